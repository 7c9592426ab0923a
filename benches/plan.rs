//! Time of plans, and how close they come to their bounds, over goals drawn by a seed.
//!
//! ```text
//! cargo bench --bench plan [-- --model FILE.json --goals 100 --seed 1]
//! ```
//!
//! Two goals in three are inside the range of the training jumps, the range of the others is 35 % longer and 40 %
//! higher. Times are wall times of the whole plan with the model already read.

use std::path::Path;

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use romc::plan::{Goal, PlanSettings, plan};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value_of = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).cloned()
    };
    let number = |name: &str, default: u64| -> u64 {
        value_of(name).map_or(default, |text| text.parse().expect("a whole number"))
    };
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/go1-d7.json");
    let path = value_of("--model").map_or(shipped, Into::into);
    let model = romc::artifact::read(&path).expect("a model file");
    let prior = model.jump_prior().expect("a model that plans");
    let [distance, apex, _] = prior.ranges();
    let mut random = ChaCha8Rng::seed_from_u64(number("--seed", 1));
    let mut share = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let (mut times_ms, mut refused, mut unsolved) = (Vec::new(), 0, 0);
    let (mut torque, mut joint) = (0.0_f64, f64::NEG_INFINITY);
    for index in 0..number("--goals", 100).max(1) {
        let beyond = if index % 3 == 2 {
            [0.35, 0.40]
        } else {
            [0.0; 2]
        };
        let mut within =
            |least: f64, most: f64, beyond: f64| least + share() * (most * (1.0 + beyond) - least);
        let wanted = [
            within(distance.least, distance.most, beyond[0]),
            within(apex.least, apex.most, beyond[1]),
        ];
        let goal = Goal::new(wanted[0], wanted[1]).expect("a jump forwards");
        let begun = std::time::Instant::now();
        let planned = plan(&model, &goal, &PlanSettings::default());
        times_ms.push(1e3 * begun.elapsed().as_secs_f64());
        match planned {
            Ok(plan) if plan.verdict.word() == "refused" => refused += 1,
            Ok(plan) => {
                torque = torque.max(plan.margins.torque_share);
                joint = joint.max(plan.margins.beyond_joint_limit_rad);
            }
            Err(error) => {
                println!("{:.3} m, apex {:.3} m: {error}", wanted[0], wanted[1]);
                unsolved += 1;
            }
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let count = times_ms.len();
    println!(
        "{count} goals: median {:.0} ms, 99 % {:.0} ms, worst {:.0} ms; {refused} refused, {unsolved} unsolved",
        times_ms[count / 2],
        times_ms[(99 * count / 100).min(count - 1)],
        times_ms[count - 1],
    );
    println!(
        "between the nodes, at the recordings' step: torques at most {:.0} % of their limits, joints {:.3} rad inside theirs",
        100.0 * torque,
        -joint,
    );
}
