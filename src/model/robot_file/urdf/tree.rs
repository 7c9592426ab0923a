//! Elements of a URDF with their place (attributes as numbers), and its links and joints as a tree.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Attribute, Document, Node};

use super::*;
use crate::files::shell_word;
use crate::robot_file::identity::LARGEST_ANGLE_RAD;

/// Kinds of joints; of them `fixed` alone does not move.
const KINDS: [&str; 6] = [
    "revolute",
    "continuous",
    "prismatic",
    "fixed",
    "floating",
    "planar",
];

pub(super) struct Link<'x> {
    pub element: Element<'x>,
    pub name: &'x str,
    pub mass_kg: f64, // kg; 0 without an `<inertial>`
    pub above: Option<usize>,
    pub below: Vec<usize>, // joints, in the file's order
}

pub(super) struct Joint<'x> {
    pub element: Element<'x>,
    pub name: &'x str,
    pub kind: &'x str,
    pub parent: usize,
    pub child: usize,
    pub origin: (Vector3<f64>, Rotation3<f64>), // child's frame in the parent's at the zero posture
}

pub(super) struct Tree<'x> {
    pub file: &'x str,
    pub links: Vec<Link<'x>>,
    pub joints: Vec<Joint<'x>>,
    pub root: usize,
}

/// Links that fixed joints hold together, and moving joints on them, both in the order of the tree.
pub(super) struct Body {
    pub links: Vec<usize>,
    pub moving: Vec<usize>,
}

impl<'x> Tree<'x> {
    pub(crate) fn new(robot: Element<'x>) -> Result<Self> {
        let mut tree = Self {
            file: robot.file,
            links: Vec::new(),
            joints: Vec::new(),
            root: 0,
        };
        let mut names = BTreeMap::new();
        for element in robot.children("link") {
            let (name, mass_kg) = (element.name()?, mass(element)?);
            if names.insert(name, tree.links.len()).is_some() {
                return Err(element.fault("", "the name a second time", "each name once"));
            }
            tree.links.push(Link {
                element,
                name,
                mass_kg,
                above: None,
                below: Vec::new(),
            });
        }
        let mut seen = BTreeMap::new();
        for element in robot.children("joint") {
            let index = tree.joints.len();
            let joint = joint(element, &names)?;
            if seen.insert(joint.name, index).is_some() {
                return Err(element.fault("", "the name a second time", "each name once"));
            }
            if let Some(first) = tree.links[joint.child].above {
                let [link, first] = [tree.links[joint.child].name, tree.joints[first].name];
                let found = format!("link `{link}` below two joints, `{first}` and this");
                return Err(element.fault("<child>", found, "one joint above each link"));
            }
            tree.links[joint.child].above = Some(index);
            tree.links[joint.parent].below.push(index);
            tree.joints.push(joint);
        }
        tree.root = tree.only_root()?;
        Ok(tree)
    }

    pub(crate) fn refused(&self, found: String, expected: impl Into<Box<str>>) -> RobotFileError {
        RobotFileError::at(self.file, "the tree", found, expected)
    }

    fn only_root(&self) -> Result<usize> {
        let roots = (0..self.links.len()).filter(|link| self.links[*link].above.is_none());
        let roots: Vec<usize> = roots.collect();
        let name = |link: &usize| format!("`{}`", self.links[*link].name);
        let below = roots
            .iter()
            .flat_map(|root| self.below(*root, |_| true).links);
        let below: BTreeSet<usize> = below.collect();
        // A link has at most one joint above it, so a link without a root above it is in a loop.
        if let Some(link) = (0..self.links.len()).find(|link| !below.contains(link)) {
            let found = format!("a loop of joints through {}", name(&link));
            return Err(self.links[link].element.fault("", found, "a tree"));
        }
        match roots[..] {
            [root] => Ok(root),
            [] => Err(self.refused("no link".to_owned(), "a tree of links and joints")),
            _ => {
                let count = roots.len();
                let names = roots
                    .iter()
                    .take(4)
                    .map(name)
                    .collect::<Vec<_>>()
                    .join(", ");
                let found = format!("{count} links without a joint above them ({names})");
                Err(self.refused(found, "one, which all others are below"))
            }
        }
    }

    /// A link with the links that joints fix to it if they `pass`, in the order of the tree, and the other joints on
    /// these.
    fn below(&self, link: usize, pass: impl Fn(&Joint<'_>) -> bool) -> Body {
        let (mut links, mut moving) = (vec![link], Vec::new());
        let mut open: Vec<usize> = self.links[link].below.iter().rev().copied().collect();
        while let Some(joint) = open.pop() {
            match pass(&self.joints[joint]) {
                false => moving.push(joint),
                true => {
                    let child = self.joints[joint].child;
                    links.push(child);
                    open.extend(self.links[child].below.iter().rev());
                }
            }
        }
        Body { links, moving }
    }

    pub(crate) fn body(&self, link: usize) -> Body {
        self.below(link, |joint| joint.kind == "fixed")
    }

    pub(crate) fn mass_below(&self, link: usize) -> f64 {
        let mut links = self.below(link, |_| true).links;
        links.sort_unstable(); // in the file's order, so that the order of joints does not change the last digit
        self.mass(&links)
    }

    pub(crate) fn mass(&self, links: &[usize]) -> f64 {
        links.iter().map(|link| self.links[*link].mass_kg).sum()
    }

    pub(crate) fn path(&self, link: usize) -> Vec<usize> {
        let mut path = vec![link];
        while let Some(joint) = self.links[path[path.len() - 1]].above {
            path.push(self.joints[joint].parent);
        }
        path.reverse();
        path
    }

    /// Position and attitude of a link in the root's frame at the zero posture.
    pub(crate) fn frame(&self, link: usize) -> (Vector3<f64>, Rotation3<f64>) {
        let mut frame = (Vector3::zeros(), Rotation3::identity());
        for link in self.path(link) {
            if let Some(joint) = self.links[link].above {
                let (position, turn) = self.joints[joint].origin;
                frame = (frame.0 + frame.1 * position, frame.1 * turn);
            }
        }
        frame
    }
}

/// Mass of a link, 0 without `<inertial>`. Moments of inertia are not used, but have to be possible.
fn mass(link: Element<'_>) -> Result<f64> {
    let Some(inertial) = link.child("inertial")? else {
        return Ok(0.0);
    };
    let Some(mass) = inertial.child("mass")? else {
        return Err(inertial.fault("", "no <mass>", "<mass value=...>"));
    };
    let value = mass.number("value")?;
    if value < 0.0 {
        return Err(mass.fault("value", value.to_string(), "a mass of 0 kg or more"));
    }
    if let Some(inertia) = inertial.child("inertia")? {
        for key in ["ixx", "iyy", "izz"] {
            if inertia.attribute(key).is_some() && inertia.number(key)? < 0.0 {
                let found = inertia.attribute(key).unwrap_or_default();
                return Err(inertia.fault(key, found, "0 kg m^2 or more"));
            }
        }
    }
    Ok(value)
}

fn joint<'x>(element: Element<'x>, links: &BTreeMap<&'x str, usize>) -> Result<Joint<'x>> {
    let link = |tag: &'static str| {
        let name = (element.child(tag)?).and_then(|child| child.attribute("link"));
        let missing = || element.fault("", format!("no <{tag}>"), format!("<{tag} link=...>"));
        let name = name.ok_or_else(missing)?;
        let found = || format!("`{name}`, which is no link");
        let unknown = || element.fault(&format!("<{tag}>"), found(), "a <link> of the file");
        links.get(name).copied().ok_or_else(unknown)
    };
    let name = element.name()?;
    let kind = element.attribute("type").unwrap_or("");
    if !KINDS.contains(&kind) {
        return Err(element.fault("type", format!("{kind:?}"), KINDS.join(", ")));
    }
    let [position, turn] = match element.child("origin")? {
        None => [Vector3::zeros(); 2],
        Some(origin) => {
            origin.only_with(&["xyz", "rpy"])?;
            let triple = |key| Ok(origin.triple(key)?.unwrap_or_default());
            let turn = triple("rpy")?;
            if turn.amax() > LARGEST_ANGLE_RAD {
                let found = origin.attribute("rpy").unwrap_or_default();
                return Err(origin.fault("rpy", found, "two turns at most: rad, not degrees"));
            }
            [triple("xyz")?, turn]
        }
    };
    Ok(Joint {
        element,
        name,
        kind,
        parent: link("parent")?,
        child: link("child")?,
        origin: (
            position,
            Rotation3::from_euler_angles(turn.x, turn.y, turn.z),
        ),
    })
}

/// Elements for drawings and simulators.
const UNREAD: [&str; 5] = [
    "visual",
    "collision",
    "gazebo",
    "transmission",
    "ros2_control",
];

/// Elements of xacro without its prefix, none of which a URDF has.
const UNPREFIXED: [&str; 4] = ["macro", "include", "property", "insert_block"];

#[derive(Clone, Copy)]
pub(super) struct Element<'x> {
    pub file: &'x str,
    node: Node<'x, 'x>,
}

pub(super) fn document<'x>(file: &str, text: &'x str) -> Result<Document<'x>> {
    let document = Document::parse(text).map_err(|error| {
        // A prefix that nothing declares; macros of included files have none.
        if let roxmltree::Error::UnknownNamespace(prefix, at) = &error
            && prefix == "xacro"
        {
            return unexpanded(file, at.row, "an element of xacro");
        }
        let at = error.pos();
        let place = Place::Character(at.row as usize, at.col as usize);
        RobotFileError::text(file, place, error.to_string())
    })?;
    let mut unread_to = 0; // parts that romc does not read, such as meshes, may have signs of xacro
    for node in document.descendants().filter(Node::is_element) {
        let name = node.tag_name();
        if UNREAD.contains(&name.name()) {
            unread_to = unread_to.max(node.range().end);
        }
        // The address that the prefix stands for differs; old xacros have no prefix.
        let is_xacro =
            |space: &str| space.contains("xacro") || node.lookup_prefix(space) == Some("xacro");
        let is_macro = match name.namespace() {
            Some(space) => is_xacro(space),
            None => node.range().end > unread_to && UNPREFIXED.contains(&name.name()),
        };
        let is_formula = |attribute: &Attribute<'_, '_>| {
            let value = attribute.value();
            value.contains("${") || value.contains("$(")
        };
        let found = match is_macro {
            true => Some(format!("<xacro:{}>", name.name())),
            false if node.range().end <= unread_to => None,
            false => (node.attributes().find(is_formula))
                .map(|attribute| format!("{}={:?}", attribute.name(), attribute.value())),
        };
        if let Some(found) = found {
            let at = document.text_pos_at(node.range().start);
            return Err(unexpanded(file, at.row, &found));
        }
    }
    Ok(document)
}

fn unexpanded(file: &str, row: u32, found: &str) -> RobotFileError {
    let stem = file.strip_suffix(".xacro");
    let urdf = match (stem, file.strip_suffix(".urdf")) {
        (Some(stem), _) if stem.ends_with(".urdf") => stem.to_owned(),
        (Some(stem), _) => format!("{stem}.urdf"),
        (None, stem) => format!("{}-expanded.urdf", stem.unwrap_or(file)),
    };
    let (from, to) = (shell_word(file), shell_word(&urdf));
    let found = format!("{found}: a xacro that is not expanded");
    let expected = format!("a URDF: `xacro {from} > {to}` makes it");
    RobotFileError::at(file, format!("line {row}"), found, expected)
}

impl<'x> Element<'x> {
    pub(crate) fn root(file: &'x str, document: &'x Document<'x>) -> Self {
        let node = document.root_element();
        Self { file, node }
    }

    pub(crate) fn tag(&self) -> &'x str {
        self.node.tag_name().name()
    }

    pub(crate) fn children(self, tag: &'static str) -> impl Iterator<Item = Self> {
        let nodes = (self.node.children()).filter(move |node| node.has_tag_name(tag));
        nodes.map(move |node| Self { node, ..self })
    }

    /// The child of a kind, which may be there once.
    pub(crate) fn child(self, tag: &'static str) -> Result<Option<Self>> {
        let mut found = self.children(tag);
        let first = found.next();
        match found.next() {
            None => Ok(first),
            Some(second) => Err(second.fault("", format!("a second <{tag}>"), "one")),
        }
    }

    pub(crate) fn attribute(&self, key: &str) -> Option<&'x str> {
        self.node.attribute(key)
    }

    /// The attribute `name`, without which nothing can refer to the element.
    pub(crate) fn name(&self) -> Result<&'x str> {
        let name = self.attribute("name").filter(|name| !name.is_empty());
        name.ok_or_else(|| self.fault("", "no name", "name=\"...\""))
    }

    pub(crate) fn number(&self, key: &str) -> Result<f64> {
        let text = self.attribute(key);
        let value = text.and_then(|text| text.trim().parse::<f64>().ok());
        value.filter(|value| value.is_finite()).ok_or_else(|| {
            let found = text.map_or("nothing".to_owned(), |text| format!("{text:?}"));
            self.fault(key, found, "a number")
        })
    }

    pub(crate) fn triple(&self, key: &str) -> Result<Option<Vector3<f64>>> {
        let Some(text) = self.attribute(key) else {
            return Ok(None);
        };
        let number = |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite());
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        match numbers.as_deref() {
            Some(&[x, y, z]) => Ok(Some(Vector3::new(x, y, z))),
            _ => Err(self.fault(key, format!("{text:?}"), "three numbers")),
        }
    }

    /// Refuses attributes other than these, such as `quat_xyzw` of other dialects, that would change the result.
    pub(crate) fn only_with(&self, keys: &[&str]) -> Result<()> {
        let mut own = self.node.attributes().filter(|a| a.namespace().is_none());
        match own.find(|a| !keys.contains(&a.name())) {
            None => Ok(()),
            Some(other) => {
                let found = format!("the attribute {}={:?}", other.name(), other.value());
                Err(self.fault("", found, format!("{} alone", keys.join(" and "))))
            }
        }
    }

    /// The line of the file and the element, such as ``line 24: joint `knee`, <limit>``.
    pub(crate) fn place(&self) -> String {
        let at = self.node.document().text_pos_at(self.node.range().start);
        let mut inner = String::new();
        for node in self.node.ancestors().filter(Node::is_element) {
            let (tag, name) = (node.tag_name().name(), node.attribute("name"));
            match (tag, name) {
                ("joint" | "link", Some(name)) => {
                    return format!("line {}: {tag} `{name}`{inner}", at.row);
                }
                _ => inner = format!(", <{tag}>{inner}"),
            }
        }
        format!("line {}: {}", at.row, inner.trim_start_matches(", "))
    }

    /// `found` at an attribute of the element (at the element, if the key is empty), where `expected` should be.
    pub(crate) fn fault(
        &self,
        key: &str,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> RobotFileError {
        let mut place = self.place();
        if !key.is_empty() {
            place = format!("{place}, {key}");
        }
        RobotFileError::at(self.file, place, found, expected)
    }
}
