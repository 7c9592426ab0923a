//! The sources of a generated controller, and the part of romc's own `Cargo.lock` that it needs: its torques have the
//! same bits, and it builds from the same downloads.

use std::collections::BTreeSet;
use std::sync::LazyLock;

const DIRECT: [&str; 3] = ["clarabel", "nalgebra", "thiserror"];

struct Package {
    name: &'static str,
    version: &'static str,
    dependencies: Vec<&'static str>,
    text: &'static str,
}

static PACKAGES: LazyLock<Vec<Package>> = LazyLock::new(|| {
    let own = include_str!("../../../Cargo.lock");
    let package = |text: &'static str| {
        let field = |key| text.lines().find_map(|line| line.strip_prefix(key));
        let listed = text.lines().filter_map(|line| line.strip_prefix(" \""));
        Some(Package {
            name: field("name = ")?.trim_matches('"'),
            version: field("version = ")?.trim_matches('"'),
            dependencies: listed
                .map(|line| line.trim_end_matches([',', '"']))
                .collect(),
            text: text.trim_end(),
        })
    };
    own.split("[[package]]\n").filter_map(package).collect()
});

/// A package by its name, with its version where one name has several.
fn package(spelled: &str) -> &'static Package {
    let (name, version) = spelled.split_once(' ').unwrap_or((spelled, ""));
    let is_it = |package: &&Package| {
        package.name == name && (version.is_empty() || package.version == version)
    };
    let found = PACKAGES.iter().find(is_it);
    found.expect("the lock file has all that its entries name")
}

fn direct(name: &str) -> &'static str {
    let mut dependencies = package("romc-control").dependencies.iter();
    let found = dependencies.find(|spelled| spelled.split(' ').next() == Some(name));
    found.expect("the controller depends on it")
}

pub(super) fn version(name: &str) -> &'static str {
    package(direct(name)).version
}

/// The lock file of a controller whose model's crate is `name`.
pub(super) fn text(banner: &str, name: &str) -> String {
    let mut dependencies = DIRECT.map(direct).to_vec();
    let mut texts = BTreeSet::new();
    let mut open = dependencies.clone();
    while let Some(spelled) = open.pop() {
        let package = package(spelled);
        if texts.insert(package.text) {
            open.extend(&package.dependencies);
        }
    }
    dependencies.push(name);
    dependencies.sort_unstable();
    let list: String = (dependencies.iter().map(|name| format!(" \"{name}\",\n"))).collect();
    let own = format!("name = \"{name}\"\nversion = \"0.1.0\"");
    let controller =
        format!("name = \"{name}-controller\"\nversion = \"0.1.0\"\ndependencies = [\n{list}]");
    texts.extend([own.as_str(), &controller]);
    let packages = texts.iter().map(|text| format!("\n[[package]]\n{text}\n"));
    format!("{banner}\nversion = 4\n{}", packages.collect::<String>())
}

/// The tests at the end of a file, and the text of the sources themselves, which stay here.
const ENDS: [&str; 2] = ["\n#[cfg(test)]\nmod tests", "\n#[cfg(feature = \"serde\")]"];

pub(crate) const LICENCES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../../../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../../../LICENSE-MIT")),
];

/// The sources below the generated crate, each with a first line that states its origin.
pub(crate) fn files(provenance: &str) -> impl Iterator<Item = (String, String)> {
    let below = |folder: &str, path: &str| format!("{folder}{}", path.replace("lib.rs", "mod.rs"));
    let control = romc_control::sources::SOURCES
        .iter()
        .map(move |file| ("", file));
    let robot = romc_robot::sources::SOURCES
        .iter()
        .map(move |file| ("robot/", file));
    control.chain(robot).map(move |(folder, (path, text))| {
        let path = below(folder, path);
        let code = (ENDS.iter()).fold(*text, |text, end| text.split(end).next().unwrap_or(text));
        let text = format!(
            "// {provenance}\n// The same in every controller that romc generates.\n{}\n",
            code.trim_end()
        );
        (format!("src/{path}"), text)
    })
}
