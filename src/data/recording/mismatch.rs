//! Mismatches: contradictions between whole recordings and this robot. A recording of possible samples can still be of
//! another robot, in other units, or have legs, signs or columns exchanged. The robot's geometry reveals it: a foot on
//! the ground stays in place, the feet carry the weight, a body in flight falls. Metrics over a whole recording are
//! compared with the bounds of `docs/reference/recordings.md`.

mod feet;
mod stance;

use super::check::{Breach, outside};
use super::*;
use crate::robot_file;
pub use stance::Balance;
use stance::{Slip, best_other_place, best_other_reading, uncarried};
pub(crate) use stance::{falls_of, foot_slip_m};
pub(super) use stance::{foot_place, hip_torque, median_place, stances};

const SLIP_M: f64 = 0.025; // largest root mean square of the places of feet on the ground about their medians, m
const READING_FACTOR: f64 = 1.4; // times that feet have to stay better in place under another reading of the columns
const READING_LEAST_M: f64 = 3e-4; // by how much they have to stay better in place, m
const PLACE: (f64, f64) = (2.0, 0.004); // the same two with the body's place read otherwise, factor and m
const FALL_M_S2: (f64, f64) = (-16.0, -6.5); // vertical acceleration of the body in flight, m/s^2
const WEIGHT_SHARE: (f64, f64) = (0.45, 1.7); // force of the feet over the force for weight and acceleration
const UNCARRIED_S: f64 = 0.08; // longest time on the ground in which torques may carry less than a quarter of that, s
const HIP_SHARE: f64 = -0.3; // least share of hips' torques that hold the feet on their own side: 1 for vertical forces
const HIP_SHARE_OF_PAIR: f64 = -0.5; // the same where both legs of one end alone are below that
const ACCELERATION_M_S2: f64 = 2.0; // largest median difference of body acceleration and slope of velocity, m/s^2
const NOTHING_CARRIED: f64 = 0.02; // share of the weight below which torques carry nothing
const OTHER_SHARE: f64 = 2.0; // times more or less weight that the torques of a recording may carry than those of most
/// Logarithm of the share of the weight from which another robot may explain it, and up to which it does.
const OTHER_WEIGHT: (f64, f64) = (0.17, 0.1);
const OTHER_SLIP: f64 = 1.15; // times worse that feet may stay in place with a robot that explains the weight

const ORIGIN: (f64, f64) = (1.0, 0.5); // m from the origin and rad about the vertical at which a segment may begin

/// A property of a whole recording that is impossible for the robot, its value and the bound that it exceeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mismatch {
    #[serde(rename = "what")]
    pub kind: &'static str,
    pub value: f64,
    pub bound: f64,
    pub words: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

type Found = Option<Mismatch>; // a mismatch, if a figure breaks a bound

fn mismatch(kind: &'static str, breach: Breach, words: String) -> Found {
    let (value, bound) = breach?;
    Some(Mismatch {
        kind,
        value,
        bound,
        words,
    })
}

/// All properties of a recording that are impossible for the robot.
pub fn mismatches(recording: &Recording, robot: &Robot) -> Vec<Mismatch> {
    let slip = Slip::of(recording, robot);
    let balance = Balance::of(recording, robot);
    let (place, is_attitude) = place(recording, robot, &slip).unzip();
    let floor_m = feet::floor_m(recording, robot);
    // With another attitude the feet's heights do not identify their columns.
    let columns = match is_attitude {
        Some(true) => None,
        _ => feet::columns(recording, robot),
    };
    let found = [
        place.or_else(|| foot_slip(&slip)),
        legs_or_signs(recording, robot, &slip),
        columns,
        fall(&balance),
        weight(&balance, robot),
        carried(recording, robot),
        hip_torques(&balance),
        accelerations(&balance),
        other_robot(recording, robot, &slip, &balance),
        origin(recording),
        feet::floor(floor_m),
        feet::fallen(recording, floor_m),
        rates(recording),
    ];
    found.into_iter().flatten().collect()
}

/// The metrics that [`mismatches`] compares with its bounds; none if a recording has too few data for them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    foot_slip_m: Option<f64>, // root mean square of the places of feet on the ground about the medians of their stances
    relative_foot_slip_m: Option<f64>,
    other_reading_m: Option<f64>, // that for the best other order of the legs or sign of an angle
    #[serde(flatten)]
    balance: Balance,
}

impl Figures {
    /// Of a recording on a robot.
    pub fn of(recording: &Recording, robot: &Robot) -> Self {
        let slip = Slip::of(recording, robot);
        Self {
            foot_slip_m: slip.rms_m(),
            relative_foot_slip_m: slip.relative_rms_m(),
            other_reading_m: best_other_reading(recording, robot).map(|(rms_m, _)| rms_m),
            balance: Balance::of(recording, robot),
        }
    }
}

/// A contradiction of recordings with any robot, or with one robot: the index of the recording, and words.
pub(crate) fn contradiction(balances: &[Balance]) -> Option<(usize, String)> {
    let each = || balances.iter().enumerate();
    let shares = || each().filter_map(|(at, balance)| Some((at, balance.weight_share?)));
    if let Some((at, share)) = shares().find(|(_, share)| share.abs() < NOTHING_CARRIED) {
        let found = format!("its feet bear weight, and its torques carry {share:.3} of it");
        let words = format!("{found}: torques that were not recorded, or in other units");
        return Some((at, words));
    }
    // Velocities may be wrong while heights are right.
    let falls = each().find_map(|(at, balance)| {
        beyond(balance.fall_by_height_m_s2?, FALL_M_S2)?;
        Some((at, fall(balance)?.words))
    });
    if falls.is_some() {
        return falls;
    }
    // Of several recordings, those that differ from the median; all may have the same deviation, by units or a payload.
    let most = median(shares().map(|(_, share)| share));
    let (low, high) = (most / OTHER_SHARE, most * OTHER_SHARE);
    let (at, share) =
        shares().find(|(_, share)| !(low.min(high)..=low.max(high)).contains(share))?;
    let words = format!(
        "its torques carry {share:.2} of the robot's weight, and those of most of these recordings {most:.2}: signs, units \
         or order of the torques, or another robot"
    );
    Some((at, words))
}

/// Notes for people: the mismatches of a recording, and how many runs of samples are implausible.
pub fn notes(recording: &Recording, robot: &Robot) -> Vec<String> {
    let path = recording.path.display();
    let found = mismatches(recording, robot);
    let mut notes = Vec::from_iter(found.iter().map(|mismatch| format!("{path}: {mismatch}")));
    let findings = check(recording, robot);
    let mut faults = findings.iter().filter(|f| f.kind.can_be_left_out());
    if let Some(first) = faults.next() {
        let count = 1 + faults.count();
        let found = format!("{count} implausible runs of samples, such as {first}");
        notes.push(format!("{path}: {found}"));
    }
    notes
}

/// The training jumps of encoders and decoders begin at the origin and run along x.
fn origin(recording: &Recording) -> Found {
    let [x, y, yaw] = [0, 1, 5].map(|coordinate| {
        let starts = recording.segments.iter().map(|segment| segment.state(0));
        let starts = starts.map(|start| start[JOINT_DIM + coordinate].abs());
        starts.fold(0.0, f64::max)
    });
    let advice = "models expect jumps that begin near the origin and run along x";
    let far_m = x.max(y);
    let far = format!(
        "a segment begins {far_m:.2} m from the origin: {advice}; `origin = \"start\"` in a map of columns counts x \
         and y from the first sample"
    );
    let turned = format!("a segment begins turned by {yaw:.2} rad about the vertical: {advice}");
    let far = mismatch("origin", outside(far_m, 0.0, ORIGIN.0), far);
    far.or_else(|| mismatch("origin", outside(yaw, 0.0, ORIGIN.1), turned))
}

fn foot_slip(slip: &Slip) -> Found {
    let value = slip.rms_m()?;
    let words = format!(
        "feet on the ground move by {:.0} mm (root mean square; {:.0} mm are accepted): the joints, the body's \
         pose, their units or signs, or the contacts are not this robot's",
        1e3 * value,
        1e3 * SLIP_M
    );
    mismatch("foot_slip", beyond(value, (0.0, SLIP_M)), words)
}

/// The body's place or attitude read otherwise, and whether it is the attitude.
fn place(recording: &Recording, robot: &Robot, slip: &Slip) -> Option<(Mismatch, bool)> {
    let value = slip.rms_m().filter(|value| *value > PLACE.1)?; // the bound is at least this
    let (best, (reading, .., elements)) = best_other_place(recording, robot)?;
    let breach = outside(value, 0.0, PLACE.0 * best + PLACE.1);
    let [value_mm, best_mm] = [1e3 * value, 1e3 * best];
    let words = format!(
        "feet on the ground move by {value_mm:.1} mm, and by {best_mm:.1} mm {reading}: is the body's place in another \
         frame than its attitude?"
    );
    Some((mismatch("foot_slip", breach, words)?, elements.is_some()))
}

fn legs_or_signs(recording: &Recording, robot: &Robot, slip: &Slip) -> Found {
    let value = slip.relative_rms_m()?;
    let (best, reading) = best_other_reading(recording, robot)?;
    let breach = outside(value, 0.0, READING_FACTOR * best + READING_LEAST_M);
    let [value_mm, best_mm] = [1e3 * value, 1e3 * best];
    let words = format!(
        "feet on the ground move by {value_mm:.1} mm against each other, and by {best_mm:.1} mm {reading}: are legs or \
         signs exchanged?"
    );
    mismatch("legs_or_signs", breach, words)
}

fn fall(balance: &Balance) -> Found {
    let (value, (low, high)) = (balance.fall_m_s2?, FALL_M_S2);
    let words = format!(
        "in flight the body accelerates by {value:.2} m/s^2 upwards, expected {low} to {high}: another axis, sign or \
         unit, another time, or contacts that are not the feet's"
    );
    mismatch("fall", beyond(value, FALL_M_S2), words)
}

fn weight(balance: &Balance, robot: &Robot) -> Found {
    let (value, (low, high)) = (balance.weight_share?, WEIGHT_SHARE);
    let mass_kg = (1e6 * robot.mass_kg()).round() / 1e6;
    let words = format!(
        "the torques carry {value:.3} of the force that {mass_kg} kg need ({low} to {high} are accepted): torques in other \
         units, of other signs or other joints, or another robot"
    );
    mismatch("weight", beyond(value, WEIGHT_SHARE), words)
}

/// Times of the robot on the ground that its torques do not carry, as with additional position control of the joints.
fn carried(recording: &Recording, robot: &Robot) -> Found {
    let segments = recording.segments.iter();
    let times: Vec<_> = segments
        .flat_map(|segment| uncarried(segment, robot))
        .collect();
    let longest_s = times.iter().map(|time| time.end - time.start);
    let longest_s = longest_s.fold(0.0, f64::max);
    let long = times
        .iter()
        .filter(|time| time.end - time.start > UNCARRIED_S);
    let shown = long.map(|time| format!("{:.2} to {:.2} s", time.start, time.end));
    let words = format!(
        "on the ground the torques carry less than a quarter of the force that the motion needs ({}): a model with these \
         inputs cannot predict it there; were joints also controlled by position?",
        shown.take(4).collect::<Vec<_>>().join(", ")
    );
    mismatch("carried", outside(longest_s, 0.0, UNCARRIED_S), words)
}

fn hip_torques(balance: &Balance) -> Found {
    let shares = Leg::ALL.into_iter().zip(balance.hip_share);
    let known = shares.filter_map(|(leg, share)| Some((leg, share?)));
    let wrong: Vec<(Leg, f64)> = known.filter(|(_, share)| *share < HIP_SHARE).collect();
    let value = (wrong.iter().map(|(_, share)| *share)).min_by(f64::total_cmp)?;
    // Both legs of one end alone pull inwards, less than exchanged ones, where feet stick and positions are controlled.
    let is_of_end = |end: &[Leg]| wrong.iter().all(|(leg, _)| end.contains(leg));
    let is_pair = wrong.len() == 2 && Leg::ALL.chunks(2).any(is_of_end);
    if is_pair && wrong.iter().any(|(_, share)| *share > HIP_SHARE_OF_PAIR) {
        return None;
    }
    let names: Vec<&str> = wrong.iter().map(|(leg, _)| leg.short_name()).collect();
    let words = format!(
        "the hips' torques of {} hold the feet on the other side of the body: are left and right legs or the \
         torques' signs exchanged, or do feet stick and pull inwards?",
        names.join(", ")
    );
    mismatch("hip_torques", Some((value, HIP_SHARE)), words)
}

const MILLISECONDS: &str = "velocities per millisecond, or positions in millimetres";
const TURNS: &str = "positions in degrees and velocities in radians";
/// Factors of wrong velocities, with their causes: a unit with the expected one, or other words.
const FACTORS: [(f64, &str, &str); 6] = [
    (57.2958, "degrees where radians", "deg/s"),
    (0.017_453_3, TURNS, ""),
    (1000.0, "millimetres where metres", "mm/s"),
    (100.0, "centimetres where metres", "cm/s"),
    (0.001, MILLISECONDS, ""),
    (-1.0, "the other sign", ""),
];
const FACTOR_SHARE: f64 = 0.1; // distance from such a factor, as a share of it
/// First row of three groups of rates, the row behind them, and whose they are.
const RATES: [(usize, usize, &str); 3] = [
    (0, JOINT_DIM, "the joints"),
    (JOINT_DIM, JOINT_DIM + 3, "the body"),
    (JOINT_DIM + 3, STATE_DIM, "roll, pitch and yaw"),
];

fn rates(recording: &Recording) -> Found {
    RATES.into_iter().find_map(|(first, end, what)| {
        let (mut product, mut squares, mut own) = (0.0, 0.0, 0.0);
        for segment in &recording.segments {
            let rows = |matrix: &DMatrix<f64>| matrix.rows(first, end - first).into_owned();
            let (angles, rates) = (rows(&segment.x), rows(&segment.dx));
            let slopes = differences(&segment.time_s, &angles);
            product += slopes.dot(&rates);
            squares += slopes.norm_squared();
            own += rates.norm_squared();
        }
        let factor = product / squares;
        // Rates that do not follow the changes at all are another fault.
        let follows = product * product > 0.5 * squares * own;
        let known = |(known, ..): &&(f64, &str, &str)| (factor / known - 1.0).abs() < FACTOR_SHARE;
        let (known, why, unit) = FACTORS.iter().find(known).filter(|_| follows)?;
        let advice = match *unit {
            "" => String::new(),
            unit => format!(" are expected (`unit = \"{unit}\"` in a map of columns)"),
        };
        let words = format!(
            "velocities of {what} are {factor:.3} times the changes of their positions, about {known}: {why}{advice}?"
        );
        mismatch("rates", Some((factor, 1.0)), words)
    })
}

fn accelerations(balance: &Balance) -> Found {
    let (axis, value) = balance.acceleration_offset_m_s2?;
    let breach = outside(value, -ACCELERATION_M_S2, ACCELERATION_M_S2);
    let words = format!(
        "the body's acceleration along {axis} differs from the slope of its velocity by {value:.2} m/s^2 in the \
         median: gravity, or another unit?"
    );
    mismatch("accelerations", breach, words)
}

fn other_robot(recording: &Recording, robot: &Robot, slip: &Slip, balance: &Balance) -> Found {
    let share = balance.weight_share.filter(|share| *share > 0.0)?;
    let (own, own_slip) = (share.ln().abs(), slip.rms_m()?);
    if own <= OTHER_WEIGHT.0 {
        return None;
    }
    let others = robot_file::known_names().into_iter();
    let others = others.filter_map(|name| robot_file::by_name(name).ok());
    let explains = others.filter_map(|other| {
        let share = Balance::of(recording, other).weight_share?;
        let fits = share > 0.0 && share.ln().abs() < OTHER_WEIGHT.1;
        let as_well = Slip::of(recording, other).rms_m()? < OTHER_SLIP * own_slip;
        (fits && as_well && other.name != robot.name).then_some((share, other))
    });
    let off = |(share, _): &(f64, &Robot)| share.ln().abs();
    let (other_share, other) = explains.min_by(|one, two| off(one).total_cmp(&off(two)))?;
    let (name, other) = (robot.name, other.name);
    let words = format!(
        "the torques carry {share:.2} of the weight of a {name} and {other_share:.2} of that of a {other}, and feet on \
         the ground stay in place as well: is it a recording of a {other}?"
    );
    mismatch("other_robot", Some((share, OTHER_WEIGHT.0.exp())), words)
}

/// A value outside a range, and the bound that it exceeds; NaN counts as above the upper.
fn beyond(value: f64, (low, high): (f64, f64)) -> Breach {
    let of_nan = value.is_nan().then_some((value, high));
    outside(value, low, high).or(of_nan)
}

fn weight_n(mass_kg: f64) -> f64 {
    GRAVITY_M_S2 * mass_kg
}
