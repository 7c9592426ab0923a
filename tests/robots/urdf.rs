//! Reading of URDFs: frames and masses of their trees, faults with element and line, impossible numbers.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use romc::robot::{Leg, Robot};
use romc::robot_file::{RobotFileError, RobotOptions, RobotReading, from_text};

use super::command_line::{romc, text};
use super::made::{Joint, LEGS, Made, fixed};
use super::tools::is_thorough;

fn read(text: &str) -> RobotReading {
    from_text("t.urdf", text, &RobotOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The robot of a URDF; the feet are these links, if any are named.
fn from_urdf(file: &str, text: &str, feet: &[String]) -> Result<&'static Robot, RobotFileError> {
    let options = RobotOptions { feet, name: None };
    from_text(file, text, &options).map(|read| read.robot)
}

fn refusal(text: &str) -> String {
    from_urdf("t.urdf", text, &[])
        .expect_err("a fault")
        .to_string()
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }
}

/// At random angles the robot's feet have the positions given by the file's numbers, relative to `trunk`.
fn assert_feet(made: &Made, robot: &Robot, trunk: &str, random: &mut Random) {
    for leg in Leg::ALL {
        let names = &robot.joint_names[3 * leg.index()..3 * leg.index() + 3];
        let q = [(); 3].map(|()| random.between(-2.0, 2.0));
        let angles: BTreeMap<&str, f64> = names.iter().copied().zip(q).collect();
        let last = made
            .joints
            .iter()
            .find(|joint| joint.name == names[2])
            .expect("a joint");
        let foot = last.child.replace("calf", "foot");
        let expected = made.frame(trunk, &foot, &angles) * Point3::origin();
        let found = robot.foot_from_body(leg, &q);
        assert!(
            (found - expected.coords).amax() < 1e-9,
            "{leg} {q:?}: {found} {expected}\n{}",
            made.urdf()
        );
        let side = Vector3::new(if leg.is_front() { 1.0 } else { -1.0 }, leg.side(), 0.0);
        let first = made
            .joints
            .iter()
            .find(|joint| joint.name == names[0])
            .expect("a joint");
        let hip = made
            .frame(trunk, &first.child, &BTreeMap::new())
            .translation
            .vector;
        assert!(
            (robot.hip_position(leg) - hip).amax() < 1e-9
                && hip.x * side.x > 0.0
                && hip.y * side.y > 0.0
        );
    }
}

#[test]
fn body_is_the_trunk_whatever_it_hangs_below() {
    let (here, level) = ([0.0; 3], [0.0; 3]);
    let mut random = Random(3);
    for (above, note) in [
        (vec![], None),
        (
            vec![("base", "fixed", here, level)],
            Some("0 0 0 m from `base`"),
        ),
        (
            vec![("world", "fixed", [0.0, 0.0, 2.0], level)],
            Some("0 0 2 m from `world`"),
        ),
        (
            vec![("base_footprint", "fixed", [0.3, -0.1, 0.35], level)],
            Some("0.3 -0.1 0.35 m from `base_footprint`"),
        ),
        (
            vec![
                ("map", "fixed", here, [0.0, 0.0, 1.5]),
                ("base", "fixed", [0.0, 0.5, 0.0], [0.3, 0.2, 0.1]),
            ],
            Some("from `map`"),
        ),
        (
            vec![("world", "floating", [0.0, 0.0, 1.0], level)],
            Some("0 0 1 m from `world`"),
        ),
        (
            vec![
                ("world", "fixed", here, level),
                ("odom", "planar", [0.0, 0.0, 0.4], level),
            ],
            Some("from `world`"),
        ),
        (
            vec![
                ("world", "prismatic", here, level),
                ("x", "prismatic", here, level),
                ("xy", "revolute", [0.0, 0.0, 0.4], level),
            ],
            Some("from `world`"),
        ),
    ] {
        let made = Made::quadruped().below(&above);
        let read = read(&made.urdf());
        assert_feet(&made, read.robot, "trunk", &mut random);
        assert!((read.robot.mass_kg() - 11.24).abs() < 1e-12);
        match (note, &read.notes[..]) {
            (None, []) => {}
            (Some(place), [note]) => {
                assert!(
                    note.starts_with("the body's frame is that of link `trunk`, ")
                        && note.ends_with(place),
                    "{note}"
                );
            }
            (_, notes) => panic!("{notes:?}"),
        }
    }
}

#[test]
fn frame_of_a_trunk_without_mass_is_its_own_and_the_mass_is_named() {
    // KDL requires a massless root: the legs are on `base`, and a second link at its centre has the mass.
    let mut made = Made::quadruped();
    made.links[0].1 = None;
    made.links.push(("inertia".to_owned(), Some(5.0)));
    made.joints
        .push(fixed("to_inertia", "trunk", "inertia", [0.0; 3], [0.0; 3]));
    assert_eq!(read(&made.urdf()).notes, [""; 0]);
    made.joint("to_inertia").xyz = [0.02, 0.0, -0.01];
    let found = read(&made.urdf());
    assert_feet(&made, found.robot, "trunk", &mut Random(4));
    assert!(
        found.notes[0].starts_with(
            "the trunk's mass is in link `inertia`, 0.02 0 -0.01 m from `trunk`, whose"
        )
    );
    // A massless frame between the trunk and its legs is not the body's frame.
    let mut made = Made::quadruped().below(&[("body", "fixed", [0.1, 0.0, 0.05], [0.0; 3])]);
    made.links[0].1 = None;
    made.links.last_mut().expect("body").1 = Some(5.0);
    let found = read(&made.urdf());
    assert_feet(&made, found.robot, "body", &mut Random(5));
    assert_eq!(found.notes, [""; 0]);
    // Masses below a world link belong to the robot; the mass of the world link does not.
    let mut made = Made::quadruped().below(&[("world", "floating", [0.0; 3], [0.0; 3])]);
    made.links.last_mut().expect("world").1 = Some(1000.0);
    assert!((read(&made.urdf()).robot.mass_kg() - 11.24).abs() < 1e-12);
}

/// The error for each change of the usual quadruped; lines count the robot's first line as 1.
#[test]
fn faults_name_line_element_and_remedy() {
    let edit = |from: &str, to: &str| {
        let text = Made::quadruped().urdf();
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    let joint = |name: &str, change: &dyn Fn(&mut Joint)| {
        let mut made = Made::quadruped();
        change(made.joint(name));
        made.urdf()
    };
    let (thigh, calf) = ("FR_thigh_joint", "FR_calf_joint");
    let hip_line = "<joint name=\"FR_hip_joint\"";
    let limit = |values: [f64; 4]| joint(calf, &|joint| joint.limit = Some(values));
    for (text, said) in [
        (joint(thigh, &|j| j.axis = [0.0; 3]), "t.urdf: line 20: joint `FR_thigh_joint`, <axis>, xyz: found \"0.0 0.0 0.0\", expected a direction, such as 0 1 0"),
        (joint(thigh, &|j| j.axis[0] = f64::NAN), "line 20: joint `FR_thigh_joint`, <axis>, xyz: found \"NaN 1.0 0.0\", expected three numbers"),
        (joint(thigh, &|j| j.xyz[1] = f64::INFINITY), "line 20: joint `FR_thigh_joint`, <origin>, xyz: found \"0.0 inf 0.0\", expected three numbers"),
        (
            joint(thigh, &|j| j.rpy[2] = 90.0),
            "line 20: joint `FR_thigh_joint`, <origin>, rpy: found 0.0 0.0 90.0, expected two turns at most: rad, not degrees",
        ),
        (edit("rpy=\"0.0 0.0 0.0\"", "rpy=\"0 0\""), "line 19: joint `FR_hip_joint`, <origin>, rpy: found \"0 0\", expected three numbers"),
        (edit("rpy=\"0.0 0.0 0.0\"", "quat_xyzw=\"0 0 0 1\""), "joint `FR_hip_joint`, <origin>: found the attribute quat_xyzw=\"0 0 0 1\", expected xyz and rpy alone"),
        (joint(thigh, &|j| j.xyz = [0.0, 80.0, 0.0]), "line 20: joint `FR_thigh_joint`, <origin>, xyz: found [0.0, 80.0, 0.0], expected three lengths of at most 10 m"),
        (limit([-2.0, 2.5, 0.0, 30.0]), "line 21: joint `FR_calf_joint`, <limit>, effort: found 0, expected a finite number above 0"),
        (limit([-2.0, 2.5, 20.0, -1.0]), "line 21: joint `FR_calf_joint`, <limit>, velocity: found -1, expected a finite number above 0"),
        (limit([2.0, -2.0, 20.0, 30.0]), "line 21: joint `FR_calf_joint`, <limit>, lower and upper: found 2 to -2, expected the lower limit first"),
        (limit([0.0, 0.0, 20.0, 30.0]), "found 0 to 0, expected the lower limit first"),
        (limit([f64::NAN, 1.0, 20.0, 30.0]), "line 21: joint `FR_calf_joint`, <limit>, lower: found \"NaN\", expected a number"),
        (limit([-45.0, 45.0, 20.0, 30.0]), "line 21: joint `FR_calf_joint`, <limit>, lower and upper: found -45 to 45 rad, expected at most two turns either way: rad, not degrees; type=\"continuous\" for"),
        (joint(calf, &|j| j.limit = None), "line 21: joint `FR_calf_joint`: found no <limit>, expected <limit lower=... upper=... effort=... velocity=...>"),
        (joint(calf, &|j| (j.limit, j.kind) = (None, "continuous".to_owned())), "joint `FR_calf_joint`: found no <limit>, expected <limit effort=... velocity=...>"),
        (joint(calf, &|j| j.kind = "prismatic".to_owned()), "line 21: joint `FR_calf_joint`: found type \"prismatic\", expected revolute or continuous in a leg"),
        (joint(calf, &|j| j.kind = "hinge".to_owned()), "joint `FR_calf_joint`, type: found \"hinge\", expected revolute, continuous, prismatic, fixed, floating, planar"),
        (joint(calf, &|j| j.inside = "<mimic joint=\"FL_calf_joint\"/>".to_owned()), "line 21: joint `FR_calf_joint`, <mimic>: found a copy of joint `FL_calf_joint`, expected joints of legs that move by themselves: without <mimic>, or type=\"fixed\""),
        (joint(calf, &|j| j.inside = "<limit effort=\"1\"/>".to_owned()), "joint `FR_calf_joint`, <limit>: found a second <limit>, expected one"),
        (joint(calf, &|j| j.parent = "shin".to_owned()), "line 21: joint `FR_calf_joint`, <parent>: found `shin`, which is no link, expected a <link> of the file"),
        (joint(calf, &|j| j.child = "FR_hip".to_owned()), "line 21: joint `FR_calf_joint`, <child>: found link `FR_hip` below two joints, `FR_hip_joint` and this, expected one joint above each link"),
        (joint("FR_hip_joint", &|j| j.parent = "FR_foot".to_owned()), "line 3: link `FR_hip`: found a loop of joints through `FR_hip`, expected a tree"),
        (joint("FR_hip_joint", &|j| j.parent = "FR_hip".to_owned()), "found a loop of joints through `FR_hip`"),
        (joint(calf, &|j| j.name = thigh.to_owned()), "line 21: joint `FR_thigh_joint`: found the name a second time, expected each name once"),
        (edit("<link name=\"FR_thigh\">", "<link name=\"FR_hip\">"), "line 4: link `FR_hip`: found the name a second time"),
        (edit("<link name=\"trunk\">", "<link>"), "line 2: <robot>, <link>: found no name, expected name=\"...\""),
        (edit(hip_line, "<joint"), "line 19: <robot>, <joint>: found no name"),
        (edit("<robot name=\"made\">", "<robot>"), "line 1: <robot>: found no name, expected name=\"...\", or --name (romc robot)"),
        (edit("<child link=\"FR_hip\"/>", ""), "line 19: joint `FR_hip_joint`: found no <child>, expected <child link=...>"),
        (edit("</robot>", "<link name=\"spare\"/></robot>"), "the tree: found 2 links without a joint above them (`trunk`, `spare`), expected one, which all others are below"),
        (edit("<mass value=\"0.5\"/>", "<mass value=\"0.5\"/><mass value=\"0.5\"/>"), "line 3: link `FR_hip`, <inertial>, <mass>: found a second <mass>, expected one"),
        (edit("<mass value=\"0.5\"/>", ""), "line 3: link `FR_hip`, <inertial>: found no <mass>, expected <mass value=...>"),
        (edit("<mass value=\"0.5\"/>", "<mass>0.5</mass>"), "line 3: link `FR_hip`, <inertial>, <mass>, value: found nothing, expected a number"),
        (edit("<mass value=\"0.5\"/>", "<mass value=\"-0.5\"/>"), "link `FR_hip`, <inertial>, <mass>, value: found -0.5, expected a mass of 0 kg or more"),
        (edit("<mass value=\"0.5\"/>", "<mass value=\"nan\"/>"), "<mass>, value: found \"nan\", expected a number"),
        (edit("ixx=\"0.1\"", "ixx=\"-0.1\""), "line 2: link `trunk`, <inertial>, <inertia>, ixx: found -0.1, expected 0 kg m^2 or more"),
        (edit("<mass value=\"5.0\"/>", "<mass value=\"0\"/>"), "line 2: link `trunk`: found no mass, nor in a link that fixed joints hold to it, expected <inertial> with a <mass>"),
        (edit("<joint name=\"FR_calf_joint\" type=\"revolute\">", "<joint name=\"FR_calf_joint\" type=\"floating\">"), "joint `FR_calf_joint`: found type \"floating\", expected "),
        (joint(calf, &|j| j.axis = [0.0, 0.0, 1.0]), "line 19: joint `FR_hip_joint`, its leg: found the axes of FR_thigh_joint and FR_calf_joint in different directions"),
        (edit("<robot ", "<mujoco "), "t.urdf:"),
        (edit("<joint name=\"FR_foot_fixed\"", "<joint name=\"FR_foot_fixed\" note=\"${l}\""), "line 22: found note=\"${l}\": a xacro that is not expanded, expected a URDF: `xacro t.urdf > t-expanded.urdf` makes it"),
        ("<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\">\n<xacro:include filename=\"legs.xacro\"/></robot>".to_owned(), "line 2: found <xacro:include>: a xacro"),
        ("<robot name=\"r\">\n<xacro:leg/></robot>".to_owned(), "line 2: found an element of xacro: a xacro"),
        ("<robot name=\"r\" xmlns:xacro=\"http://wiki.ros.org/macros\">\n<xacro:leg/></robot>".to_owned(), "line 2: found <xacro:leg>: a xacro"),
        (edit("</robot>", "<macro name=\"leg\" params=\"x\"/></robot>"), "found <xacro:macro>: a xacro"),
        ("<robot name=\"r\"/>".to_owned(), "the tree: found no link, expected a tree of links and joints"),
    ] {
        let error = refusal(&text);
        assert!(error.contains(said), "{said}\n{error}");
    }
}

#[test]
fn declarations_comments_and_extensions_change_nothing() {
    let made = Made::quadruped();
    let plain = read(&made.urdf());
    let text = made.urdf();
    let text = text.replace("<robot ", "<?xml version=\"1.0\"?>\n<!-- ${old} <xacro:leg/> -->\n<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" ");
    let text = text.replace(
        "</robot>",
        "<gazebo file=\"$(find robot)/x\"><property name=\"p\"/><link name=\"trunk\"><inertial><mass>7</mass><mass value=\"7\"/></inertial></link></gazebo>\n\
         <transmission name=\"t\"><joint name=\"FR_hip_joint\"/></transmission></robot>",
    );
    let read = read(&text);
    assert!(std::ptr::eq(read.robot, plain.robot) && read.notes.is_empty());
    // Axes of arbitrary length.
    let mut scaled = made.clone();
    scaled
        .joints
        .iter_mut()
        .for_each(|joint| joint.axis = joint.axis.map(|v| 3.0 * v));
    assert!(std::ptr::eq(
        from_urdf("t.urdf", &scaled.urdf(), &[]).expect("reads"),
        plain.robot
    ));
}

#[test]
fn numbers_that_can_hardly_be_true_are_noted() {
    let with = |change: &dyn Fn(&mut Made)| {
        let mut made = Made::quadruped();
        change(&mut made);
        read(&made.urdf()).notes
    };
    let limits = |limit: [f64; 4]| {
        with(&|made| {
            made.joints
                .iter_mut()
                .filter(|joint| joint.limit.is_some())
                .for_each(|joint| joint.limit = Some(limit))
        })
    };
    for (notes, said) in [
        (
            limits([-2.0, 2.0, 1000.0, 30.0]),
            "joint `FR_hip_joint` and 11 more: a largest torque of 1000 N m, 23 times the robot's weight",
        ),
        (
            limits([-2.0, 2.0, 20.0, 1000.0]),
            "joint `FR_hip_joint` and 11 more: a largest speed of 1000 rad/s",
        ),
        (
            limits([-10.0, 10.0, 20.0, 30.0]),
            "joint `FR_hip_joint` and 11 more: limits of -10 to 10 rad are more than one and a half turns",
        ),
        (
            with(&|made| {
                made.links
                    .iter_mut()
                    .for_each(|(_, mass)| *mass = mass.map(|m| 1000.0 * m))
            }),
            "a largest torque of 20 N m cannot carry 11240 kg; are masses in kg?",
        ),
        (
            with(&|made| (made.links[3].1, made.links[4].1) = (None, None)),
            "the links FR_calf have no mass",
        ),
        (
            with(&|made| {
                *made = made
                    .clone()
                    .below(&[("stand", "fixed", [0.0, 0.0, 0.4], [0.0; 3])]);
                made.links.last_mut().expect("the stand").1 = Some(30.0);
            }),
            "the middle of the hips is at 0 0 0.4 m, beyond the legs",
        ),
    ] {
        assert!(
            notes.len() == 1 && notes[0].contains(said),
            "{said}\n{notes:?}"
        );
    }
}

#[test]
fn robots_of_other_joints_and_feet_get_their_own_hints() {
    let mut eight = Made::quadruped();
    for leg in LEGS {
        eight.joint(&format!("{leg}_hip_joint")).kind = "fixed".to_owned();
    }
    let error = refusal(&eight.urdf());
    assert!(
        error.ends_with(
            "romc models; legs of two joints, as robots of eight have them, cannot be modelled"
        ),
        "{error}"
    );
    assert!(
        !error.contains("--feet")
            && error.contains("found 4 limbs on `trunk`: FR_thigh_joint (2 joints)")
    );
    // Six legs with three joints each.
    let mut six = Made::quadruped();
    for (from, to) in [("FR", "MR"), ("FL", "ML")] {
        let rename = |name: &str| name.replace(from, to);
        let links = six
            .links
            .clone()
            .into_iter()
            .filter(|(name, _)| name.starts_with(from));
        six.links
            .extend(links.map(|(name, mass)| (rename(&name), mass)));
        let joints = six
            .joints
            .clone()
            .into_iter()
            .filter(|joint| joint.name.starts_with(from));
        six.joints.extend(joints.map(|mut joint| {
            for name in [&mut joint.name, &mut joint.parent, &mut joint.child] {
                *name = rename(name);
            }
            joint.xyz[0] = 0.0;
            joint
        }));
    }
    let error = refusal(&six.urdf());
    assert!(
        error.contains("found 6 limbs") && !error.contains("--feet"),
        "{error}"
    );
    // Without foot links, points on the calves.
    let mut made = Made::quadruped();
    made.links.retain(|(name, _)| !name.ends_with("foot"));
    made.joints.retain(|joint| !joint.name.contains("foot"));
    let error = refusal(&made.urdf());
    assert!(error.contains("line 17: link `FR_calf` beyond joint `FR_calf_joint`: found no link on a fixed joint, expected one link at the foot, or romc robot --feet FR_calf:x,y,z,..."), "{error}");
    let points = LEGS.map(|leg| format!("{leg}_calf:0.01,0,-0.2"));
    let split: Vec<String> = points.join(",").split(',').map(str::to_owned).collect();
    for feet in [&points[..], &split] {
        let robot = from_urdf("t.urdf", &made.urdf(), feet).expect("reads");
        let foot = robot.foot_from_body(Leg::FrontLeft, &[0.0; 3]);
        assert!(
            (foot - Vector3::new(0.21, 0.13, -0.4)).amax() < 1e-12,
            "{foot}"
        );
    }
    // The point is in the link's frame, which may be turned.
    made.joint("FL_calf_joint").rpy = [0.0, 0.0, 3.0];
    made.joint("FL_calf_joint").axis = [3.0_f64.sin(), 3.0_f64.cos(), 0.0];
    let robot = from_urdf("t.urdf", &made.urdf(), &points).expect("reads");
    let foot = robot.foot_from_body(Leg::FrontLeft, &[0.0; 3]);
    let turned = Vector3::new(
        0.2 + 0.01 * 3.0_f64.cos(),
        0.13 + 0.01 * 3.0_f64.sin(),
        -0.4,
    );
    assert!((foot - turned).amax() < 1e-12, "{foot}");
    for (feet, said) in [
        ("FR_calf:0,0", "--feet: found `FR_calf:0` without y and z"),
        (
            "FR_calf,FL_calf",
            "--feet: found 2 feet, expected four links, LINK,..., or links with points",
        ),
        (
            "FR_calf,FR_calf,RR_calf,RL_calf",
            "--feet: found `FR_calf` twice",
        ),
        (
            "FR_calf,FL_calf,RR_calf,tail",
            "link `tail`: found no such link",
        ),
        (
            "FR_calf,FL_calf,RR_calf,trunk",
            "from `trunk` to `trunk`: found 0 joints",
        ),
    ] {
        let error = from_urdf("t.urdf", &made.urdf(), &[feet.to_owned()])
            .unwrap_err()
            .to_string();
        assert!(error.contains(said), "{said}\n{error}");
    }
}

#[test]
fn robot_with_the_name_of_romcs_own_is_another_and_says_what_differs() {
    let go1 = Made::quadruped().urdf().replace("\"made\"", "\"go1\"");
    let read = read(&go1);
    assert_eq!(read.robot.name, "go1-urdf");
    let note = read.notes.join("\n");
    assert!(note.starts_with("its numbers are not those of romc's own \"go1\" (mass_kg 11.24 instead of 12.01, FR_hip_joint at [0.2, -0.05, 0.0] instead of [0.1881, -0.04675, 0.0], "), "{note}");
    assert!(
        note.ends_with(
            " more): it is called \"go1-urdf\"; --name (romc robot) gives it another name"
        ),
        "{note}"
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("go1.urdf"), &go1).expect("written");
    let romc = |arguments: &[&str]| {
        let done = romc(folder.path(), arguments);
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    };
    let (code, shown, notes) = romc(&["robot", "go1.urdf"]);
    assert!(
        code == Some(0) && shown.starts_with("go1-urdf: 11.24 kg"),
        "{shown}"
    );
    assert!(
        notes.contains("note: go1.urdf: its numbers are not those of romc's own"),
        "{notes}"
    );
    let (code, shown, notes) = romc(&[
        "robot",
        "go1.urdf",
        "--name",
        "mine",
        "--output",
        "mine.toml",
    ]);
    assert!(
        code == Some(0) && shown.starts_with("mine: 11.24 kg") && notes.is_empty(),
        "{notes}"
    );
    let (_, shown, _) = romc(&["robot", "mine.toml", "--json"]);
    assert!(
        shown.contains("\"name\":\"mine\"") || shown.contains("\"name\": \"mine\""),
        "{shown}"
    );
    let (code, _, error) = romc(&["robot", "go1.urdf", "--name", "go1"]);
    assert!(
        code == Some(2)
            && error
                .contains("--name: found \"go1\", romc's own robot with other numbers (mass_kg"),
        "{error}"
    );
    let (code, _, error) = romc(&["robot", "go1.urdf", "--name", "a*/b"]);
    assert!(
        code == Some(2) && error.contains("--name: found \"a*/b\", expected a name"),
        "{error}"
    );
    let (code, _, error) = romc(&["robot", "go1", "--name", "mine"]);
    assert!(
        code == Some(2) && error.contains("--name: found romc's own go1, expected a file"),
        "{error}"
    );
}

#[test]
fn commands_of_a_refused_xacro_are_words_of_a_shell() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text_of =
        "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:leg/></robot>";
    for (file, line) in [
        (
            "my robot.urdf",
            "`xacro 'my robot.urdf' > 'my robot-expanded.urdf'`",
        ),
        ("a.urdf.xacro", "`xacro a.urdf.xacro > a.urdf`"),
        ("a.xacro", "`xacro a.xacro > a.urdf`"),
    ] {
        std::fs::write(folder.path().join(file), text_of).expect("written");
        let done = romc(folder.path(), &["robot", file]);
        let error = text(&done.stderr);
        assert!(
            done.status.code() == Some(1) && error.contains(line),
            "{error}"
        );
    }
}

#[test]
fn files_in_place_of_robots_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in ["a b.urdf", "a.toml"] {
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
        std::fs::write(folder.path().join(file), pointer).expect("written");
        let done = romc(folder.path(), &["robot", file]);
        let (error, line) = (
            text(&done.stderr),
            format!("git lfs pull --include {}", romc::files::shell_word(file)),
        );
        assert!(
            error.contains("a pointer of git LFS") && error.contains(&line),
            "{error}"
        );
    }
}

/// A deep tree does not need deep recursion.
#[test]
fn long_chains_of_fixed_joints_are_read() {
    let mut text = Made::quadruped().urdf().replace("</robot>", "");
    for index in 0..20_000 {
        let parent = if index == 0 {
            "trunk".to_owned()
        } else {
            format!("l{}", index - 1)
        };
        text += &format!(
            "<link name=\"l{index}\"/><joint name=\"j{index}\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"l{index}\"/></joint>\n"
        );
    }
    assert!((read(&(text + "</robot>")).robot.mass_kg() - 11.24).abs() < 1e-12);
}

/// Changes of a random robot: each is refused, or read as the numbers in the changed file.
#[test]
fn changed_robots_are_read_as_they_are_or_refused() {
    let count = if is_thorough() { 500 } else { 50 };
    let (mut random, mut accepted) = (Random(11), 0);
    for _ in 0..count {
        let mut made = varied(&mut random);
        for _ in 0..random.below(3) {
            change(&mut made, &mut random);
        }
        let Ok(robot) = from_urdf("t.urdf", &made.urdf(), &[]) else {
            continue;
        };
        accepted += 1;
        let mass: f64 = made.links.iter().filter_map(|(_, mass)| *mass).sum();
        assert!((robot.mass_kg() - mass).abs() < 1e-9, "{}", made.urdf());
        let hips: Vec<&Joint> = (made.joints.iter())
            .filter(|joint| {
                robot
                    .joint_names
                    .iter()
                    .step_by(3)
                    .any(|name| *name == joint.name)
            })
            .collect();
        assert_eq!(hips.len(), 4);
        let paths: Vec<Vec<&str>> = (hips.iter())
            .map(|hip| {
                made.path(&hip.parent)
                    .iter()
                    .map(|(link, _)| *link)
                    .collect()
            })
            .collect();
        let shared = paths[0]
            .iter()
            .filter(|link| paths.iter().all(|path| path.contains(*link)));
        let mass = |link: &str| {
            made.links
                .iter()
                .find(|(name, _)| name == link)
                .and_then(|(_, mass)| *mass)
        };
        let trunk = shared.max_by(|a, b| mass(a).unwrap_or(0.0).total_cmp(&mass(b).unwrap_or(0.0)));
        let trunk = trunk.expect("the root");
        assert_feet(&made, robot, trunk, &mut random);
        for (name, limit) in robot.joint_names.iter().zip(robot.torque_limit_nm()) {
            let joint = made
                .joints
                .iter()
                .find(|joint| joint.name == *name)
                .expect("a joint");
            assert_eq!(joint.limit.expect("a limit")[2], *limit);
            assert!(!joint.inside.contains("mimic"));
        }
    }
    assert!(
        (count / 5..count).contains(&accepted),
        "{accepted} of {count}"
    );
}

/// Random lengths, directions of frames, links above the trunk and mounts.
fn varied(random: &mut Random) -> Made {
    let mut made = Made::quadruped();
    for leg in LEGS {
        let turn = random.between(-0.5, 0.5);
        for (part, length) in [("hip", 0), ("thigh", 1), ("calf", 2)] {
            let joint = made.joint(&format!("{leg}_{part}_joint"));
            joint.xyz[length] *= random.between(0.5, 1.5);
            joint.xyz[0] += random.between(-0.02, 0.02);
        }
        // The thigh's frame about its own axis, so that the calf's stays parallel.
        made.joint(&format!("{leg}_thigh_joint")).rpy = [0.0, turn, 0.0];
    }
    let [x, y, z, roll, yaw] = [(); 5].map(|()| random.between(-1.0, 1.0));
    let above = [
        ("world", "fixed", [x, y, z], [roll, 0.0, yaw]),
        ("base", "fixed", [y, z, x], [0.0, yaw, 0.0]),
    ];
    made.below(&above[..random.below(3)])
}

/// One typical mistake in files: dropped, doubled, zero, negative, not a number, moved.
fn change(made: &mut Made, random: &mut Random) {
    let at = random.below(made.joints.len());
    let link = random.below(made.links.len());
    let other = made.links[random.below(made.links.len())].0.clone();
    let value = [0.0, -1.0, f64::NAN, 1e300, 0.1][random.below(5)];
    let axis = random.below(3);
    let joint = &mut made.joints[at];
    match random.below(16) {
        0 => joint.xyz[axis] = value,
        1 => joint.rpy[axis] = value,
        2 => joint.axis[axis] = value,
        3 => joint.axis = [0.0; 3],
        4 => joint.axis = joint.axis.map(|v| -2.0 * v),
        5 => joint.limit = None,
        6 => joint.limit = Some([-1.0, 1.0, value, 9.0]),
        7 => joint.limit = Some([value, -value, 9.0, 9.0]),
        8 => {
            joint.kind =
                ["fixed", "continuous", "prismatic", "floating", ""][random.below(5)].to_owned()
        }
        9 => joint.parent = other,
        10 => joint.child = other,
        11 => joint.inside = "<mimic joint=\"FR_hip_joint\"/>".to_owned(),
        12 => made.links[link].1 = [None, Some(value)][random.below(2)],
        13 => drop(made.links.remove(link)),
        14 => drop(made.joints.remove(at)),
        _ => made.links.push((other, Some(1.0))),
    }
}
