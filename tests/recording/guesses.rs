//! Guessed maps if names are ambiguous: signs, units, thresholds and topics are guessed from the possible motions of
//! the robot.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use nalgebra::DMatrix;
use romc::files::Overwrite;
use romc::recording::{self, Clocks, ColumnMap, Reader, Recording, Segment};
use romc::recording::{Guess, guess};

use super::foreign::{Log, difference, gyro, jump, quaternion};
use super::mcap::Dice;
use super::tools::is_thorough;

fn guessed(path: &Path) -> (Guess, Recording) {
    let guess = guess(path, romc::robot_file::by_name("go1").unwrap()).unwrap();
    assert_eq!(guess.missing, Vec::<&str>::new(), "{}", guess.text);
    let map = ColumnMap::parse("guessed.toml", &guess.text).unwrap();
    let read = Reader::new(Some(map), Clocks::Recorded).read(path);
    let recording = read
        .unwrap_or_else(|error| panic!("{error}\n{}", guess.text))
        .recording;
    (guess, recording)
}

const LEGS: [&str; 4] = ["FR", "FL", "RR", "RL"];
const KINDS: [&str; 3] = ["hip", "thigh", "calf"];
const DEGREE: f64 = TAU / 360.0;

/// A log's conventions for the robot's motion.
#[derive(Debug, Clone, Copy)]
struct Convention {
    /// Directions of the joints' axes; the left hips may be mirrored.
    axes: [f64; 3],
    mirrored: bool,
    /// -1 for torques from the links on the motors.
    action: f64,
    angle: f64,
    speed: Option<f64>,
    torque: f64,
    length: f64,
    /// 0: wxyz by number, 1: xyzw by number, 2: by name, 3: angles in rad, 4: angles in degrees.
    attitude: usize,
    gyro: Option<f64>,
    /// Forces at the feet: in the air, and the increase on the ground; none for flags.
    force: Option<(f64, f64)>,
    /// Offset of each sensor in the air relative to that of the previous foot.
    zero: f64,
    milliseconds: bool,
}

const PLAIN: Convention = Convention {
    axes: [1.0; 3],
    mirrored: false,
    action: 1.0,
    angle: 1.0,
    speed: None,
    torque: 1.0,
    length: 1.0,
    attitude: 3,
    gyro: None,
    force: None,
    zero: 0.0,
    milliseconds: false,
};

impl Convention {
    fn random(dice: &mut Dice) -> Self {
        let mut either = |one: f64, other: f64| if dice.below(2) == 0 { one } else { other };
        let axes = [0; 3].map(|_| either(1.0, -1.0));
        let action = either(1.0, -1.0);
        let angle = either(1.0, 1.0 / DEGREE);
        let torque = either(1.0, 1000.0);
        let speed = [None, Some(1.0), Some(1.0 / DEGREE)][dice.below(3)];
        Self {
            axes,
            mirrored: dice.below(4) == 0,
            action,
            angle,
            speed,
            torque,
            length: [1.0, 100.0, 1000.0][dice.below(3)],
            attitude: dice.below(5),
            gyro: [None, Some(1.0), Some(1.0 / DEGREE)][dice.below(3)],
            force: [
                None,
                Some((0.0, 60.0)),
                Some((100.0, 60.0)),
                Some((30.0, 400.0)),
            ][dice.below(4)],
            zero: 0.0,
            milliseconds: dice.below(2) == 0,
        }
    }

    /// Writes the log, with columns in random order.
    fn write(&self, path: &Path, s: &Segment, dice: &mut Dice) {
        let mut log = Log::default();
        let row = |m: &DMatrix<f64>, i: usize, factor: f64| -> Vec<f64> {
            m.row(i).iter().map(|value| factor * value).collect()
        };
        for i in 0..12 {
            let side = if self.mirrored && i % 3 == 0 && i / 3 % 2 == 1 {
                -1.0
            } else {
                1.0
            };
            let axis = side * self.axes[i % 3];
            let name = |what: &str| format!("{}_{}_{what}", LEGS[i / 3], KINDS[i % 3]);
            log.add(name("position"), row(&s.x, i, axis * self.angle));
            if let Some(speed) = self.speed {
                log.add(name("velocity"), row(&s.dx, i, axis * speed));
            }
            log.add(
                name("torque"),
                row(&s.torque_nm, i, axis * self.action * self.torque),
            );
        }
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            log.add(format!("base_p{axis}"), row(&s.x, 12 + i, self.length));
            if let Some(factor) = self.gyro {
                log.add(
                    format!("gyro_{axis}"),
                    (0..s.len()).map(|k| factor * gyro(s, k)[i]),
                );
            }
        }
        let of_quaternion = |element: usize| (0..s.len()).map(move |k| quaternion(s, k)[element]);
        for place in 0..4 {
            match self.attitude {
                0 => log.add(format!("imu.quaternion[{place}]"), of_quaternion(place)),
                1 => log.add(
                    format!("imu.quaternion[{place}]"),
                    of_quaternion((place + 1) % 4),
                ),
                2 => log.add(
                    format!("quat_{}", ["w", "x", "y", "z"][place]),
                    of_quaternion(place),
                ),
                unit if place < 3 => {
                    let factor = if unit == 4 { 1.0 / DEGREE } else { 1.0 };
                    log.add(
                        ["roll", "pitch", "yaw"][place],
                        row(&s.x, 15 + place, factor),
                    );
                }
                _ => {}
            }
        }
        for foot in 0..4 {
            let down = s.feet.iter().enumerate().map(|(k, feet)| (k, feet[foot]));
            let value = down.map(|(k, down)| match self.force {
                None => f64::from(u8::from(down)),
                Some((rest, load)) => {
                    let ripple = 1.0 + 0.4 * ((k * 37 + foot * 5) % 23) as f64 / 23.0;
                    rest + self.zero * foot as f64
                        + 0.02 * load * ripple
                        + if down { load * ripple } else { 0.0 }
                }
            });
            let name = if self.force.is_some() {
                "foot_force"
            } else {
                "contact"
            };
            log.add(format!("{name}_{}", LEGS[foot]), value.collect::<Vec<_>>());
        }
        let mut order: Vec<usize> = (0..log.names.len()).collect();
        dice.shuffled(&mut order);
        log.names = order.iter().map(|at| log.names[*at].clone()).collect();
        log.columns = order.iter().map(|at| log.columns[*at].clone()).collect();
        let scale = if self.milliseconds { 1e3 } else { 1.0 };
        log.names.insert(0, "time".to_owned());
        let times = s.time_s.iter().map(|time| format!("{:?}", scale * time));
        log.columns.insert(0, times.collect());
        log.write(path, ",", true);
    }
}

#[test]
fn signs_and_units_of_any_convention_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let names = if is_thorough() {
        vec!["test_01", "test_03", "train_02"]
    } else {
        vec!["test_01"]
    };
    let jumps: Vec<Segment> = (names.iter())
        .map(|name| {
            let file = format!("examples/recordings/go1/{name}.csv.gz");
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
            recording::read(&file).unwrap().segments.remove(0)
        })
        .collect();
    let mut wrong = Vec::new();
    let count = if is_thorough() { 500 } else { 50 };
    for seed in 0..count {
        let mut dice = Dice(seed);
        let convention = Convention::random(&mut dice);
        let jump = &jumps[dice.below(jumps.len())];
        convention.write(&path, jump, &mut dice);
        let (guess, found) = guessed(&path);
        let (state, _, contact) = difference(&found, jump);
        if state > 1e-8 || !contact {
            wrong.push(format!(
                "{seed}: {state} {contact} {convention:?}\n{}",
                guess.text
            ));
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {count}: {}",
        wrong.len(),
        wrong.join("\n")
    );
}

/// MIT's Mini Cheetah and others have hip and knee axes along -y: knee angles are positive, and knee torques negative
/// in stance.
#[test]
fn axes_to_the_other_side_are_turned_with_their_torques() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let plain = Convention {
        axes: [1.0, -1.0, -1.0],
        speed: Some(1.0),
        attitude: 2,
        gyro: Some(1.0),
        ..PLAIN
    };
    let jump = jump();
    for action in [1.0, -1.0] {
        Convention { action, ..plain }.write(&path, &jump, &mut Dice(3));
        let (guess, found) = guessed(&path);
        assert!(difference(&found, &jump).0 < 1e-9, "{}", guess.text);
    }
}

/// Parts of jumps, as after a loss of power, in romc's own MCAP files: one second of a stance determines signs poorly.
#[test]
fn short_parts_of_jumps_keep_their_signs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.mcap");
    let names = [
        "go1/test_01",
        "go1/test_03",
        "go1/train_01",
        "go1/train_13",
        "go1-other/jump_04",
    ];
    let count = if is_thorough() { names.len() } else { 3 };
    let mut wrong = Vec::new();
    for name in &names[..count] {
        let file = format!("examples/recordings/{name}.csv.gz");
        let jump = recording::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file));
        let jump = jump.unwrap().segments.remove(0);
        for (start, share) in [
            (0, 50),
            (50, 50),
            (0, 30),
            (40, 30),
            (60, 30),
            (0, 15),
            (60, 15),
            (80, 15),
        ] {
            let part = jump.slice(start * jump.len() / 100..(start + share) * jump.len() / 100);
            recording::write_mcap(&path, &part, None, Overwrite::Replace).unwrap();
            let read = Reader::new(None, Clocks::Recorded).read(&path).unwrap();
            let (state, _, _) = difference(&read.recording, &part);
            if state > 1e-9 {
                wrong.push(format!(
                    "{name} {start} {share}: {state} {}",
                    read.notes.join("; ")
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Noise hides the axes of small velocities; those of an odometry are the body's.
    let noisy = Path::new(env!("CARGO_MANIFEST_DIR"));
    let noisy = noisy.join("examples/recordings/go1-noisy/test_01.csv.gz");
    let noisy = recording::read(&noisy).unwrap().segments.remove(0);
    recording::write_mcap(&path, &noisy, None, Overwrite::Replace).unwrap();
    let read = Reader::new(None, Clocks::Recorded).read(&path).unwrap();
    assert!(difference(&read.recording, &noisy).1 < 1e-9);
}

#[test]
fn forces_show_contact_whatever_their_sign_zeros_and_flights() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let jump = jump();
    let lift_off = jump.feet.iter().position(|feet| *feet != [true; 4]);
    let standing = jump.slice(0..lift_off.unwrap());
    let of = |rest: f64, load: f64, zero: f64| Convention {
        force: Some((rest, load)),
        zero,
        ..PLAIN
    };
    for (convention, own, line) in [
        (of(0.0, 30.0, 0.0), &jump, "release = "),
        (of(1.5, 900.0, 0.0), &jump, "release = "),
        (of(20.0, 80.0, 0.0), &jump, "release = "),
        (of(400.0, 80.0, 0.0), &jump, "release = "),
        (of(-30.0, 30.0, 0.0), &jump, "release = "),
        (of(0.0, -80.0, 0.0), &jump, "sign = -1 "),
        (of(0.0, 80.0, 30.0), &jump, "offset = [-"),
        (of(0.0, 80.0, 0.0), &standing, "no foot is in the air"),
    ] {
        convention.write(&path, own, &mut Dice(1));
        let (guess, found) = guessed(&path);
        let contact = difference(&found, own).2;
        assert!(contact && guess.text.contains(line), "{}", guess.text);
    }
}

/// In flight no foot is on the ground, so the joints' limits determine the unit.
#[test]
fn units_of_joints_in_flight_are_those_of_their_limits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut flight = jump();
    let first = (0..flight.len())
        .find(|k| flight.feet[*k] == [false; 4])
        .unwrap();
    let last = (first..flight.len())
        .find(|k| flight.feet[*k] != [false; 4])
        .unwrap();
    flight = flight.slice(first..last);
    for (angle, spikes) in [(1.0, 0), (1.0, 8), (1.0 / DEGREE, 0)] {
        let mut own = flight.clone();
        (0..spikes).for_each(|k| own.x[(2, 10 + k)] = 40.0);
        let convention = Convention { angle, ..PLAIN };
        convention.write(&path, &own, &mut Dice(1));
        let (guess, _) = guessed(&path);
        let unit = if angle == 1.0 { "rad" } else { "deg" };
        let table = guess.text.split("[joint.position]").nth(1).unwrap();
        let table = table.split("\n\n").next().unwrap();
        assert!(table.contains(&format!("unit = \"{unit}\"")), "{table}");
    }
}

#[test]
fn whole_turns_of_joints_and_trunk_stay_radians() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut turned = jump();
    for (row, turns) in [(1, 1.0), (2, -1.0), (5, 2.0), (16, 1.0)] {
        turned.x.row_mut(row).add_scalar_mut(TAU * turns);
    }
    PLAIN.write(&path, &turned, &mut Dice(1));
    let (guess, found) = guessed(&path);
    assert!(difference(&found, &turned).0 < 1e-9, "{}", guess.text);
}

#[test]
fn joints_and_feet_are_counted_from_0_or_1() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let s = jump();
    let row = |m: &DMatrix<f64>, i: usize| m.row(i).iter().copied().collect::<Vec<f64>>();
    for first in [0, 1] {
        let mut log = Log::default();
        log.add("time", s.time_s.clone());
        for i in 0..12 {
            log.add(format!("q{}", i + first), row(&s.x, i));
            log.add(format!("tau_{}", i + first), row(&s.torque_nm, i));
        }
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            log.add(format!("base_p{axis}"), row(&s.x, 12 + i));
            log.add(["roll", "pitch", "yaw"][i], row(&s.x, 15 + i));
        }
        for foot in 0..4 {
            let down = s.feet.iter().map(|feet| f64::from(u8::from(feet[foot])));
            log.add(
                format!("contact_{}", foot + first),
                down.collect::<Vec<_>>(),
            );
        }
        log.write(&path, ",", true);
        let (guess, found) = guessed(&path);
        let (state, _, contact) = difference(&found, &s);
        assert!(state < 1e-9 && contact, "{}", guess.text);
    }
}

#[test]
fn columns_of_one_family_are_taken_and_the_others_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let s = jump();
    let row = |m: &DMatrix<f64>, i: usize, factor: f64| -> Vec<f64> {
        m.row(i).iter().map(|value| factor * value).collect()
    };
    let mut log = Log::default();
    log.add("time", s.time_s.clone());
    for i in 0..12 {
        let joint = format!("{}_{}", LEGS[i / 3], KINDS[i % 3]);
        log.add(format!("q_sim_{joint}"), row(&s.x, i, 0.9));
        log.add(format!("q_real_{joint}"), row(&s.x, i, 1.0));
        log.add(format!("dq_real_{joint}"), row(&s.dx, i, 1.0));
        log.add(format!("tau_sim_{joint}"), row(&s.torque_nm, i, 0.8));
        log.add(format!("tau_real_{joint}"), row(&s.torque_nm, i, 1.0));
    }
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        log.add(format!("base_p{axis}"), row(&s.x, 12 + i, 1.0));
        log.add(["roll", "pitch", "yaw"][i], row(&s.x, 15 + i, 1.0));
    }
    for foot in 0..4 {
        let down = s.feet.iter().map(|feet| f64::from(u8::from(feet[foot])));
        log.add(format!("contact_{}", LEGS[foot]), down.collect::<Vec<_>>());
    }
    log.write(&path, ",", true);
    let (guess, found) = guessed(&path);
    assert!(difference(&found, &s).0 < 1e-9, "{}", guess.text);
    let notes = guess.notes.join("\n");
    for name in ["q_sim_FR_hip", "tau_sim_FR_hip"] {
        assert!(
            notes.contains(name) && guess.text.contains(name),
            "{notes}\n{}",
            guess.text
        );
    }
    // Plain names before those with additional words.
    let mut plain = Log::default();
    let names = log.names.iter().map(|name| name.replace("_real", ""));
    (plain.names, plain.columns) = (names.collect(), log.columns.clone());
    plain.write(&path, ",", true);
    let (guess, found) = guessed(&path);
    assert!(difference(&found, &s).0 < 1e-9, "{}", guess.text);
    assert!(
        guess.notes.join("\n").contains("q_sim_FR_hip"),
        "{:?}",
        guess.notes
    );
    log.write(&path, ",", true);
    // Lines before the header.
    let text = fs::read_to_string(&path).unwrap();
    for comment in [
        "# jumps of Tuesday\n",
        "robot 3, firmware 1.2\n# q in rad\n",
    ] {
        fs::write(&path, format!("{comment}{text}")).unwrap();
        let (guess, found) = guessed(&path);
        let skip = format!("skip = {}", comment.lines().count());
        assert!(guess.text.contains(&skip), "{}", guess.text);
        assert!(difference(&found, &s).0 < 1e-9, "{}", guess.text);
    }
}

/// A log of these columns and of others without information, and the guess of its map.
fn guess_of_names(names: &[String]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut log = Log::default();
    log.add("Time [ms]", (0..8).map(|k| f64::from(2 * k)));
    for (i, name) in names.iter().enumerate() {
        log.add(name, (0..8).map(|k| 0.01 * f64::from(k) + i as f64));
    }
    log.write(&path, ",", true);
    let go1 = romc::robot_file::by_name("go1").unwrap();
    guess(&path, go1).unwrap().text
}

/// `{leg}` stands for the words for legs after a bar, `{joint}` for those for joints, `{axis}` for axes or angles;
/// `{n}` for numbers from the one after the bar.
fn names_of(pattern: &str, count: usize) -> Vec<String> {
    let (pattern, words) = pattern.split_once(" | ").unwrap();
    let words: Vec<&str> = words.split(' ').collect();
    let name = |i: usize| match count {
        _ if pattern.contains("{n}") => {
            let first: usize = words[0].parse().unwrap();
            pattern.replace("{n}", &(first + i).to_string())
        }
        12 => pattern
            .replace("{leg}", words[i / 3])
            .replace("{joint}", words[4 + i % 3]),
        _ => pattern
            .replace("{leg}", words[i])
            .replace("{axis}", words[i]),
    };
    (0..count).map(name).collect()
}

#[test]
fn names_of_many_loggers_are_known() {
    for (table, count, patterns) in [
        (
            "joint.position",
            12,
            "{leg}_{joint}_joint/position | FR FL RR RL hip thigh calf; \
             position[{leg}_{joint}_joint] | FR FL RR RL hip thigh calf; q_{n} | 1; \
             {leg} {joint} angle (deg) | RightFront FrontLeft RearRight RearLeft abad thigh knee; \
             qpos[{n}] | 7; {leg}{joint}Pos | FR FL RR RL Hip Thigh Knee",
        ),
        (
            "joint.torque",
            12,
            "effort[{leg}_{joint}] | RF LF RH LH HAA HFE KFE; tau{n} | 0; ctrl[{n}] | 0; \
             {leg}.{joint}.torque | fr fl hr hl hip_roll hip_pitch knee; \
             {leg}_{joint}_torque | leg0 leg1 leg2 leg3 joint0 joint1 joint2; \
             tau_{leg}_{joint} [Nm] | FR FL RR RL hip thigh knee",
        ),
        (
            "joint.velocity",
            12,
            "motor_state[{n}].dq | 0; qvel_{n} | 6; dof_vel[{n}] | 0; dQ_{n} | 0; \
             {leg}.{joint}.vel | front_right front_left rear_right rear_left abduction hip knee",
        ),
        (
            "body.position",
            3,
            "pose.pose.position.{axis} | x y z; com_{axis} | x y z; CoM {axis} | X Y Z; p_{axis} | x y z; qpos[{n}] | 0",
        ),
        (
            "body.orientation",
            4,
            "pose.pose.orientation.{axis} | w x y z; imu_state.quaternion[{n}] | 0; q{axis} | w x y z; qpos[{n}] | 3",
        ),
        (
            "body.orientation",
            3,
            "base_{axis} | roll pitch yaw; Body angular Position {axis} | x y z; {axis} | phi theta psi",
        ),
        (
            "body.velocity",
            3,
            "twist.twist.linear.{axis} | x y z; body_v{axis} | x y z; Body linear Velocity {axis} | x y z; \
             base v{axis} [m/s] | x y z",
        ),
        (
            "body.angular_velocity",
            3,
            "twist.twist.angular.{axis} | x y z; imu_state.gyroscope[{n}] | 0; w{axis} | x y z; qvel_{n} | 3; \
             {axis}_rate | roll pitch yaw; {axis}_dot | phi theta psi; {axis} rate [deg/s] | roll pitch yaw",
        ),
        (
            "feet",
            4,
            "foot_force[{n}] | 0; contact_{leg} | FR FL RR RL; {leg} Foot | fr fl rr rl; Fz {leg} | RF LF RH LH; \
             F_{leg} [N] | FR FL RR RL; {leg} load (N) | FR FL RR RL; c_{n} | 0",
        ),
    ] {
        for pattern in patterns.split("; ") {
            let names = names_of(pattern, count);
            let others = [
                "wireless_remote[0]",
                "temperature",
                "FR_foot_position_x",
                "battery",
            ];
            let others = others.iter().chain(&["mode", "tick", "foot_speed_body[1]"]);
            let mut columns: Vec<String> = names.iter().rev().cloned().collect();
            columns.extend(others.map(|&name| name.to_owned()));
            let text = guess_of_names(&columns);
            let clock = "[time]\ncolumn = \"Time [ms]\"\nunit = \"ms\"\n";
            assert!(text.contains(clock), "{text}");
            let own = text.split(&format!("\n[{table}]\n")).nth(1);
            let own = own.unwrap_or_else(|| panic!("{pattern}: {text}"));
            let own = own
                .strip_prefix("columns = [")
                .unwrap()
                .split("]\n")
                .next()
                .unwrap();
            let found: Vec<&str> = own.split('"').skip(1).step_by(2).collect();
            assert_eq!(found, names, "{pattern}: {text}");
            let is_free = |name: &&String| !text.contains(&format!("\"{name}\""));
            assert_eq!(columns[count..].iter().filter(is_free).count(), 7, "{text}");
        }
    }
    let both = ["q_{n} | 0", "q_des_{n} | 0"].map(|pattern| names_of(pattern, 12));
    assert!(!guess_of_names(&both.concat()).contains("q_des_3"));
}
