//! The sources of romc that every generated controller holds.

/// The tests at the end of a file, which stay here.
const TESTS: &str = "\n#[cfg(test)]\nmod tests";

/// The licences of these sources.
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
        interior links lower mod point problem riccati rows scalar solve wide;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_all_files_of_their_folders() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        for folder in [
            "motion/mpc/online",
            "motion/mpc/online/interface",
            "algebra/robot",
            "motion/solver",
        ] {
            let mut found: Vec<String> = std::fs::read_dir(root.join(folder))
                .expect("a folder of sources")
                .map(|entry| entry.expect("an entry").file_name())
                .map(|name| format!("{folder}/{}", name.to_string_lossy()))
                .filter(|path| path.ends_with(".rs"))
                .collect();
            found.sort();
            let listed: Vec<&str> = SOURCES
                .iter()
                .map(|(path, _)| *path)
                .filter(|path| path.rsplit_once('/').map(|(parent, _)| parent) == Some(folder))
                .collect();
            assert_eq!(listed, found);
        }
    }

    #[test]
    fn sources_import_nothing_of_romc_but_robot_and_solver_and_end_before_their_tests() {
        for (path, text) in files("made by a test") {
            let code = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("//"));
            for line in code {
                assert!(!line.contains("#[cfg(test)]"), "{path}: {line}");
                for rest in line.split("crate::").skip(1) {
                    let is_emitted = rest.starts_with("robot") || rest.starts_with("solver");
                    assert!(is_emitted, "{path}: {line}");
                }
            }
        }
    }
}
