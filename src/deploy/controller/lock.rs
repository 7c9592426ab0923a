//! The versions of the solver and of linear algebra that romc was built with.
//!
//! A generated controller gets the part of romc's own `Cargo.lock` that it needs, so that its
//! torques have the same bits and that it can be built from the same downloads.

use std::collections::BTreeSet;

/// romc's own lock file.
const OWN: &str = include_str!("../../../Cargo.lock");

/// What a generated controller depends on, besides its model.
const DIRECT: [&str; 3] = ["clarabel", "nalgebra", "thiserror"];

/// Locked packages.
#[derive(Debug, Clone)]
pub struct Lock<'a> {
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
    /// romc's own.
    pub fn own() -> Self {
        let blocks = OWN.split("[[package]]\n").skip(1);
        Self {
            packages: blocks.filter_map(Package::parse).collect(),
        }
    }
}

impl<'a> Lock<'a> {
    /// The version of a direct dependency of romc.
    pub fn version(&self, name: &str) -> &'a str {
        self.find(&self.direct(name)).version
    }

    /// The lock file of a controller whose model's crate is `name`.
    pub fn text(&self, banner: &str, name: &str) -> String {
        let mut dependencies: Vec<String> = DIRECT.iter().map(|name| self.direct(name)).collect();
        let mut needed = BTreeSet::new();
        let mut open: Vec<usize> = (dependencies.iter())
            .map(|name| self.position(name))
            .collect();
        while let Some(position) = open.pop() {
            if needed.insert(position) {
                let dependencies = &self.packages[position].dependencies;
                open.extend(dependencies.iter().map(|name| self.position(name)));
            }
        }
        let own = |name: &str, dependencies: String| {
            format!("name = \"{name}\"\nversion = \"0.1.0\"{dependencies}")
        };
        dependencies.push(name.to_owned());
        dependencies.sort();
        let list: String = dependencies
            .iter()
            .map(|name| format!(" \"{name}\",\n"))
            .collect();
        let mut texts: Vec<String> = (needed.iter())
            .map(|&position| self.packages[position].text.to_owned())
            .collect();
        texts.push(own(name, String::new()));
        texts.push(own(
            &format!("{name}-controller"),
            format!("\ndependencies = [\n{list}]"),
        ));
        texts.sort();
        let packages: String = texts
            .iter()
            .map(|text| format!("\n[[package]]\n{text}\n"))
            .collect();
        format!("{banner}\nversion = 4\n{packages}")
    }

    /// A direct dependency of the crate with the controller, as its own entry spells it, with a version if it needs one.
    fn direct(&self, name: &str) -> String {
        let own = self.find("romc-motion");
        own.dependencies
            .iter()
            .find(|dependency| dependency.split(' ').next() == Some(name))
            .map(|dependency| (*dependency).to_owned())
            .expect("the controller depends on it")
    }

    fn position(&self, spelled: &str) -> usize {
        let mut words = spelled.split(' ');
        let (name, version) = (words.next(), words.next());
        self.packages
            .iter()
            .position(|package| {
                Some(package.name) == name
                    && version.is_none_or(|version| version == package.version)
            })
            .expect("the lock file has all that its entries name")
    }

    fn find(&self, spelled: &str) -> &Package<'a> {
        &self.packages[self.position(spelled)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lock_of_a_controller_has_the_solver_and_what_it_needs_and_no_more() {
        let text = Lock::own().text("# made by a test", "go1_d4");
        let names: Vec<&str> = text
            .lines()
            .filter_map(|line| Some(line.strip_prefix("name = ")?.trim_matches('"')))
            .collect();
        for needed in ["clarabel", "nalgebra", "amd", "go1_d4", "go1_d4-controller"] {
            assert!(names.contains(&needed), "{needed}");
        }
        for other in ["romc", "clap", "zip"] {
            assert!(!names.contains(&other), "{other}");
        }
        assert!(names.is_sorted());
        assert!(!Lock::own().version("clarabel").is_empty());
        // Both versions of thiserror: clarabel's and romc's own.
        let both = names.iter().filter(|name| **name == "thiserror");
        assert_eq!(both.count(), 2);
    }
}
