//! Names of the robot's own joints in generated controllers, as a crate and in C.

use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::robot::WrenchFrame;

use crate::legs::on_robot;
use crate::programs::shipped;

const UNITREE: [&str; 6] = [
    "FR_hip",
    "FR_thigh",
    "FR_calf",
    "FR_foot",
    "Unitree",
    "motorState",
];

/// Paths and contents of both controllers.
fn files(model: &romc::model::ReducedModel) -> Vec<(String, String)> {
    let targets = [Target::Controller, Target::ControllerC];
    let files = emit(&Equations::of(model), &targets, &EmitOptions::default());
    let files = files.expect("a complete model").into_iter();
    files.map(|file| (file.path, file.contents)).collect()
}

fn file<'f>(files: &'f [(String, String)], end: &str) -> &'f str {
    let found = files.iter().find(|(path, _)| path.ends_with(end));
    &found.unwrap_or_else(|| panic!("{end}")).1
}

#[test]
fn generated_controllers_name_the_robots_own_joints() {
    for (name, joints, feet, row) in [
        (
            "anymal_c.toml",
            ["RF_HAA", "LF_HFE", "RH_KFE", "LH_KFE"],
            "\"RF_foot/force.z\", \"LF_foot/force.z\", \"RH_foot/force.z\", \"LH_foot/force.z\"",
            " *    0  fr.hx  RF_HAA    -0.72     0.49       80       12  x\n",
        ),
        (
            "hare.urdf",
            ["ne_swing", "nw_thigh", "se_shin", "sw_shin"],
            "\"ne_foot/force.z\", \"nw_foot/force.z\", \"se_foot/force.z\", \"sw_foot/force.z\"",
            "",
        ),
    ] {
        let model = on_robot(name, WrenchFrame::Body);
        let robot = model.robot().expect("a robot");
        let files = files(&model);
        for (path, text) in &files {
            let found = UNITREE.iter().find(|word| text.contains(**word));
            assert_eq!(found, None, "{name}: {path}");
        }
        for folder in ["-controller/include", "-controller-c"] {
            let header = file(&files, &format!("go1_d4{folder}/go1_d4_controller.h"));
            assert!(header.contains(row), "{row}");
            let array = header
                .split_once("go1_d4_joint_names[12] = {")
                .expect("an array")
                .1;
            let quoted: Vec<&str> = array.split('"').skip(1).step_by(2).take(12).collect();
            assert_eq!(quoted, robot.joint_names);
            assert_eq!([quoted[0], quoted[4], quoted[8], quoted[11]], joints);
        }
        let parameters = file(&files, "controllers.yaml");
        assert!(
            robot
                .joint_names
                .iter()
                .all(|joint| parameters.contains(&format!("{joint:?}")))
        );
        assert!(parameters.contains(feet), "{parameters}");
    }
    let files = files(&shipped("go1-d2"));
    assert!(file(&files, "_robot.h").contains("`motorState[i].q` is x[i]"));
    assert!(file(&files, "controllers.yaml").contains("\"FR_foot/force.z\""));
}
