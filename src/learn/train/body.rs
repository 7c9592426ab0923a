//! Coordinates of the body whose momentum is a row of the encoder.

use super::*;

pub(super) const Y: usize = BODY_X + 1;
pub(super) const ROLL: usize = JOINT_DIM + 3;
pub(super) const PITCH: usize = JOINT_DIM + 4;
/// In the order of their rows: those in the plane of a symmetric motion, then those that change sign in a mirror image.
const NAMED: [(&str, usize); 6] = [
    ("x", BODY_X),
    ("z", BODY_Z),
    ("pitch", PITCH),
    ("y", Y),
    ("roll", ROLL),
    ("yaw", YAW),
];
const IN_PLANE: usize = 3;
const ALL: &str = "all";

/// The body coordinates with a momentum row: `x` and `z` always, of the others any. Without its own row a coordinate is
/// left to the rows that are learned, as far as these contain it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BodyRows {
    pub(super) coordinates: Vec<usize>, // indices of the state, in the order of `NAMED`
}

impl BodyRows {
    /// The default: with one latent coordinate none, from two on the centre of mass forwards and upwards, from five on
    /// also the rotation about it in the plane. With fewer, torques of the legs are lost when the rotation is a row.
    pub(super) fn of_dim(latent_dim: usize) -> Self {
        let count = match latent_dim {
            0 | 1 => 0,
            2..=4 => 2,
            _ => IN_PLANE,
        };
        Self {
            coordinates: NAMED[..count].iter().map(|(_, of)| *of).collect(),
        }
    }

    /// All six.
    pub fn all() -> Self {
        let coordinates = NAMED.iter().map(|(_, of)| *of).collect();
        Self { coordinates }
    }

    /// Whether a model of this many latent coordinates has room for these rows.
    pub fn fits(&self, latent_dim: usize) -> bool {
        self.coordinates.len() <= latent_dim
    }

    /// Whether a row changes sign in a mirror image: there is more than the motion in the plane.
    pub(super) fn is_spatial(&self) -> bool {
        self.coordinates.iter().copied().any(is_lateral)
    }
}

/// Whether a body coordinate, and the force or moment along it, changes sign in a mirror image.
pub(super) fn is_lateral(coordinate: usize) -> bool {
    NAMED[IN_PLANE..].iter().any(|(_, of)| *of == coordinate)
}

impl FromStr for BodyRows {
    type Err = String;

    /// `all`, or names separated by commas in any order, with `x` and `z` among them.
    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || {
            format!(
                "found `{text}`, expected `all` or a list with x and z such as x,z,pitch of x, y, z, roll, pitch and yaw"
            )
        };
        let is_named = |name: &&str| NAMED.iter().any(|(known, _)| known == name);
        let names: Vec<&str> = match text {
            ALL => NAMED.iter().map(|(name, _)| *name).collect(),
            list => list.split(',').map(str::trim).collect(),
        };
        let chosen = NAMED.iter().filter(|(name, _)| names.contains(name));
        let coordinates: Vec<usize> = chosen.map(|(_, of)| *of).collect();
        let has_centre = coordinates.starts_with(&[BODY_X, BODY_Z]);
        match names.iter().all(is_named) && coordinates.len() == names.len() && has_centre {
            true => Ok(Self { coordinates }),
            false => Err(refused()),
        }
    }
}

impl fmt::Display for BodyRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = NAMED.iter().filter(|(_, of)| self.coordinates.contains(of));
        let names: Vec<&str> = names.map(|(name, _)| *name).collect();
        match self.coordinates.len() == NAMED.len() {
            true => f.write_str(ALL),
            false => f.write_str(&names.join(",")),
        }
    }
}

impl TryFrom<String> for BodyRows {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<BodyRows> for String {
    fn from(rows: BodyRows) -> String {
        rows.to_string()
    }
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_body.rs"]
mod tests;
