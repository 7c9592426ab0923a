//! The generated controller: built, linked into C, C++ and Python, and compared with the library.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::deploy::{EmitError, EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::EmittedFile;
use romc::model::ReducedModel;
use romc::mpc::{Lift, Measurement, MpcSettings, ReferenceSamples};
use romc::recording::Segment;

#[path = "controller/programs.rs"]
mod programs;
mod tools;
use programs::{WARNINGS, root, shipped, succeed, with_losses};

/// System libraries that a Rust static library needs.
const SYSTEM: [&str; 4] = ["-lm", "-lpthread", "-ldl", "-lrt"];

fn emitted(model: &ReducedModel) -> Vec<EmittedFile> {
    emit(
        &Equations::of(model),
        &[Target::Controller],
        &EmitOptions::default(),
    )
    .expect("a complete model")
}

/// A built generated crate; all crates share one folder of compiled dependencies.
struct Built {
    name: String,
    folder: PathBuf,
    target: PathBuf,
}

impl Built {
    fn new(model: &ReducedModel) -> Self {
        let name = model.identifier().to_string();
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let built = Self {
            folder: scratch.join(format!("{name}-controller")),
            target: scratch.join("controller-target"),
            name,
        };
        let files = emitted(model);
        built.remove_all_but(&files);
        for file in files {
            let path = scratch.join(&file.path);
            // Unchanged files are not compiled again.
            if fs::read_to_string(&path).ok().as_ref() != Some(&file.contents) {
                fs::create_dir_all(path.parent().expect("inside the folder")).expect("a folder");
                fs::write(&path, &file.contents).expect("written");
            }
        }
        let output = succeed(
            Command::new(env!("CARGO"))
                .args(["build", "--release"])
                .current_dir(&built.folder)
                // The bits are those of full optimisation, and the build needs half the time.
                .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1")
                .env("CARGO_PROFILE_RELEASE_LTO", "off")
                .env("CARGO_TARGET_DIR", &built.target),
        );
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(!told.contains("warning"), "{told}");
        built
    }

    /// Removes files of an earlier version that this one does not emit.
    fn remove_all_but(&self, files: &[EmittedFile]) {
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let kept: Vec<PathBuf> = files.iter().map(|file| scratch.join(&file.path)).collect();
        let mut folders = vec![self.folder.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).into_iter().flatten() {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else if !kept.contains(&path) {
                    fs::remove_file(path).expect("removed");
                }
            }
        }
    }

    fn library(&self, ending: &str) -> PathBuf {
        let file = format!("release/lib{}_controller.{ending}", self.name);
        self.target.join(file)
    }

    /// Compiles a program against the header and links the static library.
    fn program(&self, compiler: &str, flags: &[&str], source: &Path) -> PathBuf {
        let stem = source.file_name().expect("a file").to_string_lossy();
        let program = self.target.join(format!("{}_{stem}_{compiler}", self.name));
        succeed(
            Command::new(compiler)
                .args(flags)
                .args(WARNINGS)
                .arg("-I")
                .arg(self.folder.join("include"))
                .arg(format!("-DNAME={}", self.name))
                .arg(format!("-DUPPER={}", self.name.to_ascii_uppercase()))
                .arg(format!("-DHEADER=\"{}_controller.h\"", self.name))
                .arg(source)
                .arg(self.library("a"))
                .args(SYSTEM)
                .arg("-o")
                .arg(&program),
        );
        program
    }
}

/// One run: settings, reference, and the samples at which the controller acts.
struct Case {
    lift: Lift,
    has_input: bool,
}

/// A segment's samples in the controller's form, and every fifth of them as a measurement.
fn samples<'a>(segment: &'a Segment, input: Option<&'a [f64]>) -> ReferenceSamples<'a> {
    ReferenceSamples {
        time_s: &segment.time_s,
        x: segment.x.as_slice(),
        dx: segment.dx.as_slice(),
        u: input,
        feet: &segment.feet,
    }
}

fn measurements(segment: &Segment) -> impl Iterator<Item = Measurement<'_>> {
    (0..segment.len()).step_by(5).map(|sample| Measurement {
        time_s: segment.time_s[sample],
        x: &segment.x.as_slice()[18 * sample..][..18],
        dx: &segment.dx.as_slice()[18 * sample..][..18],
        feet: segment.feet[sample],
    })
}

fn push(bytes: &mut Vec<u8>, values: &[f64]) {
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}

/// The case as the driver reads it.
fn encoded(case: &Case, segment: &Segment, input: &[f64]) -> Vec<u8> {
    let lift = match case.lift {
        Lift::Transpose => 0,
        Lift::Consistent => 1,
    };
    let n_steps = measurements(segment).count();
    let head = [lift, usize::from(case.has_input), segment.len(), n_steps];
    let mut bytes: Vec<u8> = head
        .iter()
        .flat_map(|value| (*value as i64).to_le_bytes())
        .collect();
    push(&mut bytes, &segment.time_s);
    push(&mut bytes, segment.x.as_slice());
    push(&mut bytes, segment.dx.as_slice());
    if case.has_input {
        push(&mut bytes, input);
    }
    bytes.extend(segment.feet.iter().flatten().map(|down| u8::from(*down)));
    for measurement in measurements(segment) {
        push(&mut bytes, &[measurement.time_s]);
        push(&mut bytes, measurement.x);
        push(&mut bytes, measurement.dx);
        bytes.extend(measurement.feet.map(u8::from));
    }
    bytes
}

/// The library's commands in the driver's format.
fn commanded(model: &ReducedModel, case: &Case, segment: &Segment, input: &[f64]) -> Vec<u8> {
    let settings = MpcSettings {
        lift: case.lift,
        ..MpcSettings::default()
    };
    let mut controller = romc::mpc::controller(model, settings).expect("a complete model");
    let input = case.has_input.then_some(input);
    controller
        .set_reference(samples(segment, input))
        .expect("a sound recording");
    let mut bytes = Vec::new();
    for measurement in measurements(segment) {
        let command = controller.step(measurement);
        let status = i64::from(command.status.code());
        for code in [status, status, i64::from(command.iterations)] {
            bytes.extend(code.to_le_bytes());
        }
        push(&mut bytes, &command.torque_nm);
        push(&mut bytes, &command.joint_position_rad);
        push(&mut bytes, &command.joint_velocity_rad_s);
        push(&mut bytes, &command.u_lat);
    }
    bytes
}

/// Drives the linked controller over whole recordings, both lifts, with and without their inputs.
fn drive_and_compare(model: &ReducedModel, built: &Built) {
    let driver = built.program(
        "cc",
        &["-std=c99"],
        &root().join("tests/controller/drive.c"),
    );
    let mut cases = Vec::new();
    let mut expected = Vec::new();
    for recording in ["test_01", "test_03"] {
        let path = root().join(format!("examples/recordings/go1/{recording}.csv.gz"));
        let recording = romc::recording::read(&path).expect("a sound recording");
        let segment = &recording.segments[0];
        let rule = model.input_rule().expect("a robot");
        let input = segment.input(&rule).expect("inputs").as_slice().to_vec();
        for lift in [Lift::Transpose, Lift::Consistent] {
            for has_input in [true, false] {
                let case = Case { lift, has_input };
                cases.extend(encoded(&case, segment, &input));
                expected.extend(commanded(model, &case, segment, &input));
            }
        }
    }
    let files =
        ["cases", "commands"].map(|what| built.target.join(format!("{}.{what}", built.name)));
    fs::write(&files[0], cases).expect("written");
    succeed(Command::new(driver).args(&files));
    let found = fs::read(&files[1]).expect("the driver wrote");
    assert_eq!(found.len(), expected.len());
    let step_len = 8 * (3 + 36 + model.latent_dim());
    assert!(expected.len() / step_len > 1000, "few steps");
    for (step, (found, expected)) in found
        .chunks(step_len)
        .zip(expected.chunks(step_len))
        .enumerate()
    {
        assert_eq!(found, expected, "{}: command {step} differs", model.name());
    }
}

/// A source missing from the list would give a crate that does not compile.
#[test]
fn generated_controllers_hold_all_sources_of_the_controller_and_its_solver() {
    let files = emitted(&shipped("go1-d4"));
    for folder in ["online", "solver"] {
        let entries = fs::read_dir(root().join("src/control").join(folder)).expect("sources");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        for name in names.map(|name| name.to_string_lossy().into_owned()) {
            let path = format!("go1_d4-controller/src/{folder}/{name}");
            assert!(files.iter().any(|file| file.path == path), "no {path}");
        }
    }
}

#[test]
fn emission_is_the_same_twice_and_names_its_origin_in_every_source() {
    let model = shipped("go1-d4");
    let files = emitted(&model);
    assert_eq!(files, emitted(&model));
    for file in &files {
        let is_licence = file.path.contains("LICENSE");
        let first = file.contents.lines().next().unwrap_or_default();
        assert!(
            is_licence || (first.contains("romc") && first.contains("go1-d4")),
            "{}: {first}",
            file.path
        );
    }
    let manifest = (files.iter())
        .find(|file| file.path == "go1_d4-controller/Cargo.toml")
        .expect("a manifest");
    let lock = fs::read_to_string(root().join("Cargo.lock")).expect("romc's own");
    for name in ["clarabel", "nalgebra"] {
        let (_, rest) = lock
            .split_once(&format!("name = \"{name}\"\nversion = \""))
            .expect("locked");
        let version = rest.split('"').next().expect("a version");
        assert!(
            manifest
                .contents
                .contains(&format!("{name} = {{ version = \"={version}\""))
        );
    }
    let lock = (files.iter())
        .find(|file| file.path == "go1_d4-controller/Cargo.lock")
        .expect("a lock file");
    let names = (lock.contents.lines()).filter_map(|line| line.strip_prefix("name = "));
    let names: Vec<&str> = names.map(|name| name.trim_matches('"')).collect();
    for needed in ["clarabel", "nalgebra", "amd", "go1_d4", "go1_d4-controller"] {
        assert!(names.contains(&needed), "{needed}");
    }
    for other in ["romc", "clap", "zip"] {
        assert!(!names.contains(&other), "{other}");
    }
    assert!(names.is_sorted());
    // Both versions of thiserror: clarabel's and romc's own.
    let both = names.iter().filter(|name| **name == "thiserror");
    assert_eq!(both.count(), 2);
}

#[test]
fn model_without_a_robot_or_with_activations_is_refused_with_the_reason() {
    let paper = shipped("paper-2d");
    let refused = emit(
        &Equations::of(&paper),
        &[Target::Controller],
        &EmitOptions::default(),
    );
    assert!(matches!(refused, Err(EmitError::Control(_))), "{refused:?}");

    let path = root().join("models/go1-d4.json");
    let text = fs::read_to_string(path).expect("a shipped model");
    let mut manifest: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mut layer = manifest["encoder"].take();
    layer["activation"] = "tanh".into();
    manifest["encoder"] = serde_json::json!({ "layers": [layer] });
    // Prior and landmarks also need a linear encoder, and would be reported first.
    let fields = manifest.as_object_mut().expect("an object");
    fields.retain(|name, _| !["prior", "landmarks"].contains(&name.as_str()));
    let folder = tempfile::tempdir().expect("a folder");
    let bent = folder.path().join("bent.json");
    fs::write(&bent, manifest.to_string()).expect("written");
    let bent = romc::artifact::read(&bent).expect("a nonlinear model");
    let refused = emit(
        &Equations::of(&bent),
        &[Target::Controller],
        &EmitOptions::default(),
    );
    assert!(
        matches!(&refused, Err(EmitError::Nonlinear { model }) if model == "go1-d4"),
        "{refused:?}"
    );
}

#[test]
fn generated_controllers_command_the_librarys_bits_and_survive_abuse() {
    // A crate compiles for a minute: the simpler model is built only in thorough runs.
    let mut models = vec![with_losses(shipped("go1-d6"))];
    if tools::is_thorough() {
        models.push(shipped("go1-d4"));
    }
    for model in models {
        let built = Built::new(&model);
        drive_and_compare(&model, &built);
        let abuse = root().join("tests/controller/abuse.c");
        succeed(&mut Command::new(built.program(
            "cc",
            &["-std=c99"],
            &abuse,
        )));
        let examples = built.folder.join("examples");
        for (compiler, standard, source) in [
            ("cc", "-std=c99", "example.c"),
            ("c++", "-std=c++11", "example.cpp"),
        ] {
            if !tools::is_there(compiler) {
                continue;
            }
            let program = built.program(compiler, &[standard], &examples.join(source));
            let output = succeed(&mut Command::new(program));
            assert!(String::from_utf8_lossy(&output.stdout).contains("N m"));
        }
        run_python(&built);
    }
}

/// The Python example on the shared library; without Python skipped with a message, unless required.
fn run_python(built: &Built) {
    let script = format!(
        "import {0}_controller as c; s = c.Library({1:?}).default_settings(); assert s.off() == []; \
         s.tilt_rad, s.poor_steps = float('inf'), 0; assert s.off() == ['tilt_rad', 'poor_steps']; \
         assert len(c.JOINT_NAMES) == 12; c.Controller.__init__.__defaults__ = (None, {1:?}); import example; example.main()",
        built.name,
        built.library("so")
    );
    if !tools::is_there("python3") {
        return;
    }
    let output = succeed(
        Command::new("python3")
            .args(["-B", "-c", &script])
            .current_dir(built.folder.join("python")),
    );
    assert!(String::from_utf8_lossy(&output.stdout).contains("N m"));
}

#[test]
fn bounds_that_are_off_are_listed() {
    let mut settings = romc::mpc::interface::Settings::default();
    assert_eq!(settings.off().count(), 0);
    (settings.tilt_rad, settings.poor_steps) = (f64::INFINITY, 0);
    let off: Vec<&str> = settings.off().collect();
    assert_eq!(off, ["tilt_rad", "poor_steps"]);
}
