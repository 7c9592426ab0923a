//! What each latent coordinate of a linear encoder over a robot's coordinates is, in words and with its unit.

use nalgebra::DVector;

use crate::model::ReducedModel;
use crate::robot::{BODY_X, JOINT_DIM, LEG_JOINT_DIM, Leg, Robot, STATE_DIM};

const BODY: [(&str, &str); 6] = [
    ("centre of mass forwards", "m"),
    ("centre of mass to the left", "m"),
    ("centre of mass upwards", "m"),
    ("rotation about the centre of mass, roll", "rad"),
    ("rotation about the centre of mass, pitch", "rad"),
    ("rotation about the centre of mass, yaw", "rad"),
];
const TRUNK: [&str; 6] = ["body x", "body y", "body z", "roll", "pitch", "yaw"];
const PAIRS: [(&str, [Leg; 2]); 2] = [
    ("front", [Leg::FrontRight, Leg::FrontLeft]),
    ("rear", [Leg::RearRight, Leg::RearLeft]),
];
/// Cosine between a row's flexions and knees and those that move feet, from which on the row is the place of these feet.
const LIKE_FEET: f64 = 0.95;
const MOST: f64 = 0.9; // share of the squared weights of a row that names it after two legs
const NONE: f64 = 1e-9;

/// One text a coordinate, such as `centre of mass upwards, in 10 m`; none for other models.
pub(super) fn of(model: &ReducedModel) -> Option<Vec<String>> {
    let (encoder, robot) = (model.encoder().ok()?, model.robot().ok()?);
    if encoder.input_dim() != STATE_DIM {
        return None;
    }
    let rest = model.decode(&DVector::zeros(model.latent_dim())).ok()?;
    let factors = model.state_factors().ok()?;
    if factors.iter().any(|factor| *factor != factors[0]) {
        return None;
    }
    let rows = encoder.weights().row_iter();
    let words = rows.map(|row| words(&row.transpose(), &rest, robot).scaled(factors[0]));
    Some(words.collect())
}

/// What a coordinate is, and the unit of its SI value if it has one.
struct Words(String, Option<&'static str>);

impl Words {
    /// With the unit of the scaled value: what it is in SI units when it is 1.
    fn scaled(self, factor: f64) -> String {
        match self.1 {
            None => self.0,
            Some(unit) if factor == 1.0 => format!("{}, {unit}", self.0),
            Some(unit) => format!("{}, in {} {unit}", self.0, 1.0 / factor),
        }
    }
}

/// A line a coordinate, such as `  z2  centre of mass upwards, in 10 m`; empty for other models.
pub(super) fn lines(model: &ReducedModel) -> String {
    let words = of(model).unwrap_or_default().into_iter().zip(1..);
    words
        .map(|(words, number)| format!("  z{number}  {words}\n"))
        .collect()
}

fn words(row: &DVector<f64>, rest: &DVector<f64>, robot: &Robot) -> Words {
    let together = || Words("joints and body together".to_owned(), None);
    let is_in = |i: &usize| row[*i].abs() > NONE;
    let body: Vec<usize> = (BODY_X..STATE_DIM).filter(is_in).collect();
    let has_joints = (0..JOINT_DIM).any(|i| is_in(&i));
    match (body.as_slice(), has_joints) {
        ([], _) => joints(row, rest, robot),
        ([one], _) if (row[*one] - 1.0).abs() > NONE => together(),
        ([one], true) => {
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
    Words("joints of all legs".to_owned(), Some("rad"))
}
