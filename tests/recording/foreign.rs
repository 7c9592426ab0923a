//! One jump as the logs of ten programs: by their maps all give the recording, and guessed maps find most.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, Vector3};
use romc::files::Overwrite;
use romc::recording::guess;
use romc::recording::{self, Clocks, ColumnMap, Reader, Recording, RecordingError, Segment};
use romc::robot::JOINT_NAMES;
use romc::robot::rotation;

/// Columns of numbers with names.
#[derive(Default)]
pub struct Log {
    pub names: Vec<String>,
    pub columns: Vec<Vec<String>>,
}

impl Log {
    pub fn add(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = f64>) {
        let cells = values.into_iter().map(|value| format!("{value:?}"));
        self.text(name, cells);
    }

    fn text(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        self.names.push(name.into());
        self.columns.push(cells.into_iter().collect());
    }

    pub fn write(&self, path: &Path, separator: &str, header: bool) {
        let mut text = String::new();
        if header {
            text += &self.names.join(separator);
            text.push('\n');
        }
        for row in 0..self.columns[0].len() {
            let cells: Vec<&str> = self.columns.iter().map(|c| c[row].as_str()).collect();
            text += &cells.join(separator);
            text.push('\n');
        }
        fs::write(path, text).unwrap();
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Legs and joints as most URDFs call them.
const LEGS: [&str; 4] = ["FR", "FL", "RR", "RL"];
const JOINTS: [&str; 3] = ["hip", "thigh", "calf"];
const NAMES: &str =
    "[names]\nlegs = [\"FR\", \"FL\", \"RR\", \"RL\"]\njoints = [\"hip\", \"thigh\", \"calf\"]\n";

pub fn jump() -> Segment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1/test_01.csv.gz");
    let mut segment = recording::read(&path).unwrap().segments.remove(0);
    // Every log below leaves accelerations out.
    segment.ddx = recording::preprocess::differences(&segment.time_s, &segment.dx);
    segment
}

fn row(m: &DMatrix<f64>, i: usize) -> Vec<f64> {
    m.row(i).iter().copied().collect()
}

fn scaled(m: &DMatrix<f64>, i: usize, factor: f64) -> Vec<f64> {
    m.row(i).iter().map(|value| factor * value).collect()
}

fn joint_name(i: usize) -> String {
    format!("{}_{}_joint", LEGS[i / 3], JOINTS[i % 3])
}

/// Quaternion (w, x, y, z) of a sample.
pub fn quaternion(segment: &Segment, sample: usize) -> [f64; 4] {
    let angle = |i: usize| {
        nalgebra::UnitQuaternion::from_scaled_axis(Vector3::ith(i, segment.x[(15 + i, sample)]))
    };
    let q = angle(2) * angle(1) * angle(0);
    [q.w, q.i, q.j, q.k]
}

/// Angular velocity about the body's axes, from rates of the angles.
pub fn gyro(segment: &Segment, sample: usize) -> [f64; 3] {
    let [roll, pitch, _] = [15, 16, 17].map(|i| segment.x[(i, sample)]);
    let [dr, dp, dy] = [15, 16, 17].map(|i| segment.dx[(i, sample)]);
    [
        dr - dy * pitch.sin(),
        dp * roll.cos() + dy * roll.sin() * pitch.cos(),
        -dp * roll.sin() + dy * roll.cos() * pitch.cos(),
    ]
}

fn body_velocity(segment: &Segment, sample: usize) -> Vector3<f64> {
    let turn = rotation([15, 16, 17].map(|i| segment.x[(i, sample)]));
    turn.transpose() * Vector3::from_fn(|i, _| segment.dx[(12 + i, sample)])
}

fn feet(log: &mut Log, segment: &Segment, name: impl Fn(usize) -> String) {
    for foot in 0..4 {
        log.add(
            name(foot),
            segment.feet.iter().map(|f| f64::from(u8::from(f[foot]))),
        );
    }
}

fn joints(log: &mut Log, segment: &Segment) {
    for (kind, of) in [
        ("position", &segment.x),
        ("velocity", &segment.dx),
        ("effort", &segment.torque_nm),
    ] {
        for i in 0..12 {
            log.add(format!("{}/{kind}", joint_name(i)), row(of, i));
        }
    }
}

const JOINT_TABLES: &str = "[joint.position]\ncolumns = \"{leg}_{joint}_joint/position\"\n\
     [joint.velocity]\ncolumns = \"{leg}_{joint}_joint/velocity\"\n\
     [joint.torque]\ncolumns = \"{leg}_{joint}_joint/effort\"\n";

fn trunk(log: &mut Log, segment: &Segment) {
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        log.add(format!("base_p{axis}"), row(&segment.x, 12 + i));
        log.add(format!("base_v{axis}"), row(&segment.dx, 12 + i));
    }
}

const TRUNK_TABLES: &str = "[body.position]\ncolumns = \"base_p{axis}\"\n\
     [body.velocity]\ncolumns = \"base_v{axis}\"\n";

fn angles(log: &mut Log, segment: &Segment) {
    for (i, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
        log.add(angle, row(&segment.x, 15 + i));
        log.add(format!("{angle}_rate"), row(&segment.dx, 15 + i));
    }
}

const ANGLE_TABLES: &str = "[body.orientation]\ncolumns = [\"roll\", \"pitch\", \"yaw\"]\n\
     [body.angular_velocity]\ncolumns = [\"roll_rate\", \"pitch_rate\", \"yaw_rate\"]\n";
const FEET_TABLE: &str = "[feet]\ncolumns = \"contact_{leg}\"\n";

/// A log with its map.
struct Case {
    name: &'static str,
    path: PathBuf,
    map: String,
}

/// The jump as logs in a folder.
fn cases(folder: &Path, s: &Segment) -> Vec<Case> {
    let mut out = Vec::new();
    let mut add = |name, path, map: String| out.push(Case { name, path, map });
    let clock = "[time]\ncolumn = \"time\"\n";
    let common = |log: &mut Log| {
        trunk(log, s);
        angles(log, s);
        feet(log, s, |foot| format!("contact_{}", LEGS[foot]));
    };
    let rest = [TRUNK_TABLES, ANGLE_TABLES, FEET_TABLE].concat();

    let mut log = Log::default();
    log.add("time", s.time_s.clone());
    joints(&mut log, s);
    common(&mut log);
    let path = folder.join("names.csv");
    log.write(&path, ",", true);
    add("names", path, [clock, NAMES, JOINT_TABLES, &rest].concat());

    let mut log = Log::default();
    log.add("t_ms", s.time_s.iter().map(|t| 1e3 * t));
    for (kind, of, factor) in [
        ("angle", &s.x, 1.0 / DEGREE),
        ("speed", &s.dx, 1.0 / DEGREE),
        ("torque", &s.torque_nm, 1e3),
    ] {
        for i in 0..12 {
            log.add(format!("{}.{kind}", JOINT_NAMES[i]), scaled(of, i, factor));
        }
    }
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        log.add(format!("com_{axis}"), scaled(&s.x, 12 + i, 1e3));
        log.add(format!("com_v{axis}"), scaled(&s.dx, 12 + i, 1e3));
    }
    for (i, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
        log.add(format!("{angle}_deg"), scaled(&s.x, 15 + i, 1.0 / DEGREE));
        log.add(
            format!("{angle}_speed"),
            scaled(&s.dx, 15 + i, 1.0 / DEGREE),
        );
    }
    feet(&mut log, s, |foot| format!("contact_{}", LEGS[foot]));
    let path = folder.join("units.csv");
    log.write(&path, ";", true);
    let units = "[time]\ncolumn = \"t_ms\"\nunit = \"ms\"\n\
         [joint.position]\ncolumns = \"{leg}.{joint}.angle\"\nunit = \"deg\"\n\
         [joint.velocity]\ncolumns = \"{leg}.{joint}.speed\"\nunit = \"deg/s\"\n\
         [joint.torque]\ncolumns = \"{leg}.{joint}.torque\"\nunit = \"N mm\"\n\
         [body.position]\ncolumns = [\"com_z\", \"com_x\", \"com_y\"]\norder = \"zxy\"\nunit = \"mm\"\n\
         [body.velocity]\ncolumns = \"com_v{axis}\"\nunit = \"mm/s\"\n\
         [body.orientation]\ncolumns = [\"yaw_deg\", \"pitch_deg\", \"roll_deg\"]\norder = \"ypr\"\nunit = \"deg\"\n\
         [body.angular_velocity]\ncolumns = [\"roll_speed\", \"pitch_speed\", \"yaw_speed\"]\nunit = \"deg/s\"\n\
         [feet]\ncolumns = [\"contact_FR\", \"contact_FL\", \"contact_RR\", \"contact_RL\"]\n";
    add("units", path, units.to_owned());

    // Two conventions of quaternions, rates and velocities about the body's own axes.
    for (name, order) in [("wxyz", [0, 1, 2, 3]), ("xyzw", [1, 2, 3, 0])] {
        let mut log = Log::default();
        log.add("time", s.time_s.clone());
        joints(&mut log, s);
        feet(&mut log, s, |foot| format!("contact_{}", LEGS[foot]));
        for (place, element) in order.into_iter().enumerate() {
            let values = (0..s.len()).map(|i| quaternion(s, i)[element]);
            log.add(format!("imu.quaternion[{place}]"), values);
        }
        for i in 0..3 {
            let axis = ["x", "y", "z"][i];
            log.add(
                format!("imu.gyroscope[{i}]"),
                (0..s.len()).map(|k| gyro(s, k)[i]),
            );
            log.add(format!("base_p{axis}"), row(&s.x, 12 + i));
            let velocity = (0..s.len()).map(|k| body_velocity(s, k)[i]);
            log.add(format!("base_v{axis}"), velocity);
        }
        let path = folder.join(format!("{name}.csv"));
        log.write(&path, ",", true);
        let own = format!(
            "{TRUNK_TABLES}frame = \"body\"\n\
             [body.orientation]\ncolumns = [\"imu.quaternion[0]\", \"imu.quaternion[1]\", \
             \"imu.quaternion[2]\", \"imu.quaternion[3]\"]\norder = \"{name}\"\n\
             [body.angular_velocity]\ncolumns = [\"imu.gyroscope[0]\", \"imu.gyroscope[1]\", \
             \"imu.gyroscope[2]\"]\nframe = \"body\"\n{FEET_TABLE}"
        );
        add(name, path, [clock, NAMES, JOINT_TABLES, &own].concat());
    }

    // Other legs first, knees the other way round, zero angles elsewhere.
    let order = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8];
    let sign = |i: usize| if i % 3 == 2 { -1.0 } else { 1.0 };
    let zero = |i: usize| if i % 3 == 1 { 0.3 } else { 0.0 };
    let mut log = Log::default();
    log.add("time", s.time_s.clone());
    for (place, i) in order.into_iter().enumerate() {
        let at = |m: &DMatrix<f64>, offset: f64| -> Vec<f64> {
            m.row(i)
                .iter()
                .map(|value| sign(i) * (value - offset))
                .collect()
        };
        log.add(format!("q{place}"), at(&s.x, zero(i)));
        log.add(format!("dq{place}"), at(&s.dx, 0.0));
        log.add(format!("tau{place}"), at(&s.torque_nm, 0.0));
    }
    common(&mut log);
    let path = folder.join("signs.csv");
    log.write(&path, ",", true);
    let table = |key: &str, name: &str, more: &str| {
        format!(
            "[joint.{key}]\ncolumns = \"{name}{{0}}\"\norder = \"fl.* fr.* rl.* rr.*\"\n\
             sign = {{ \"*.kn\" = -1 }}\n{more}"
        )
    };
    let own = [
        table("position", "q", "offset = { \"*.hy\" = 0.3 }\n"),
        table("velocity", "dq", ""),
        table("torque", "tau", ""),
    ];
    let names = "[names]\nlegs = [\"FR\", \"FL\", \"RR\", \"RL\"]\n";
    add("signs", path, [clock, names, &own.concat(), &rest].concat());

    // Tabs, dates, words for contact, decimal commas.
    let mut log = Log::default();
    log.text(
        "stamp",
        s.time_s.iter().map(|t| {
            let micros = (t * 1e6).round() as u64;
            format!(
                "2026-03-01T23:59:{:02}.{:06}Z",
                59 + micros / 1_000_000,
                micros % 1_000_000
            )
        }),
    );
    joints(&mut log, s);
    trunk(&mut log, s);
    angles(&mut log, s);
    for foot in 0..4 {
        let words = s
            .feet
            .iter()
            .map(|f| if f[foot] { "True" } else { "False" });
        log.text(format!("contact_{}", LEGS[foot]), words.map(str::to_owned));
    }
    for column in &mut log.columns[1..] {
        column
            .iter_mut()
            .for_each(|cell| *cell = cell.replace('.', ","));
    }
    let path = folder.join("tabs.tsv");
    log.write(&path, "\t", true);
    let stamp = "[time]\ncolumn = \"stamp\"\n";
    add("tabs", path, [stamp, NAMES, JOINT_TABLES, &rest].concat());

    // Forces at the feet that bounce around the threshold, nanoseconds since 1970.
    let mut log = Log::default();
    let start = 1_772_366_400_123_456_789_u64;
    log.text(
        "timestamp",
        s.time_s
            .iter()
            .map(|t| (start + (t * 1e9).round() as u64).to_string()),
    );
    joints(&mut log, s);
    trunk(&mut log, s);
    angles(&mut log, s);
    for foot in 0..4 {
        let mut count = 0;
        let force = s.feet.iter().map(|f| {
            count = if f[foot] { count + 1 } else { 0 };
            match count {
                0 => 1.5,
                1 => 60.0,
                _ => [14.0, 80.0, 35.0][count % 3],
            }
        });
        log.add(
            format!("foot_force_{}", LEGS[foot]),
            force.collect::<Vec<_>>(),
        );
    }
    let path = folder.join("forces.csv");
    log.write(&path, ",", true);
    let nanoseconds = "[time]\ncolumn = \"timestamp\"\nunit = \"ns\"\n";
    let forces = "[feet]\ncolumns = \"foot_force_{leg}\"\nthreshold = 20.0\nrelease = 10.0\n";
    let tables = [
        nanoseconds,
        NAMES,
        JOINT_TABLES,
        TRUNK_TABLES,
        ANGLE_TABLES,
        forces,
    ];
    add("forces", path, tables.concat());

    // Files without header, by numbers of columns, as a folder.
    let own = folder.join("bare");
    fs::create_dir(&own).unwrap();
    let (mut joint, mut body) = (Log::default(), Log::default());
    for (of, log) in [
        (&s.x, 0),
        (&s.dx, 0),
        (&s.torque_nm, 0),
        (&s.x, 1),
        (&s.dx, 1),
    ] {
        match log {
            0 => (0..12).for_each(|i| joint.add("", row(of, i))),
            _ => (12..18).for_each(|i| body.add("", row(of, i))),
        }
    }
    feet(&mut body, s, |_| String::new());
    joint.write(&own.join("joint.txt"), "  ", false);
    body.write(&own.join("body.txt"), " ", false);
    let bare = "[time]\nsample_time_s = 0.002\n\
         [joint.position]\nfile = \"joint.txt\"\ncolumns = \"1..12\"\n\
         [joint.velocity]\nfile = \"joint.txt\"\ncolumns = \"13..24\"\n\
         [joint.torque]\nfile = \"joint.txt\"\ncolumns = \"25..36\"\n\
         [body.position]\nfile = \"body.txt\"\ncolumns = \"1..3\"\n\
         [body.orientation]\nfile = \"body.txt\"\ncolumns = \"4..6\"\n\
         [body.velocity]\nfile = \"body.txt\"\ncolumns = \"7..9\"\n\
         [body.angular_velocity]\nfile = \"body.txt\"\ncolumns = [10, \"11..12\"]\n\
         [feet]\nfile = \"body.txt\"\ncolumns = \"13..16\"\n";
    add("bare", own, bare.to_owned());

    // ROS 2 messages.
    let path = folder.join("jump.mcap");
    recording::write_mcap(&path, s, None, Overwrite::Replace).unwrap();
    let joint = |key: &str, field: &str| {
        format!(
            "[joint.{key}]\ntopic = \"/joint_states\"\ncolumns = \"{field}[{{leg}}.{{joint}}]\"\n"
        )
    };
    let odometry = |key: &str, field: &str, more: &str| {
        format!("[body.{key}]\ntopic = \"/odom\"\ncolumns = \"{field}.{{axis}}\"\n{more}")
    };
    let messages = [
        joint("position", "position"),
        joint("velocity", "velocity"),
        joint("torque", "effort"),
        odometry("position", "pose.pose.position", ""),
        odometry("velocity", "twist.twist.linear", "frame = \"body\"\n"),
        odometry("angular_velocity", "twist.twist.angular", "frame = \"body\"\n"),
        "[body.orientation]\ntopic = \"/odom\"\norder = \"wxyz\"\ncolumns = [\"pose.pose.orientation.w\", \
         \"pose.pose.orientation.x\", \"pose.pose.orientation.y\", \"pose.pose.orientation.z\"]\n"
            .to_owned(),
        "[feet]\ntopic = \"/foot_contacts\"\ncolumns = \"position[{leg}]\"\n".to_owned(),
    ];
    add("mcap", path, messages.concat());
    out
}

/// Largest differences of two recordings: time, state and torques; velocities; whether contact agrees.
pub fn difference(found: &Recording, expected: &Segment) -> (f64, f64, bool) {
    assert_eq!(found.segments.len(), 1);
    let found = &found.segments[0];
    if found.len() != expected.len() {
        return (f64::INFINITY, f64::INFINITY, false);
    }
    let times = found.time_s.iter().zip(&expected.time_s);
    let start = expected.time_s[0] - found.time_s[0];
    let time = times
        .map(|(a, b)| (a + start - b).abs())
        .fold(0.0, f64::max);
    let state = (&found.x - &expected.x).amax();
    let torque = (&found.torque_nm - &expected.torque_nm).amax();
    let velocity = (&found.dx - &expected.dx).amax();
    (
        time.max(state).max(torque),
        velocity,
        found.feet == expected.feet,
    )
}

fn read(case: &Case) -> Recording {
    let map = ColumnMap::parse(case.name, &case.map).unwrap_or_else(|e| panic!("{e}"));
    let reader = Reader::new(Some(map), Clocks::Recorded);
    let reading = reader.read(&case.path);
    reading
        .unwrap_or_else(|error| panic!("{}: {error}", case.name))
        .recording
}

#[test]
fn logs_of_one_jump_by_their_maps_are_the_same_recording() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    for case in cases(folder.path(), &jump) {
        let found = read(&case);
        let (state, velocity, contact) = difference(&found, &jump);
        assert!(
            state < 1e-9 && velocity < 1e-9,
            "{}: {state} {velocity}",
            case.name
        );
        assert!(contact, "{}", case.name);
        let acceleration = (&found.segments[0].ddx - &jump.ddx).amax();
        assert!(acceleration < 1e-6, "{}: {acceleration}", case.name);
    }
}

#[test]
fn guessed_maps_of_seven_logs_give_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    let go1 = romc::robot_file::by_name("go1").unwrap();
    let mut found = Vec::new();
    for case in cases(folder.path(), &jump) {
        if case.path.is_dir() {
            continue;
        }
        let guess = guess(&case.path, go1).unwrap();
        assert_eq!(
            guess.missing,
            Vec::<&str>::new(),
            "{}:\n{}",
            case.name,
            guess.text
        );
        let guessed = Case {
            map: guess.text.clone(),
            ..case
        };
        let (state, velocity, contact) = difference(&read(&guessed), &jump);
        if state < 1e-9 && velocity < 1e-9 && contact {
            found.push(guessed.name);
        } else {
            println!(
                "{}: {state} {velocity} {contact}\n{}",
                guessed.name, guess.text
            );
        }
    }
    // The map of `signs` needs the offset of the thighs and the legs' order, which no number shows.
    assert_eq!(
        found,
        ["names", "units", "wxyz", "xyzw", "tabs", "forces", "mcap"]
    );
}

/// A motion that is known at all times: value and rate of coordinate `i` of 18.
fn motion(i: usize, time: f64) -> (f64, f64) {
    let (rate, phase) = (6.0 + i as f64, 0.4 * i as f64);
    let (middle, size) = match i {
        0..12 => ([0.0, 0.7, -1.5][i % 3], 0.2),
        14 => (0.3, 0.03),
        _ => (0.0, 0.1),
    };
    let angle = rate * time + phase;
    (middle + size * angle.sin(), size * rate * angle.cos())
}

#[test]
fn topics_with_clocks_of_their_own_agree_to_1e_4() {
    let folder = tempfile::tempdir().unwrap();
    let times = |step: f64, start: f64, count: usize| -> Vec<f64> {
        (0..count).map(|i| start + step * i as f64).collect()
    };
    let topic = |name: &str, times: &[f64], rows: std::ops::Range<usize>| {
        let mut log = Log::default();
        log.add("stamp", times.iter().map(|t| 1e3 * t));
        for i in rows {
            log.add(format!("p{i}"), times.iter().map(|t| motion(i, *t).0));
            log.add(format!("v{i}"), times.iter().map(|t| motion(i, *t).1));
        }
        (log, folder.path().join(name))
    };
    let joint_times = times(0.002, 0.0, 400);
    let (mut joints, path) = topic("jump_joints.csv", &joint_times, 0..12);
    for i in 0..12 {
        joints.add(format!("tau{i}"), joint_times.iter().map(|t| 3.0 + 2.0 * t));
    }
    joints.write(&path, ",", true);
    // Motion capture at 240 Hz, its clock 0.1 s late; contact at 1 kHz.
    let pose_times = times(1.0 / 240.0, 0.011, 180);
    let (mut pose, pose_path) = topic("jump_pose.csv", &pose_times, 12..18);
    pose.columns[0] = pose_times
        .iter()
        .map(|t| format!("{:?}", 1e3 * (t + 0.1)))
        .collect();
    pose.write(&pose_path, ",", true);
    let feet_times = times(0.001, 0.0003, 790);
    let (mut feet, feet_path) = topic("jump_feet.csv", &feet_times, 0..0);
    for foot in 0..4 {
        let down = feet_times
            .iter()
            .map(|t| f64::from(u8::from(!(0.3..0.5).contains(t))));
        feet.add(format!("f{foot}"), down.collect::<Vec<_>>());
    }
    feet.write(&feet_path, ",", true);
    let list = |prefix: &str, rows: std::ops::Range<usize>| {
        let names: Vec<String> = rows.map(|i| format!("\"{prefix}{i}\"")).collect();
        names.join(", ")
    };
    let pose_file =
        "file = \"jump_pose.csv\"\ntime = \"stamp\"\ntime_unit = \"ms\"\ntime_offset_s = -0.1\n";
    let map = format!(
        "[time]\ncolumn = \"stamp\"\nunit = \"ms\"\n\
         [joint.position]\ncolumns = [{}]\n[joint.velocity]\ncolumns = [{}]\n\
         [joint.torque]\ncolumns = [{}]\n\
         [body.position]\n{pose_file}columns = [{}]\n[body.velocity]\n{pose_file}columns = [{}]\n\
         [body.orientation]\n{pose_file}columns = [{}]\n\
         [body.angular_velocity]\n{pose_file}columns = [{}]\n\
         [feet]\nfile = \"jump_feet.csv\"\ncolumns = [{}]\n",
        list("p", 0..12),
        list("v", 0..12),
        list("tau", 0..12),
        list("p", 12..15),
        list("v", 12..15),
        list("p", 15..18),
        list("v", 15..18),
        list("f", 0..4),
    );
    let read_by = |map: &str| {
        Reader::new(
            Some(ColumnMap::parse("map", map).unwrap()),
            Clocks::Recorded,
        )
        .read(&path)
    };
    let reading = read_by(&map).unwrap();
    let segment = &reading.recording.segments[0];
    assert!(
        reading.notes[0].contains("clocks of their own"),
        "{:?}",
        reading.notes
    );
    // From the first pose to the last one.
    let ends = [segment.time_s[0], segment.time_s[segment.len() - 1]];
    assert_eq!((ends[0], segment.len()), (0.012, 373));
    for (k, &time) in segment.time_s.iter().enumerate() {
        for i in 0..18 {
            let (value, rate) = motion(i, time);
            assert!((segment.x[(i, k)] - value).abs() < 1e-4, "{i} {time}");
            assert!((segment.dx[(i, k)] - rate).abs() < 1e-4, "{i} {time}");
        }
        assert!((segment.torque_nm[(0, k)] - 3.0 - 2.0 * time).abs() < 1e-12);
        let edge = (time - 0.3).abs().min((time - 0.5).abs());
        assert!(
            edge < 1e-3 || segment.feet[k][0] != (0.3..0.5).contains(&time),
            "{time}"
        );
    }
    let resampled = map.replace(
        "unit = \"ms\"\n[joint",
        "unit = \"ms\"\nresample_s = 0.004\n[joint",
    );
    let segment = &read_by(&resampled).unwrap().recording.segments[0];
    assert!((segment.mean_step_s() - 0.004).abs() < 1e-12);
    let small = map.replace(
        "unit = \"ms\"\n[joint",
        "unit = \"ms\"\nmax_gap_s = 0.003\n[joint",
    );
    let error = read_by(&small).unwrap_err();
    assert!(error.to_string().contains("found no sample for"), "{error}");
}

#[test]
fn wrong_maps_name_the_key_the_column_and_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let cases = cases(folder.path(), &jump());
    let case = |name: &str| cases.iter().find(|case| case.name == name).unwrap();
    let fault = |name: &str, from: &str, to: &str| {
        let Case { path, map, .. } = case(name);
        assert!(map.contains(from), "{from}");
        let map = ColumnMap::parse("map.toml", &map.replace(from, to));
        let read = map.and_then(|map| Reader::new(Some(map), Clocks::Recorded).read(path));
        read.unwrap_err().to_string()
    };
    let text = fault("names", "joint/effort", "joint/torque");
    assert!(
        text.contains("`joint.torque.columns`: found `FR_hip_joint/torque`"),
        "{text}"
    );
    assert!(text.contains("`FR_hip_joint/position`"), "{text}");
    let text = fault("units", "unit = \"mm\"", "unit = \"inch\"");
    assert!(
        text.contains("`body.position.unit`: found `inch`, expected one of m, mm"),
        "{text}"
    );
    let text = fault("wxyz", "order = \"wxyz\"\n", "");
    assert!(text.contains("`body.orientation.order`"), "{text}");
    let text = fault("wxyz", "order = \"wxyz\"", "order = \"wxxz\"");
    assert!(text.contains("`x` twice"), "{text}");
    let text = fault("signs", "fl.* fr.*", "FR.hz fr.*");
    assert!(text.contains("`FR.hz`, which is none of"), "{text}");
    let text = fault("signs", "\"*.kn\" = -1", "\"*.kn\" = 2");
    assert!(text.contains("`joint.position.sign`: found 2"), "{text}");
    for (columns, found) in [
        (
            "\"13..9999999999\"",
            "`feet.columns`: found \"13..9999999999\", expected at most",
        ),
        ("[13, 14, 14, 15]", "`feet.columns`: found 14 twice"),
    ] {
        let text = fault("bare", "\"13..16\"", columns);
        assert!(text.contains(found), "{text}");
    }
    let text = fault("signs", "offset = { \"*.hy\" = 0.3 }", "offset = nan");
    assert!(
        text.contains("`joint.position.offset`: found NaN, expected a finite number"),
        "{text}"
    );
    let text = fault("bare", "\"13..16\"", "\"13..15\"");
    assert!(
        text.contains("`feet.columns`: found 3 columns, expected 4"),
        "{text}"
    );
    let text = fault("bare", "\"13..16\"", "\"14..17\"");
    assert!(
        text.contains("found column 17, expected a column of `body.txt`"),
        "{text}"
    );
    let text = fault("forces", "threshold = 20.0\nrelease = 10.0\n", "");
    assert!(
        text.contains("column `fr Foot`: found 60, expected contact 0 or 1"),
        "{text}"
    );
    let text = fault("tabs", "column = \"stamp\"", "column = \"clock\"");
    assert!(text.contains("`time.column`: found `clock`"), "{text}");
}

#[test]
fn files_with_late_samples_are_smoothed_unless_told_otherwise() {
    use romc::recording::{ConditionOptions, RecordingFile, RecordingSet};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fast.csv");
    let mut jump = jump();
    jump.time_s.iter_mut().for_each(|time| *time /= 1.15);
    let recording = Recording {
        path: path.clone(),
        segments: vec![jump],
        ignored_columns: Vec::new(),
    };
    recording::write(&path, &recording).unwrap();
    let lines = |clocks| {
        let file = RecordingFile {
            path: path.clone(),
            segments: None,
        };
        let go1 = romc::robot_file::by_name("go1").unwrap();
        let (options, reader) = (ConditionOptions::default(), Reader::new(None, clocks));
        let mut set = RecordingSet::default();
        set.read(&[file], go1, &options, &reader).unwrap();
        (set.recordings.remove(0), set.reading.lines())
    };
    let (smoothed, notes) = lines(Clocks::Repaired);
    assert!(
        notes.iter().any(|note| note.contains("rows are smoothed")),
        "{notes:?}"
    );
    let raw = Reader::new(None, Clocks::Repaired)
        .read(&path)
        .unwrap()
        .recording;
    assert_ne!(smoothed.segments[0].ddx, raw.segments[0].ddx);
    let (kept, notes) = lines(Clocks::Recorded);
    assert_eq!((kept, notes.len()), (recording::read(&path).unwrap(), 0));
}

#[test]
fn repaired_clocks_leave_shipped_recordings_as_they_are() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings");
    let reader = Reader::new(None, Clocks::Repaired);
    for name in [
        "go1/train_01",
        "go1/test_02",
        "go1-noisy/train_01",
        "go1-other/jump_01",
        "go2-asynchronous/test_01",
    ] {
        let path = folder.join(format!("{name}.csv.gz"));
        let reading = reader.read(&path).unwrap();
        assert_eq!(reading.recording, recording::read(&path).unwrap(), "{name}");
        assert!(
            reading.mended.iter().all(|m| m.elapsed_ratio.is_none()),
            "{name}"
        );
    }
}

#[test]
fn a_clock_that_runs_too_fast_is_rebuilt_from_the_motion() {
    let folder = tempfile::tempdir().unwrap();
    let mut jump = jump();
    let path = folder.path().join("fast.csv");
    jump.time_s.iter_mut().for_each(|time| *time /= 1.15);
    let recording = Recording {
        path: path.clone(),
        segments: vec![jump.clone()],
        ignored_columns: Vec::new(),
    };
    recording::write(&path, &recording).unwrap();
    let reading = Reader::new(None, Clocks::Repaired).read(&path).unwrap();
    let ratio = reading.mended[0].elapsed_ratio.unwrap();
    assert!((ratio - 1.15).abs() < 0.01, "{ratio}");
    let mended = &reading.recording.segments[0];
    let elapsed = mended.duration_s() / jump.duration_s();
    assert!((elapsed - 1.15).abs() < 0.02, "{elapsed}");
    let as_recorded = Reader::new(None, Clocks::Recorded).read(&path).unwrap();
    assert_eq!(as_recorded.recording.segments[0].time_s, jump.time_s);
}

/// The published files of a real jump, where they are at hand: equal to the same jump in romc's format but for the
/// feet, which that one has from kinematics.
#[test]
fn published_a1_files_by_the_map_of_the_documentation_are_the_jump() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = root.join("../shared/data/a1");
    if !data.is_dir() {
        println!("{} is not there: nothing is compared", data.display());
        return;
    }
    let map = ColumnMap::read(&root.join("docs/maps/a1-raw.toml")).unwrap();
    let reading = Reader::new(Some(map), Clocks::Recorded)
        .read(&data.join("raw_01"))
        .unwrap();
    let expected = recording::read(&data.join("a1_01.csv.gz")).unwrap();
    let expected = &expected.segments[0];
    let found = reading.recording.segments[0].slice(0..expected.len());
    // The comparison has six digits after the point.
    for (name, found, expected) in [
        ("state", &found.x, &expected.x),
        ("velocity", &found.dx, &expected.dx),
        ("torque", &found.torque_nm, &expected.torque_nm),
    ] {
        let error = (found - expected).amax();
        assert!(error < 5.1e-7, "{name}: {error}");
    }
    let times = found.time_s.iter().zip(&expected.time_s);
    assert!(times.into_iter().all(|(a, b)| (a - b).abs() < 1e-9));
}

#[test]
fn mcap_files_are_read_without_a_map_and_damaged_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("jump.mcap");
    let jump = jump();
    let inputs = DMatrix::from_fn(18, jump.len(), |i, k| (i * k) as f64);
    recording::write_mcap(&path, &jump, Some(&inputs), Overwrite::Replace).unwrap();
    let reading = Reader::new(None, Clocks::Recorded).read(&path).unwrap();
    let (state, velocity, contact) = difference(&reading.recording, &jump);
    assert!(
        state < 1e-9 && velocity < 1e-9 && contact,
        "{state} {velocity}"
    );
    assert!(
        reading
            .notes
            .iter()
            .any(|note| note.contains("by their names"))
    );
    let bytes = fs::read(&path).unwrap();
    for end in [0, 7, 100] {
        fs::write(&path, &bytes[..end]).unwrap();
        let error = Reader::default().read(&path).unwrap_err();
        let words = "no MCAP file that can be read";
        assert!(error.to_string().contains(words), "{end}: {error}");
    }
}

const REQUIRED: &str = "[time]\ncolumn = 1\n[joint.position]\ncolumns = \"{leg}-{joint}\"\n\
     [joint.torque]\ncolumns = \"tau{1}\"\n[body.position]\ncolumns = \"p{axis}\"\n\
     [body.orientation]\ncolumns = [7, \"2..4\"]\norder = \"wxyz\"\n[feet]\ncolumns = \"f_{leg}\"\n";

#[test]
fn parse_faults_name_key_found_and_expected() {
    let message = |text: &str| ColumnMap::parse("m.toml", text).unwrap_err().to_string();
    assert_eq!(
        message(""),
        "m.toml: `joint.position`: found no such table, expected the columns of fr.hx Position"
    );
    let unknown = message(&format!("{REQUIRED}[foots]\n"));
    assert!(
        unknown.contains("foots") && unknown.starts_with("m.toml"),
        "{unknown}"
    );
    let release = message(&format!("{REQUIRED}release = 3.0\n"));
    assert!(release.contains("`feet.release`"), "{release}");
    let frame = message(&format!("{REQUIRED}frame = \"body\"\n"));
    assert!(frame.contains("`feet.frame`"), "{frame}");
    let step = message(&REQUIRED.replace("column = 1\n", "sample_time_s = 0.0\n"));
    assert!(step.contains("`time.sample_time_s`: found 0"), "{step}");
}

const COUNTED: &str = "[joint.position]\ncolumns = \"q{0}\"\n[joint.torque]\ncolumns = \"tau{0}\"\n\
     [body.position]\ncolumns = \"p{axis}\"\n[body.orientation]\ncolumns = \"angle{0}\"\n\
     [body.angular_velocity]\ncolumns = \"omega{0}\"\nframe = \"FRAME\"\n[feet]\ncolumns = \"f{0}\"\n";

/// Reads a log of a robot whose joints have this angle, and whose trunk these angles and angular velocities.
fn read_counted(
    clock: &str,
    frame: &str,
    times: &[f64],
    joint: impl Fn(f64) -> f64,
    trunk: impl Fn(f64) -> [Vector3<f64>; 2],
) -> Result<Recording, RecordingError> {
    let mut log = Log::default();
    log.add("time", times.to_vec());
    for i in 0..12 {
        log.add(format!("q{i}"), times.iter().map(|time| joint(*time)));
        log.add(format!("tau{i}"), times.iter().map(|time| joint(*time)));
    }
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        log.add(format!("p{axis}"), vec![0.0; times.len()]);
        log.add(
            format!("angle{i}"),
            times.iter().map(|time| trunk(*time)[0][i]),
        );
        log.add(
            format!("omega{i}"),
            times.iter().map(|time| trunk(*time)[1][i]),
        );
    }
    for foot in 0..4 {
        log.add(
            format!("f{foot}"),
            times.iter().map(|time| f64::from(*time < 0.02)),
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    log.write(&path, ",", true);
    let map = format!(
        "[time]\ncolumn = \"time\"\n{clock}{}",
        COUNTED.replace("FRAME", frame)
    );
    let map = ColumnMap::parse("map.toml", &map).unwrap();
    let reading = Reader::new(Some(map), Clocks::Recorded).read(&path)?;
    Ok(reading.recording)
}

#[test]
fn angular_velocities_agree_with_the_derivative_of_the_rotation() {
    let (rates, times) = (Vector3::new(0.7, -1.1, 0.4), [0.0, 0.01, 0.02]);
    for start in [
        [0.1, -0.2, 0.3],
        [-1.0, 1.2, -3.0],
        [0.0, -1.5, 2.0],
        [3.0, 0.4, 0.0],
    ] {
        let angles = |time: f64| Vector3::from(start) + rates * time;
        for frame in ["body", "world"] {
            let trunk = |time: f64| {
                let turn = |time: f64| rotation(angles(time).into());
                let derivative = (turn(time + 1e-6) - turn(time - 1e-6)) / 2e-6;
                let spin = match frame {
                    "body" => turn(time).transpose() * derivative,
                    _ => derivative * turn(time).transpose(),
                };
                [
                    angles(time),
                    Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]),
                ]
            };
            let found = read_counted("", frame, &times, |_| 0.1, trunk).unwrap();
            for rate in found.segments[0].dx.fixed_rows::<3>(15).column_iter() {
                assert!((rate - rates).amax() < 1e-7, "{frame} {start:?}: {rate}");
            }
        }
    }
    let upright = |_| {
        [
            Vector3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0),
            Vector3::zeros(),
        ]
    };
    let error = read_counted("", "body", &times, |_| 0.1, upright).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("row 2: found a pitch of 90 degrees"),
        "{error}"
    );
}

#[test]
fn resampled_motion_has_the_slopes_of_a_quartic_and_of_differences_where_steps_are_uneven() {
    let quartic = |t: f64| ((3.0 * t - 2.0) * t + 1.0) * t * t - t;
    let slope = |t: f64| ((12.0 * t - 6.0) * t + 2.0) * t - 1.0;
    let still = |_| [Vector3::zeros(), Vector3::zeros()];
    let smooth = vec![0.0, 0.011, 0.019, 0.032, 0.04, 0.049, 0.062];
    let bursts = vec![0.0, 0.001, 0.01, 0.011, 0.02, 0.021];
    let even: Vec<f64> = (0..9).map(|i| 0.003 * f64::from(i)).collect();
    let few = smooth[..3].to_vec();
    for (own, is_quartic) in [(smooth, true), (bursts, false), (few, false), (even, true)] {
        let values = DMatrix::from_fn(1, own.len(), |_, i| quartic(own[i]));
        let rough = recording::preprocess::differences(&own, &values);
        let slope = |i: usize| if is_quartic { slope(own[i]) } else { rough[i] };
        let found = read_counted("resample_s = 0.003\n", "body", &own, quartic, still).unwrap();
        let found = &found.segments[0];
        for (k, &time) in found.time_s.iter().enumerate() {
            let after = own
                .partition_point(|own| *own <= time)
                .clamp(1, own.len() - 1);
            let (a, b) = (values[after - 1], values[after]);
            let step = own[after] - own[after - 1];
            let share = (time - own[after - 1]) / step;
            let rest = 1.0 - share;
            let line = rest * a + share * b;
            let bend = (slope(after - 1) * step - (b - a)) * (share * rest * rest)
                + ((b - a) - slope(after) * step) * (share * share * rest);
            assert!(
                (found.x[(0, k)] - line - bend).abs() < 1e-13,
                "{own:?} at {time}"
            );
            assert!(
                (found.torque_nm[(0, k)] - line).abs() < 1e-13,
                "{own:?} at {time}"
            );
            let nearest = own[after - usize::from(share < 0.5)];
            assert_eq!(found.feet[k][0], nearest < 0.02, "{own:?} at {time}");
            let is_own = (own.iter()).position(|own| (own - time).abs() < 1e-9);
            assert!(
                is_own.is_none_or(|at| found.x[(0, k)] == values[at]),
                "{own:?} at {time}"
            );
        }
    }
}
