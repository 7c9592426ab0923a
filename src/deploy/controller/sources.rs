//! The sources of romc that every generated controller holds.

/// The tests at the end of a file, and the text of the sources themselves, which stay here.
const ENDS: [&str; 2] = ["\n#[cfg(test)]\nmod tests", "\n#[cfg(feature = \"serde\")]"];

pub(crate) const LICENCES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../../../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../../../LICENSE-MIT")),
];

/// The sources below the generated crate, each with a first line that says what it is.
pub fn files(provenance: &str) -> impl Iterator<Item = (String, String)> {
    let robot = romc_robot::sources::SOURCES.iter();
    let robot =
        robot.map(|(name, text)| (format!("robot/{}", name.replace("lib.rs", "mod.rs")), *text));
    let control = romc_control::sources::SOURCES.iter();
    let control = control.map(|(path, text)| ((*path).to_owned(), *text));
    control.chain(robot).map(move |(path, text)| {
        let code = ENDS
            .iter()
            .fold(text, |text, end| text.split(end).next().unwrap_or(text));
        let text = format!(
            "// {provenance}\n// The same in every controller that romc generates.\n{}\n",
            code.trim_end()
        );
        (format!("src/{path}"), text)
    })
}
