//! The controller's real-time iteration compared with the solver's default settings, on the same problems.
//!
//! ```text
//! cargo bench --bench mpc                      the table
//! cargo bench --bench mpc -- --steps 100000    growth of memory over this many steps instead
//! cargo bench --bench mpc -- --dump FILE       the problems as JSON lines, for other solvers
//! cargo bench --bench mpc -- --dump FILE --along   the same with the recorded states as measurements
//! ```
//!
//! Drives the shipped model along the recorded jumps from measurements away from the reference,
//! so that limits become active; with `--along` the measurements are the recorded ones. Each problem
//! of the table is solved by the controller (linearisation, solve and lift together). Immediately
//! afterwards clarabel solves it with its default settings, set up again. Each problem that is written
//! out comes with the time of the controller with the structured solver. Times are those of this thread's
//! CPU clock where the system has one.

use std::io::Write;
use std::path::Path;

use romc::mpc::{
    Command, ConeProgram, Controller, Lift, Measurement, MpcSettings, Outcome, QpSettings,
    QpSolver, ReferenceSamples, RowSelection, Solver, SolverProfile,
};
use romc::recording::Segment;

#[path = "shared/clock.rs"]
mod clock;
use clock::{percentile, timed};

const MODEL: &str = "models/go1-d4.json";
const RECORDINGS: [&str; 3] = ["test_01", "test_02", "test_03"];

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value_of = |name: &str| {
        arguments
            .iter()
            .position(|argument| argument == name)
            .and_then(|at| arguments.get(at + 1))
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let model = romc::artifact::read(&root.join(MODEL)).expect("the shipped model is sound");
    let segments: Vec<Segment> = RECORDINGS
        .iter()
        .flat_map(|name| {
            let path = root.join(format!("examples/recordings/go1/{name}.csv.gz"));
            romc::recording::read(&path)
                .expect("the recordings are sound")
                .segments
        })
        .collect();
    if let Some(steps) = value_of("--steps") {
        let steps = steps.parse().expect("--steps needs a number");
        watch_memory(&model, &segments[0], steps);
    } else if let Some(path) = value_of("--dump") {
        let push = match arguments.iter().any(|argument| argument == "--along") {
            true => 0.0,
            false => 1.0,
        };
        dump(&model, &segments, push, Path::new(path));
    } else {
        compare(&model, &segments);
    }
}

/// A controller at the beginning of a segment, with the recorded input as reference.
fn controller(
    model: &romc::model::ReducedModel,
    segment: &Segment,
    settings: MpcSettings,
) -> Controller {
    let mut controller =
        romc::mpc::controller(model, settings).expect("the shipped model is complete");
    let input = segment
        .input(controller.plant().input_rule())
        .expect("no leg is stretched");
    controller
        .set_reference(ReferenceSamples {
            time_s: &segment.time_s,
            x: segment.x.as_slice(),
            dx: segment.dx.as_slice(),
            u: Some(input.as_slice()),
            feet: &segment.feet,
        })
        .expect("the recordings are sound");
    controller
}

fn conic(controller: &Controller) -> &QpSolver {
    controller.solver().expect("clarabel is the solver")
}

/// The recorded state with slowly changing displacements forwards, down and in pitch, `size` times as large as in the
/// table.
fn pushed(segment: &Segment, sample: usize, size: f64) -> ([f64; 18], [f64; 18]) {
    let mut x: [f64; 18] = std::array::from_fn(|i| segment.x[(i, sample)]);
    let mut dx: [f64; 18] = std::array::from_fn(|i| segment.dx[(i, sample)]);
    let wave = size * (12.0 * segment.time_s[sample]).sin();
    x[12] += 0.1 * wave;
    x[14] -= 0.08 * wave;
    x[16] += 0.3 * wave;
    dx[14] -= 1.5 * wave;
    (x, dx)
}

fn step(controller: &mut Controller, segment: &Segment, sample: usize, command: &mut Command) {
    step_pushed(controller, segment, sample, 1.0, command);
}

fn step_pushed(
    controller: &mut Controller,
    segment: &Segment,
    sample: usize,
    push: f64,
    command: &mut Command,
) {
    let (x, dx) = pushed(segment, sample, push);
    let feet = segment.feet[sample];
    let measurement = Measurement {
        time_s: segment.time_s[sample],
        x: &x,
        dx: &dx,
        feet,
    };
    controller.step_into(measurement, command);
}

#[derive(Default)]
struct Times {
    iteration: Vec<f64>,
    setup: Vec<f64>,
    solve: Vec<f64>,
    all_rows: Vec<f64>,
}

fn compare(model: &romc::model::ReducedModel, segments: &[Segment]) {
    println!("CPU time in us, median / 99th percentile; {MODEL}, stages of 10 ms");
    println!("iteration: linearisation, solve and lift of the controller");
    println!("defaults: clarabel's default settings, set up anew for the same program");
    println!("all rows: the same for the program that has every constraint row");
    println!(
        "{:<18}{:>16}{:>17}{:>17}{:>17}{:>8}{:>8}{:>9}",
        "",
        "iteration",
        "defaults setup",
        "defaults solve",
        "all rows solve",
        "ratio",
        "ratio",
        "at limit"
    );
    for (lift, horizon) in [
        (Lift::Transpose, 10),
        (Lift::Transpose, 20),
        (Lift::Transpose, 50),
        (Lift::Consistent, 20),
    ] {
        let settings = MpcSettings {
            horizon,
            lift,
            ..MpcSettings::default()
        };
        let mut times = Times::default();
        let (mut at_limit, mut steps, mut disagreements) = (0, 0, 0);
        for segment in segments {
            let mut ours = controller(model, segment, settings);
            let all = MpcSettings {
                rows: RowSelection::All,
                ..settings
            };
            let mut with_all = controller(model, segment, all);
            let mut command = Command::zeros(model.latent_dim());
            for sample in (0..segment.len() - 5).step_by(5) {
                step(&mut with_all, segment, sample, &mut command);
                times
                    .iteration
                    .push(timed(|| step(&mut ours, segment, sample, &mut command)));
                steps += 1;
                at_limit += usize::from(touches_a_limit(&ours, &command));
                let (setup, solve, cost) = by_default(conic(&ours).program());
                times.setup.push(setup);
                times.solve.push(solve);
                times
                    .all_rows
                    .push(by_default(conic(&with_all).program()).1);
                let found = cost_of(conic(&ours).program(), conic(&ours).solution());
                disagreements += usize::from((found - cost).abs() > 1e-4 * cost.abs().max(1.0));
            }
        }
        println!(
            "{:<18}{:>16}{:>17}{:>17}{:>17}{:>8.3}{:>8.3}{:>8.0}%",
            format!(
                "{} N {horizon}",
                if lift == Lift::Transpose {
                    "transpose"
                } else {
                    "consistent"
                }
            ),
            both(&times.iteration),
            both(&times.setup),
            both(&times.solve),
            both(&times.all_rows),
            median(&times.iteration) / median(&times.solve),
            median(&times.iteration) / median(&times.all_rows),
            100.0 * at_limit as f64 / steps as f64,
        );
        if disagreements > 0 {
            println!(
                "  costs differ from the default solver's in {disagreements} of {steps} problems"
            );
        }
    }
}

/// Times of setup and solve, and the cost found, with clarabel's default settings.
fn by_default(program: &ConeProgram) -> (f64, f64, f64) {
    let settings = QpSettings {
        profile: SolverProfile::AsShipped,
        ..QpSettings::default()
    };
    let mut solver = None;
    let setup = timed(|| solver = QpSolver::new(program.clone(), settings).ok());
    let mut solver = solver.expect("the controller has built the same program");
    let mut outcome = Outcome::NumericalFailure;
    let solve = timed(|| outcome = solver.solve());
    assert_eq!(outcome, Outcome::Solved);
    (setup, solve, cost_of(program, solver.solution()))
}

/// The cost of a point; the program's quadratic part is diagonal.
fn cost_of(program: &ConeProgram, x: &[f64]) -> f64 {
    let pairs = x.iter().zip(&program.p.nzval).zip(&program.q);
    pairs.map(|((x, p), q)| x * (0.5 * p * x + q)).sum()
}

fn touches_a_limit(controller: &Controller, command: &Command) -> bool {
    let limits = controller.plant().robot().torque_limit_nm();
    command.slack > 1e-4
        || command
            .torque_nm
            .iter()
            .zip(limits)
            .any(|(torque, limit)| torque.abs() > 0.98 * limit)
}

fn watch_memory(model: &romc::model::ReducedModel, segment: &Segment, steps: usize) {
    let mut controller = controller(model, segment, MpcSettings::default());
    let mut command = Command::zeros(model.latent_dim());
    let period = segment.len() / 5 - 1;
    let mut after_warm_up = 0;
    for number in 0..steps {
        if number % period == 0 {
            controller.reset();
        }
        step(
            &mut controller,
            segment,
            5 * (number % period),
            &mut command,
        );
        if number == steps / 10 {
            after_warm_up = resident_kib();
        }
    }
    let end = resident_kib();
    println!(
        "resident memory after {} steps {after_warm_up} KiB, after {steps} steps {end} KiB",
        steps / 10
    );
    assert!(
        end <= after_warm_up + 64,
        "memory grew by {} KiB",
        end - after_warm_up
    );
}

fn dump(model: &romc::model::ReducedModel, segments: &[Segment], push: f64, path: &Path) {
    let file = std::fs::File::create(path).expect("the file can be made");
    let mut out = std::io::BufWriter::new(file);
    for segment in segments {
        let structured = MpcSettings {
            solver: Solver::Riccati,
            ..MpcSettings::default()
        };
        let samples = || (0..segment.len() - 5).step_by(5);
        let mut command = Command::zeros(model.latent_dim());
        // Each in a run of its own, as the solvers that read the file are: nothing else fills the caches.
        let [own_us, prepared_us] = [false, true].map(|is_prepared| {
            let mut own = self::controller(model, segment, structured);
            let mut time_of = |sample| {
                if is_prepared {
                    own.prepare(segment.time_s[sample]);
                }
                timed(|| step_pushed(&mut own, segment, sample, push, &mut command))
            };
            samples().map(&mut time_of).collect::<Vec<f64>>()
        });
        let mut controller = controller(model, segment, MpcSettings::default());
        for (sample, (own_us, prepared_us)) in samples().zip(own_us.iter().zip(&prepared_us)) {
            step_pushed(&mut controller, segment, sample, push, &mut command);
            let program = conic(&controller).program();
            let equalities = program.cones.first().map_or(0, |cone| cone.dim());
            let matrix = |matrix: &clarabel::algebra::CscMatrix<f64>| {
                serde_json::json!({
                    "shape": [matrix.m, matrix.n],
                    "indptr": matrix.colptr,
                    "indices": matrix.rowval,
                    "data": matrix.nzval,
                })
            };
            let problem = serde_json::json!({
                "P": matrix(&program.p), "q": program.q, "A": matrix(&program.a), "b": program.b,
                "equalities": equalities, "solution": conic(&controller).solution(),
                "own_us": own_us, "prepared_us": prepared_us,
            });
            writeln!(out, "{problem}").expect("the disk has room");
        }
    }
}

fn resident_kib() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("VmRSS:"));
    line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok())
        .unwrap_or(0)
}

fn median(values: &[f64]) -> f64 {
    percentile(values, 0.5)
}

fn both(values: &[f64]) -> String {
    format!("{:.0} / {:.0}", median(values), percentile(values, 0.99))
}
