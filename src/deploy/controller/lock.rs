//! The versions of the solver and of linear algebra that romc was built with.
//!
//! A generated controller gets the part of romc's own `Cargo.lock` that it needs, so that its
//! torques have the same bits and that it can be built from the same downloads.

use std::collections::BTreeSet;
use std::sync::LazyLock;

const OWN: &str = include_str!("../../../Cargo.lock");

/// What a generated controller depends on, besides its model.
const DIRECT: [&str; 3] = ["clarabel", "nalgebra", "thiserror"];

#[derive(Debug, Clone)]
pub(crate) struct Lock<'a> {
    packages: Vec<Package<'a>>,
}

#[derive(Debug, Clone)]
struct Package<'a> {
    name: &'a str,
    version: &'a str,
    /// Names, with a version where one name has several.
    dependencies: Vec<&'a str>,
    text: &'a str,
}

impl<'a> Package<'a> {
    fn parse(text: &'a str) -> Option<Self> {
        let field = |key: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(key))?;
            Some(line.trim_matches([' ', '=', '"']))
        };
        let listed = text.lines().filter_map(|line| line.strip_prefix(" \""));
        Some(Self {
            name: field("name")?,
            version: field("version")?,
            dependencies: listed
                .map(|line| line.trim_end_matches([',', '"']))
                .collect(),
            text: text.trim_end(),
        })
    }
}

impl Lock<'static> {
    pub(crate) fn own() -> &'static Self {
        static PARSED: LazyLock<Lock<'static>> = LazyLock::new(|| {
            let blocks = OWN.split("[[package]]\n").skip(1);
            Lock {
                packages: blocks.filter_map(Package::parse).collect(),
            }
        });
        &PARSED
    }
}

impl<'a> Lock<'a> {
    /// The version of a direct dependency of romc.
    pub(crate) fn version(&self, name: &str) -> &'a str {
        self.packages[self.position(self.direct(name))].version
    }

    /// The lock file of a controller whose model's crate is `name`.
    pub(crate) fn text(&self, banner: &str, name: &str) -> String {
        let mut dependencies = DIRECT.map(|name| self.direct(name)).to_vec();
        let mut needed = BTreeSet::new();
        let mut open = dependencies.clone();
        while let Some(spelled) = open.pop() {
            let position = self.position(spelled);
            if needed.insert(position) {
                open.extend(&self.packages[position].dependencies);
            }
        }
        dependencies.push(name);
        dependencies.sort_unstable();
        let list = dependencies.iter().map(|name| format!(" \"{name}\",\n"));
        let list = list.collect::<String>();
        let own = format!("name = \"{name}\"\nversion = \"0.1.0\"");
        let controller =
            format!("name = \"{name}-controller\"\nversion = \"0.1.0\"\ndependencies = [\n{list}]");
        let mut texts = vec![own.as_str(), &controller];
        texts.extend(needed.iter().map(|&position| self.packages[position].text));
        texts.sort_unstable();
        let packages: String = texts
            .iter()
            .map(|text| format!("\n[[package]]\n{text}\n"))
            .collect();
        format!("{banner}\nversion = 4\n{packages}")
    }

    /// A direct dependency of the crate with the controller, as its own entry spells it, with a version if it needs one.
    fn direct(&self, name: &str) -> &'a str {
        let own = &self.packages[self.position("romc-motion")].dependencies;
        let is_named = |dependency: &&&str| dependency.split(' ').next() == Some(name);
        own.iter()
            .find(is_named)
            .expect("the controller depends on it")
    }

    fn position(&self, spelled: &str) -> usize {
        let mut words = spelled.split(' ');
        let (name, version) = (words.next(), words.next());
        let is_it = |package: &Package<'_>| {
            name == Some(package.name) && version.is_none_or(|version| version == package.version)
        };
        let position = self.packages.iter().position(is_it);
        position.expect("the lock file has all that its entries name")
    }
}
