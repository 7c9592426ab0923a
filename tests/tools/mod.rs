//! Tools of the machine that some tests need, and the thoroughness of comparisons.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::process::Command;
use std::sync::{Mutex, OnceLock};

/// Whether the run is thorough, with all tools: ROMC_REQUIRE_TOOLS=1, as in `.ci/run`.
pub fn is_thorough() -> bool {
    std::env::var("ROMC_REQUIRE_TOOLS").is_ok_and(|value| value == "1")
}

/// `all` in a thorough run; otherwise `few`, with which all tests finish within minutes.
pub fn thorough_or<T>(all: T, few: T) -> T {
    if is_thorough() { all } else { few }
}

/// The Python to use: from the environment named by `ROMC_PYTHON`, or from the path.
pub fn python() -> Command {
    Command::new(std::env::var("ROMC_PYTHON").unwrap_or_else(|_| "python3".to_owned()))
}

/// Whether the tool command `probe` succeeds. If not, the calling test is skipped with a message, or fails in a
/// thorough run.
pub fn answers(probe: &mut Command) -> bool {
    let found = probe.output().is_ok_and(|output| output.status.success());
    if !found {
        assert!(!is_thorough(), "{probe:?} fails and ROMC_REQUIRE_TOOLS=1");
        say_once(format!("skipped: {probe:?} fails"));
    }
    found
}

/// Whether a program with the flag `--version` exists, see [`answers`].
pub fn is_there(tool: &str) -> bool {
    answers(Command::new(tool).arg("--version"))
}

/// Whether checks with a tool that needs minutes should run: only in a thorough run, where `probe` must succeed. In
/// other runs a message is printed.
pub fn is_asked_for(tool: &str, probe: &mut Command) -> bool {
    if is_thorough() {
        return answers(probe);
    }
    say_once(format!(
        "skipped: checks with `{tool}` run with ROMC_REQUIRE_TOOLS=1"
    ));
    false
}

/// The same for a program with the flag `--version`.
pub fn has(tool: &str) -> bool {
    is_asked_for(tool, Command::new(tool).arg("--version"))
}

/// Whether the C compiler finds the libraries that `flags` need, such as those of sanitizers; in thorough runs only.
pub fn has_compiler_with(compiler: &str, flags: &[&str]) -> bool {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = folder.path().join("probe.c");
    fs::write(&source, "int main(void) { return 0; }\n").expect("written");
    let mut probe = Command::new(compiler);
    probe.args(flags).arg(&source).arg("-o");
    probe.arg(folder.path().join("probe"));
    is_asked_for(&format!("{compiler} {}", flags.join(" ")), &mut probe)
}

/// Whether pdflatex is installed with all packages of the emitted documents: if some are missing, LaTeX counts as
/// missing.
pub fn has_latex() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let document = format!(
            "\\documentclass{{article}}\n{}\\begin{{document}}$\\ddot z_1 = 0$ \\textbf{{text}}\\end{{document}}\n",
            LATEX_PACKAGES.map(|package| format!("\\usepackage{package}\n")).concat()
        );
        fs::write(folder.path().join("probe.tex"), document).expect("written");
        let mut probe = Command::new("pdflatex");
        probe
            .args(["-interaction=nonstopmode", "-halt-on-error", "probe.tex"])
            .current_dir(folder.path());
        answers(&mut probe)
    })
}

/// Whether a document class of LaTeX is installed.
pub fn has_latex_class(name: &str) -> bool {
    answers(Command::new("kpsewhich").arg(format!("{name}.cls")))
}

/// Packages that `tests/latex.rs` and the emitted previews load.
const LATEX_PACKAGES: [&str; 9] = [
    "[T1]{fontenc}",
    "[utf8]{inputenc}",
    "{lmodern}",
    "{textcomp}",
    "{geometry}",
    "{amsmath}",
    "{booktabs}",
    "{longtable}",
    "{siunitx}",
];

fn say_once(line: String) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if SAID.lock().expect("no panic").insert(line.clone()) {
        // not by println!, which the test harness captures
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}
