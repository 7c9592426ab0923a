//! Elements of a URDF with their place: attributes as numbers, children that may be there once.

use nalgebra::Vector3;
use roxmltree::{Attribute, Document, Node};

use crate::files::{Place, shell_word};
use crate::robot_file::RobotFileError;

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

pub(super) fn document<'x>(file: &str, text: &'x str) -> Result<Document<'x>, RobotFileError> {
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
    // Meshes and extensions of simulators may have signs of xacro in what romc does not read.
    let mut unread_to = 0;
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
    pub(crate) fn child(self, tag: &'static str) -> Result<Option<Self>, RobotFileError> {
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
    pub(crate) fn name(&self) -> Result<&'x str, RobotFileError> {
        let name = self.attribute("name").filter(|name| !name.is_empty());
        name.ok_or_else(|| self.fault("", "no name", "name=\"...\""))
    }

    pub(crate) fn number(&self, key: &str) -> Result<f64, RobotFileError> {
        let text = self.attribute(key);
        let value = text.and_then(|text| text.trim().parse::<f64>().ok());
        value.filter(|value| value.is_finite()).ok_or_else(|| {
            let found = text.map_or("nothing".to_owned(), |text| format!("{text:?}"));
            self.fault(key, found, "a number")
        })
    }

    pub(crate) fn triple(&self, key: &str) -> Result<Option<Vector3<f64>>, RobotFileError> {
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
    pub(crate) fn only_with(&self, keys: &[&str]) -> Result<(), RobotFileError> {
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
