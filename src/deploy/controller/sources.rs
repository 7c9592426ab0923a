//! The sources of romc that every generated controller holds.

/// The tests at the end of a file, which stay here.
const TESTS: &str = "\n#[cfg(test)]\nmod tests";

pub(crate) const LICENCES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../../../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../../../LICENSE-MIT")),
];

/// Path below `src` and text of files, by their folders.
macro_rules! sources {
    ($($folder:literal: $($file:ident)*;)*) => {
        &[$($((
            concat!($folder, "/", stringify!($file), ".rs"),
            include_str!(concat!("../../", $folder, "/", stringify!($file), ".rs")),
        )),*),*]
    };
}

const SOURCES: &[(&str, &str)] = sources! {
    "motion/mpc/online":
        command conic control_model controller dense effectiveness engine error estimate fallback horizon
        interface lift linearise mod plan problem prune qp reference settings stage step structured swing;
    "algebra/robot":
        actuators chain error feet geometry input_rule joints kinematics mod registry wrench;
    "motion/solver":
        interior links lower mod point problem riccati rows scalar solve;
};

/// The sources below the generated crate, each with a first line that says what it is.
pub fn files(provenance: &str) -> impl Iterator<Item = (String, String)> {
    SOURCES.iter().map(move |(path, text)| {
        let code = text.split(TESTS).next().unwrap_or(text);
        let (_, room) = path.split_once('/').expect("a crate, then a room");
        let path = room.trim_start_matches("mpc/");
        let text = format!(
            "// {provenance}\n// The same in every controller that romc generates.\n{}\n",
            code.trim_end()
        );
        (format!("src/{path}"), text)
    })
}
