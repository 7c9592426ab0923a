//! The legs of a URDF.
//!
//! `element` reads elements and attributes, `tree` links and joints, `limbs` finds trunk, legs and feet: a limb begins
//! at a moving joint with fixed joints alone between it and the body. The body's frame is that of the trunk, the heaviest
//! of the links that all four legs are below, wherever the root is.

mod element;
mod limbs;
mod tree;

use nalgebra::{Rotation3, Vector3};

use super::entry::{Axis, JointEntry, LegEntry, RobotEntry};
use super::identity::{RobotReading, identified};
use super::legs::{LegPlaces, Places};
use super::read::{RobotFileError, RobotOptions};
use element::{Element, document};
use limbs::{Legs, Limb};
use tree::{Joint, Tree};

/// Components of axes and positions that are rounding of zero or one.
const ROUNDING: f64 = 1e-12;
/// Limits of a joint that turns without end, rad.
const ENDLESS_RAD: f64 = 2.0 * std::f64::consts::PI;
const AXIS: std::ops::Range<f64> = 1e-6..1e6;

pub(super) fn read(
    file: &str,
    text: &str,
    options: &RobotOptions<'_>,
) -> Result<RobotReading, RobotFileError> {
    let feet = limbs::feet(options.feet)?;
    let document = document(file, text)?;
    let robot = Element::root(file, &document);
    if robot.tag() != "robot" {
        let (place, found) = ("the root element", format!("<{}>", robot.tag()));
        return Err(RobotFileError::at(file, place, found, "<robot>"));
    }
    let tree = Tree::new(robot)?;
    let legs = Legs::find(&tree, &feet)?;
    let leg = legs.legs.iter().map(|leg| entry(&tree, legs.trunk, leg));
    let leg = leg.collect::<Result<_, _>>()?;
    let name = match options.name.or_else(|| robot.attribute("name")) {
        Some(name) => name.to_owned(),
        None => return Err(robot.fault("", "no name", "name=\"...\", or --name (romc robot)")),
    };
    let notes = notes(&tree, &legs)?;
    let entry = RobotEntry {
        name,
        mass_kg: tree.mass_below(legs.top),
        leg,
    };
    let places = places(robot, &tree, &legs);
    identified(file, entry, &places, options.name, notes)
}

/// Where the body's frame is if not at the root, and which parts have no mass.
fn notes(tree: &Tree<'_>, legs: &Legs) -> Result<Vec<String>, RobotFileError> {
    let (trunk, body) = (&tree.links[legs.trunk], tree.body(legs.top));
    if tree.mass(&body.links) == 0.0 {
        let found = "no mass, nor in a link that fixed joints hold to it";
        let expected = "<inertial> with a <mass>: a robot's mass is the sum of its links";
        return Err(trunk.element.fault("", found, expected));
    }
    let apart = |link: usize, from: usize| {
        let ((at, _), (origin, turn)) = (tree.frame(link), tree.frame(from));
        let [x, y, z] = rounded(turn.inverse() * (at - origin));
        format!("{x} {y} {z} m from `{}`", tree.links[from].name)
    };
    let mut notes = Vec::new();
    if legs.trunk != tree.root {
        let place = apart(legs.trunk, tree.root);
        notes.push(format!(
            "the body's frame is that of link `{}`, {place}",
            trunk.name
        ));
    }
    let by_mass = |a: &usize, b: &usize| tree.links[*a].mass_kg.total_cmp(&tree.links[*b].mass_kg);
    let heaviest = body
        .links
        .iter()
        .copied()
        .max_by(by_mass)
        .unwrap_or(legs.trunk);
    let distance = (tree.frame(heaviest).0 - tree.frame(legs.trunk).0).norm();
    if trunk.mass_kg == 0.0 && distance > ROUNDING {
        let (name, place) = (tree.links[heaviest].name, apart(heaviest, legs.trunk));
        notes.push(format!(
            "the trunk's mass is in link `{name}`, {place}, whose frame is the body's: recordings have to have that one's position"
        ));
    }
    let joints = legs.legs.iter().flat_map(|leg| &leg.joints);
    let children = joints.map(|joint| tree.joints[*joint].child);
    let massless = children.filter(|link| tree.mass(&tree.body(*link).links) == 0.0);
    let massless: Vec<&str> = massless.map(|link| tree.links[link].name).collect();
    if !massless.is_empty() {
        let names = massless.join(", ");
        notes.push(format!(
            "the links {names} have no mass: the robot's mass is without them"
        ));
    }
    Ok(notes)
}

fn places(robot: Element<'_>, tree: &Tree<'_>, legs: &Legs) -> Places {
    let of = |leg: &Limb| {
        let joints = leg
            .joints
            .iter()
            .map(|joint| tree.joints[*joint].element.place());
        LegPlaces {
            joints: joints.collect(),
            foot: tree.links[leg.foot].element.place(),
        }
    };
    Places::Elements {
        robot: robot.place(),
        legs: legs.legs.iter().map(of).collect(),
    }
}

fn entry(tree: &Tree<'_>, trunk: usize, leg: &Limb) -> Result<LegEntry, RobotFileError> {
    let (origin, frame) = tree.frame(trunk);
    let seen = |link: usize| {
        let (position, turn) = tree.frame(link);
        let back = frame.inverse();
        (back * (position - origin), back * turn)
    };
    let mut entries = Vec::with_capacity(leg.joints.len());
    let mut before = Vector3::zeros();
    for &joint in &leg.joints {
        let joint = &tree.joints[joint];
        let (position, turn) = seen(joint.child);
        let (at, axis) = (rounded(position - before), axis(joint, turn)?);
        entries.push(joint_entry(joint, at, axis)?);
        before = position;
    }
    let (position, turn) = seen(leg.foot);
    Ok(LegEntry {
        joint: entries,
        foot: rounded(position + turn * leg.point - before),
    })
}

fn axis(joint: &Joint<'_>, turn: Rotation3<f64>) -> Result<[f64; 3], RobotFileError> {
    let Some(element) = joint.element.child("axis")? else {
        return Ok(rounded(turn * Vector3::x()));
    };
    element.only_with(&["xyz"])?;
    let axis = element.triple("xyz")?.unwrap_or_else(Vector3::x);
    if !AXIS.contains(&axis.norm()) {
        let found = element.attribute("xyz").unwrap_or_default();
        return Err(element.fault("xyz", format!("{found:?}"), "a direction, such as 0 1 0"));
    }
    Ok(rounded((turn * axis).normalize()))
}

fn joint_entry(
    joint: &Joint<'_>,
    at: [f64; 3],
    axis: [f64; 3],
) -> Result<JointEntry, RobotFileError> {
    let element = joint.element;
    let (is_endless, attributes) = match joint.kind {
        "revolute" => (false, "<limit lower=... upper=... effort=... velocity=...>"),
        "continuous" => (true, "<limit effort=... velocity=...>"),
        kind => {
            let expected = "revolute or continuous in a leg";
            return Err(element.fault("", format!("type {kind:?}"), expected));
        }
    };
    if let Some(mimic) = element.child("mimic")? {
        let found = format!(
            "a copy of joint `{}`",
            mimic.attribute("joint").unwrap_or("")
        );
        let expected = "joints of legs that move by themselves: without <mimic>, or type=\"fixed\"";
        return Err(mimic.fault("", found, expected));
    }
    let Some(limit) = element.child("limit")? else {
        return Err(element.fault("", "no <limit>", attributes));
    };
    let limits = match is_endless {
        true => [-ENDLESS_RAD, ENDLESS_RAD],
        false => [limit.number("lower")?, limit.number("upper")?],
    };
    Ok(JointEntry {
        name: joint.name.to_owned(),
        at,
        axis: Axis::of(axis),
        sign: 1.0,
        offset_rad: 0.0,
        limits_rad: Some(limits),
        limits_deg: None,
        torque_nm: limit.number("effort")?,
        speed_rad_s: limit.number("velocity")?,
    })
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
