//! Orders in which other programs keep the coordinates of a robot.

use std::str::FromStr;

use nalgebra::allocator::Allocator;

use super::*;

const KINDS: [&str; LEG_JOINT_DIM] = ["hx", "hy", "kn"];

/// An order of the 18 coordinates of a robot, and of its inputs alike: names separated by commas. A name is a
/// coordinate (`fr.hx`, `body.z`) or a group in romc's order: a leg (`fr`), a kind of joint over the legs (`kn`),
/// `joints`, `body`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CoordinateOrder {
    text: String,
    /// For each place the coordinate that is there, as an index into romc's order.
    pub places: [usize; STATE_DIM],
}

impl CoordinateOrder {
    pub fn sorted<C: Dim>(&self, rows: &OMatrix<f64, Dyn, C>) -> OMatrix<f64, Dyn, C>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        let mut sorted = rows.clone();
        for (place, &coordinate) in self.places.iter().enumerate() {
            sorted.row_mut(coordinate).copy_from(&rows.row(place));
        }
        sorted
    }

    /// Body first or last, legs in any order, joints by leg or by kind; pairs of legs from the front first.
    pub fn common() -> Vec<Self> {
        let mut orders = Vec::new();
        for legs in leg_orders() {
            let names: Vec<&str> = legs.iter().map(|leg| leg.short_name()).collect();
            let by_leg = names.join(",");
            let each = |kind: &&str| -> Vec<String> {
                names.iter().map(|leg| format!("{leg}.{kind}")).collect()
            };
            let by_kind: Vec<String> = match legs == Leg::ALL {
                true => KINDS.map(str::to_owned).to_vec(),
                false => KINDS.iter().flat_map(each).collect(),
            };
            for joints in [by_leg, by_kind.join(",")] {
                for text in [format!("{joints},body"), format!("body,{joints}")] {
                    orders.push(text.parse().expect("every coordinate is there once"));
                }
            }
        }
        orders
    }
}

fn leg_orders() -> Vec<[Leg; FOOT_DIM]> {
    let digits = |code: usize| std::array::from_fn(|k| code / FOOT_DIM.pow(k as u32) % FOOT_DIM);
    let mut orders: Vec<[Leg; FOOT_DIM]> = (0..FOOT_DIM.pow(4))
        .map(digits)
        .filter(|order: &[usize; FOOT_DIM]| (0..FOOT_DIM).all(|leg| order.contains(&leg)))
        .map(|order| order.map(|leg| Leg::ALL[leg]))
        .collect();
    // Pairs from the front first, then pairs of a side, then all others.
    orders.sort_by_key(|order| {
        let is_same = |a: usize, b: usize, of: fn(Leg) -> bool| of(order[a]) == of(order[b]);
        let is_left = |leg: Leg| leg.side() > 0.0;
        match (is_same(0, 1, Leg::is_front), is_same(0, 1, is_left)) {
            (true, _) => (0, !order[0].is_front()),
            (_, true) => (1, is_left(order[0])),
            _ => (2, false),
        }
    });
    orders
}

fn group(name: &str) -> Option<Vec<usize>> {
    let joints = 0..JOINT_DIM;
    if let Some(leg) = Leg::ALL.iter().find(|leg| leg.short_name() == name) {
        let first = LEG_JOINT_DIM * leg.index();
        return Some((first..first + LEG_JOINT_DIM).collect());
    }
    if let Some(kind) = KINDS.iter().position(|kind| *kind == name) {
        return Some(joints.skip(kind).step_by(LEG_JOINT_DIM).collect());
    }
    let single = (JOINT_NAMES.iter().chain(&BODY_NAMES)).position(|known| *known == name);
    match name {
        "joints" => Some(joints.collect()),
        "body" => Some((JOINT_DIM..JOINT_DIM + BODY_DIM).collect()),
        _ => single.map(|index| vec![index]),
    }
}

impl FromStr for CoordinateOrder {
    type Err = ModelError;

    fn from_str(text: &str) -> Result<Self> {
        let refused = |found: String| {
            let expected = "each of the 18 coordinates once, as names (fr.hx, body.z) or groups \
                            (fr, hx, joints, body), separated by commas";
            ModelError::invalid("order of coordinates", found, expected)
        };
        let name_of = |index: usize| match index.checked_sub(JOINT_DIM) {
            None => JOINT_NAMES[index],
            Some(body) => BODY_NAMES[body],
        };
        let mut found: Vec<usize> = Vec::with_capacity(STATE_DIM);
        for name in text.split(',').map(str::trim) {
            let group = group(name).ok_or_else(|| refused(format!("{name:?}")))?;
            if let Some(&twice) = group.iter().find(|index| found.contains(index)) {
                return Err(refused(format!("`{}` twice", name_of(twice))));
            }
            found.extend(group);
        }
        let places = <[usize; STATE_DIM]>::try_from(found).map_err(|found| {
            let missing = (0..STATE_DIM).find(|index| !found.contains(index));
            refused(format!("no `{}`", missing.map_or("", name_of)))
        })?;
        let text = text.to_owned();
        Ok(Self { text, places })
    }
}

impl fmt::Display for CoordinateOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
