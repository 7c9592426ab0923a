//! Robots from files: kinematics compared with Pinocchio's, errors about other trees, models that contain their robot.
//!
//! `fixtures/robots/reference.json` holds Pinocchio's values, computed and checked by `examples/robots/reference.py`.

mod command_line;
#[path = "robots/formulas.rs"]
mod formulas;
#[path = "robots/made.rs"]
mod made;
mod tools;
#[path = "robots/urdf.rs"]
mod urdf;

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use nalgebra::{Matrix3, Vector3};
use romc::artifact;
use romc::ir::Interpreter;
use romc::lower;
use romc::model::{AffineMap, Library, ReducedModel, Scaling, StateMap};
use romc::robot::{Actuators, InputRule, Leg, LegMoments, Robot, WrenchFrame};
use romc::robot_file::{self, RobotEntry, RobotFileError, RobotOptions};
use serde_json::Value;

use command_line::{romc, text};

const FILES: [&str; 3] = ["solo12.toml", "anymal_c.toml", "hare.urdf"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn file(name: &str) -> PathBuf {
    root().join("examples/robots").join(name)
}

fn from_text(file: &str, text: &str) -> Result<&'static Robot, RobotFileError> {
    let read = robot_file::from_text(file, text, &RobotOptions::default())?;
    Ok(read.robot)
}

fn robot(name: &str) -> &'static Robot {
    robot_file::find(&file(name).to_string_lossy()).expect("an example")
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().expect("a list").iter();
    numbers
        .map(|number| number.as_f64().expect("a number"))
        .collect()
}

#[test]
fn feet_and_jacobians_are_those_of_pinocchio() {
    let text = fs::read_to_string(root().join("tests/fixtures/robots/reference.json"));
    let reference: Value = serde_json::from_str(&text.expect("checked in")).expect("JSON");
    // The world link of `reference.py`; below it Pinocchio's trunk has the same legs.
    let hare = fs::read_to_string(file("hare.urdf")).expect("an example");
    let below_world = hare.replace(
        "</robot>",
        "<link name=\"world\"/><joint name=\"held\" type=\"fixed\"><parent link=\"world\"/><child link=\"torso\"/>\
         <origin xyz=\"0.3 -0.1 2\" rpy=\"0.1 0.2 0.7\"/></joint></robot>",
    );
    let below_world = from_text("t.urdf", &below_world).expect("reads");
    let robots = FILES.map(|name| (name, robot(name)));
    for (name, robot) in robots.into_iter().chain([("hare.urdf", below_world)]) {
        let mut legs = 0;
        for posture in reference[name].as_array().expect("postures") {
            for entry in posture.as_array().expect("legs") {
                let first = entry["joints"][0].as_str().expect("a name");
                let place = robot.joint_names.iter().position(|joint| *joint == first);
                let leg = Leg::ALL[place.expect("a first joint") / 3];
                let names: Vec<&str> = (0..3)
                    .map(|k| entry["joints"][k].as_str().expect("a name"))
                    .collect();
                assert_eq!(
                    robot.joint_names[3 * leg.index()..3 * leg.index() + 3],
                    names[..]
                );
                let q: [f64; 3] = numbers(&entry["angles"]).try_into().expect("three angles");
                let foot = robot.foot_from_body(leg, &q);
                let expected = Vector3::from_vec(numbers(&entry["foot"]));
                assert!(
                    (foot - expected).amax() < 1e-9,
                    "{name} {leg} {q:?}: {foot} {expected}"
                );
                let rows = entry["jacobian"]
                    .as_array()
                    .expect("rows")
                    .iter()
                    .flat_map(numbers);
                let expected = Matrix3::from_row_iterator(rows);
                let found = robot.geometry(leg).foot_jacobian(&q);
                assert!(
                    (found - expected).amax() < 1e-9,
                    "{name} {leg}: {found} {expected}"
                );
                legs += 1;
            }
        }
        assert_eq!(legs, 100, "{name}");
    }
}

#[test]
fn legs_are_matched_by_where_they_stand() {
    for (name, front_right) in [
        ("solo12.toml", "FR_HAA"),
        ("anymal_c.toml", "RF_HAA"),
        ("hare.urdf", "ne_swing"),
    ] {
        assert_eq!(robot(name).joint_names[0], front_right);
    }
    // The hare's thighs turn about y on the left and about -y on the right: mirrored motions have opposite signs there.
    let signs: Vec<f64> = (0..6)
        .map(|joint| robot("hare.urdf").mirror_sign(joint))
        .collect();
    assert_eq!(signs, [1.0, -1.0, -1.0, 1.0, -1.0, -1.0]);
    let signs: Vec<f64> = (0..3)
        .map(|joint| robot("solo12.toml").mirror_sign(joint))
        .collect();
    assert_eq!(signs, [-1.0, 1.0, 1.0]);
}

#[test]
fn robot_of_a_urdf_comes_back_from_its_own_toml_bit_for_bit() {
    let hare = robot("hare.urdf");
    let again = from_text("hare.toml", &robot_file::to_toml(hare)).expect("its text");
    assert!(std::ptr::eq(again, hare));
    assert!((hare.mass_kg() - 11.6).abs() < 1e-12);
    let turned = hare.joint_limit_rad()[8];
    assert!(
        turned.0 < -6.0 && turned.1 > 6.0,
        "se_shin turns without end: {turned:?}"
    );
}

/// A latent model over a robot.
fn model_on(robot: &'static Robot) -> ReducedModel {
    let library = Library::from_terms(1, &["z1".to_owned()]).expect("a term");
    let builder = ReducedModel::builder("m", library).robot(robot);
    let phase = romc::model::Phase {
        name: "contact".to_owned(),
        feet: romc::robot::FeetRule::Any,
        xi: nalgebra::DMatrix::from_element(1, 1, -1.0),
    };
    builder.phase(phase).build().expect("a model")
}

#[test]
fn model_file_carries_its_robot() {
    for name in FILES {
        let model = model_on(robot(name));
        let text = artifact::to_text(&model);
        assert!(text.contains("\"romc-model/2\""), "{text}");
        let again = artifact::read_from_bytes("m.json", text.as_bytes()).expect("a model");
        assert!(std::ptr::eq(again.robot().expect("a robot"), robot(name)));
        assert_eq!(artifact::to_text(&again), text);
        let first = text.replacen("romc-model/2", "romc-model/1", 1);
        let error = artifact::read_from_bytes("m.json", first.as_bytes()).unwrap_err();
        assert!(
            error.to_string().contains("`robot`: found in a file of"),
            "{error}"
        );
        let wrong = text.replacen("\"mass_kg\": ", "\"mass_kg\": -", 1);
        let error = artifact::read_from_bytes("m.json", wrong.as_bytes()).unwrap_err();
        assert!(
            error.to_string().contains("robot: mass_kg: found -"),
            "{error}"
        );
    }
    let text = artifact::to_text(&model_on(romc::robot_file::by_name("go2").expect("known")));
    assert!(
        text.contains("\"robot\": \"go2\"") && text.contains("romc-model/1"),
        "{text}"
    );
}

#[test]
fn generalised_input_of_robots_of_files_is_that_of_the_rule_also_where_it_is_damped() {
    let mut random = Random(1);
    for name in FILES {
        let robot = robot(name);
        for frame in WrenchFrame::ALL {
            let rule = InputRule::new(robot, None, frame);
            let mut input = Input::of(&rule);
            let mut damped = 0;
            for _ in 0..300 {
                let x: [f64; 18] = std::array::from_fn(|_| random.between(-2.0, 2.0));
                let tau: [f64; 12] = std::array::from_fn(|_| random.between(-20.0, 20.0));
                let feet: [bool; 4] = std::array::from_fn(|_| random.between(0.0, 1.0) < 0.6);
                let joints: [f64; 12] = std::array::from_fn(|k| x[k]);
                damped += usize::from(Leg::ALL.iter().any(|leg| {
                    let spans = robot.geometry(*leg).spans(&leg.of_joints(&joints));
                    feet[leg.index()] && (spans[0] < 0.3 || spans[1] < 0.12)
                }));
                let expected = rule.input_wrench(&x, &tau, feet).expect("finite");
                let u = input.run(&x, &[0.0; 18], &tau, &numbers_of(feet));
                for (found, expected) in u[12..].iter().zip(&expected) {
                    let bound = 1e-9 * (1.0 + expected.abs());
                    assert!(
                        (found - expected).abs() < bound,
                        "{name}: {found} {expected}"
                    );
                }
            }
            assert!(damped > 20, "{name}: {damped} damped postures");
        }
    }
}

/// Every built-in robot with and without joint losses, in every frame; also with the weight of its legs.
fn rules() -> Vec<InputRule> {
    let actuators = Actuators::of_leg([1.0, 0.6, 0.5], [0.2, 0.0, 0.3], [0.01; 3]);
    let mut rules = Vec::new();
    for name in romc::robot_file::known_names() {
        let robot = romc::robot_file::by_name(name).expect("a known robot");
        for frame in WrenchFrame::ALL {
            rules.push(InputRule::new(robot, None, frame));
            rules.push(InputRule::new(robot, Some(actuators.clone()), frame));
        }
        let legs = Some(LegMoments {
            side_kg_m: 0.07,
            thigh_kg_m: 0.072,
            calf_kg_m: 0.029,
            thigh_kg_m2: 0.018,
            calf_kg_m2: 0.006,
        });
        let moving = Actuators {
            legs,
            ..actuators.clone()
        };
        rules.push(InputRule::new(robot, Some(moving), WrenchFrame::Ground));
    }
    rules
}

#[test]
fn leg_torque_is_that_of_the_rule_for_every_robot_and_contact() {
    let mut random = Random(23);
    let moving = rules().into_iter().filter(|rule| rule.legs().is_some());
    let mut compared = 0;
    for rule in moving {
        let program = lower::leg_torque(&over_robot(&rule)).expect("lowers");
        let mut interpreter = Interpreter::new(&program.expect("a rule with legs"));
        for bits in 0..16_usize {
            let [x, dx] = sample(&mut random, (-2.7, -0.9));
            let ddx = std::array::from_fn(|_| random.between(-60.0, 60.0));
            let contact: [bool; 4] = std::array::from_fn(|k| bits >> k & 1 == 1);
            let inputs = [&x[..], &dx, &ddx, &numbers_of(contact)].map(<[f64]>::to_vec);
            let found = interpreter.results(&inputs).remove(0);
            let expected = rule.leg_torques([&x, &dx, &ddx], contact);
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-11 * (1.0 + expected.abs()),
                    "{rule:?}"
                );
                compared += usize::from(expected.abs() > 0.1);
            }
        }
    }
    assert!(compared > 200, "{compared}");
    let without = InputRule::published(romc::robot_file::by_name("go1").expect("a known robot"));
    assert!(
        lower::leg_torque(&over_robot(&without))
            .expect("lowers")
            .is_none()
    );
}

/// A state and its velocities.
fn sample(random: &mut Random, knee: (f64, f64)) -> [[f64; 18]; 2] {
    let x = std::array::from_fn(|k| match (k < 12, k % 3) {
        (true, 0) => random.between(-0.8, 0.8),
        (true, 1) => random.between(-0.3, 3.0),
        (true, _) => random.between(knee.0, knee.1),
        (false, _) => random.between(-1.4, 1.4),
    });
    let dx = std::array::from_fn(|k| match k % 4 {
        0 => random.between(-0.1, 0.1),
        _ => random.between(-12.0, 12.0),
    });
    [x, dx]
}

#[test]
fn generalised_input_is_that_of_the_rule_for_every_frame_and_contact_with_losses_of_the_joints() {
    let mut random = Random(11);
    for rule in rules() {
        let mut input = Input::of(&rule);
        for k in 0..40 {
            // Includes knees that are nearly stretched, and feet at the height of their hips.
            let knee = if k % 4 == 0 {
                (-0.2, 0.2)
            } else {
                (-2.7, -0.9)
            };
            let [x, dx] = sample(&mut random, knee);
            let tau: [f64; 12] = std::array::from_fn(|_| random.between(-30.0, 30.0));
            let losses = rule.losses([&x, &dx, &[0.0; 18]], [false; 4]);
            let net: [f64; 12] = std::array::from_fn(|i| tau[i] - losses[i]);
            for bits in 0..16_usize {
                let contact: [bool; 4] = std::array::from_fn(|k| bits >> k & 1 == 1);
                let u = input.run(&x, &dx, &tau, &numbers_of(contact));
                let wrench = rule.input_wrench(&x, &net, contact).expect("finite");
                for i in 0..12 {
                    assert!((u[i] - net[i]).abs() < 1e-14 * (1.0 + tau[i].abs() + losses[i].abs()));
                }
                for i in 0..6 {
                    let largest = wrench.rows(i / 3 * 3, 3).amax() + 1e-3 * wrench.amax();
                    let error = (u[12 + i] - wrench[i]).abs();
                    assert!(error <= 1e-11 * largest, "{rule:?} {i}: {u:?} {wrench}");
                }
            }
        }
    }
}

#[test]
fn generalised_input_of_a_stretched_leg_is_bounded_and_zero_in_the_air() {
    for rule in rules() {
        let mut input = Input::of(&rule);
        // Torques that stretch the legs, so the feet push.
        let tau: [f64; 12] = std::array::from_fn(|joint| if joint % 3 == 0 { 20.0 } else { -20.0 });
        let mut at = |feet: f64| input.run(&[0.0; 18], &[0.0; 18], &tau, &[feet; 4]);
        let on_ground = at(1.0);
        let force = on_ground[12..].iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        assert!(force > 1.0 && force < 4000.0, "{rule:?} {on_ground:?}");
        assert_eq!(at(0.0)[12..], [0.0; 6]);
    }
}

#[test]
fn actuator_torque_undoes_the_friction_of_generalised_input_and_adds_the_inertia() {
    let mut random = Random(5);
    for rule in rules() {
        let [x, dx] = sample(&mut random, (-2.0, -1.0));
        let tau: [f64; 12] = std::array::from_fn(|_| random.between(-30.0, 30.0));
        let u = Input::of(&rule).run(&x, &dx, &tau, &[1.0; 4]);
        let program = lower::actuator_torque(&over_robot(&rule)).expect("lowers");
        let mut interpreter = Interpreter::new(&program.expect("a robot"));
        for acceleration in [0.0, 70.0] {
            let inputs = [&dx[..], &[acceleration; 18], &u[..12]].map(<[f64]>::to_vec);
            let back = interpreter.results(&inputs).remove(0);
            let inertia = rule.actuators().map_or(0.0, |_| 0.01 * acceleration);
            for (found, tau) in back.into_iter().zip(tau) {
                assert!((found - tau - inertia).abs() < 1e-13 * 50.0, "{rule:?}");
            }
        }
    }
}

#[test]
fn generalised_input_weighs_a_foot_with_its_number() {
    let go1 = InputRule::published(romc::robot_file::by_name("go1").expect("a known robot"));
    let mut input = Input::of(&go1);
    let x: [f64; 18] = std::array::from_fn(|k| match (k < 12, k % 3) {
        (true, joint) => [0.1, 0.7, -1.4][joint],
        (false, _) => 0.0,
    });
    let tau: [f64; 12] = std::array::from_fn(|k| k as f64 - 4.0);
    let [full, half] =
        [1.0, 0.5].map(|foot| input.run(&x, &[0.0; 18], &tau, &[foot, 0.0, 0.0, 0.0]));
    for i in 12..18 {
        assert!((half[i] - 0.5 * full[i]).abs() < 1e-12, "{i}");
    }
}

/// Random numbers, equal in every run.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

fn numbers_of(feet: [bool; 4]) -> [f64; 4] {
    feet.map(|foot| f64::from(u8::from(foot)))
}

/// The program of generalised inputs.
struct Input(Interpreter);

impl Input {
    fn of(rule: &InputRule) -> Self {
        let program = lower::generalised_input(&over_robot(rule)).expect("lowers");
        Self(Interpreter::new(&program.expect("a robot")))
    }

    fn run(&mut self, x: &[f64], dx: &[f64], tau: &[f64], feet: &[f64]) -> [f64; 18] {
        let mut u = [0.0; 18];
        self.0.run(&[x, dx, tau, feet], &mut [&mut u]);
        u
    }
}

/// A model over the 18 coordinates of a robot.
fn over_robot(rule: &InputRule) -> ReducedModel {
    let weights = nalgebra::DMatrix::from_fn(1, 18, |_, k| 0.1 + 0.01 * k as f64);
    let encoder = AffineMap::new("encoder", weights, nalgebra::DVector::zeros(1)).expect("fits");
    model_on(rule.robot())
        .into_builder()
        .encoder(StateMap::from(encoder))
        .scaling(Scaling::uniform(1.0))
        .wrench_frame(rule.wrench_frame())
        .actuators(rule.actuators().cloned())
        .build()
        .expect("a model")
}

/// A URDF of limbs with these numbers of joints, all about x, then y.
fn tree(limbs: &[usize]) -> String {
    let mut text = "<robot name=\"t\"><link name=\"base\"/>".to_owned();
    for (limb, joints) in limbs.iter().enumerate() {
        let mut parent = "base".to_owned();
        for joint in 0..*joints {
            let child = format!("l{limb}_{joint}");
            let axis = if joint == 0 { "1 0 0" } else { "0 1 0" };
            text += &format!(
                "<link name=\"{child}\"/><joint name=\"j{limb}_{joint}\" type=\"revolute\">\
                 <parent link=\"{parent}\"/><child link=\"{child}\"/>\
                 <origin xyz=\"{} 0 -0.2\"/><axis xyz=\"{axis}\"/>\
                 <limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"9\"/></joint>",
                limb as f64
            );
            parent = child;
        }
    }
    text + "</robot>"
}

#[test]
fn trees_of_other_robots_are_told_apart() {
    for (limbs, said) in [
        (
            vec![6, 6],
            "found 2 limbs on `base`: j0_0 (6 joints), j1_0 (6 joints), expected four legs",
        ),
        (vec![3; 6], "found 6 limbs on `base`"),
        (vec![], "found 0 limbs on `base`, expected four legs"),
        (vec![4; 4], "--feet"),
        (
            vec![3; 4],
            "link `l0_2` beyond joint `j0_2`: found no link on a fixed joint",
        ),
    ] {
        let error = from_text("t.urdf", &tree(&limbs)).unwrap_err().to_string();
        assert!(
            error.starts_with("t.urdf: ") && error.contains(said),
            "{error}"
        );
    }
    let hare = fs::read_to_string(file("hare.urdf")).expect("an example");
    for (from, to, said) in [
        (
            " effort=\"30\"",
            "",
            "joint `nw_shin`, <limit>, effort: found nothing",
        ),
        (
            "<link name=\"nw_paw\"/>",
            "<link name=\"nw_paw\">",
            "t.urdf:",
        ),
        (
            "type=\"revolute\"><parent link=\"ne_mount\"/>",
            "type=\"prismatic\"><parent link=\"ne_mount\"/>",
            "type \"prismatic\"",
        ),
    ] {
        assert!(hare.contains(from), "{from}");
        let wrong = hare.replace(from, to);
        let error = from_text("t.urdf", &wrong).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn command_shows_a_robot_and_writes_its_toml() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let urdf = file("hare.urdf").display().to_string();
    let done = romc(folder.path(), &["robot", &urdf, "--output", "hare.toml"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("ne_swing"));
    let written =
        robot_file::find(&folder.path().join("hare.toml").to_string_lossy()).expect("its TOML");
    assert!(std::ptr::eq(written, robot("hare.urdf")));
    let feet = "se_paw,nw_paw,sw_paw,ne_paw";
    let named = romc(folder.path(), &["robot", &urdf, "--feet", feet, "--json"]);
    let json: Value = serde_json::from_slice(&named.stdout).expect("one object");
    assert_eq!(json["robot"]["leg"][0]["joint"][2]["name"], "ne_shin");
    for (arguments, code, said) in [
        (
            vec!["robot", "spot"],
            2,
            "unknown robot `spot`; known: go1, go2, a1, or a file",
        ),
        (
            vec!["robot", "none.toml"],
            1,
            "none.toml: cannot read the file",
        ),
        (
            vec!["robot", &urdf, "--feet", "skull,nw_paw,sw_paw,ne_paw"],
            1,
            "found 1 joints (neck)",
        ),
    ] {
        let failed = romc(folder.path(), &arguments);
        assert_eq!(failed.status.code(), Some(code), "{arguments:?}");
        assert!(
            text(&failed.stderr).contains(said),
            "{}",
            text(&failed.stderr)
        );
    }
}

#[test]
fn models_are_read_from_standard_input() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = fs::File::open(root().join("models/paper-2d.json")).expect("shipped");
    let done = Command::new(env!("CARGO_BIN_EXE_romc"))
        .current_dir(folder.path())
        .args(["compile", "-", "--emit", "latex", "--out-dir", "out"])
        .stdin(model)
        .output()
        .expect("the binary runs");
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(
        folder.path().join("out/paper-2d.tex").exists()
            || folder.path().join("out/paper_2d.tex").exists()
    );
    let failed = Command::new(env!("CARGO_BIN_EXE_romc"))
        .args(["inspect", "-"])
        .stdin(std::process::Stdio::null())
        .output()
        .expect("the binary runs");
    assert_eq!(failed.status.code(), Some(1));
    assert!(
        text(&failed.stderr).contains("standard input: at"),
        "{}",
        text(&failed.stderr)
    );
}

#[test]
fn completions_offer_targets_and_robots() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = text(&romc(folder.path(), &["completions", "bash"]).stdout);
    assert!(script.contains("compgen -f -W \"go1 go2 a1\""));
    let emit = script.split("--emit)").nth(1).expect("the option");
    let offered = emit.lines().nth(1).expect("a line");
    assert!(
        offered.contains("latex") && offered.contains("controller"),
        "{offered}"
    );
}

/// Names of robots and joints cannot end the comment in the header that lists them, and appear unchanged.
#[test]
fn names_that_act_on_the_text_around_them_are_refused() {
    let solo12 = robot_file::to_toml(robot("solo12.toml"));
    for acts in [
        "\u{202e}", "\u{2066}", "\u{200b}", "\u{2028}", "\n", "*/", "/*", "??/", "\\", "`",
    ] {
        for (name, place) in [("solo12", "name"), ("FL_HAA", "leg[1].joint[0].name")] {
            let hostile = format!("{name}{acts}x");
            let quoted = Value::from(hostile.as_str()).to_string();
            let text = solo12.replace(&format!("\"{name}\""), &quoted);
            let error = from_text("r.toml", &text).expect_err("a fault").to_string();
            let found =
                format!("r.toml: {place}: found {hostile:?}, expected a name of at most 80 bytes");
            assert!(error.starts_with(&found), "{error}");
        }
    }
    let text = robot_file::to_toml(robot("solo12.toml")).replace("FL_HAA", "FL*/HAA");
    let error = from_text("r.toml", &text).unwrap_err().to_string();
    assert!(
        error.contains("leg[1].joint[0].name: found \"FL*/HAA\""),
        "{error}"
    );
}

#[test]
fn known_robots_come_back_from_their_own_text_as_themselves() {
    for name in romc::robot_file::known_names() {
        let robot = romc::robot_file::by_name(name).expect("read");
        let again =
            from_text(&format!("{name}.toml"), &robot_file::to_toml(robot)).expect("its own text");
        assert!(std::ptr::eq(again, robot), "{name}");
        assert!(std::ptr::eq(robot_file::find(name).expect("known"), robot));
    }
}

#[test]
fn faults_name_the_entry() {
    let good = robot_file::to_toml(romc::robot_file::by_name("go1").unwrap())
        .replace("\"go1\"", "\"mine\"");
    for (from, to, said) in [
        (
            "FR_calf_joint",
            "FR_hip_joint",
            "leg[0].joint[2].name: found \"FR_hip_joint\" a second",
        ),
        (
            "torque_nm = 35.55",
            "torque_nm = -1.0",
            "leg[0].joint[2].torque_nm: found -1",
        ),
        (
            "axis = \"y\"",
            "axis = \"w\"",
            "leg[0].joint[1].axis: found Name(\"w\")",
        ),
        (
            "limits_rad = [-0.863, 0.863]",
            "limits_rad = [0.863, -0.863]",
            "the lower limit first",
        ),
        (
            "[0.1881, 0.04675, 0.0]",
            "[0.1881, -0.04675, 0.0]",
            "one at each corner",
        ),
        ("mass_kg", "mass", "unknown field `mass`"),
        ("axis = \"y\"", "axis = \"z\"", "parallel axes"),
    ] {
        assert!(good.contains(from), "{from}");
        let error = from_text("r.toml", &good.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn another_robot_of_a_known_name_is_one_of_its_own_and_says_what_differs() {
    let a1 =
        robot_file::to_toml(romc::robot_file::by_name("a1").unwrap()).replace("12.78", "12.79");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("r.toml").display().to_string();
    fs::write(&path, &a1).expect("written");
    let open = |name: Option<&str>| robot_file::open(&path, &RobotOptions { feet: &[], name });
    let read = open(None).expect("read");
    assert_eq!((read.robot.name, read.robot.mass_kg()), ("a1-toml", 12.79));
    assert_eq!(
        read.notes,
        [
            "its numbers are not those of romc's own \"a1\" (mass_kg 12.79 instead of 12.78): it is called \
             \"a1-toml\"; --name (romc robot) gives it another name"
        ]
    );
    assert_eq!(open(Some("mine")).expect("read").robot.name, "mine");
    let error = open(Some("a1")).unwrap_err().to_string();
    let found = "--name: found \"a1\", romc's own robot with other";
    assert!(error.contains(found), "{error}");
    // The robot of a model file is not renamed.
    let entry: RobotEntry = toml::from_str(&a1).expect("an entry");
    let error = entry.robot("robot").unwrap_err().to_string();
    assert!(error.contains("(mass_kg 12.79 instead of 12.78), expected another name"));
}

#[test]
fn signs_and_offsets_turn_the_same_leg_at_other_angles() {
    let own = romc::robot_file::by_name("go1").unwrap();
    let text = robot_file::to_toml(own).replace("\"go1\"", "\"mine\"");
    // Knee angles with the opposite sign, and 0.4 rad for a straight leg.
    let text = text.replace(
        "_calf_joint\", at = [0.0, 0.0, -0.213], axis = \"y\"",
        "_calf_joint\", at = [0.0, 0.0, -0.213], axis = \"y\", sign = -1.0, offset_rad = 0.4",
    );
    let turned = from_text("mine.toml", &text).unwrap();
    for leg in Leg::ALL {
        let q = [0.1, 0.7, -1.4];
        let read = [q[0], q[1], 0.4 - q[2]];
        let (a, b) = (
            own.geometry(leg).foot_position(&q),
            turned.geometry(leg).foot_position(&read),
        );
        assert!((a - b).norm() < 1e-15, "{leg}: {a} {b}");
        let (a, b) = (
            own.geometry(leg).foot_jacobian(&q),
            turned.geometry(leg).foot_jacobian(&read),
        );
        assert!((a.column(2) + b.column(2)).norm() < 1e-15);
    }
}

#[test]
fn generated_controllers_hold_all_sources_of_the_robot_but_those_of_its_files() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/robot");
    let mut found: Vec<String> = std::fs::read_dir(root)
        .expect("a folder of sources")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .filter(|name| name.ends_with(".rs"))
        .filter(|name| !["sources.rs", "serialised.rs", "phase.rs"].contains(&name.as_str()))
        .collect();
    found.sort();
    let held = romc::robot::sources::SOURCES.iter();
    assert!(held.map(|(name, _)| *name).eq(found));
}
