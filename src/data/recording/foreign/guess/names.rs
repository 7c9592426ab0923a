//! Interpretation of the name of a column: leg, joint, axis, quantity, unit. Tables have words of many loggers in lower
//! case.

use super::*;

/// Words for legs, in romc's order.
const LEGS: [&str; 4] = [
    "fr rf vr frontright rightfront foreright rightfore",
    "fl lf vl frontleft leftfront foreleft leftfore",
    "rr hr rh br rb rearright hindright backright rightrear righthind",
    "rl hl lh bl lb rearleft hindleft backleft leftrear lefthind",
];
/// Words for joints, in romc's order; a bare `hip` is the first, unless `y`, `pitch` or `flexion` also occurs.
const JOINTS: [&str; 3] = [
    "hx haa abad abduction hipx hipaa",
    "hy hfe thigh upper flexion hipy hipfe",
    "kn kfe calf knee lower shank",
];
const TORQUE: &str = "torque torques tau effort efforts trq moment tauest ctrl";
const ACCELERATION: &str = "acceleration acc accel ddq qdd ddot accelerometer";
const VELOCITY: &str = "velocity vel dq qd qdot dot speed rate rates twist v dp dx";
const ANGULAR_VELOCITY: &str = "gyro gyroscope omega w angvel";
const ANGULAR: &str = "angular rpy euler attitude orientation ang rot rotation";
const QUATERNION: &str = "quat quaternion orientation attitude rotation rot q";
const PLACE: &str = "position pos p com base body trunk torso pose odom";
const FEET: &str = "foot feet contact contacts grf touch stance toe fz";
const JOINT_ARRAYS: &str = "motor motors joint joints q dq ddq qd qdd qdot tau torque torques effort efforts position \
     velocity dof ctrl actuator angle angles theta";
/// Words of values that a controller asked for rather than measured.
const WANTED: &str = "des desired ref reference references cmd cmds command commands commanded target targets setpoint \
     setpoints goal raw lost temperature mode covariance ff kp kd";
const TIME: &str = "time timestamp stamp t sec secs seconds clock datetime date";

/// The interpretation of a column's name. A quaternion and angles are both orientations.
#[derive(Debug, Clone)]
pub(super) struct Reading {
    pub quantity: Quantity,
    pub element: usize, // romc's order, of a quaternion 0 is w; number of elements for the last of those counted from 1
    pub is_quaternion: bool,
    pub is_counted: bool,
    pub family: String,
    pub is_wanted: bool,
    pub is_bare_hip: bool,
}

/// Words of a name: lower case, apart at signs, capitals and digits; `FRHip` is `fr hip`.
fn words(name: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let (mut last, mut capitals) = (' ', 0);
    for c in name.chars() {
        if c.is_lowercase()
            && capitals > 2
            && let Some(initial) = out.last_mut().and_then(String::pop)
        {
            out.push(initial.to_string());
        }
        capitals = if c.is_uppercase() { capitals + 1 } else { 0 };
        let starts = !last.is_alphanumeric()
            || (last.is_lowercase() && c.is_uppercase())
            || (last.is_ascii_digit() != c.is_ascii_digit());
        if c.is_alphanumeric() {
            if starts || out.is_empty() {
                out.push(String::new());
            }
            out.last_mut().expect("a word").extend(c.to_lowercase());
        }
        last = c;
    }
    out
}

fn is_one(word: &str, of: &str) -> bool {
    of.split(' ').any(|known| known == word)
}

pub(super) fn is_quantity(word: &str) -> bool {
    let rates = [TORQUE, ACCELERATION, VELOCITY, ANGULAR_VELOCITY];
    let places = [ANGULAR, QUATERNION, PLACE, FEET, JOINT_ARRAYS];
    (rates.iter().chain(&places)).any(|known| is_one(word, known))
}

pub(super) fn is_wanted(name: &str) -> bool {
    words(name).iter().any(|word| is_one(word, WANTED))
}

pub(super) fn is_time(name: &str) -> bool {
    words(name).iter().any(|word| is_one(word, TIME))
}

/// The unit that a name carries, such as `q_deg`, `time (ms)`.
pub(super) fn unit(name: &str, units: &[&'static str]) -> Option<&'static str> {
    let (words, low) = (words(name), name.to_lowercase());
    // A single letter is rather an axis than a unit, unless in brackets.
    let is_told = |unit: &&&str| {
        low.contains(&format!("({unit})"))
            || low.contains(&format!("[{unit}]"))
            || (unit.len() > 1 && words.iter().skip(1).any(|word| word == **unit))
    };
    units.iter().find(is_told).copied()
}

type Meaning = (Quantity, usize, bool, bool); // quantity, element, whether of a quaternion, whether counted

pub(super) fn read(name: &str) -> Option<Reading> {
    let words = Name::of(name);
    let (quantity, element, is_quaternion, is_counted) = words.meaning()?;
    Some(Reading {
        quantity,
        element,
        is_quaternion,
        is_counted,
        family: words.family(),
        is_wanted: words.has(WANTED),
        is_bare_hip: words.joint() == Some(0) && words.has("hip") && !words.has("x roll aa"),
    })
}

struct Name(Vec<String>);

impl Name {
    fn of(name: &str) -> Self {
        let mut words = joined_pairs(words(name));
        words = words.iter().flat_map(|word| parts(word)).collect();
        if Self::number_of(&words).is_none() {
            // Phi, theta and psi, where they are not counted.
            let angle = |word: String| match &word[..] {
                "phi" => "roll".to_owned(),
                "theta" => "pitch".to_owned(),
                "psi" => "yaw".to_owned(),
                _ => word,
            };
            words = words.into_iter().map(angle).collect();
        }
        Self(words)
    }

    fn number_of(words: &[String]) -> Option<usize> {
        (words.iter().rev()).find_map(|word| word.parse().ok())
    }

    fn has(&self, known: &str) -> bool {
        self.0.iter().any(|word| is_one(word, known))
    }

    fn place(&self, table: &[&str]) -> Option<usize> {
        let of = |word: &String| table.iter().position(|known| is_one(word, known));
        self.0.iter().find_map(of)
    }

    fn after(&self, known: &str) -> Option<usize> {
        let pair = self.0.windows(2).find(|pair| is_one(&pair[0], known))?;
        pair[1].parse().ok()
    }

    fn axis(&self) -> Option<usize> {
        self.place(&["x roll", "y pitch", "z yaw"])
    }

    fn joint(&self) -> Option<usize> {
        match self.has("hip") {
            true => Some(usize::from(self.has("y pitch flexion fe"))),
            false => self.place(&JOINTS),
        }
    }

    fn family(&self) -> String {
        let names_element = |word: &String| {
            LEGS.iter().chain(&JOINTS).any(|known| is_one(word, known))
                || is_one(word, "x y z w roll pitch yaw hip")
                || word.parse::<usize>().is_ok()
        };
        let family = self.0.iter().filter(|word| !names_element(word));
        family.cloned().collect::<Vec<_>>().join(" ")
    }

    fn meaning(&self) -> Option<Meaning> {
        let has = |known| self.has(known);
        if has("covariance") {
            return None;
        }
        let (leg, joint) = (self.place(&LEGS), self.joint());
        let (axis, number) = (self.axis(), Self::number_of(&self.0));
        let kinds = [
            (TORQUE, Quantity::JointTorque),
            (ACCELERATION, Quantity::JointAcceleration),
            (VELOCITY, Quantity::JointVelocity),
        ];
        let kind = kinds.into_iter().find(|(known, _)| has(known));
        let kind = kind.map_or(Quantity::JointPosition, |(_, kind)| kind);
        if let (Some(number), [list, _]) = (number, &self.0[..])
            && let Some(found) = in_list(list, number)
        {
            return Some(found);
        }
        let is_force = has("force forces") || (has("f fn load pressure") && leg.is_some());
        if has(FEET) || (is_force && axis.is_none() && joint.is_none()) {
            let element = leg.or(number.filter(|n| *n <= 4))?;
            let is_moved = has("position pos velocity vel speed");
            let is_contact = has("contact contacts stance touch");
            let is_place = axis.map_or(is_moved && !is_contact, |axis| axis != 2 || is_moved);
            return (!is_place).then_some((Quantity::Feet, element, false, leg.is_none()));
        }
        if let Some(leg) = leg {
            let joint = joint.or(number.filter(|number| *number < 3))?;
            return Some((kind, 3 * leg + joint, false, false));
        }
        let counted = (self.after("leg"), self.after("joint motor"));
        if let (Some(leg @ 0..4), Some(joint @ 0..3)) = counted {
            return Some((kind, 3 * leg + joint, false, true));
        }
        let of_body = has("imu body base trunk com torso pose odom twist");
        let of_axes = has(QUATERNION) && !has("q") || has(ANGULAR) || has("gyro gyroscope omega");
        let in_array = axis.is_none() && !of_body && !of_axes && has(JOINT_ARRAYS);
        match number.filter(|number| in_array && *number <= 12) {
            Some(number) => Some((kind, number, false, true)),
            None => self.of_trunk(kind, [axis, number]),
        }
    }

    /// An element of a quantity of the trunk, whose names are those of a joint's quantity of this kind.
    fn of_trunk(&self, kind: Quantity, [axis, number]: [Option<usize>; 2]) -> Option<Meaning> {
        let has = |known| self.has(known);
        let by_angle = has("roll pitch yaw rpy euler");
        let counted = axis.is_none();
        let of_quaternion = |element| Some((Quantity::Orientation, element, true, counted));
        if has("w") && has(QUATERNION) && !by_angle {
            return Some((Quantity::Orientation, 0, true, false));
        }
        if has("quat quaternion") {
            let element = axis.map(|axis| axis + 1);
            return of_quaternion(element.or(number.filter(|number| *number < 4))?);
        }
        let element = axis.or(number.filter(|number| *number < 3))?;
        let angular = by_angle || has(ANGULAR) || has(ANGULAR_VELOCITY);
        let rate = has(ANGULAR_VELOCITY) || kind == Quantity::JointVelocity;
        let quantity = match (angular, kind) {
            (_, Quantity::JointTorque) => return None,
            (true, Quantity::JointAcceleration) => Quantity::AngularAcceleration,
            (false, Quantity::JointAcceleration) => Quantity::BodyAcceleration,
            (true, _) if rate => Quantity::AngularVelocity,
            // `Body angular Position x`; a bare `orientation.x` is one of a quaternion.
            (true, _) if by_angle || has("position pos angle angular") => Quantity::Orientation,
            (false, _) if rate => Quantity::BodyVelocity,
            (true, _) => return of_quaternion(element + 1),
            (false, _) if has("q") => return of_quaternion(element + 1),
            (false, _) if has(PLACE) || self.0.len() == 1 => Quantity::BodyPosition,
            (false, _) => return None,
        };
        Some((quantity, element, false, counted))
    }
}

/// An element of MuJoCo's lists of a floating robot: place, quaternion, joints; or of a list `c` of contacts.
fn in_list(list: &str, number: usize) -> Option<Meaning> {
    Some(match (list, number) {
        ("qpos", 0..3) => (Quantity::BodyPosition, number, false, false),
        ("qpos", 3..7) => (Quantity::Orientation, number - 3, true, false),
        ("qpos", 7..19) => (Quantity::JointPosition, number - 7, false, true),
        ("qvel", 0..3) => (Quantity::BodyVelocity, number, false, false),
        ("qvel", 3..6) => (Quantity::AngularVelocity, number - 3, false, false),
        ("qvel", 6..18) => (Quantity::JointVelocity, number - 6, false, true),
        ("c", 0..4) => (Quantity::Feet, number, false, true),
        _ => return None,
    })
}

/// Joins `front right`, `Co M`, `d Q` and the like to one word.
fn joined_pairs(mut words: Vec<String>) -> Vec<String> {
    let is_leg = |pair: &str| LEGS.iter().any(|names| is_one(pair, names));
    let mut i = 0;
    while i + 1 < words.len() {
        let pair = format!("{}{}", words[i], words[i + 1]);
        if (pair.len() > 3 && is_leg(&pair)) || is_one(&pair, "com dq ddq") {
            words[i] = pair;
            words.remove(i + 1);
        }
        i += 1;
    }
    words
}

/// Compact names and the word before their axis.
const COMPACT: [(&str, &str); 5] = [
    ("v vel dp", "velocity"),
    ("w omega gyro", "omega"),
    ("q quat", "quat"),
    ("p pos com", "pos"),
    ("a acc", "acc"),
];

/// Splits `vx`, `wz`, `qw`, `px`, `rollrate`.
fn parts(word: &str) -> Vec<String> {
    let pair = |one: &str, other: &str| vec![one.to_owned(), other.to_owned()];
    for angle in ["roll", "pitch", "yaw"] {
        let rate = word.strip_prefix(angle);
        let is_rate = rate.is_some_and(|rate| is_one(rate, "rate speed dot vel"));
        if is_rate || word.strip_prefix('d') == Some(angle) {
            return pair(angle, "rate");
        }
    }
    if let Some((what, axis)) = word.split_at_checked(word.len().saturating_sub(1))
        && (is_one(axis, "x y z") || (what == "q" && axis == "w"))
        && let Some((_, whole)) = COMPACT.iter().find(|(known, _)| is_one(what, known))
    {
        return pair(whole, axis);
    }
    vec![word.to_owned()]
}
