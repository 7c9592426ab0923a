//! `--robot` of every command, and `romc robot`: contents of a robot file.

use super::*;

/// The robot of `--robot`; for a file, the matching of its joints is printed to stderr.
pub(super) fn chosen(name_or_file: &str) -> Result<&'static Robot> {
    let read = robot_file::open(name_or_file, &RobotOptions::default())?;
    let robot = read.robot;
    if robot_file::by_name(name_or_file).is_err() {
        let joints = Leg::ALL.into_iter().zip(robot.joint_names.chunks(3));
        let matched = joints.map(|(leg, joints)| format!("{leg} = {}", joints.join(" ")));
        let (name, matched) = (robot.name, matched.collect::<Vec<_>>().join(", "));
        note(&format!("{name_or_file}: robot {name}, {matched}"));
    }
    note_all(name_or_file, &read.notes);
    Ok(robot)
}

fn note_all(file: &str, notes: &[String]) {
    let notes = notes.iter();
    notes.for_each(|text| note(&format!("{file}: {text}")));
}

pub(super) fn run(arguments: &RobotArguments) -> Result<Answer> {
    Inputs::default()
        .and_robot(Some(&arguments.robot))
        .check_output(arguments.output.as_deref(), Format::TOML, arguments.force)?;
    let options = RobotOptions {
        feet: &arguments.feet,
        name: arguments.name.as_deref(),
    };
    let read = robot_file::open(&arguments.robot, &options)?;
    let robot = read.robot;
    note_all(&arguments.robot, &read.notes);
    let geometry = |joint: usize| robot.geometry(Leg::ALL[joint / 3]);
    let limits = robot.joint_limit_rad();
    let (torques, speeds) = (robot.torque_limit_nm(), &robot.joint_speed_limit_rad_s);
    let table = Table::of(0..JOINT_NAMES.len())
        .column("romc", "", |&i| JOINT_NAMES[i])
        .column("joint", "", |&i| robot.joint_names[i])
        .column("at", "m", |&i| match i % 3 {
            0 => vector(robot.hip_position(Leg::ALL[i / 3]).into()),
            _ => vector(geometry(i).links[i % 3 - 1]),
        })
        .column("axis", "", |&i| vector(geometry(i).axes[i % 3]))
        .column("lowest", "rad", |&i| number(limits[i].0))
        .column("highest", "rad", |&i| number(limits[i].1))
        .column("torque", "N m", |&i| number(torques[i]))
        .column("speed", "rad/s", |&i| number(speeds[i]))
        .table();
    let (name, mass) = (robot.name, number(robot.mass_kg()));
    let mut text = format!("{name}: {mass} kg\n\n{table}\n");
    for leg in Leg::ALL {
        let foot = vector(robot.geometry(leg).links[2]);
        let _ = writeln!(text, "foot {leg}: {foot} m from its last joint");
    }
    if let Some(path) = &arguments.output {
        write_file(path, robot_file::to_toml(robot).as_bytes(), arguments.force)?;
        let _ = writeln!(text, "\n{}: the robot", path.display());
    }
    let json = json!({
        "robot": RobotEntry::of(robot),
        "notes": read.notes,
        "output": shown(&arguments.output),
    });
    Ok(Answer::new(text, json))
}

fn vector(vector: [f64; 3]) -> String {
    vector.map(number).join(" ")
}

fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
