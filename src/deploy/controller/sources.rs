//! The sources of romc that every generated controller holds.

/// The tests at the end of a file, which stay here.
const TESTS: &str = "\n#[cfg(test)]\nmod tests";

/// The licences of these sources.
pub const LICENCES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../../../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../../../LICENSE-MIT")),
];

macro_rules! sources {
    ($($path:literal),* $(,)?) => {
        [$(($path, include_str!(concat!("../../", $path)))),*]
    };
}

/// Path below `src` and text.
const SOURCES: [(&str, &str); 56] = sources![
    "mpc/online/command.rs",
    "mpc/online/control_model.rs",
    "mpc/online/controller.rs",
    "mpc/online/dense.rs",
    "mpc/online/dynamics.rs",
    "mpc/online/effectiveness.rs",
    "mpc/online/engine.rs",
    "mpc/online/error.rs",
    "mpc/online/estimate.rs",
    "mpc/online/fallback.rs",
    "mpc/online/horizon.rs",
    "mpc/online/interface/codes.rs",
    "mpc/online/interface/handle.rs",
    "mpc/online/interface/mod.rs",
    "mpc/online/interface/settings.rs",
    "mpc/online/interface/values.rs",
    "mpc/online/layout.rs",
    "mpc/online/lift.rs",
    "mpc/online/lift_cones.rs",
    "mpc/online/lift_pyramids.rs",
    "mpc/online/linearise.rs",
    "mpc/online/mod.rs",
    "mpc/online/nonlinear.rs",
    "mpc/online/plan.rs",
    "mpc/online/problem.rs",
    "mpc/online/prune.rs",
    "mpc/online/qp.rs",
    "mpc/online/reference.rs",
    "mpc/online/settings.rs",
    "mpc/online/sparse.rs",
    "mpc/online/step.rs",
    "mpc/online/structured.rs",
    "mpc/online/swing.rs",
    "mpc/online/transcribe.rs",
    "robot/actuators.rs",
    "robot/chain.rs",
    "robot/error.rs",
    "robot/feet.rs",
    "robot/geometry.rs",
    "robot/input_rule.rs",
    "robot/joints.rs",
    "robot/kinematics.rs",
    "robot/mod.rs",
    "robot/registry.rs",
    "robot/wrench.rs",
    "solver/interior.rs",
    "solver/links.rs",
    "solver/lower.rs",
    "solver/mod.rs",
    "solver/point.rs",
    "solver/problem.rs",
    "solver/riccati.rs",
    "solver/rows.rs",
    "solver/scalar.rs",
    "solver/solve.rs",
    "solver/wide.rs",
];

/// The sources below the generated crate, each with a first line that says what it is.
pub fn files(provenance: &str) -> impl Iterator<Item = (String, String)> {
    SOURCES.iter().map(move |(path, text)| {
        let code = text.split(TESTS).next().unwrap_or(text);
        let path = path.trim_start_matches("mpc/");
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
        for folder in ["mpc/online", "mpc/online/interface", "robot", "solver"] {
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
