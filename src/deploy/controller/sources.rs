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
    "motion/mpc/online/command.rs",
    "motion/mpc/online/control_model.rs",
    "motion/mpc/online/controller.rs",
    "motion/mpc/online/dense.rs",
    "motion/mpc/online/dynamics.rs",
    "motion/mpc/online/effectiveness.rs",
    "motion/mpc/online/engine.rs",
    "motion/mpc/online/error.rs",
    "motion/mpc/online/estimate.rs",
    "motion/mpc/online/fallback.rs",
    "motion/mpc/online/horizon.rs",
    "motion/mpc/online/interface/codes.rs",
    "motion/mpc/online/interface/handle.rs",
    "motion/mpc/online/interface/mod.rs",
    "motion/mpc/online/interface/settings.rs",
    "motion/mpc/online/interface/values.rs",
    "motion/mpc/online/layout.rs",
    "motion/mpc/online/lift.rs",
    "motion/mpc/online/lift_cones.rs",
    "motion/mpc/online/lift_pyramids.rs",
    "motion/mpc/online/linearise.rs",
    "motion/mpc/online/mod.rs",
    "motion/mpc/online/nonlinear.rs",
    "motion/mpc/online/plan.rs",
    "motion/mpc/online/problem.rs",
    "motion/mpc/online/prune.rs",
    "motion/mpc/online/qp.rs",
    "motion/mpc/online/reference.rs",
    "motion/mpc/online/settings.rs",
    "motion/mpc/online/sparse.rs",
    "motion/mpc/online/step.rs",
    "motion/mpc/online/structured.rs",
    "motion/mpc/online/swing.rs",
    "motion/mpc/online/transcribe.rs",
    "algebra/robot/actuators.rs",
    "algebra/robot/chain.rs",
    "algebra/robot/error.rs",
    "algebra/robot/feet.rs",
    "algebra/robot/geometry.rs",
    "algebra/robot/input_rule.rs",
    "algebra/robot/joints.rs",
    "algebra/robot/kinematics.rs",
    "algebra/robot/mod.rs",
    "algebra/robot/registry.rs",
    "algebra/robot/wrench.rs",
    "motion/solver/interior.rs",
    "motion/solver/links.rs",
    "motion/solver/lower.rs",
    "motion/solver/mod.rs",
    "motion/solver/point.rs",
    "motion/solver/problem.rs",
    "motion/solver/riccati.rs",
    "motion/solver/rows.rs",
    "motion/solver/scalar.rs",
    "motion/solver/solve.rs",
    "motion/solver/wide.rs",
];

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
