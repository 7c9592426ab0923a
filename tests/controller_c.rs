//! The generated controller in C99: bit for bit compared with the library, under strict compilers, as a project of
//! CMake.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::codegen::Precision;
use romc::deploy::{EmitError, EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::model::ReducedModel;
use romc::mpc::{
    AfterEnd, Bounds, ConsistentLift, Controller, Drives, Legs, Lift, Linearisation, Measurement,
    MissingInput, MpcSettings, ReferenceSamples, Solver, StanceState, Status,
};

#[path = "controller_c/analysers.rs"]
mod analysers;
#[path = "controller_c/boards.rs"]
mod boards;
#[path = "controller_c/emitted.rs"]
mod emitted;
#[path = "controller_c/joints.rs"]
mod joints;
#[path = "controller_c/legs.rs"]
mod legs;
#[path = "controller_c/log.rs"]
mod log;
#[path = "controller_c/machine.rs"]
mod machine;
#[path = "controller/programs.rs"]
mod programs;
#[path = "mpc/random.rs"]
mod random;
#[path = "controller_c/ros2.rs"]
mod ros2;
#[path = "controller_c/solver.rs"]
mod solver;
#[path = "controller_c/steps.rs"]
mod steps;
mod tools;
#[path = "controller_c/walk.rs"]
mod walk;
use emitted::Emitted;
use programs::{root, shipped, succeed, with_losses};
use random::Random;
use tools::{is_asked_for, is_thorough};

/// The shipped model with torques divided by 0.3 for the same latent input: its limits bind as if they were 30 % of
/// their values.
fn with_tight_limits(name: &str) -> ReducedModel {
    changed(name, |manifest| {
        let scale = |value: &mut serde_json::Value| {
            *value = (0.3 * value.as_f64().expect("a number")).into();
        };
        match &mut manifest["scaling"]["input"] {
            serde_json::Value::Array(values) => values.iter_mut().for_each(scale),
            value => scale(value),
        }
    })
}

/// The shipped model without the statistics of inputs given states, like an imported model.
fn without_given_state(name: &str) -> ReducedModel {
    changed(name, |manifest| {
        let phases = manifest["input_statistics"]
            .as_object_mut()
            .expect("phases");
        for statistics in phases.values_mut() {
            let known = statistics.as_object_mut().expect("statistics");
            known.remove("given_state").expect("a trained model");
        }
    })
}

/// The shipped model of four coordinates without its last: the library pads an odd dimension, the C does not.
fn with_three_coordinates() -> ReducedModel {
    fn rows_of(value: &mut serde_json::Value) -> &mut Vec<serde_json::Value> {
        value.as_array_mut().expect("an array")
    }
    changed("go1-d4", |manifest| {
        manifest["latent_dim"] = 3.into();
        rows_of(&mut manifest["encoder"]["weights"]).truncate(3);
        rows_of(&mut manifest["encoder"]["bias"]).truncate(3);
        for row in rows_of(&mut manifest["decoder"]["weights"]) {
            rows_of(row).truncate(3);
        }
        for phase in rows_of(&mut manifest["phases"]) {
            let xi = rows_of(&mut phase["xi"]);
            // Terms are 1, z, dz and u, the latter three of four coordinates each.
            for last in [12, 8, 4] {
                xi.remove(last);
            }
            for row in xi {
                rows_of(row).truncate(3);
            }
        }
        let statistics = manifest["input_statistics"].as_object_mut();
        for phase in statistics.expect("phases").values_mut() {
            let known = phase.as_object_mut().expect("statistics");
            known.remove("given_state").expect("a trained model");
        }
        let parts = manifest.as_object_mut().expect("an object");
        for plan in ["landmarks", "prior"] {
            parts.remove(plan).expect("a model that plans");
        }
    })
}

/// A shipped model with its file changed.
fn changed(name: &str, change: impl Fn(&mut serde_json::Value)) -> ReducedModel {
    let text = fs::read_to_string(root().join(format!("models/{name}.json"))).expect("shipped");
    let mut manifest: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    change(&mut manifest);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tight.json");
    fs::write(&path, manifest.to_string()).expect("written");
    romc::artifact::read(&path).expect("a sound model")
}

fn push(bytes: &mut Vec<u8>, values: &[f64]) {
    bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes()));
}

fn push_counts(bytes: &mut Vec<u8>, values: &[i64]) {
    bytes.extend(values.iter().flat_map(|value| value.to_ne_bytes()));
}

/// Whether most runs have limits on torque rates, and whether a supervisor watches them, each with a different fault.
#[derive(Clone, Copy, PartialEq)]
enum Rates {
    Free,
    Limited,
    FreeAndWatched,
}

/// Kinds of faults in the measurements of a supervised run; the last is none.
const FAULTS: usize = 14;
/// Samples between the beginnings of two faults, and the duration of each in samples.
const FAULT_EVERY: usize = 150;
const FAULT_LASTS: usize = 50;

/// Steps of random measurements along random variations of recorded jumps, with the library's commands, as `replay.c`
/// reads them. Also the numbers of latent inputs changed by the estimate of the share that arrives, of limited
/// consistent lifts and of failed ones. Every second run has that estimate.
fn replay_file(
    model: &ReducedModel,
    steps: usize,
    seed: u64,
    rates: Rates,
) -> (Vec<u8>, usize, [usize; 2]) {
    let mut random = Random::new(seed);
    let mut bytes = Vec::new();
    let (mut done, mut changed, mut lifts) = (0, 0, [0; 2]);
    let rule = model.input_rule().expect("a robot");
    let plant = romc::mpc::control_model(model).expect("a complete model");
    let knows_inputs = plant
        .phases()
        .iter()
        .all(|phase| phase.given_state.is_some());
    let recordings = [1, 2, 3].map(|number| {
        let path = format!("examples/recordings/go1/test_0{number}.csv.gz");
        romc::recording::read(&root().join(path)).expect("a sound recording")
    });
    for run in 0.. {
        if done >= steps {
            break;
        }
        let segment = &recordings[run % 3].segments[0];
        let input = segment.input(&rule).expect("inputs");
        let vary = |values: &[f64], scale: f64, random: &mut Random| -> Vec<f64> {
            let factor = 1.0 + scale * random.signed();
            values.iter().map(|value| factor * value).collect()
        };
        let (x, dx) = (
            vary(segment.x.as_slice(), 0.02, &mut random),
            vary(segment.dx.as_slice(), 0.3, &mut random),
        );
        let u = (run % 4 != 3).then(|| vary(input.as_slice(), 0.5, &mut random));
        let friction = if run % 3 == 2 { 0.6 } else { 0.0 };
        let drives = Drives {
            stiffness_nm_rad: [20.0, 0.0, 40.0][run / 2 % 3],
            damping_nm_s_rad: [0.8, 0.0][run / 4 % 2],
        };
        let is_watched = rates == Rates::FreeAndWatched;
        let settings = MpcSettings {
            solver: Solver::Riccati,
            missing_input: match knows_inputs {
                true => MissingInput::Estimate,
                false => MissingInput::Mean,
            },
            body_friction: (friction > 0.0).then_some(friction),
            lift: [Lift::Transpose, Lift::Consistent][usize::from(run % 5 % 3 != 0)],
            foot_friction: [0.6, 0.2][run % 2],
            lift_prior_weight: [1e-3, 1e-2, 1e-4][run % 3],
            linearisation: [Linearisation::Reference, Linearisation::LastPlan][run / 2 % 3 % 2],
            effectiveness: (run % 2 == 1).then_some([0.05, 1.0][run / 2 % 2]),
            drives,
            swing_turn: [1.0, 0.0, 0.5][run / 3 % 3],
            flight_torque: [1.0, 0.3, 0.0][run / 2 % 3],
            after_end: [AfterEnd::Hold, AfterEnd::Damp, AfterEnd::Stop][run % 3],
            legs: [Legs::Decoded, Legs::Reference][usize::from(run % 7 > 4)],
            place_scale_m: (run % 4 > 1).then_some(0.03),
            heading_scale_rad: (run % 6 > 2).then_some(0.05),
            bounds: [Bounds::OFF, MpcSettings::default().bounds][usize::from(is_watched)],
            torque_rate_nm_s: match rates {
                Rates::Free | Rates::FreeAndWatched => None,
                Rates::Limited => [Some(300.0), Some(100.0), None, Some(1000.0)][run % 4],
            },
            ..MpcSettings::default()
        };
        let trusting = MpcSettings {
            effectiveness: None,
            ..settings
        };
        let [mut controller, mut trusting] = [settings, trusting]
            .map(|s| romc::mpc::controller(model, s).expect("a complete model"));
        // A measurement for each stage, or more: some are within the first stage of the last plan although a step
        // without a plan is between them.
        let is_dense = run % 2 == 1 && seed.is_multiple_of(2);
        let stride = if is_dense { 2 } else { 5 };
        let roughness = match is_watched {
            true => 0.1,
            false => [0.0, 0.3, 1.0, 3.0][run % 4],
        };
        // The whole jump, then its end with the same controller, near fewer joint limits.
        for first in [0, segment.len() * 3 / 5] {
            let reference = ReferenceSamples {
                time_s: &segment.time_s[first..],
                x: &x[18 * first..],
                dx: &dx[18 * first..],
                u: u.as_ref().map(|u| &u[18 * first..]),
                feet: &segment.feet[first..],
            };
            controller.set_reference(reference).expect("sound");
            trusting.set_reference(reference).expect("sound");
            let samples: Vec<usize> = (first..segment.len()).step_by(stride).collect();
            let head = [reference.time_s.len(), samples.len()].map(|count| count as i64);
            push_counts(&mut bytes, &head);
            push_counts(&mut bytes, &[i64::from(u.is_some()), i64::from(first > 0)]);
            let is_consistent = settings.lift == Lift::Consistent;
            let is_about_plan = settings.linearisation == Linearisation::LastPlan;
            push_counts(
                &mut bytes,
                &[
                    i64::from(is_consistent),
                    i64::from(is_about_plan),
                    settings.after_end as i64,
                ],
            );
            push(&mut bytes, &[friction]);
            push(
                &mut bytes,
                &[
                    settings.effectiveness.unwrap_or(0.0),
                    drives.stiffness_nm_rad,
                    drives.damping_nm_s_rad,
                    settings.foot_friction,
                    settings.lift_prior_weight,
                    settings.torque_rate_nm_s.unwrap_or(0.0),
                    settings.swing_turn,
                    settings.flight_torque,
                    f64::from(u8::from(is_watched)),
                    f64::from(settings.legs as u8),
                    settings.place_scale_m.unwrap_or(0.0),
                    settings.heading_scale_rad.unwrap_or(0.0),
                ],
            );
            push(&mut bytes, reference.time_s);
            push(&mut bytes, reference.x);
            push(&mut bytes, reference.dx);
            push(&mut bytes, reference.u.unwrap_or_default());
            let feet = reference.feet.iter().flatten();
            bytes.extend(feet.map(|down| u8::from(*down)));
            let from = first + (20 * run + 40) % 200;
            let mut is_latched = false;
            for &sample in &samples {
                let since = sample.checked_sub(from).filter(|_| is_watched);
                let fault = since
                    .filter(|since| since % FAULT_EVERY < FAULT_LASTS)
                    .map(|since| (run + since / FAULT_EVERY) % FAULTS);
                let (is_changed, status) = one_step(
                    [&mut controller, &mut trusting],
                    segment,
                    (sample, fault, is_latched),
                    roughness,
                    &mut random,
                    (&mut bytes, &mut lifts),
                );
                changed += usize::from(is_changed);
                is_latched = status.code() >= Status::Tilt.code();
            }
        }
        done += segment.len() / 5;
    }
    (bytes, changed, lifts)
}

/// Whether both controllers command different latent inputs, and the status. A latched fault is reset soon.
fn one_step(
    [controller, trusting]: [&mut Controller; 2],
    segment: &romc::recording::Segment,
    (sample, fault, is_latched): (usize, Option<usize>, bool),
    roughness: f64,
    random: &mut Random,
    (bytes, lifts): (&mut Vec<u8>, &mut [usize; 2]),
) -> (bool, Status) {
    let mut x: [f64; 18] = std::array::from_fn(|i| segment.x[(i, sample)]);
    let mut dx: [f64; 18] = std::array::from_fn(|i| segment.dx[(i, sample)]);
    for i in 0..18 {
        x[i] += 0.02 * roughness * random.normal();
        dx[i] += 0.2 * roughness * random.normal();
    }
    let mut feet = segment.feet[sample];
    if random.signed() > 0.95 {
        feet = std::array::from_fn(|_| random.signed() > 0.0);
    }
    // Sometimes long enough that the last plan is used up and its torques fade.
    let is_lost = (350..390).contains(&(sample % 400));
    if is_lost || random.signed() > 0.98 {
        dx[sample % 18] = f64::NAN;
    }
    let jitter = if random.signed() > 0.9 { 0.003 } else { 0.0 };
    let mut time_s = segment.time_s[sample] + jitter;
    match fault {
        Some(0) => x[15] += 3.0,
        Some(1) => x[13] += 5.0,
        Some(2) => x.swap(1, 2),
        Some(3) => dx[7] += 60.0,
        Some(4) => time_s = 0.3,
        Some(5) => time_s -= 0.001 * (sample % 300) as f64,
        Some(6) => time_s += 0.5,
        Some(7) => (x, dx) = ([0.01; 18], [0.1; 18]),
        Some(8) => dx[12..15].fill(0.0),
        Some(9) => feet = feet.map(|down| !down),
        Some(10) => x[4] += 0.7,
        Some(11) => feet = [true, false, false, false],
        Some(12) => dx[sample % 18] = [1e30, -1e300, 2e6][sample % 3],
        _ => {}
    }
    let resets = random.signed() > if is_latched { 0.6 } else { 0.97 };
    if resets {
        controller.reset();
        trusting.reset();
    }
    if resets && random.signed() > 0.0 {
        // A stretched knee; the first measurement after a reset is accepted.
        x[5] = 0.0;
    }
    let prepares = random.signed() > 0.0;
    if prepares {
        controller.prepare(time_s);
    }
    let measurement = Measurement {
        time_s,
        x: &x,
        dx: &dx,
        feet,
    };
    let command = controller.step(measurement);
    let is_changed = controller.settings().effectiveness.is_some()
        && trusting.step(measurement).u_lat != command.u_lat;
    lifts[0] += usize::from(is_limited(controller, &measurement, &command));
    lifts[1] += usize::from(command.status == Status::LiftFailed);
    push(bytes, &[time_s]);
    push(bytes, &x);
    push(bytes, &dx);
    bytes.extend(feet.map(u8::from));
    bytes.push(u8::from(prepares) + 2 * u8::from(resets));
    push(bytes, &command.torque_nm);
    push(bytes, &command.joint_position_rad);
    push(bytes, &command.joint_velocity_rad_s);
    let drives = &command.drives;
    push(bytes, &[drives.stiffness_nm_rad, drives.damping_nm_s_rad]);
    push(bytes, &command.u_lat);
    push_counts(
        bytes,
        &[
            i64::from(command.status.code()),
            i64::from(command.iterations),
        ],
    );
    (is_changed, command.status)
}

/// Whether the consistent lift of a step needed iterations: a torque limit or a friction pyramid is active.
fn is_limited(
    controller: &Controller,
    measurement: &Measurement<'_>,
    command: &romc::mpc::Command,
) -> bool {
    let settings = controller.settings();
    let (Lift::Consistent, Legs::Decoded, Some(phase), true) = (
        settings.lift,
        settings.legs,
        command.phase,
        command.status.has_plan(),
    ) else {
        return false;
    };
    let stance = StanceState {
        joints_rad: std::array::from_fn(|joint| measurement.x[joint]),
        attitude_rad: std::array::from_fn(|angle| measurement.x[15 + angle]),
        feet: measurement.feet,
        phase,
        losses_nm: command.losses_nm,
        near_nm: None,
        keeps_swing: false,
    };
    let mut lift = ConsistentLift::new(controller.plant(), settings).expect("a sound program");
    let torque = lift.lift(controller.plant(), &command.u_lat, &stance);
    torque.expect("it was lifted before");
    lift.iterations() > 0
}

/// Steps of the comparison: `ROMC_CONTROLLER_STEPS`, or some thousands.
fn step_count() -> usize {
    let asked = std::env::var("ROMC_CONTROLLER_STEPS");
    asked.map_or(4000, |text| text.parse().expect("a number"))
}

#[test]
fn controller_in_c_repeats_the_library_bit_for_bit_under_random_steps_and_tight_limits() {
    let models = [
        (shipped("go1-d4"), false),
        (with_tight_limits("go1-d4"), true),
        (with_tight_limits("go1-d6"), true),
        (with_losses(shipped("go1-d4")), false),
        (shipped("go1-d2"), false),
        (without_given_state("go1-d4"), false),
        (with_three_coordinates(), false),
    ];
    let mut unlifted = 0;
    for (number, (model, is_tight)) in models.into_iter().enumerate() {
        // Each model compiles for seconds.
        if !is_thorough() && ![1, 3, 5].contains(&number) {
            continue;
        }
        let emitted = Emitted::with_library_sines(&model);
        let replay = root().join("tests/controller_c/replay.c");
        let level = if number == 0 { "-O2" } else { "-O1" };
        let program = emitted.program("cc", &[level], replay.to_str().expect("UTF-8"));
        let file = emitted.scratch.path().join("steps");
        let (steps, changed, [limited, failed]) =
            replay_file(&model, step_count() / 5, number as u64, Rates::Free);
        assert!(changed > 50, "inputs hardly change: {changed}");
        assert!(limited > 50, "the lift is hardly limited: {limited}");
        fs::write(&file, steps).expect("written");
        let output = succeed(Command::new(program).arg(&file));
        let text = String::from_utf8_lossy(&output.stdout);
        println!(
            "{} of {}: {limited} limited lifts, {failed} failed, {text}",
            model.name(),
            model.latent_dim()
        );
        unlifted += failed;
        let words: Vec<&str> = text.split_whitespace().collect();
        let active: usize = words[words.iter().position(|w| *w == "with").expect("told") - 1]
            .parse()
            .expect("a count");
        assert!(
            active > if is_tight { 20 } else { 0 },
            "limits hardly bind: {text}"
        );
    }
    assert!(unlifted > 3, "lifts hardly fail: {unlifted}");
}

#[test]
fn supervisor_in_c_repeats_the_library_bit_for_bit_under_faults() {
    let model = shipped("go1-d4");
    let emitted = Emitted::with_library_sines(&model);
    let replay = root().join("tests/controller_c/replay.c");
    let program = emitted.program("cc", &[], replay.to_str().expect("UTF-8"));
    let file = emitted.scratch.path().join("steps");
    let (steps, ..) = replay_file(&model, step_count(), 5, Rates::FreeAndWatched);
    fs::write(&file, steps).expect("written");
    let output = succeed(Command::new(program).arg(&file));
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}");
    let counts: Vec<usize> = (text.split(|letter: char| !letter.is_ascii_digit()))
        .filter_map(|word| word.parse().ok())
        .collect();
    let [done, _, _, _, _, _, plans, doubted, damped, kinds] = counts[..] else {
        panic!("other counts: {text}");
    };
    assert!(kinds >= 10, "few kinds of faults: {text}");
    assert!(
        3 * plans > done && 5 * damped > done && 50 * doubted > done,
        "one-sided steps: {text}"
    );
}

#[test]
fn controller_in_c_repeats_the_library_bit_for_bit_with_limits_on_torque_rates() {
    let models = [
        (shipped("go1-d2"), 20),
        (shipped("go1-d4"), 3),
        (shipped("go1-d6"), 3),
        (with_three_coordinates(), 3),
    ];
    for (number, (model, most)) in models.into_iter().enumerate() {
        if !is_thorough() && ![0, 3].contains(&number) {
            continue;
        }
        let emitted = Emitted::with_library_sines(&model);
        let replay = root().join("tests/controller_c/replay.c");
        let rates = format!("-D{}_TORQUE_RATES=1", emitted.name.to_ascii_uppercase());
        let program = emitted.program("cc", &[&rates], replay.to_str().expect("UTF-8"));
        let file = emitted.scratch.path().join("steps");
        let (steps, ..) = replay_file(&model, step_count() / 5, 7 + number as u64, Rates::Limited);
        fs::write(&file, steps).expect("written");
        let output = succeed(Command::new(program).arg(&file));
        let text = String::from_utf8_lossy(&output.stdout);
        println!("{} of {}: {text}", model.name(), model.latent_dim());
        let words: Vec<&str> = text.split_whitespace().collect();
        let count = |word: &str, before: usize| -> usize {
            let at = words.iter().position(|other| *other == word);
            words[at.expect("reported") - before]
                .parse()
                .expect("a count")
        };
        let (done, active, fallbacks) =
            (count("steps,", 1), count("with", 1), count("fallbacks,", 1));
        assert!(active > done / most, "rates hardly bind: {text}");
        assert!(2 * fallbacks < done, "hardly any plans: {text}");
    }
}

#[test]
fn settings_that_are_refused_are_named() {
    let emitted = Emitted::new(&shipped("go1-d2"), Precision::Double);
    let source = root().join("tests/controller_c/settings.c");
    for rates in ["-DGO1_D2_TORQUE_RATES=0", "-DGO1_D2_TORQUE_RATES=1"] {
        let program = emitted.program("cc", &[rates], source.to_str().expect("UTF-8"));
        succeed(&mut Command::new(program));
    }
}

#[test]
fn fast_math_is_refused() {
    let emitted = Emitted::new(&shipped("go1-d4"), Precision::Double);
    for stem in [
        format!("{}_controller.c", emitted.name),
        format!("{}.c", emitted.name),
    ] {
        let output = Command::new("cc")
            .args(["-ffast-math", "-c", &stem, "-o", "/dev/null"])
            .current_dir(emitted.folder())
            .output()
            .expect("a C compiler");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && text.contains("-ffast-math"),
            "{stem}: {text}"
        );
    }
}

#[test]
fn cmake_builds_tests_installs_and_is_found_by_another_project() {
    // 3.20 because of the newest option used here; an older version counts as missing.
    let emitted = Emitted::new(&shipped("go1-d4"), Precision::Double);
    let mut probe = Command::new("ctest");
    // In a scratch folder, because it writes a log.
    (probe.args(["--test-dir", ".", "-N"])).current_dir(emitted.scratch.path());
    if !is_asked_for("ctest --test-dir", &mut probe) {
        return;
    }
    let (name, folder) = (&emitted.name, emitted.folder());
    let run = |arguments: &[&str], at: &Path| {
        succeed(Command::new("cmake").args(arguments).current_dir(at));
    };
    let prefix = emitted.scratch.path().join("prefix");
    let prefix_flag = format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display());
    run(
        &[
            "-S",
            ".",
            "-B",
            "build",
            "-DCMAKE_C_FLAGS=-Ofast",
            &prefix_flag,
        ],
        &folder,
    );
    run(&["--build", "build"], &folder);
    succeed(
        Command::new("ctest")
            .args(["--test-dir", "build"])
            .current_dir(&folder),
    );
    run(&["--install", "build"], &folder);
    let user = emitted.scratch.path().join("user");
    fs::create_dir(&user).expect("a folder");
    fs::write(
        user.join("CMakeLists.txt"),
        format!(
            "cmake_minimum_required(VERSION 3.10)\nproject(user C)\n\
             find_package({name}_controller REQUIRED)\nadd_executable(user user.c)\n\
             target_link_libraries(user {name}_controller::{name}_controller)\n"
        ),
    )
    .expect("written");
    fs::write(
        user.join("user.c"),
        format!(
            "#include <{name}_controller.h>\n\
             int main(void) {{ static {name}_controller c; return {name}_controller_init(&c, 0); }}\n"
        ),
    )
    .expect("written");
    let found = format!("-DCMAKE_PREFIX_PATH={}", prefix.display());
    run(&["-S", ".", "-B", "build", &found], &user);
    run(&["--build", "build"], &user);
    succeed(&mut Command::new(user.join("build/user")));
}

#[test]
fn model_that_cannot_be_controlled_is_refused() {
    let paper = shipped("paper-2d");
    let equations = Equations::of(&paper);
    let refused = emit(&equations, &[Target::ControllerC], &EmitOptions::default());
    assert!(matches!(refused, Err(EmitError::Control(_))), "{refused:?}");
}
