//! A recording as an MCAP file of ROS 2 messages, which robots' own tools open and romc reads back.

use std::io::{Seek, Write};

use ::mcap::records::MessageHeader;
use ::mcap::{WriteOptions, Writer};
use nalgebra::{UnitQuaternion, Vector3};

use super::*;

const JOINT_STATE: &str = "std_msgs/Header header\n
string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";
const ODOMETRY: &str = "std_msgs/Header header\nstring child_frame_id\n\
geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n";
/// Parts of messages: the name, then the fields.
const HEADER: [&str; 2] = [
    "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
];
const GEOMETRY: [&str; 7] = [
    "geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance",
    "geometry_msgs/Pose\nPoint position\nQuaternion orientation",
    "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance",
    "geometry_msgs/Twist\nVector3 linear\nVector3 angular",
    "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
];

fn definition(own: &str, parts: &[&str]) -> String {
    let part = |part: &&str| format!("{:=<80}\nMSG: {part}\n", "");
    own.to_owned() + &parts.iter().map(part).collect::<String>()
}

/// Topic of joint angles, velocities and torques.
pub(crate) const JOINT_TOPIC: &str = "/joint_states";
const BODY_TOPIC: &str = "/odom"; // pose of the trunk in the world, its velocities in its own axes
const FEET_TOPIC: &str = "/foot_contacts"; // contact, 1 or 0 for each foot
const INPUT_TOPIC: &str = "/inputs"; // inputs of a model

/// Writes a segment and, if given, its inputs (18 x samples) as messages; chunks are not packed.
pub(crate) fn write_mcap(
    destination: impl Write + Seek,
    segment: &Segment,
    inputs: Option<&DMatrix<f64>>,
) -> Result<(), ::mcap::McapError> {
    const LIBRARY: &str = concat!("romc ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().compression(None).profile("ros2");
    let options = options.library(LIBRARY);
    let mut writer = Writer::with_options(destination, options)?;
    let joint_text = definition(JOINT_STATE, &HEADER);
    let body_text = definition(ODOMETRY, &[&GEOMETRY[..], &HEADER].concat());
    let mut schema = |name, text: String| writer.add_schema(name, "ros2msg", text.as_bytes());
    let joint = schema("sensor_msgs/msg/JointState", joint_text)?;
    let body = schema("nav_msgs/msg/Odometry", body_text)?;
    let mut topic = |schema, topic| writer.add_channel(schema, topic, "cdr", &BTreeMap::new());
    let (joints, odom) = (topic(joint, JOINT_TOPIC)?, topic(body, BODY_TOPIC)?);
    let contacts = topic(joint, FEET_TOPIC)?;
    let with_topic = |inputs| Ok::<_, ::mcap::McapError>((topic(joint, INPUT_TOPIC)?, inputs));
    let inputs = inputs.map(with_topic).transpose()?;
    let names = JOINT_NAMES.map(str::to_owned);
    let feet = Leg::ALL.map(|leg| leg.to_string());
    let input_names = Robot::input_names();
    for sample in 0..segment.len() {
        let time_ns = (1e9 * segment.time_s[sample]).round() as i64;
        let stamped = || Message::stamped(time_ns);
        let rows = |m: &DMatrix<f64>| m.column(sample).as_slice()[..JOINT_DIM].to_vec();
        let [q, dq, tau] = [&segment.x, &segment.dx, &segment.torque_nm].map(rows);
        let contact = segment.feet[sample].map(|down| f64::from(u8::from(down)));
        let mut messages = vec![
            (joints, stamped().joint_state(&names, [&q, &dq, &tau])),
            (odom, odometry(segment, sample, time_ns)),
            (contacts, stamped().joint_state(&feet, [&contact, &[], &[]])),
        ];
        if let Some((channel, inputs)) = inputs {
            let values = inputs.column(sample);
            let message = stamped().joint_state(&input_names, [&[], &[], values.as_slice()]);
            messages.push((channel, message));
        }
        for (channel_id, message) in messages {
            let log_time = u64::try_from(time_ns).unwrap_or(0);
            let header = MessageHeader {
                channel_id,
                sequence: sample as u32,
                log_time,
                publish_time: log_time,
            };
            writer.write_to_known_channel(&header, &message.0)?;
        }
    }
    writer.finish()?;
    Ok(())
}

fn odometry(segment: &Segment, sample: usize, time_ns: i64) -> Message {
    const BODY: usize = JOINT_DIM;
    let of = |m: &DMatrix<f64>, first: usize| -> Vector3<f64> {
        m.fixed_view::<3, 1>(first, sample).into_owned()
    };
    let angles = of(&segment.x, BODY + 3);
    let turn = rotation(angles.into());
    let about = |axis: usize| UnitQuaternion::from_scaled_axis(Vector3::ith(axis, angles[axis]));
    let q = about(2) * about(1) * about(0);
    let velocity = turn.transpose() * of(&segment.dx, BODY);
    let rates = of(&segment.dx, BODY + 3);
    let [(s_r, c_r), (s_p, c_p)] = [angles[0].sin_cos(), angles[1].sin_cos()];
    let angular = [
        rates[0] - s_p * rates[2],
        c_r * rates[1] + s_r * c_p * rates[2],
        -s_r * rates[1] + c_r * c_p * rates[2],
    ];
    let mut message = Message::stamped(time_ns);
    message.text("base");
    let (place, attitude) = (of(&segment.x, BODY), [q.i, q.j, q.k, q.w]);
    let pose = [place.as_slice(), &attitude, &[0.0; 36]];
    let twist = [velocity.as_slice(), &angular, &[0.0; 36]];
    (pose.iter().chain(&twist)).for_each(|values| message.numbers(values));
    message
}

struct Message(Vec<u8>); // bytes in CDR behind its header

impl Message {
    fn stamped(time_ns: i64) -> Self {
        let mut message = Self(vec![0, 1, 0, 0]);
        let seconds = time_ns.div_euclid(1_000_000_000) as i32;
        message.put(4, &seconds.to_le_bytes());
        let nanoseconds = time_ns.rem_euclid(1_000_000_000) as u32;
        message.put(4, &nanoseconds.to_le_bytes());
        message.text("world");
        message
    }

    fn joint_state(mut self, names: &[String], lists: [&[f64]; 3]) -> Self {
        self.length(names.len());
        names.iter().for_each(|name| self.text(name));
        for values in lists {
            self.length(values.len());
            self.numbers(values);
        }
        self
    }

    fn length(&mut self, length: usize) {
        self.put(4, &(length as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn numbers(&mut self, values: &[f64]) {
        (values.iter()).for_each(|value| self.put(8, &value.to_le_bytes()));
    }

    fn put(&mut self, align: usize, bytes: &[u8]) {
        let body = self.0.len() - 4;
        self.0.resize(4 + body.next_multiple_of(align), 0);
        self.0.extend(bytes);
    }
}
