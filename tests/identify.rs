//! `romc identify` on the shipped recordings: the simulated robots are known.

#[allow(dead_code, reason = "folders alone")]
mod outside;
mod tools;

use std::path::{Path, PathBuf};
use std::process::Command;

use romc::identify::{Identification, IdentifyError, identify};
use romc::recording::{self, Recording};
use serde_json::Value;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples/recordings")
        .join(name)
}

fn found(robot: &str, names: &[&str]) -> Identification {
    let read = |name: &&str| recording::read(&path(name)).expect("a shipped recording");
    let recordings: Vec<Recording> = names.iter().map(read).collect();
    let robot = romc::robot_file::by_name(robot).expect("a known robot");
    identify(&recordings, robot).expect("recordings of jumps")
}

/// Value, standard error and the simulator's value of gravity, mass and the losses of the Go1.
fn against_the_go1(found: &Identification) -> Vec<(&'static str, f64, f64, f64)> {
    let error = &found.standard_error;
    let mut all = vec![
        ("gravity", found.gravity_m_s2, error.gravity_m_s2, 9.81),
        ("mass", found.mass_kg, error.mass_kg, 12.743),
    ];
    let [viscous, dry, armature] = found.losses();
    for (names, values, errors, truth) in [
        (
            ["viscous hx", "viscous hy", "viscous kn"],
            viscous,
            error.viscous_nm_s_rad,
            [1.0, 0.6, 0.6],
        ),
        (["dry hx", "dry hy", "dry kn"], dry, error.dry_nm, [0.2; 3]),
        (
            ["armature hx", "armature hy", "armature kn"],
            armature,
            error.armature_kg_m2,
            [0.01; 3],
        ),
    ] {
        let [values, errors] = [values, errors].map(|of| [of.hx, of.hy, of.kn]);
        for kind in 0..3 {
            all.push((names[kind], values[kind], errors[kind], truth[kind]));
        }
    }
    all
}

fn is_the_go1(names: &[&str]) {
    let found = found("go1", names);
    let all = against_the_go1(&found);
    for (name, value, error, truth) in &all {
        let (low, high) = match *name {
            "gravity" => (0.995, 1.005),
            "mass" => (0.98, 1.02),
            "viscous hy" | "viscous kn" => (0.9, 1.1),
            "viscous hx" => (0.85, 1.15),
            "dry hx" => (0.75, 1.25),
            _ => (0.5, 2.0),
        };
        let ratio = value / truth;
        assert!(
            (low..high).contains(&ratio),
            "{name}: {value} ± {error}, not {truth}"
        );
    }
    let inside =
        |(_, value, error, truth): &&(&str, f64, f64, f64)| (value - truth).abs() <= 3.0 * error;
    assert!(all.iter().filter(inside).count() >= 10, "{all:?}");
    // Torques act from one row to the next: half a step later than their row on average.
    assert!((found.delay_s - 0.001).abs() < 0.0007, "{}", found.delay_s);
    assert!(found.r2.x > 0.97 && found.r2.z > 0.98, "{:?}", found.r2);
    assert!(found.force_alone.r2.x < 0.9 && found.force_alone.r2.z < 0.9);
    assert!(!(11.0..14.0).contains(&found.force_alone.mass_kg));
}

#[test]
fn shipped_go1_test_jumps_return_the_simulated_robot() {
    is_the_go1(&[
        "go1/test_01.csv.gz",
        "go1/test_02.csv.gz",
        "go1/test_03.csv.gz",
    ]);
}

#[test]
fn shipped_go1_training_jumps_return_the_same_robot() {
    is_the_go1(&[
        "go1/train_02.csv.gz",
        "go1/train_08.csv.gz",
        "go1/train_12.csv.gz",
    ]);
}

#[test]
fn eight_jumps_have_errors_that_cover_the_simulated_robot_and_its_legs() {
    let names = [1, 2, 3, 4, 5, 6, 7, 8].map(|i| format!("go1-other/jump_0{i}.csv.gz"));
    let names = names.each_ref().map(String::as_str);
    is_the_go1(&names);
    let Identification {
        legs,
        standard_error,
        ..
    } = found("go1", &names);
    let errors = standard_error.legs;
    for (value, error, truth) in [
        (legs.thigh_kg_m, errors.thigh_kg_m, 0.0725),
        (legs.calf_kg_m, errors.calf_kg_m, 0.0286),
    ] {
        assert!((value - truth).abs() < 3.0 * error, "{value} ± {error}");
    }
}

#[test]
fn noisy_sensors_and_an_unrecorded_push_widen_the_errors_and_keep_the_robot() {
    let names = [1, 2, 3, 4].map(|i| format!("go1-noisy/train_0{i}.csv.gz"));
    let noisy = found("go1", &names.each_ref().map(String::as_str));
    let clean = found("go1", &["go1/test_01.csv.gz", "go1/test_02.csv.gz"]);
    assert!(
        (noisy.gravity_m_s2 / 9.81 - 1.0).abs() < 0.02,
        "{}",
        noisy.gravity_m_s2
    );
    assert!(
        (noisy.mass_kg / 12.743 - 1.0).abs() < 0.03,
        "{}",
        noisy.mass_kg
    );
    let [viscous, ..] = noisy.losses();
    for found in [viscous.hy, viscous.kn] {
        assert!((found / 0.6 - 1.0).abs() < 0.2, "{found}");
    }
    assert!(noisy.standard_error.gravity_m_s2 > 3.0 * clean.standard_error.gravity_m_s2);
}

#[test]
fn shipped_go2_jumps_return_the_mass_of_the_go2() {
    let names = [1, 2, 3].map(|i| format!("go2-asynchronous/train_0{i}.csv.gz"));
    let go2 = found("go2", &names.each_ref().map(String::as_str));
    assert!((go2.mass_kg / 15.206 - 1.0).abs() < 0.02, "{}", go2.mass_kg);
    assert!(
        (go2.gravity_m_s2 / 9.81 - 1.0).abs() < 0.005,
        "{}",
        go2.gravity_m_s2
    );
}

fn romc(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_romc"))
        .args(arguments)
        .output()
        .expect("romc starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn command_prints_one_object_and_writes_a_file_that_reads_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join("actuators.toml");
    let (jump, file) = (path("go1/test_02.csv.gz"), output.to_str().expect("UTF-8"));
    let jump = jump.to_str().expect("UTF-8");
    let arguments = [
        "identify", jump, "--robot", "go1", "--output", file, "--json",
    ];
    let (code, stdout, stderr) = romc(&arguments);
    assert_eq!(code, Some(0), "{stderr}");
    let json: Value = serde_json::from_str(&stdout).expect("one object");
    let number = |value: &Value| value.as_f64().expect("a number");
    for group in ["viscous_nm_s_rad", "dry_nm", "armature_kg_m2"] {
        for kind in ["hx", "hy", "kn"] {
            assert!(number(&json[group][kind]) >= 0.0);
            assert!(number(&json["standard_error"][group][kind]) > 0.0);
        }
    }
    assert!(number(&json["r2"]["losses"]["z"]) > number(&json["r2"]["force"]["z"]));
    assert!(number(&json["samples"]["contact"]) > number(&json["samples"]["flight"]));
    let read = Identification::read(&output).expect("its own file");
    assert!((read.mass_kg / number(&json["mass_kg"]) - 1.0).abs() < 1e-5);
    assert!((read.actuators.viscous[4] - number(&json["viscous_nm_s_rad"]["hy"])).abs() < 1e-5);
    // The file stays unless it is asked to be replaced.
    let (code, _, stderr) = romc(&arguments);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("already exists; pass --force"), "{stderr}");
}

#[test]
fn command_unknown_robot_is_wrong_usage() {
    let jump = path("go1/test_02.csv.gz");
    let (code, stdout, stderr) =
        romc(&["identify", jump.to_str().expect("UTF-8"), "--robot", "spot"]);
    assert_eq!((code, stdout.as_str()), (Some(2), ""));
    assert!(
        stderr.contains("unknown robot `spot`; known: go1"),
        "{stderr}"
    );
}

#[test]
fn values_that_the_motion_contradicts_are_told() {
    let read = |name: &str| recording::read(&path(name)).expect("a shipped recording");
    let names = [
        "go1/test_01.csv.gz",
        "go1/test_02.csv.gz",
        "go1/test_03.csv.gz",
    ];
    let right: Vec<Recording> = names.map(read).into();
    let go1 = romc::robot_file::by_name("go1").expect("a known robot");
    let spoiled = |spoil: &dyn Fn(&mut recording::Segment)| {
        let mut wrong = right.clone();
        wrong
            .iter_mut()
            .flat_map(|jump| &mut jump.segments)
            .for_each(spoil);
        identify(&wrong, go1).expect("a mass all the same")
    };
    assert_eq!(identify(&right, go1).expect("jumps").contradiction(), None);
    let backwards = spoiled(&|segment| {
        for matrix in [&mut segment.x, &mut segment.dx, &mut segment.ddx] {
            matrix.row_mut(12).neg_mut();
        }
    });
    let thighs = spoiled(&|segment| {
        for leg in 0..4 {
            segment.torque_nm.row_mut(3 * leg + 1).neg_mut();
        }
    });
    for wrong in [backwards, thighs] {
        let reason = wrong.contradiction().expect("told");
        assert!(
            reason.starts_with("R^2 of the trunk's acceleration forwards is -"),
            "{reason}"
        );
        assert!(wrong.notes.contains(&reason));
    }
    let has_note = |found: &Identification, start: &str| {
        found.notes.iter().any(|note| note.starts_with(start))
    };
    let right = identify(&right, go1).expect("jumps");
    let half = spoiled(&|segment| segment.torque_nm /= 2.0);
    let shrunk = spoiled(&|segment| {
        for matrix in [&mut segment.x, &mut segment.dx, &mut segment.ddx] {
            matrix.row_mut(14).scale_mut(0.9);
        }
    });
    for (wrong, start) in [(half, "the mass is "), (shrunk, "gravity is ")] {
        assert!(!has_note(&right, start), "{:?}", right.notes);
        assert!(has_note(&wrong, start), "{start}: {:?}", wrong.notes);
    }
}

fn read_all(names: &[&str]) -> Vec<Recording> {
    let read = |name: &&str| recording::read(&path(name)).expect("a shipped recording");
    names.iter().map(read).collect()
}

/// The refusal of recordings that are not of one robot.
fn contradiction(recordings: &[Recording]) -> String {
    let go1 = romc::robot_file::by_name("go1").expect("a known robot");
    match identify(recordings, go1) {
        Err(error @ IdentifyError::Contradiction { .. }) => error.to_string(),
        Err(error) => panic!("{error}"),
        Ok(found) => panic!("{} kg, {}", found.mass_kg, found.gravity_m_s2),
    }
}

#[test]
fn recordings_that_contradict_each_other_or_physics_are_refused_by_name() {
    let names = [
        "go1/test_01.csv.gz",
        "go1/test_02.csv.gz",
        "go1/test_03.csv.gz",
    ];
    let right = read_all(&names);
    let spoiled = |at: usize, spoil: &dyn Fn(&mut recording::Segment)| {
        let mut wrong = right.clone();
        wrong[at].segments.iter_mut().for_each(spoil);
        contradiction(&wrong)
    };
    for at in 0..3 {
        let error = spoiled(at, &|segment| segment.torque_nm.fill(0.0));
        assert!(
            error.contains(names[at]) && error.contains("its torques carry 0.000"),
            "{error}"
        );
        let error = spoiled(at, &|segment| segment.torque_nm.neg_mut());
        assert!(
            error.contains(names[at]) && error.contains("its torques carry -"),
            "{error}"
        );
        let error = spoiled(at, &|segment| segment.torque_nm *= 1e3);
        assert!(error.contains(names[at]), "{error}");
        let error = spoiled(at, &|segment| {
            for matrix in [&mut segment.x, &mut segment.dx, &mut segment.ddx] {
                matrix.row_mut(14).scale_mut(0.5);
            }
        });
        assert!(
            error.contains(names[at]) && error.contains("in flight"),
            "{error}"
        );
        let error = spoiled(at, &|segment| segment.torque_nm *= 1.2);
        assert!(
            error.contains(names[at]) && error.contains("its mass is"),
            "{error}"
        );
    }
    // Two robots of nearly the same geometry, as files and as segments of one.
    let go2 = read_all(&[
        "go2-asynchronous/train_01.csv.gz",
        "go2-asynchronous/train_02.csv.gz",
    ]);
    let both = [&right[..2], &go2[..]].concat();
    assert!(contradiction(&both).contains("its mass is"));
    let mut one = right[0].clone();
    one.segments.extend(go2[0].segments.iter().cloned());
    let error = contradiction(&[one]);
    assert!(error.contains(", segment "), "{error}");
    // A payload, or a wrong mass in the robot's file, that all have.
    let mut heavier = right;
    let segments = heavier
        .iter_mut()
        .flat_map(|recording| &mut recording.segments);
    segments.for_each(|segment| segment.torque_nm *= 1.3);
    let go1 = romc::robot_file::by_name("go1").expect("a known robot");
    let found = identify(&heavier, go1).expect("one robot");
    assert!(found.mass_kg > 15.5, "{}", found.mass_kg);
}

#[test]
fn moments_of_legs_that_no_leg_has_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("actuators.toml");
    let losses = "[actuators]\nviscous = [1, 1, 1]\ndry = [0, 0, 0]\narmature = [0, 0, 0]\n[legs]\nside_kg_m = 0.07\n\
                  thigh_kg_m = 0.07\ncalf_kg_m = 0.03\n";
    let losses = losses
        .replace("[1, 1, 1]", "[1.0, 1.0, 1.0]")
        .replace("[0, 0, 0]", "[0.0, 0.0, 0.0]");
    for (moments, expected) in [
        ("thigh_kg_m2 = 0.02\ncalf_kg_m2 = 0.006\n", None),
        (
            "thigh_kg_m2 = -0.02\ncalf_kg_m2 = 0.006\n",
            Some("legs.thigh_kg_m2"),
        ),
        (
            "thigh_kg_m2 = 0.02\ncalf_kg_m2 = nan\n",
            Some("legs.calf_kg_m2"),
        ),
    ] {
        std::fs::write(&file, losses.clone() + moments).expect("written");
        let read = romc::robot_file::read_actuators(&file, None);
        match expected {
            None => assert!(read.expect("sound").legs.is_some()),
            Some(place) => {
                let error = read.expect_err(place).to_string();
                assert!(
                    error.contains(place) && error.contains("actuators.toml"),
                    "{error}"
                );
            }
        }
    }
}

#[test]
fn training_refuses_them_too_whatever_actuators_it_is_given() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut without = read_all(&["go1/test_02.csv.gz"]).remove(0);
    without.segments[0].torque_nm.fill(0.0);
    let bad = folder.path().join("without-torques.csv");
    recording::write(&bad, &without).expect("written");
    let actuators = folder.path().join("actuators.toml");
    let text = "robot = \"go1\"\ngravity_m_s2 = 1.77\n[actuators]\nviscous = [1.0, 0.6, 0.6]\ndry = [0.2, 0.2, 0.2]\n\
                armature = [0.01, 0.01, 0.01]\n";
    std::fs::write(&actuators, text).expect("written");
    let good = ["go1/test_01.csv.gz", "go1/test_03.csv.gz"].map(path);
    let [good_1, good_2] = good.each_ref().map(|path| path.to_str().expect("UTF-8"));
    let (bad, file) = (
        bad.to_str().expect("UTF-8"),
        actuators.to_str().expect("UTF-8"),
    );
    let model = folder.path().join("model.json");
    let model = model.to_str().expect("UTF-8");
    let train = |recordings: &[&str], more: &[&str]| {
        let fixed = ["--robot", "go1", "--latent-dim", "2", "--output", model];
        let (code, _, stderr) = romc(&[&["train"], recordings, more, &fixed[..]].concat());
        assert_eq!(code, Some(1), "{stderr}");
        stderr
    };
    for more in [&[][..], &["--actuators", "none"]] {
        let error = train(&[good_1, bad, good_2], more);
        assert!(
            error.contains("without-torques.csv") && error.contains("its torques carry 0.000"),
            "{error}"
        );
    }
    // Among the validation recordings as well.
    let error = train(
        &[good_1, good_2],
        &["--actuators", "none", "--validation", bad],
    );
    assert!(error.contains("without-torques.csv"), "{error}");
    let error = train(&[good_1], &["--actuators", file]);
    assert!(
        error.contains("gravity_m_s2: found 1.77, expected about 9.81"),
        "{error}"
    );
}

/// Every set of right recordings agrees, and none is refused.
#[test]
fn right_recordings_are_not_refused() {
    let sets = [
        ("go1", "go1"),
        ("go1-other", "go1"),
        ("go1-noisy", "go1"),
        ("go2-asynchronous", "go2"),
        ("go1-trot", "go1"),
        ("go1-trot-other", "go1"),
        ("go1-gaits", "go1"),
    ];
    let mut sets: Vec<(PathBuf, &str)> = sets.map(|(folder, robot)| (path(folder), robot)).into();
    sets.extend(outside::beside("a1").map(|folder| (folder, "a1")));
    if !tools::is_thorough() {
        sets.retain(|(folder, _)| folder.ends_with("go1-noisy") || folder.ends_with("a1"));
    }
    for (folder, robot) in sets {
        let entries = std::fs::read_dir(&folder)
            .expect("recordings")
            .map(|entry| entry.expect("one").path());
        let files = entries.filter(|path| path.extension().is_some_and(|end| end == "gz"));
        let recordings: Vec<Recording> = files
            .map(|path| recording::read(&path).expect("a recording"))
            .collect();
        let robot = romc::robot_file::by_name(robot).expect("a known robot");
        assert!(recordings.len() >= 4);
        if let Err(error) = identify(&recordings, robot) {
            panic!("{}: {error}", folder.display());
        }
    }
}
