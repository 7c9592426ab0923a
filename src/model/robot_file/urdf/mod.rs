//! The legs of a URDF. `tree` reads elements, links and joints, `limbs` finds trunk, legs and feet: a limb begins at a
//! moving joint with fixed joints alone between it and the body. The body's frame is that of the trunk, the heaviest of
//! the links that all four legs are below, wherever the root is.

mod limbs;
mod tree;

use limbs::{Legs, Limb};
use tree::{Element, Joint, Tree, document};

use super::*;

const ROUNDING: f64 = 1e-12; // components of axes and positions that are rounding of zero or one
const ENDLESS_RAD: f64 = 2.0 * std::f64::consts::PI;
const AXIS: std::ops::Range<f64> = 1e-6..1e6;

pub(super) fn read(file: &str, text: &str, options: &RobotOptions<'_>) -> Result<RobotReading> {
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
    let of = &|part: Part<'_>| place(robot, &tree, &legs.legs, part);
    let kind = "urdf";
    identified(entry, &Places { file, kind, of }, options.name, notes)
}

/// Where the body's frame is if not at the root, and which parts have no mass.
fn notes(tree: &Tree<'_>, legs: &Legs) -> Result<Vec<String>> {
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
        let (name, place) = (trunk.name, apart(legs.trunk, tree.root));
        notes.push(format!(
            "the body's frame is that of link `{name}`, {place}"
        ));
    }
    let by_mass = |a: &usize, b: &usize| tree.links[*a].mass_kg.total_cmp(&tree.links[*b].mass_kg);
    let heaviest = body.links.iter().copied().max_by(by_mass);
    let heaviest = heaviest.unwrap_or(legs.trunk);
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

const SPELLINGS: [(&str, &str); 5] = [
    ("at", "<origin>, xyz"),
    ("axis", "<axis>, xyz"),
    ("limits_rad", "<limit>, lower and upper"),
    ("torque_nm", "<limit>, effort"),
    ("speed_rad_s", "<limit>, velocity"),
];

/// The element of a part, such as ``line 24: joint `knee`, <axis>, xyz``.
fn place(robot: Element<'_>, tree: &Tree<'_>, legs: &[Limb], part: Part<'_>) -> String {
    let joint = |leg: usize, joint: usize| tree.joints[legs[leg].joints[joint]].element.place();
    match part {
        Part::Name => format!("{}, name", robot.place()),
        Part::Mass => "the masses of the links".to_owned(),
        Part::Legs => "the tree".to_owned(),
        Part::Leg(leg) => format!("{}, its leg", joint(leg, 0)),
        Part::Foot(leg) => tree.links[legs[leg].foot].element.place(),
        Part::Joint(leg, index, "") => joint(leg, index),
        Part::Joint(leg, index, key) => {
            let known = SPELLINGS.iter().find(|(name, _)| *name == key);
            let spelling = known.map_or(key, |(_, spelling)| spelling);
            format!("{}, {spelling}", joint(leg, index))
        }
    }
}

fn entry(tree: &Tree<'_>, trunk: usize, leg: &Limb) -> Result<LegEntry> {
    let (origin, frame) = tree.frame(trunk);
    let seen = |link: usize| {
        let (position, turn) = tree.frame(link);
        let back = frame.inverse();
        (back * (position - origin), back * turn)
    };
    let mut before = Vector3::zeros();
    let joints = leg.joints.iter().map(|joint| {
        let joint = &tree.joints[*joint];
        let (position, turn) = seen(joint.child);
        let at = position - std::mem::replace(&mut before, position);
        joint_entry(joint, rounded(at), axis(joint, turn)?)
    });
    let joint = joints.collect::<Result<_, _>>()?;
    let (position, turn) = seen(leg.foot);
    let foot = rounded(position + turn * leg.point - before);
    Ok(LegEntry { joint, foot })
}

fn axis(joint: &Joint<'_>, turn: Rotation3<f64>) -> Result<[f64; 3]> {
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

fn joint_entry(joint: &Joint<'_>, at: [f64; 3], axis: [f64; 3]) -> Result<JointEntry> {
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
        let original = mimic.attribute("joint").unwrap_or("");
        let found = format!("a copy of joint `{original}`");
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
        sign: None,
        offset_rad: None,
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
