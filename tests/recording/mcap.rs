//! MCAP logs as recorders write them: names in any order, damaged, cut, split, out of order, deeply compressed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{MessageStream, WriteOptions, Writer};
use romc::files::Overwrite;
use romc::recording::{self, Clocks, ColumnMap, Reader, Reading, RecordingError, Segment};
use romc::robot::JOINT_NAMES;

use super::foreign::{difference, gyro, jump, quaternion};
use super::tools::is_thorough;

/// The usual topic of joint states in ROS 2.
const JOINT_TOPIC: &str = "/joint_states";

/// A message of a topic with its time of recording.
#[derive(Clone)]
struct Message {
    topic: String,
    time_ns: u64,
    bytes: Vec<u8>,
}

/// The jump as messages, and the definitions of its topics.
struct Bag {
    messages: Vec<Message>,
    /// Encodings of definitions and messages.
    encodings: [&'static str; 2],
    schemas: BTreeMap<String, (String, Vec<u8>)>,
}

impl Bag {
    fn of(segment: &Segment) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("jump.mcap");
        recording::write_mcap(&path, segment, None, Overwrite::Replace).unwrap();
        let bytes = fs::read(&path).unwrap();
        let (mut messages, mut schemas) = (Vec::new(), BTreeMap::new());
        for message in MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let topic = message.channel.topic.clone();
            let schema = message.channel.schema.as_ref().unwrap();
            let schema = (schema.name.clone(), schema.data.to_vec());
            schemas.entry(topic.clone()).or_insert(schema);
            let (time_ns, bytes) = (message.log_time, message.data.to_vec());
            messages.push(Message {
                topic,
                time_ns,
                bytes,
            });
        }
        Self {
            messages,
            encodings: ["ros2msg", "cdr"],
            schemas,
        }
    }

    /// The messages in a file, in chunks of some 20 kB.
    fn write(&self, path: &Path, messages: &[Message]) {
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(Some(20_000));
        let mut writer = Writer::with_options(fs::File::create(path).unwrap(), options).unwrap();
        let mut channels = BTreeMap::new();
        for (topic, (name, text)) in &self.schemas {
            let schema = writer.add_schema(name, self.encodings[0], text).unwrap();
            let channel = writer
                .add_channel(schema, topic, self.encodings[1], &BTreeMap::new())
                .unwrap();
            channels.insert(topic.clone(), channel);
        }
        for message in messages {
            let header = MessageHeader {
                channel_id: channels[&message.topic],
                sequence: 0,
                log_time: message.time_ns,
                publish_time: message.time_ns,
            };
            writer
                .write_to_known_channel(&header, &message.bytes)
                .unwrap();
        }
        writer.finish().unwrap();
    }

    /// A file of these messages, plain.
    fn file(&self, folder: &Path, messages: &[Message]) -> PathBuf {
        let path = folder.join("log.mcap");
        self.write(&path, messages);
        path
    }
}

/// A message in CDR, little endian; or packed, as in ROS 1.
#[derive(Default)]
struct Cdr(Vec<u8>, bool);

impl Cdr {
    fn put(&mut self, align: usize, bytes: &[u8]) {
        let align = if self.1 { 1 } else { align };
        self.0.resize(self.0.len().next_multiple_of(align), 0);
        self.0.extend(bytes);
    }

    fn length(&mut self, length: usize) {
        self.put(4, &(length as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.length(text.len() + usize::from(!self.1));
        self.0.extend(text.as_bytes());
        self.0.extend((!self.1).then_some(0));
    }

    fn single(&mut self, value: f64) {
        self.put(4, &(value as f32).to_le_bytes());
    }

    fn message(self) -> Vec<u8> {
        match self.1 {
            true => self.0,
            false => [&[0, 1, 0, 0], &self.0[..]].concat(),
        }
    }
}

/// A joint state as in `sensor_msgs/JointState`.
fn joint_state(time_ns: u64, names: &[String], lists: [&[f64]; 3]) -> Vec<u8> {
    joint_state_in(Cdr::default(), time_ns, names, lists)
}

fn joint_state_in(mut out: Cdr, time_ns: u64, names: &[String], lists: [&[f64]; 3]) -> Vec<u8> {
    out.length((time_ns / 1_000_000_000) as usize);
    out.length((time_ns % 1_000_000_000) as usize);
    out.text("world");
    out.length(names.len());
    names.iter().for_each(|name| out.text(name));
    for list in lists {
        out.length(list.len());
        list.iter()
            .for_each(|value| out.put(8, &value.to_le_bytes()));
    }
    out.message()
}

const LOW_STATE: &str = "uint8 KIND=3 # a constant\nIMUState imu_state\nMotorState[20] motor_state\nint16[4] foot_force\nuint32 tick\n\
     ===\nMSG: unitree_go/IMUState\nfloat32[4] quaternion\nfloat32[3] gyroscope\nfloat32[3] accelerometer\n\
     float32[3] rpy\nint8 temperature\n===\nMSG: unitree_go/MotorState\nuint8 mode\nfloat32 q\nfloat32 dq\n\
     float32 ddq\nfloat32 tau_est\nfloat32 q_raw\nfloat32 dq_raw\nfloat32 ddq_raw\nint8 temperature\n\
     uint32 lost\nuint32[2] reserve\n";

/// The main parts of Unitree's low-level state, as in `unitree_go/LowState`.
fn low_state(s: &Segment, sample: usize) -> Vec<u8> {
    let mut out = Cdr::default();
    quaternion(s, sample)
        .iter()
        .for_each(|value| out.single(*value));
    gyro(s, sample).iter().for_each(|value| out.single(*value));
    [0.0, 0.0, 9.81].iter().for_each(|value| out.single(*value));
    (15..18).for_each(|row| out.single(s.x[(row, sample)]));
    out.put(1, &[40]);
    for motor in 0..20 {
        let of = |m: &nalgebra::DMatrix<f64>| if motor < 12 { m[(motor, sample)] } else { 0.0 };
        out.put(1, &[1]);
        for value in [
            of(&s.x),
            of(&s.dx),
            0.0,
            of(&s.torque_nm),
            of(&s.x),
            0.0,
            0.0,
        ] {
            out.single(value);
        }
        out.put(1, &[30]);
        (0..3).for_each(|_| out.length(0));
    }
    for foot in 0..4 {
        let down = s.feet[sample][foot];
        let force = 21
            + foot as i16
            + if down {
                60 + (sample % 7) as i16
            } else {
                (sample % 3) as i16
            };
        out.put(2, &force.to_le_bytes());
    }
    out.length(sample);
    out.message()
}

/// Whole numbers below a bound, the same in every run.
pub struct Dice(pub u64);

impl Dice {
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound
    }

    pub fn shuffled<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }
}

/// The messages with new joint states: `state` gets sample, names and values of the twelve joints.
fn with_joints(
    bag: &Bag,
    segment: &Segment,
    mut state: impl FnMut(usize, u64, Vec<(String, [f64; 3])>) -> Vec<Vec<u8>>,
) -> Vec<Message> {
    let (mut out, mut sample) = (Vec::new(), 0);
    for message in &bag.messages {
        if message.topic != JOINT_TOPIC {
            out.push(message.clone());
            continue;
        }
        let values =
            |i: usize| [&segment.x, &segment.dx, &segment.torque_nm].map(|m| m[(i, sample)]);
        let joints = JOINT_NAMES.iter().enumerate();
        let joints = joints
            .map(|(i, name)| ((*name).to_owned(), values(i)))
            .collect();
        for bytes in state(sample, message.time_ns, joints) {
            out.push(Message {
                bytes,
                ..message.clone()
            });
        }
        sample += 1;
    }
    out
}

fn encoded(time_ns: u64, joints: &[(String, [f64; 3])]) -> Vec<u8> {
    let names: Vec<String> = joints.iter().map(|(name, _)| name.clone()).collect();
    let list = |of: usize| -> Vec<f64> { joints.iter().map(|(_, values)| values[of]).collect() };
    joint_state(time_ns, &names, [&list(0), &list(1), &list(2)])
}

fn read(path: &Path) -> Result<Reading, RecordingError> {
    Reader::new(None, Clocks::Recorded).read(path)
}

fn refused(path: &Path) -> String {
    read(path)
        .map(|reading| reading.notes)
        .unwrap_err()
        .to_string()
}

/// Checks that a file gives the jump to the last bit of its messages; returns the notes of reading it.
fn is_the_jump(path: &Path, jump: &Segment) -> String {
    let reading = read(path).unwrap_or_else(|error| panic!("{error}"));
    let (state, velocity, contact) = difference(&reading.recording, jump);
    assert!(
        state < 1e-9 && velocity < 1e-9 && contact,
        "{state} {velocity} {contact}"
    );
    reading.notes.join("\n")
}

/// Names of joints as in other programs, by leg and joint in romc's order.
const STYLES: [([&str; 4], [&str; 3], &str); 5] = [
    (["fr", "fl", "rr", "rl"], ["hx", "hy", "kn"], "."),
    (
        ["FR", "FL", "RR", "RL"],
        ["hip_joint", "thigh_joint", "calf_joint"],
        "_",
    ),
    (["RF", "LF", "RH", "LH"], ["HAA", "HFE", "KFE"], "_"),
    (
        ["front_right", "front_left", "rear_right", "rear_left"],
        ["abduction", "hip", "knee"],
        "/",
    ),
    (["fr", "fl", "hr", "hl"], ["hx", "hy", "kn"], "."),
];

#[test]
fn joints_go_by_the_names_of_each_message() {
    let folder = tempfile::tempdir().unwrap();
    let whole = jump();
    let jump = whole.slice(220..280);
    let bag = Bag::of(&jump);
    let by_map = "[joint.position]\ntopic = \"/joint_states\"\ncolumns = \"position[{leg}.{joint}]\"\n\
         [joint.torque]\ntopic = \"/joint_states\"\ncolumns = \"effort[{leg}.{joint}]\"\n\
         [body.position]\ntopic = \"/odom\"\ncolumns = \"pose.pose.position.{axis}\"\n\
         [body.orientation]\ntopic = \"/odom\"\norder = \"xyzw\"\ncolumns = [\"pose.pose.orientation.x\", \
         \"pose.pose.orientation.y\", \"pose.pose.orientation.z\", \"pose.pose.orientation.w\"]\n\
         [feet]\ntopic = \"/foot_contacts\"\ncolumns = \"position[{leg}]\"\n";
    for seed in 0..if is_thorough() { 500 } else { 50 } {
        let mut dice = Dice(seed);
        let (legs, kinds, cut) = STYLES[dice.below(STYLES.len())];
        let is_own = legs[0] == "fr" && legs[2] == "rr";
        // Other joints of the robot belong to no leg.
        let wheels = dice.below(3);
        let messages = with_joints(&bag, &jump, |_, time_ns, mut joints| {
            for (i, (name, _)) in joints.iter_mut().enumerate() {
                *name = format!("{}{cut}{}", legs[i / 3], kinds[i % 3]);
            }
            joints.extend((0..wheels).map(|i| (format!("wheel_{i}"), [9.0; 3])));
            dice.shuffled(&mut joints);
            vec![encoded(time_ns, &joints)]
        });
        let path = bag.file(folder.path(), &messages);
        is_the_jump(&path, &jump);
        if is_own {
            let map = ColumnMap::parse("map.toml", by_map).unwrap();
            let found = Reader::new(Some(map), Clocks::Recorded)
                .read(&path)
                .unwrap();
            assert!(difference(&found.recording, &jump).0 < 1e-9, "{seed}");
        }
    }
}

#[test]
fn messages_of_ros_1_are_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump().slice(220..280);
    let mut bag = Bag::of(&jump);
    bag.encodings = ["ros1msg", "ros1"];
    let owned = |names: &[&str]| -> Vec<String> { names.iter().map(|&n| n.to_owned()).collect() };
    let (joints, feet) = (owned(&JOINT_NAMES), owned(&["fr", "fl", "rr", "rl"]));
    for (at, message) in bag.messages.iter_mut().enumerate() {
        let (time_ns, sample) = (message.time_ns, at / 3);
        let of = |m: &nalgebra::DMatrix<f64>| m.column(sample).as_slice()[..12].to_vec();
        let [q, dq, tau] = [&jump.x, &jump.dx, &jump.torque_nm].map(of);
        let down = jump.feet[sample].map(|down| f64::from(u8::from(down)));
        let mut packed = Cdr(Vec::new(), true);
        message.bytes = match at % 3 {
            0 => joint_state_in(packed, time_ns, &joints, [&q, &dq, &tau]),
            1 => {
                packed.length((time_ns / 1_000_000_000) as usize);
                packed.length((time_ns % 1_000_000_000) as usize);
                packed.text("world");
                packed.text("base");
                let numbers = 8 * (7 + 36 + 6 + 36);
                packed
                    .0
                    .extend(&message.bytes[message.bytes.len() - numbers..]);
                packed.message()
            }
            _ => joint_state_in(packed, time_ns, &feet, [&down, &[], &[]]),
        };
    }
    let path = bag.file(folder.path(), &bag.messages);
    is_the_jump(&path, &jump);
}

#[test]
fn messages_that_are_cut_or_of_unknown_kinds_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump().slice(220..240);
    let mut bag = Bag::of(&jump);
    let with = |bytes: &[u8]| {
        let mut messages = bag.messages.clone();
        messages[15].bytes = bytes.to_vec();
        refused(&bag.file(folder.path(), &messages))
    };
    let whole = bag.messages[15].bytes.clone();
    for end in (0..whole.len()).step_by(if is_thorough() { 1 } else { 7 }) {
        let error = with(&whole[..end]);
        assert!(
            error.contains("which end before its fields do"),
            "{end}: {error}"
        );
    }
    let error = with(&[&[0, 3], &whole[2..]].concat());
    assert!(error.contains("encoding `cdr 0x0 0x3`"), "{error}");
    for (text, words) in [
        ("Missing part\n", "definition: `a/Missing` is not defined"),
        (
            "float64\n",
            "definition: found `float64`, expected a type and a name",
        ),
    ] {
        let schema = ("a/B".to_owned(), text.into());
        bag.schemas.insert(JOINT_TOPIC.to_owned(), schema);
        let error = refused(&bag.file(folder.path(), &bag.messages));
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn joints_that_are_not_the_robots_are_refused_or_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump().slice(220..280);
    let bag = Bag::of(&jump);
    let arm = |joints: &[(String, [f64; 3])], name: &dyn Fn(usize) -> String| {
        let renamed = joints
            .iter()
            .enumerate()
            .map(|(i, (_, values))| (name(i), *values));
        renamed.collect::<Vec<_>>()
    };
    let names: [&dyn Fn(usize) -> String; 4] = [
        &|i| format!("arm_{}_joint_{}", i / 6, i % 6),
        &|i| format!("joint{i}"),
        &|i| i.to_string(),
        &|i| {
            [
                "shoulder_pan",
                "shoulder_lift",
                "elbow",
                "wrist_1",
                "wrist_2",
                "wrist_3",
            ][i % 6]
                .to_owned()
                + ["_left", "_right"][i / 6]
        },
    ];
    for name in names {
        let messages = with_joints(&bag, &jump, |_, time_ns, joints| {
            vec![encoded(time_ns, &arm(&joints, name))]
        });
        let error = refused(&bag.file(folder.path(), &messages));
        assert!(error.contains(&format!("position[{}]", name(0))), "{error}");
        assert!(
            error.contains("expected") && error.contains("--guess"),
            "{error}"
        );
    }
    // A second publisher on the same topic, also as the first of all messages.
    let messages = with_joints(&bag, &jump, |_, time_ns, joints| {
        let own = encoded(time_ns, &joints);
        vec![encoded(time_ns, &arm(&joints, names[0])), own]
    });
    let notes = is_the_jump(&bag.file(folder.path(), &messages), &jump);
    assert!(
        notes.contains("60 of 120 messages have other names"),
        "{notes}"
    );
    // Messages with additional joints, or without values that are not needed, are of the same robot.
    for further in [0, 20, 59] {
        let messages = with_joints(&bag, &jump, |sample, time_ns, mut joints| {
            if sample >= further {
                joints.insert(0, ("gripper".to_owned(), [9.0; 3]));
            }
            vec![encoded(time_ns, &joints)]
        });
        let notes = is_the_jump(&bag.file(folder.path(), &messages), &jump);
        assert!(
            !notes.contains("left out") && !notes.contains("out of order"),
            "{notes}"
        );
    }
    // Two topics with the same names and rate and other numbers.
    let mut two = Bag::of(&jump);
    let schema = two.schemas[JOINT_TOPIC].clone();
    two.schemas.insert("/a/joint_states".to_owned(), schema);
    let mut messages = with_joints(&two, &jump, |_, time_ns, joints| {
        let other = joints
            .iter()
            .map(|(name, values)| (name.clone(), values.map(|v| 1.01 * v)));
        let other: Vec<_> = other.collect();
        vec![encoded(time_ns, &joints), encoded(time_ns, &other)]
    });
    let states = messages.iter_mut();
    let states = states.filter(|message| message.topic == JOINT_TOPIC);
    states
        .skip(1)
        .step_by(2)
        .for_each(|message| message.topic = "/a/joint_states".to_owned());
    let error = refused(&two.file(folder.path(), &messages));
    assert!(
        error.contains("by their names also") && error.contains("joint_states` (500 Hz)"),
        "{error}"
    );
    // An arm with a topic of its own at the same rate or a higher one; commands of the same names.
    for (topic, names) in [
        ("/arm/joint_states", Some(names[0])),
        ("/joint_commands", None),
    ] {
        let mut bag = Bag::of(&jump);
        let schema = bag.schemas[JOINT_TOPIC].clone();
        bag.schemas.insert(topic.to_owned(), schema);
        let messages = with_joints(&bag, &jump, |_, time_ns, joints| {
            let other = match names {
                Some(names) => arm(&joints, names),
                None => joints
                    .iter()
                    .map(|(name, values)| (name.clone(), values.map(|v| 2.0 * v)))
                    .collect(),
            };
            vec![
                encoded(time_ns, &joints),
                encoded(time_ns, &other),
                encoded(time_ns + 1_000_000, &other),
            ]
        });
        let mut count = 0;
        let messages: Vec<Message> = messages
            .into_iter()
            .map(|mut message| {
                if message.topic == JOINT_TOPIC {
                    count += 1;
                    if count % 3 != 1 {
                        message.topic = topic.to_owned();
                        message.time_ns += if count % 3 == 0 { 1_000_000 } else { 0 };
                    }
                }
                message
            })
            .collect();
        is_the_jump(&bag.file(folder.path(), &messages), &jump);
    }
    // Lists that do not match the names.
    let messages = with_joints(&bag, &jump, |_, time_ns, joints| {
        let names: Vec<String> = joints.iter().map(|(name, _)| name.clone()).collect();
        vec![joint_state(time_ns, &names[1..], [&[0.0; 12], &[], &[]])]
    });
    let error = refused(&bag.file(folder.path(), &messages));
    assert!(
        error.contains("11 names and 12 values of `position`"),
        "{error}"
    );
    let messages = with_joints(&bag, &jump, |_, time_ns, mut joints| {
        joints[1].0 = joints[0].0.clone();
        vec![encoded(time_ns, &joints)]
    });
    let error = refused(&bag.file(folder.path(), &messages));
    assert!(error.contains("[fr.hx]` twice"), "{error}");
}

#[test]
fn changed_bytes_are_refused_with_chunk_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let bag = Bag::of(&jump());
    let path = bag.file(folder.path(), &bag.messages);
    let right = fs::read(&path).unwrap();
    let changed = |at: usize, by: u8| {
        let mut bytes = right.clone();
        bytes[at] ^= by;
        fs::write(&path, bytes).unwrap();
        refused(&path)
    };
    // The sign of a number in the second chunk.
    let error = changed(40_000, 0x80);
    assert!(
        error.contains("chunk 2 at byte") && error.contains("checksum"),
        "{error}"
    );
    // Outside of chunks: the index after the data.
    let error = changed(right.len() - 60, 1);
    assert!(error.contains("at byte"), "{error}");
}

/// A chunk checksum of zero means that it is absent.
#[test]
fn absent_checksums_are_not_compared() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let jump = jump();
    let bag = Bag::of(&jump);
    let options = WriteOptions::new()
        .compression(None)
        .calculate_chunk_crcs(false);
    let options = options
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false);
    let mut writer = Writer::with_options(fs::File::create(&path).unwrap(), options).unwrap();
    let mut channels = BTreeMap::new();
    for (topic, (name, text)) in &bag.schemas {
        let schema = writer.add_schema(name, "ros2msg", text).unwrap();
        let channel = writer
            .add_channel(schema, topic, "cdr", &BTreeMap::new())
            .unwrap();
        channels.insert(topic.clone(), channel);
    }
    for message in &bag.messages {
        let (channel_id, time) = (channels[&message.topic], message.time_ns);
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: time,
            publish_time: time,
        };
        writer
            .write_to_known_channel(&header, &message.bytes)
            .unwrap();
    }
    writer.finish().unwrap();
    is_the_jump(&path, &jump);
}

#[test]
fn messages_out_of_order_are_sorted_and_repeats_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    let bag = Bag::of(&jump);
    for seed in 0..10 {
        let mut dice = Dice(seed);
        let mut messages = bag.messages.clone();
        // Neighbours, blocks, everything.
        match seed % 3 {
            0 => messages.chunks_mut(12).for_each(|some| dice.shuffled(some)),
            1 => messages.rotate_left(700),
            _ => dice.shuffled(&mut messages),
        }
        let twice: Vec<Message> = (0..5)
            .map(|_| messages[dice.below(messages.len())].clone())
            .collect();
        messages.splice(100..100, twice);
        let notes = is_the_jump(&bag.file(folder.path(), &messages), &jump);
        assert!(
            notes.contains("were out of order and are sorted"),
            "{notes}"
        );
        assert!(
            notes.contains("were exact repeats and are left out"),
            "{notes}"
        );
    }
    let notes = is_the_jump(&bag.file(folder.path(), &bag.messages), &jump);
    assert!(
        !notes.contains("sorted") && !notes.contains("repeats"),
        "{notes}"
    );
}

#[test]
fn files_that_end_early_give_their_whole_chunks() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    let bag = Bag::of(&jump);
    let path = bag.file(folder.path(), &bag.messages);
    let right = fs::read(&path).unwrap();
    let mut dice = Dice(1);
    for _ in 0..20 {
        let cut = 45_000 + dice.below(right.len() - 46_000);
        for zeros in [0, 4096] {
            fs::write(&path, [&right[..cut], &vec![0; zeros]].concat()).unwrap();
            let result = read(&path);
            if zeros > 0 && result.is_err() {
                continue; // zeros that complete a record make it damaged
            }
            let reading = result.unwrap_or_else(|error| panic!("{cut}: {error}"));
            let notes = reading.notes.join("\n");
            assert!(
                notes.contains("the file ends early, after"),
                "{cut}: {notes}"
            );
            let found = &reading.recording.segments[0];
            let expected = jump.slice(0..found.len());
            assert!(
                found.len() > 30 && (&found.x - &expected.x).amax() < 1e-9,
                "{cut}"
            );
        }
    }
    for cut in [0, 7, 100, 20_000] {
        fs::write(&path, &right[..cut]).unwrap();
        let error = refused(&path);
        assert!(
            error.contains(&format!("it ends after {cut} bytes")),
            "{error}"
        );
    }
}

#[test]
fn folders_of_bags_are_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    let bag = Bag::of(&jump);
    let own = folder.path().join("bag");
    fs::create_dir(&own).unwrap();
    // Eleven parts: bag_10 is the last, not the third.
    let size = bag.messages.len().div_ceil(11);
    let mut list = String::new();
    for (part, messages) in bag.messages.chunks(size).enumerate() {
        let name = format!("bag_{part}.mcap");
        bag.write(&own.join(&name), messages);
        list += &format!("    - {name}\n");
    }
    is_the_jump(&own, &jump);
    let metadata = own.join("metadata.yaml");
    let text = format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n{list}  \
         duration:\n    nanoseconds: 1\n"
    );
    fs::write(&metadata, text).unwrap();
    is_the_jump(&own, &jump);
    let part = own.join("bag_3.mcap");
    fs::rename(&part, folder.path().join("elsewhere")).unwrap();
    let error = refused(&own);
    assert!(error.contains("bag_3.mcap: no such file"), "{error}");
    fs::remove_file(&metadata).unwrap();
    fs::rename(folder.path().join("elsewhere"), own.join("other.mcap")).unwrap();
    let error = refused(&own);
    assert!(
        error.contains("11 MCAP files without metadata.yaml"),
        "{error}"
    );
    fs::rename(own.join("other.mcap"), folder.path().join("elsewhere")).unwrap();
    let error = refused(&own);
    assert!(error.contains("bag_3.mcap: no such file"), "{error}");
    fs::rename(folder.path().join("elsewhere"), own.join("bag_3.mcap")).unwrap();
    // An empty last file after a loss of power, and one that is missing in the list.
    for bytes in [&[][..], &[0; 4096], b"\x89MC"] {
        fs::write(own.join("bag_11.mcap"), bytes).unwrap();
        let notes = is_the_jump(&own, &jump);
        assert!(notes.contains("bag_11.mcap: it ends after"), "{notes}");
    }
    fs::write(&metadata, format!("relative_file_paths:\n{list}")).unwrap();
    let notes = is_the_jump(&own, &jump);
    assert!(
        notes.contains("bag_11.mcap: not in metadata.yaml"),
        "{notes}"
    );
    // Bags of other kinds.
    for (name, bytes, words) in [
        ("bag_0.db3", &b"SQLite format 3\0..."[..], "mcap convert"),
        ("bag_0.mcap.zstd", b"\x28\xb5\x2f\xfd\0", "zstd -d"),
    ] {
        let own = folder.path().join(format!("of-{name}"));
        fs::create_dir(&own).unwrap();
        fs::write(own.join(name), bytes).unwrap();
        let error = refused(&own);
        assert!(error.contains(words) && error.contains(name), "{error}");
        let error = refused(&own.join(name));
        assert!(error.contains(words) && error.contains(name), "{error}");
    }
}

/// A zstd frame of this many zeros, in blocks that repeat one byte: 32 kB for 1 GiB.
fn zeros_in_zstd(count: usize) -> Vec<u8> {
    const BLOCK: usize = 1 << 17;
    let mut out = b"\x28\xb5\x2f\xfd\x00\x58".to_vec(); // a window of 2 MiB
    let blocks = count / BLOCK;
    for block in 0..blocks {
        let header = (BLOCK << 3) | 2 | usize::from(block + 1 == blocks);
        out.extend(&header.to_le_bytes()[..3]);
        out.push(0);
    }
    out
}

#[test]
fn small_files_that_unpack_to_gigabytes_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.mcap");
    let packed = zeros_in_zstd(1 << 30);
    for stated in [1_u64 << 30, 1 << 20, u64::MAX] {
        let mut bytes = b"\x89MCAP0\r\n".to_vec();
        for _ in 0..3 {
            let mut chunk = vec![0; 16];
            chunk.extend(stated.to_le_bytes());
            chunk.extend([0; 4]);
            chunk.extend(4_u32.to_le_bytes());
            chunk.extend(b"zstd");
            chunk.extend((packed.len() as u64).to_le_bytes());
            chunk.extend(&packed);
            bytes.push(6);
            bytes.extend((chunk.len() as u64).to_le_bytes());
            bytes.extend(chunk);
        }
        assert!(bytes.len() < 100_000);
        fs::write(&path, bytes).unwrap();
        let start = std::time::Instant::now();
        let error = refused(&path);
        assert!(error.contains("chunk 1 at byte 8"), "{error}");
        assert!(error.contains("expected at most"), "{error}");
        assert!(start.elapsed().as_secs() < 2, "{:?}", start.elapsed());
    }
    // The same for gzip: a text that unpacks to more than two hundred times its size.
    let path = folder.path().join("bomb.csv.gz");
    let line = format!("{}\n", "1".repeat(60_000));
    let best = flate2::Compression::best();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), best);
    for _ in 0..16 {
        std::io::Write::write_all(&mut gzip, line.as_bytes()).unwrap();
    }
    fs::write(&path, gzip.finish().unwrap().repeat(80)).unwrap();
    let map = ColumnMap::parse("map.toml", BARE).unwrap();
    let error = Reader::new(Some(map), Clocks::Recorded)
        .read(&path)
        .unwrap_err();
    let source = std::error::Error::source(&error).map(ToString::to_string);
    assert!(
        source.is_some_and(|text| text.contains("expected at most so many")),
        "{error}"
    );
}

/// A map of columns by number.
const BARE: &str = "[time]\nsample_time_s = 0.002\n[joint.position]\ncolumns = \"1..12\"\n[joint.torque]\n\
     columns = \"13..24\"\n[body.position]\ncolumns = \"25..27\"\n[body.orientation]\ncolumns = \"28..30\"\n\
     [feet]\ncolumns = \"31..34\"\n";

#[test]
fn logs_of_other_formats_are_named_with_the_line_that_converts_them() {
    let folder = tempfile::tempdir().unwrap();
    let npz = [
        &b"PK\x03\x04"[..],
        &[0; 22],
        &[5, 0, 0, 0],
        b"q.npy\x93NUMPY",
    ]
    .concat();
    let lfs = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n";
    for (name, bytes, words) in [
        ("log.npz", &npz[..], "NumPy arrays (.npz)"),
        (
            "log.mat",
            b"MATLAB 5.0 MAT-file, Platform: GLNXA64",
            "scipy.io.loadmat",
        ),
        (
            "log.mat",
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64",
            "mat73",
        ),
        ("log.h5", b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
        ("log.db3", b"SQLite format 3\0", "mcap convert"),
        ("log.bag", b"#ROSBAG V2.0\n", "mcap convert"),
        ("log.parquet", b"PAR1\x15", "pd.read_parquet"),
        ("log.pkl", b"\x80\x04\x95", "pickle"),
        ("log.csv", lfs, "git lfs pull --include"),
        ("log.csv.gz", lfs, "git lfs pull --include"),
        ("log.mcap", lfs, "git lfs pull --include"),
        ("log.csv", b"\xff\xfeT\0i\0", "iconv"),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        for reader in [
            Reader::default(),
            Reader::new(ColumnMap::parse("m", BARE).ok(), Clocks::Recorded),
        ] {
            let error = reader.read(&path).unwrap_err().to_string();
            assert!(
                error.contains(words) && error.contains("convert the file with"),
                "{name}: {error}"
            );
        }
        let robot = romc::robot_file::by_name("go1").unwrap();
        let error = romc::recording::guess(&path, robot)
            .unwrap_err()
            .to_string();
        assert!(error.contains(words), "{name}: {error}");
    }
    // An MCAP log with another file name is still recognised.
    let jump = jump();
    let path = folder.path().join("jump.bag");
    recording::write_mcap(&path, &jump, None, Overwrite::Replace).unwrap();
    is_the_jump(&path, &jump);
}

/// Go2s publish `/lf/lowstate` at a tenth of the rate of `/lowstate`.
#[test]
fn of_two_topics_the_faster_is_taken_and_the_other_named() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump();
    let mut bag = Bag::of(&jump);
    let low = ("unitree_go/msg/LowState".to_owned(), LOW_STATE.into());
    bag.schemas = [("/lf/lowstate", low.clone()), ("/lowstate", low)]
        .into_iter()
        .map(|(topic, schema)| (topic.to_owned(), schema))
        .chain(
            bag.schemas
                .into_iter()
                .filter(|(topic, _)| topic == "/odom"),
        )
        .collect();
    let odometry = bag
        .messages
        .iter()
        .filter(|message| message.topic == "/odom");
    let mut messages = Vec::new();
    for (sample, odometry) in odometry.enumerate() {
        let state = |topic: &str| Message {
            topic: topic.to_owned(),
            time_ns: odometry.time_ns,
            bytes: low_state(&jump, sample),
        };
        messages.extend((sample % 10 == 0).then(|| state("/lf/lowstate")));
        messages.push(state("/lowstate"));
        messages.push(odometry.clone());
    }
    let reading =
        read(&bag.file(folder.path(), &messages)).unwrap_or_else(|error| panic!("{error}"));
    let (state, velocity, contact) = difference(&reading.recording, &jump);
    assert!(
        state < 1e-5 && velocity < 1e-4 && contact,
        "{state} {velocity} {contact}"
    );
    let notes = reading.notes.join("\n");
    assert!(notes.contains("`/lf/lowstate` (50 Hz)"), "{notes}");
}

#[test]
fn whole_numbers_of_messages_have_their_signs() {
    let folder = tempfile::tempdir().unwrap();
    let jump = jump().slice(220..400);
    let mut bag = Bag::of(&jump);
    let definition = b"bool fr\nint8 fl\nint64 rr\nint16 rl\n".to_vec();
    bag.schemas.insert(
        "/foot_contacts".to_owned(),
        ("a/Feet".to_owned(), definition),
    );
    let contacts = bag
        .messages
        .iter_mut()
        .filter(|message| message.topic == "/foot_contacts");
    for (message, feet) in contacts.zip(&jump.feet) {
        let sign = feet.map(|down| if down { 1 } else { -1 });
        let mut out = Cdr::default();
        out.put(1, &[u8::from(feet[0]), (sign[1] as i8).to_le_bytes()[0]]);
        out.put(8, &(9 * i64::from(sign[2])).to_le_bytes());
        out.put(2, &(300 * sign[3] as i16).to_le_bytes());
        message.bytes = out.message();
    }
    let path = bag.file(folder.path(), &bag.messages);
    let map = "[joint.position]\ntopic = \"/joint_states\"\ncolumns = \"position[{leg}.{joint}]\"\n\
         [joint.torque]\ntopic = \"/joint_states\"\ncolumns = \"effort[{leg}.{joint}]\"\n\
         [body.position]\ntopic = \"/odom\"\ncolumns = \"pose.pose.position.{axis}\"\n\
         [body.orientation]\ntopic = \"/odom\"\norder = \"xyzw\"\ncolumns = [\"pose.pose.orientation.x\", \
         \"pose.pose.orientation.y\", \"pose.pose.orientation.z\", \"pose.pose.orientation.w\"]\n\
         [feet]\ntopic = \"/foot_contacts\"\ncolumns = \"{leg}\"\nthreshold = LEVEL\n";
    // Below the smallest positive number, and between negative numbers of one byte and of more.
    for (level, expected) in [
        ("0.5", jump.feet.clone()),
        (
            "-5.0",
            (jump.feet.iter())
                .map(|feet| [true, true, feet[2], feet[3]])
                .collect(),
        ),
        (
            "-100.0",
            (jump.feet.iter())
                .map(|feet| [true, true, true, feet[3]])
                .collect(),
        ),
    ] {
        let map = ColumnMap::parse("map.toml", &map.replace("LEVEL", level)).unwrap();
        let found = Reader::new(Some(map), Clocks::Recorded)
            .read(&path)
            .unwrap();
        assert_eq!(found.recording.segments[0].feet, expected, "{level}");
    }
}
