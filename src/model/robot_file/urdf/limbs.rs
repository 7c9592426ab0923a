//! Which links of a tree are the trunk, which joints the legs, and where the feet are.

use super::tree::Body;
use super::*;
use crate::files::shell_word;

const SAME_PLACE_M: f64 = 1e-12; // largest distance of two feet that are one

/// Moving joints of a leg from the trunk, the link of its foot, and the foot in that link's frame.
pub(super) struct Limb {
    pub joints: Vec<usize>,
    pub foot: usize,
    pub point: Vector3<f64>,
}

pub(super) struct Legs {
    pub legs: Vec<Limb>,
    pub top: usize,
    pub trunk: usize, // its frame is the body's
}

type Chain = (Vec<usize>, bool); // moving joints below a body while they are a chain; whether nothing else follows

impl Legs {
    /// Finds legs, or uses those that end at these feet.
    pub(crate) fn find(tree: &Tree<'_>, feet: &[(String, Vector3<f64>)]) -> Result<Self> {
        let top = top(tree);
        let body = tree.body(top);
        let legs = match feet {
            [] => found_legs(tree, top, &body)?,
            feet => named_legs(tree, top, &body, feet)?,
        };
        for joint in &tree.joints {
            let is_free = matches!(joint.kind, "floating" | "planar");
            if is_free && tree.path(joint.parent).contains(&top) {
                let (found, expected) = (format!("type {:?}", joint.kind), "one above the trunk");
                return Err(joint.element.fault("", found, expected));
            }
        }
        let path = |leg: &Limb| tree.path(tree.joints[leg.joints[0]].parent);
        let paths: Vec<Vec<usize>> = legs.iter().map(path).collect();
        let is_shared = |depth: &usize| {
            let link = paths[0].get(*depth);
            link.is_some() && paths.iter().all(|path| path.get(*depth) == link)
        };
        // The heaviest of the links that all legs are below; the nearest to the legs, if none has a mass.
        let shared = (0..).take_while(is_shared).map(|depth| paths[0][depth]);
        let shared = shared.skip_while(|link| *link != top);
        let mass_kg = |link: &usize| tree.links[*link].mass_kg;
        let trunk = shared.max_by(|a, b| mass_kg(a).total_cmp(&mass_kg(b)));
        let trunk = trunk.unwrap_or(top);
        Ok(Self { legs, top, trunk })
    }
}

/// The feet of `--feet`: names of links, each with a point in its frame if it is not the link's origin.
pub(super) fn feet(list: &[String]) -> Result<Vec<(String, Vector3<f64>)>> {
    let joined = list.join(",");
    let mut words = (joined.split(',').map(str::trim)).filter(|word| !word.is_empty());
    let number = |word: &str| word.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let refused = |found: String| {
        let expected = "four links, LINK,..., or links with points in their frames, LINK:x,y,z,...";
        RobotFileError::option("--feet", found, expected)
    };
    let mut feet: Vec<(String, Vector3<f64>)> = Vec::new();
    while let Some(word) = words.next() {
        let split = word.rsplit_once(':');
        let (link, point) = match split.and_then(|(link, x)| Some((link, number(x)?))) {
            None => (word, Vector3::zeros()),
            Some((link, x)) => match [words.next(), words.next()].map(|word| word.and_then(number))
            {
                [Some(y), Some(z)] => (link, Vector3::new(x, y, z)),
                _ => return Err(refused(format!("`{word}` without y and z"))),
            },
        };
        if feet.iter().any(|(other, _)| other == link) {
            return Err(refused(format!("`{link}` twice")));
        }
        feet.push((link.to_owned(), point));
    }
    match feet.len() {
        0 | FOOT_DIM => Ok(feet),
        count => Err(refused(format!("{count} feet"))),
    }
}

/// The uppermost link of a body: the root, or the link below a joint without bounds or massless links such as `world`.
fn top(tree: &Tree<'_>) -> usize {
    let (mut top, mut link) = (tree.root, tree.root);
    loop {
        let body = tree.body(link);
        let [only] = body.moving[..] else {
            return if body.moving.is_empty() { top } else { link }; // a chain without an end that branches is a limb
        };
        let is_free = matches!(tree.joints[only].kind, "floating" | "planar");
        if !is_free && tree.mass(&body.links) > 0.0 {
            return top;
        }
        link = tree.joints[only].child;
        if is_free {
            top = link;
        }
    }
}

fn chain(tree: &Tree<'_>, first: usize) -> Chain {
    let mut joints = vec![first];
    let mut next = tree.body(tree.joints[first].child).moving;
    while let [only] = next[..] {
        joints.push(only);
        next = tree.body(tree.joints[only].child).moving;
    }
    (joints, next.is_empty())
}

fn found_legs(tree: &Tree<'_>, top: usize, body: &Body) -> Result<Vec<Limb>> {
    let limbs = body.moving.iter().map(|joint| chain(tree, *joint));
    let limbs: Vec<Chain> = limbs.collect();
    let is_leg = |(joints, is_chain): &&Chain| *is_chain && joints.len() == LEG_JOINT_DIM;
    let legs: Vec<&Chain> = limbs.iter().filter(is_leg).collect();
    if legs.len() == FOOT_DIM {
        let with_foot = |(joints, _): &Chain| {
            let (joints, foot) = (joints.clone(), foot(tree, joints)?);
            Ok(Limb {
                joints,
                foot,
                point: Vector3::zeros(),
            })
        };
        return legs.into_iter().map(with_foot).collect();
    }
    let of = |(joints, is_chain): &Chain| {
        let more = if *is_chain { "" } else { " and branches" };
        let (name, count) = (tree.joints[joints[0]].name, joints.len());
        format!("{name} ({count} joints{more})")
    };
    let texts: Vec<String> = limbs.iter().map(of).collect();
    let texts = match texts.is_empty() {
        true => String::new(),
        false => format!(": {}", texts.join(", ")),
    };
    let (count, name) = (limbs.len(), tree.links[top].name);
    let found = format!("{count} limbs on `{name}`{texts}");
    // Whether four limbs have legs in them, and whether they are legs with a joint too few.
    let have =
        |least: fn(&Chain) -> bool| limbs.iter().filter(|limb| least(limb)).count() >= FOOT_DIM;
    let has_more = |(joints, is_chain): &Chain| joints.len() > LEG_JOINT_DIM || !is_chain;
    let may_be_legs = have(|(joints, is_chain)| joints.len() >= LEG_JOINT_DIM || !is_chain);
    let hint = if may_be_legs && limbs.iter().any(has_more) {
        "; --feet (romc robot) names their feet where limbs have more joints"
    } else if have(|(joints, _)| joints.len() == 2) {
        "; legs of two joints, as robots of eight have them, cannot be modelled"
    } else {
        ""
    };
    let expected =
        format!("four legs of three joints each, the only robots that romc models{hint}");
    Err(tree.refused(found, expected))
}

/// The link at the foot: among the links fixed to the last joint, the one named foot or toe, or the only one at the
/// end.
fn foot(tree: &Tree<'_>, joints: &[usize]) -> Result<usize> {
    let last = &tree.joints[joints[joints.len() - 1]];
    let held = tree.body(last.child).links.split_off(1);
    let name = |link: &usize| tree.links[*link].name;
    let says_so = |link: &usize| {
        let name = name(link).to_lowercase();
        name.contains("foot") || name.contains("toe")
    };
    let named: Vec<usize> = held.iter().copied().filter(says_so).collect();
    let is_end = |link: &usize| tree.links[*link].below.is_empty();
    let ends: Vec<usize> = held.iter().copied().filter(is_end).collect();
    let is_same_place =
        |a: usize, b: usize| (tree.frame(a).0 - tree.frame(b).0).norm() < SAME_PLACE_M;
    match (&named[..], &ends[..]) {
        ([only], _) | ([], [only]) => Ok(*only),
        ([first, rest @ ..], _) if rest.iter().all(|link| is_same_place(*first, *link)) => {
            Ok(*first)
        }
        _ => {
            let (link, joint) = (name(&last.child), last.name);
            let line = last.element.place();
            let line = line.split_once(':').map_or("", |(line, _)| line);
            let place = format!("{line}: link `{link}` beyond joint `{joint}`");
            let (found, expected) = match held.is_empty() {
                true => (
                    "no link on a fixed joint".to_owned(),
                    format!(
                        "one link at the foot, or romc robot --feet {} with the feet of all four \
                         in the frames of their last links",
                        shell_word(&format!("{link}:x,y,z,..."))
                    ),
                ),
                false => (
                    held.iter().map(name).collect::<Vec<_>>().join(", "),
                    "one link at the foot, with foot or toe in its name, or --feet (romc robot) with the \
                     links of all four"
                        .to_owned(),
                ),
            };
            Err(RobotFileError::at(tree.file, place, found, expected))
        }
    }
}

fn named_legs(
    tree: &Tree<'_>,
    top: usize,
    body: &Body,
    feet: &[(String, Vector3<f64>)],
) -> Result<Vec<Limb>> {
    let leg = |(name, point): &(String, Vector3<f64>)| {
        let Some(foot) = tree.links.iter().position(|link| link.name == *name) else {
            let (place, found) = (format!("link `{name}`"), "no such link");
            return Err(RobotFileError::at(tree.file, place, found, "a foot"));
        };
        let path = tree.path(foot).into_iter();
        let path = path.skip_while(|link| body.links.contains(link));
        let above = path.filter_map(|link| tree.links[link].above);
        let joints = above.filter(|joint| tree.joints[*joint].kind != "fixed");
        let joints: Vec<usize> = joints.collect();
        if joints.len() == LEG_JOINT_DIM {
            return Ok(Limb {
                joints,
                foot,
                point: *point,
            });
        }
        let names = joints.iter().map(|joint| tree.joints[*joint].name);
        let names = names.collect::<Vec<_>>().join(", ");
        let found = format!("{} joints ({names})", joints.len());
        let place = format!("from `{}` to `{name}`", tree.links[top].name);
        Err(RobotFileError::at(tree.file, place, found, "three"))
    };
    feet.iter().map(leg).collect()
}
