//! The legs of a URDF tree.
//!
//! The trunk is the root link, or the child of its only joint if that floats. A limb begins at a
//! moving joint with fixed joints alone between it and the trunk. Feet are named, or found: of the
//! links that a limb's last joint carries, the one whose name says so, or the only one at the end.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};
use roxmltree::{Document, Node};

use super::entry::{Axis, JointEntry, LegEntry, RobotEntry};
use super::error::{RobotFileError, RobotFileFault};
use crate::files::{Located, Place};
use crate::robot::FOOT_DIM;
use crate::robot::joints::LEG_JOINT_DIM;

/// Components of axes and positions that are rounding of zero or one.
const ROUNDING: f64 = 1e-12;
/// Limits of a joint that turns without end, rad.
const ENDLESS_RAD: f64 = 2.0 * std::f64::consts::PI;

struct Joint<'x> {
    name: &'x str,
    kind: &'x str,
    parent: &'x str,
    child: &'x str,
    position: Vector3<f64>,
    turn: Rotation3<f64>,
    axis: Vector3<f64>,
    limit: Option<Node<'x, 'x>>,
}

impl Joint<'_> {
    fn moves(&self) -> bool {
        self.kind != "fixed"
    }
}

struct Tree<'x> {
    file: &'x str,
    joints: Vec<Joint<'x>>,
    /// Joints below a link.
    below: BTreeMap<&'x str, Vec<usize>>,
    /// The joint above a link.
    above: BTreeMap<&'x str, usize>,
}

/// A limb: its moving joints from the trunk, as far as they are a chain, and whether nothing else follows.
type Limb = (Vec<usize>, bool);

/// The entry of a URDF.
///
/// # Errors
/// [`RobotFileError`] with the element that is wrong or missing.
pub(super) fn entry(file: &str, text: &str, feet: &[String]) -> Result<RobotEntry, RobotFileError> {
    let document = Document::parse(text).map_err(|error| {
        let at = error.pos();
        let place = Place::Character(at.row as usize, at.col as usize);
        Located::new(file, place, RobotFileFault::Syntax(error.to_string()))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        let (place, found) = ("the root element", format!("<{}>", root.tag_name().name()));
        return Err(RobotFileError::at(file, place, found, "<robot>"));
    }
    let tree = Tree::new(file, root)?;
    let trunk = tree.trunk(root)?;
    let legs = match feet {
        [] => tree.found_legs(trunk)?,
        feet => tree.named_legs(trunk, feet)?,
    };
    let leg = (legs.iter()).map(|(joints, foot)| tree.leg(trunk, joints, foot));
    let leg = leg.collect::<Result<_, _>>()?;
    let mass = root.descendants().filter(|node| node.has_tag_name("mass"));
    let mass: Result<Vec<f64>, _> = mass
        .map(|node| {
            let value = number(file, node, "value", "a <mass>")?;
            let is_mass = value.is_finite() && value >= 0.0;
            is_mass.then_some(value).ok_or_else(|| {
                let of = (node.ancestors())
                    .find(|above| above.has_tag_name("link"))
                    .and_then(|link| link.attribute("name"))
                    .map_or("a <mass>".to_owned(), |name| {
                        format!("<mass> of the link {name:?}")
                    });
                RobotFileError::at(file, of, value.to_string(), "a mass of 0 kg or more")
            })
        })
        .collect();
    Ok(RobotEntry {
        name: root.attribute("name").unwrap_or("robot").to_owned(),
        mass_kg: mass?.iter().sum(),
        leg,
    })
}

fn child<'x>(node: Node<'x, 'x>, tag: &str) -> Option<Node<'x, 'x>> {
    node.children().find(|child| child.has_tag_name(tag))
}

fn number(file: &str, node: Node<'_, '_>, key: &str, of: &str) -> Result<f64, RobotFileError> {
    let text = node.attribute(key);
    let value: Option<f64> = text.and_then(|text| text.trim().parse().ok());
    value.ok_or_else(|| {
        let found = text.map_or("nothing".to_owned(), |text| format!("{text:?}"));
        RobotFileError::at(file, format!("{of}, {key}"), found, "a number")
    })
}

/// Three numbers of an attribute; none if it is not there.
fn triple(
    file: &str,
    node: Option<Node<'_, '_>>,
    key: &str,
    of: &str,
) -> Result<Option<Vector3<f64>>, RobotFileError> {
    let Some(text) = node.and_then(|node| node.attribute(key)) else {
        return Ok(None);
    };
    let numbers: Option<Vec<f64>> =
        (text.split_whitespace().map(|word| word.parse().ok())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Some(Vector3::new(x, y, z))),
        _ => {
            let (place, found) = (format!("{of}, {key}"), format!("{text:?}"));
            Err(RobotFileError::at(file, place, found, "three numbers"))
        }
    }
}

impl<'x> Tree<'x> {
    fn new(file: &'x str, root: Node<'x, 'x>) -> Result<Self, RobotFileError> {
        let mut tree = Self {
            file,
            joints: Vec::new(),
            below: BTreeMap::new(),
            above: BTreeMap::new(),
        };
        for node in root.children().filter(|node| node.has_tag_name("joint")) {
            let joint = tree.joint(node)?;
            let index = tree.joints.len();
            tree.below.entry(joint.parent).or_default().push(index);
            if tree.above.insert(joint.child, index).is_some() {
                let found = format!("link `{}` below two joints", joint.child);
                return Err(tree.refused(found, "one joint above each"));
            }
            tree.joints.push(joint);
        }
        Ok(tree)
    }

    /// Another tree than that of a quadruped.
    fn refused(&self, found: String, expected: &str) -> RobotFileError {
        RobotFileError::at(self.file, "the tree", found, expected)
    }

    fn joint(&self, node: Node<'x, 'x>) -> Result<Joint<'x>, RobotFileError> {
        let name = node.attribute("name").unwrap_or("");
        let of = format!("joint `{name}`");
        let link = |tag: &str| {
            let link = child(node, tag).and_then(|node| node.attribute("link"));
            link.ok_or_else(|| {
                let expected = format!("<{tag} link=...>");
                RobotFileError::at(self.file, of.as_str(), "nothing", expected)
            })
        };
        let origin = child(node, "origin");
        let turn = triple(self.file, origin, "rpy", &of)?.unwrap_or_default();
        let axis = triple(self.file, child(node, "axis"), "xyz", &of)?;
        Ok(Joint {
            name,
            kind: node.attribute("type").unwrap_or(""),
            parent: link("parent")?,
            child: link("child")?,
            position: triple(self.file, origin, "xyz", &of)?.unwrap_or_default(),
            turn: Rotation3::from_euler_angles(turn.x, turn.y, turn.z),
            axis: axis.unwrap_or_else(Vector3::x),
            limit: child(node, "limit"),
        })
    }

    /// The link whose frame is the body's.
    fn trunk(&self, root: Node<'x, 'x>) -> Result<&'x str, RobotFileError> {
        let links = root.children().filter(|node| node.has_tag_name("link"));
        let names: Vec<&str> = links.filter_map(|node| node.attribute("name")).collect();
        let is_root = |name: &&&str| !self.above.contains_key(**name);
        let roots: Vec<&&str> = names.iter().filter(is_root).collect();
        let [only] = roots[..] else {
            let found = format!("{} links without a joint above them", roots.len());
            return Err(self.refused(found, "one, the trunk"));
        };
        Ok(match self.below.get(only).map(Vec::as_slice) {
            Some(&[joint]) if matches!(self.joints[joint].kind, "floating" | "planar") => {
                self.joints[joint].child
            }
            _ => only,
        })
    }

    /// What fixed joints hold to a link: moving joints at it or at a link that they hold, and these links.
    fn held_by(&self, link: &str) -> (Vec<usize>, Vec<&'x str>) {
        let (mut moving, mut links) = (Vec::new(), Vec::new());
        for &joint in self.below.get(link).into_iter().flatten() {
            if self.joints[joint].moves() {
                moving.push(joint);
                continue;
            }
            let child = self.joints[joint].child;
            let (joints, further) = self.held_by(child);
            moving.extend(joints);
            links.push(child);
            links.extend(further);
        }
        (moving, links)
    }

    fn limb(&self, first: usize) -> Limb {
        let mut joints = vec![first];
        let mut next = self.held_by(self.joints[first].child).0;
        while let [only] = next[..] {
            joints.push(only);
            next = self.held_by(self.joints[only].child).0;
        }
        (joints, next.is_empty())
    }

    /// Moving joints and foot of each leg.
    fn found_legs(&self, trunk: &'x str) -> Result<Vec<(Vec<usize>, &'x str)>, RobotFileError> {
        let limbs = self.held_by(trunk).0.into_iter().map(|j| self.limb(j));
        let limbs: Vec<Limb> = limbs.collect();
        let is_leg = |(joints, is_chain): &&Limb| *is_chain && joints.len() == LEG_JOINT_DIM;
        let legs: Vec<&Limb> = limbs.iter().filter(is_leg).collect();
        if legs.len() != FOOT_DIM {
            let of = |(joints, is_chain): &Limb| {
                let more = if *is_chain { "" } else { " and branches" };
                let (name, count) = (self.joints[joints[0]].name, joints.len());
                format!("{name} ({count} joints{more})")
            };
            let texts: Vec<String> = limbs.iter().map(of).collect();
            let texts = match texts.is_empty() {
                true => String::new(),
                false => format!(": {}", texts.join(", ")),
            };
            let found = format!("{} limbs on `{trunk}`{texts}", limbs.len());
            let expected = "four legs of three joints each, the only robots that romc models; \
                            --feet (romc robot) names their feet where limbs have more joints";
            return Err(self.refused(found, expected));
        }
        let with_foot = |(joints, _): &Limb| Ok((joints.clone(), self.foot(joints)?));
        legs.into_iter().map(with_foot).collect()
    }

    fn foot(&self, joints: &[usize]) -> Result<&'x str, RobotFileError> {
        let last = &self.joints[joints[joints.len() - 1]];
        let (_, held) = self.held_by(last.child);
        let says_so = |link: &&&str| {
            let name = link.to_lowercase();
            name.contains("foot") || name.contains("toe")
        };
        let named: Vec<&&str> = held.iter().filter(says_so).collect();
        let is_end = |link: &&&str| !self.below.contains_key(**link);
        let ends: Vec<&&str> = held.iter().filter(is_end).collect();
        let is_same_place =
            |a: &str, b: &str| (self.along(a).0 - self.along(b).0).norm() < ROUNDING;
        match (&named[..], &ends[..]) {
            ([only], _) | ([], [only]) => Ok(only),
            ([first, rest @ ..], _) if rest.iter().all(|link| is_same_place(first, link)) => {
                Ok(first)
            }
            _ => {
                let found = match held.is_empty() {
                    true => "no link on a fixed joint".to_owned(),
                    false => held.join(", "),
                };
                let place = format!("link `{}` beyond joint `{}`", last.child, last.name);
                let expected = "one link at the foot, with foot or toe in its name, or --feet \
                                (romc robot) with the links of all four";
                Err(RobotFileError::at(self.file, place, found, expected))
            }
        }
    }

    /// Position and attitude of a link in the root's frame.
    fn along(&self, link: &str) -> (Vector3<f64>, Rotation3<f64>) {
        match self.above.get(link) {
            None => (Vector3::zeros(), Rotation3::identity()),
            Some(&joint) => {
                let joint = &self.joints[joint];
                let (position, turn) = self.along(joint.parent);
                (position + turn * joint.position, turn * joint.turn)
            }
        }
    }

    /// The legs that end in these links.
    fn named_legs(
        &self,
        trunk: &'x str,
        feet: &[String],
    ) -> Result<Vec<(Vec<usize>, &'x str)>, RobotFileError> {
        let leg = |foot: &String| {
            let Some((&foot, _)) = self.above.get_key_value(foot.as_str()) else {
                let (place, found) = (format!("link `{foot}`"), "no such link");
                return Err(RobotFileError::at(self.file, place, found, "a foot"));
            };
            let mut joints = Vec::new();
            let mut link = foot;
            while let Some(&joint) = self.above.get(link).filter(|_| link != trunk) {
                if self.joints[joint].moves() {
                    joints.push(joint);
                }
                link = self.joints[joint].parent;
            }
            joints.reverse();
            match joints.len() == LEG_JOINT_DIM {
                true => Ok((joints, foot)),
                false => {
                    let names: Vec<&str> = joints.iter().map(|&j| self.joints[j].name).collect();
                    let found = format!("{} joints ({})", names.len(), names.join(", "));
                    let place = format!("from `{trunk}` to `{foot}`");
                    Err(RobotFileError::at(self.file, place, found, "three"))
                }
            }
        };
        feet.iter().map(leg).collect()
    }

    fn leg(&self, trunk: &str, joints: &[usize], foot: &str) -> Result<LegEntry, RobotFileError> {
        let (origin, frame) = self.along(trunk);
        let seen = |link: &str| {
            let (position, turn) = self.along(link);
            let back = frame.inverse();
            (back * (position - origin), back * turn)
        };
        let mut entries = Vec::with_capacity(joints.len());
        let mut before = Vector3::zeros();
        for &joint in joints {
            let joint = &self.joints[joint];
            let (position, turn) = seen(joint.child);
            let axis = (turn * joint.axis).normalize();
            entries.push(self.entry(joint, rounded(position - before), rounded(axis))?);
            before = position;
        }
        Ok(LegEntry {
            joint: entries,
            foot: rounded(seen(foot).0 - before),
        })
    }

    fn entry(
        &self,
        joint: &Joint<'_>,
        at: [f64; 3],
        axis: [f64; 3],
    ) -> Result<JointEntry, RobotFileError> {
        let of = format!("joint `{}`", joint.name);
        let refused = |found: &str, expected: &str| {
            RobotFileError::at(self.file, of.as_str(), found, expected)
        };
        let is_endless = match joint.kind {
            "revolute" => false,
            "continuous" => true,
            kind => return Err(refused(&format!("type {kind:?}"), "revolute or continuous")),
        };
        let attributes = "<limit lower=... upper=... effort=... velocity=...>";
        let limit = (joint.limit).ok_or_else(|| refused("no <limit>", attributes))?;
        let value = |key: &str| number(self.file, limit, key, &format!("{of}, <limit>"));
        let limits = match is_endless {
            true => [-ENDLESS_RAD, ENDLESS_RAD],
            false => [value("lower")?, value("upper")?],
        };
        Ok(JointEntry {
            name: joint.name.to_owned(),
            at,
            axis: Axis::of(axis),
            sign: 1.0,
            offset_rad: 0.0,
            limits_rad: Some(limits),
            limits_deg: None,
            torque_nm: value("effort")?,
            speed_rad_s: value("velocity")?,
        })
    }
}

/// Without the rounding of right angles.
fn rounded(vector: Vector3<f64>) -> [f64; 3] {
    vector
        .map(|v| match v {
            _ if v.abs() < ROUNDING => 0.0,
            _ if (v.abs() - 1.0).abs() < ROUNDING => v.signum(),
            _ => v,
        })
        .into()
}
