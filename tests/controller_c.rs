//! The generated controller in C99: against the library bit for bit, under strict compilers, as a
//! project of CMake.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::codegen::Precision;
use romc::deploy::{EmitError, EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::model::ReducedModel;
use romc::mpc::{Controller, Measurement, MpcSettings, ReferenceSamples, Solver};

#[path = "controller_c/boards.rs"]
mod boards;
#[path = "controller_c/emitted.rs"]
mod emitted;
#[path = "controller/programs.rs"]
mod programs;
#[path = "mpc/random.rs"]
mod random;
#[path = "controller_c/tools.rs"]
mod tools;
use emitted::Emitted;
use programs::{has, root, shipped, succeed, with_losses};
use random::Random;

/// The shipped model with torques over 0.3 as large for the same latent input: its limits bind as if
/// they were 30 % of what they are.
fn with_tight_limits(name: &str) -> ReducedModel {
    let text = fs::read_to_string(root().join(format!("models/{name}.json"))).expect("shipped");
    let mut manifest: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let scale = |value: &mut serde_json::Value| {
        *value = (0.3 * value.as_f64().expect("a number")).into();
    };
    match &mut manifest["scaling"]["input"] {
        serde_json::Value::Array(values) => values.iter_mut().for_each(scale),
        value => scale(value),
    }
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

/// Steps of random measurements along random variations of recorded jumps, with what the library
/// commands, as `replay.c` reads them.
fn replay_file(model: &ReducedModel, steps: usize, seed: u64) -> Vec<u8> {
    let mut random = Random::new(seed);
    let mut bytes = Vec::new();
    let mut done = 0;
    let rule = model.input_rule().expect("a robot");
    for run in 0.. {
        if done >= steps {
            break;
        }
        let path = root().join(format!(
            "examples/recordings/go1/test_0{}.csv.gz",
            1 + run % 3
        ));
        let recording = romc::recording::read(&path).expect("a sound recording");
        let segment = &recording.segments[0];
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
        let settings = MpcSettings {
            solver: Solver::Riccati,
            missing_input: romc::mpc::MissingInput::Mean,
            body_friction: (friction > 0.0).then_some(friction),
            ..MpcSettings::default()
        };
        let mut controller = Controller::new(model, settings).expect("a complete model");
        let reference = ReferenceSamples {
            time_s: &segment.time_s,
            x: &x,
            dx: &dx,
            u: u.as_deref(),
            feet: &segment.feet,
        };
        controller.set_reference(reference).expect("sound");
        let samples: Vec<usize> = (0..segment.len()).step_by(5).collect();
        push_counts(
            &mut bytes,
            &[
                segment.len() as i64,
                samples.len() as i64,
                i64::from(u.is_some()),
            ],
        );
        push(&mut bytes, &[friction]);
        push(&mut bytes, &segment.time_s);
        push(&mut bytes, &x);
        push(&mut bytes, &dx);
        push(&mut bytes, u.as_deref().unwrap_or_default());
        bytes.extend(segment.feet.iter().flatten().map(|down| u8::from(*down)));
        let roughness = [0.0, 0.3, 1.0, 3.0][run % 4];
        for &sample in &samples {
            one_step(
                &mut controller,
                segment,
                sample,
                roughness,
                &mut random,
                &mut bytes,
            );
        }
        done += samples.len();
    }
    bytes
}

fn one_step(
    controller: &mut Controller,
    segment: &romc::recording::Segment,
    sample: usize,
    roughness: f64,
    random: &mut Random,
    bytes: &mut Vec<u8>,
) {
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
    if random.signed() > 0.98 {
        dx[sample % 18] = f64::NAN;
    }
    let jitter = if random.signed() > 0.9 { 0.003 } else { 0.0 };
    let time_s = segment.time_s[sample] + jitter;
    let prepares = random.signed() > 0.0;
    if prepares {
        controller.prepare(time_s);
    }
    let command = controller.step(Measurement {
        time_s,
        x: &x,
        dx: &dx,
        feet,
    });
    push(bytes, &[time_s]);
    push(bytes, &x);
    push(bytes, &dx);
    bytes.extend(feet.map(u8::from));
    bytes.push(u8::from(prepares));
    push(bytes, &command.torque_nm);
    push(bytes, &command.joint_position_rad);
    push(bytes, &command.joint_velocity_rad_s);
    push(bytes, &command.u_lat);
    push_counts(
        bytes,
        &[
            i64::from(command.status.code()),
            i64::from(command.iterations),
        ],
    );
}

/// Steps of the comparison: 2000, or as many as `ROMC_CONTROLLER_STEPS` says.
fn step_count() -> usize {
    std::env::var("ROMC_CONTROLLER_STEPS").map_or(2000, |text| text.parse().expect("a number"))
}

#[test]
fn controller_in_c_repeats_the_library_bit_for_bit_under_random_steps_and_tight_limits() {
    let models = [
        (shipped("go1-d4"), false),
        (with_tight_limits("go1-d4"), true),
        (with_tight_limits("go1-d6"), true),
        (with_losses(shipped("go1-d4")), false),
        (shipped("go1-d2"), false),
    ];
    for (number, (model, is_tight)) in models.into_iter().enumerate() {
        let emitted = Emitted::new(&model, Precision::Double);
        let replay = root().join("tests/controller_c/replay.c");
        let program = emitted.program("cc", &[], replay.to_str().expect("UTF-8"));
        let file = emitted.scratch.path().join("steps");
        let steps = replay_file(&model, step_count() / 5, number as u64);
        fs::write(&file, steps).expect("written");
        let output = succeed(Command::new(program).arg(&file));
        let text = String::from_utf8_lossy(&output.stdout);
        println!("{}: {text}", model.name());
        let words: Vec<&str> = text.split_whitespace().collect();
        let active: usize = words[words.iter().position(|w| *w == "with").expect("told") - 1]
            .parse()
            .expect("a count");
        assert!(
            active > if is_tight { 20 } else { 0 },
            "limits hardly bind: {text}"
        );
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
    if !has("cmake") {
        return;
    }
    let emitted = Emitted::new(&shipped("go1-d4"), Precision::Double);
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
