//! Tools of the machine that some tests need.

use std::io::Write as _;
use std::process::Command;

/// Whether everything is asked for, all tools included: with ROMC_REQUIRE_TOOLS=1, as `.ci/run` does.
pub fn is_thorough() -> bool {
    std::env::var("ROMC_REQUIRE_TOOLS").is_ok_and(|value| value == "1")
}

/// The Python to use: of the environment that `ROMC_PYTHON` names, or of the path.
#[allow(dead_code, reason = "some test binaries run none")]
pub fn python() -> Command {
    Command::new(std::env::var("ROMC_PYTHON").unwrap_or_else(|_| "python3".to_owned()))
}

/// Whether a tool answers to `probe`. Where it does not, the calling test says so and is skipped, or fails if
/// everything is asked for.
pub fn answers(probe: &mut Command) -> bool {
    let found = probe.output().is_ok_and(|output| output.status.success());
    if !found {
        assert!(!is_thorough(), "{probe:?} fails and ROMC_REQUIRE_TOOLS=1");
        // not by println!, which the test harness captures
        let _ = writeln!(std::io::stderr(), "skipped: {probe:?} fails");
    }
    found
}
