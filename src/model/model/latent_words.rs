//! Quantities and units of latent coordinates of a linear encoder over a robot's coordinates.

use super::*;

const BODY: [(&str, &str); 6] = [
    ("centre of mass forwards", "m"),
    ("centre of mass to the left", "m"),
    ("centre of mass upwards", "m"),
    ("rotation about the centre of mass, roll", "rad"),
    ("rotation about the centre of mass, pitch", "rad"),
    ("rotation about the centre of mass, yaw", "rad"),
];
const KINDS: [&str; LEG_JOINT_DIM] = ["abductions", "flexions", "knees"];
const TRUNK: [&str; 6] = ["body x", "body y", "body z", "roll", "pitch", "yaw"];
const PAIRS: [(&str, [Leg; 2]); 2] = [
    ("front", [Leg::FrontRight, Leg::FrontLeft]),
    ("rear", [Leg::RearRight, Leg::RearLeft]),
];
/// Least cosine between a row's flexions and knees and those that move feet, from which the row is named after the
/// position of these feet.
const LIKE_FEET: f64 = 0.95;
const MOST: f64 = 0.9; // share of the squared weights of a row that names it after two legs
const NONE: f64 = 1e-9;
const ROLL: usize = BODY_X + 3; // of the state; pitch and yaw follow

/// Quantity and unit of a latent coordinate; displayed as `centre of mass upwards, in 10 m`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LatentWords {
    pub quantity: String,
    /// `m`, or `in 10 m` for a scaled value that is 1 at 10 m; empty if one unit does not describe the coordinate.
    pub unit: String,
}

impl fmt::Display for LatentWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let comma = if self.unit.is_empty() { "" } else { ", " };
        write!(f, "{}{comma}{}", self.quantity, self.unit)
    }
}

impl ReducedModel {
    /// Quantity and unit of each latent coordinate; empty unless a linear encoder maps the coordinates of a known
    /// robot.
    pub fn latent_words(&self) -> Vec<LatentWords> {
        let (Ok(encoder), Ok(robot)) = (self.encoder(), self.robot()) else {
            return Vec::new();
        };
        let rest = self.decode(&DVector::zeros(self.latent_dim()));
        let (Ok(rest), Ok(factors)) = (rest, self.state_factors()) else {
            return Vec::new();
        };
        let factor = factors[0];
        if encoder.input_dim() != STATE_DIM || factors.iter().any(|other| *other != factor) {
            return Vec::new();
        }
        let rows = encoder.weights().row_iter();
        let words = rows.map(|row| words(&row.transpose(), &rest, robot).scaled(factor));
        words.collect()
    }

    /// The latent coordinates that describe the centre of mass, in the order of the body's coordinates in the state.
    pub fn mass_centre(&self) -> Vec<MassCentre> {
        let (words, Ok(factors)) = (self.latent_words(), self.state_factors()) else {
            return Vec::new();
        };
        let axes = BODY.iter().zip(BODY_X..);
        let found = axes.filter_map(|((name, _), axis)| {
            let latent = words.iter().position(|words| words.quantity == *name)?;
            let factor = factors[axis];
            Some(MassCentre {
                latent,
                axis,
                factor,
            })
        });
        found.collect()
    }
}

/// A latent coordinate that is a position of the centre of mass, or a rotation about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassCentre {
    /// Place in `z`.
    pub latent: usize,
    /// Row of the state with the body's position along the same axis, or rotation about it.
    pub axis: usize,
    /// `z` of 1 m or 1 rad.
    pub factor: f64,
}

/// Quantity of a coordinate, and the unit of its SI value if it has one.
struct Words(String, Option<&'static str>);

impl Words {
    fn scaled(self, factor: f64) -> LatentWords {
        let unit = self.1.map_or(String::new(), |unit| match factor {
            1.0 => unit.to_owned(),
            _ => format!("in {} {unit}", 1.0 / factor),
        });
        let quantity = self.0;
        LatentWords { quantity, unit }
    }
}

fn words(row: &DVector<f64>, rest: &DVector<f64>, robot: &Robot) -> Words {
    let is_in = |i: &usize| row[*i].abs() > NONE;
    let body: Vec<usize> = (BODY_X..STATE_DIM).filter(is_in).collect();
    let has_joints = (0..JOINT_DIM).any(|i| is_in(&i));
    let together = || {
        let (largest, is_joint) = largest(row);
        let others = match (has_joints, is_joint) {
            (true, true) => ", with other joints and the body",
            (true, false) => ", with joints and other coordinates of the body",
            (false, _) if body.len() > 1 => ", with other coordinates of the body",
            (false, _) => return Words(format!("{largest}, times a constant"), None),
        };
        Words(format!("mainly {largest}{others}"), None)
    };
    match (body.as_slice(), has_joints) {
        ([], _) => joints(row, rest, robot),
        ([one, ..], _) if (row[*one] - 1.0).abs() > NONE => together(),
        // A centre of mass away from the body's origin moves with the body's rotation.
        ([one, turns @ ..], true) if turns.is_empty() || (*one < ROLL && turns[0] >= ROLL) => {
            let (name, unit) = BODY[one - BODY_X];
            Words(name.to_owned(), Some(unit))
        }
        ([one], false) => {
            let unit = BODY[one - BODY_X].1;
            Words(TRUNK[one - BODY_X].to_owned(), Some(unit))
        }
        _ => together(),
    }
}

/// The coordinate with the largest weight, and whether it is a joint (then named for both front or both rear legs) or a
/// coordinate of the trunk.
fn largest(row: &DVector<f64>) -> (String, bool) {
    let joints = PAIRS.into_iter().flat_map(|(pair, legs)| {
        KINDS.into_iter().enumerate().map(move |(kind, name)| {
            let [one, other] = legs.map(|leg| row[LEG_JOINT_DIM * leg.index() + kind].abs());
            (one.max(other), format!("{pair} {name}"), true)
        })
    });
    let trunk = (BODY_X..STATE_DIM).zip(TRUNK);
    let trunk = trunk.map(|(i, name)| (row[i].abs(), name.to_owned(), false));
    // Of equal weights the first, so that the name does not depend on rounding.
    let found = joints
        .chain(trunk)
        .reduce(|best, other| match other.0 > best.0 + NONE {
            true => other,
            false => best,
        });
    let (_, name, is_joint) = found.expect("a robot has joints");
    (name, is_joint)
}

fn joints(row: &DVector<f64>, rest: &DVector<f64>, robot: &Robot) -> Words {
    let joint = |leg: Leg, kind: usize| LEG_JOINT_DIM * leg.index() + kind;
    let all: f64 = row.norm_squared();
    for (pair, legs) in PAIRS {
        let of_leg = |leg: Leg| row.rows(joint(leg, 0), LEG_JOINT_DIM).norm_squared();
        if legs.map(of_leg).iter().sum::<f64>() < MOST * all {
            continue;
        }
        let own = legs.map(|leg| [1, 2].map(|kind| row[joint(leg, kind)]));
        let own = DVector::from_vec(own.concat());
        for (axis, way) in [(0, "forwards"), (2, "upwards")] {
            let moved = legs.map(|leg| {
                let q = std::array::from_fn(|kind| rest[joint(leg, kind)]);
                let jacobian = robot.geometry(leg).foot_jacobian(&q);
                [1, 2].map(|kind| 0.5 * jacobian[(axis, kind)])
            });
            let moved = DVector::from_vec(moved.concat());
            if own.dot(&moved) > LIKE_FEET * own.norm() * moved.norm() {
                return Words(
                    format!("{pair} feet {way} from the centre of mass"),
                    Some("m"),
                );
            }
        }
        return Words(format!("joints of the {pair} legs"), Some("rad"));
    }
    let (largest, _) = largest(row);
    Words(format!("mainly {largest}, with other joints"), Some("rad"))
}
