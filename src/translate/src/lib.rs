//! C99 from the small subset of Rust that romc's solver and the steps of its controller are written in. In: sources, a
//! prefix for names, the functions that the C is for. Out: these, what they call, the types and constants that they
//! need, with comments. `cargo run -p romc-translate` writes `templates/controller_c/`; `tests/controller_c.rs`
//! compares it byte for byte. Read `function` first.
//!
//! | Rust | C |
//! |---|---|
//! | `T: Real` or the alias `Real`, `f64`, `usize` and `u32`, `bool` | `real`, `double`, `int`, `bool` |
//! | const parameters of structs | names that whoever includes the C defines |
//! | other const parameters of a function | one function for each value: `add_multiple_nx` |
//! | structs, arrays, enums without data, constants | the same |
//! | a trait | a struct that whoever includes the C defines, with its required methods; the others are made |
//! | `&mut [T; N]`, `&[T]` | pointers; those of `&mut` parameters are `restrict` |
//! | `stages.len()` of a field | a field `stages_len` |
//! | `part(x, i)`, `&x[i..]`, `x.split_at_mut(n)` | `x + i` |
//! | assignment of arrays; `x.sqrt()` | `memcpy`; `SQRT(x)` |
//! | `while`, `loop`, `for` over ranges, also reversed or in steps; `if`, also as a value | the same |
//!
//! Anything else is a [`Fault`] with file and line, where the C needs it. Indices are not checked in C: the Rust's
//! tests have to reach them. A sum or product keeps the order that it has in Rust, so that both have the same bits
//! without contraction.

mod call;
mod expression;
mod function;
mod items;
mod statement;
mod text;
mod types;

use std::path::Path;
use std::{fmt, fs};

/// A source: its path for faults, and its text.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path that faults name.
    pub path: String,
    /// Rust.
    pub text: String,
}

/// A construct that is outside the subset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Path of the source.
    pub path: String,
    /// Line, from 1.
    pub line: usize,
    /// The construct, and what is expected in its place.
    pub message: String,
}

pub(crate) type Found<T = expression::Value> = Result<T, Fault>;

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            path,
            line,
            message,
        } = self;
        write!(f, "{path}:{line}: {message}")
    }
}

impl std::error::Error for Fault {}

/// The names of the C.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unit<'a> {
    /// Before every name: `solver` for `solver_solve` and `SOLVER_WIDE`.
    pub prefix: &'a str,
    /// Functions that the C is for, as `Type::function` or `function`.
    pub roots: &'a [&'a str],
    /// Constants that whoever includes the C reads.
    pub constants: &'a [&'a str],
    /// Structs that nothing changes, which are `const` wherever they are pointed to.
    pub fixed: &'a [&'a str],
    /// Structs whose text stands apart, for a header.
    pub header: &'a [&'a str],
    /// Constants, structs and methods that state a condition, that whoever includes the C defines, with their names
    /// there; a struct keeps its own.
    pub elsewhere: &'a [(&'a str, &'a str)],
    /// What stands before the type of every function, with a space.
    pub attribute: &'a str,
}

impl<'a> Unit<'a> {
    pub(crate) fn elsewhere(&self, word: &str) -> Option<&'a str> {
        let found = self.elsewhere.iter().find(|(name, _)| *name == word);
        found.map(|(_, name)| *name)
    }
}

/// The text of a unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Translated {
    /// Structs of [`Unit::header`] and what they need.
    pub header: String,
    /// All else, in an order in which everything is declared before it is used.
    pub source: String,
}

/// Translates the functions of a unit, and all that they need.
pub fn translate(sources: &[Source], unit: &Unit<'_>) -> Result<Translated, Fault> {
    let items = items::Items::read(sources, unit)?;
    let mut writer = function::Writer::new(&items);
    for root in unit.roots {
        writer.root(root)?;
    }
    for name in unit.constants {
        writer.constant(name);
    }
    writer.finish(unit)
}

fn fault(path: &str, error: std::io::Error) -> Fault {
    let (path, message) = (path.to_owned(), error.to_string());
    Fault {
        path,
        line: 0,
        message,
    }
}

fn file(root: &Path, path: String) -> Result<Source, Fault> {
    let text = fs::read_to_string(root.join(&path)).map_err(|error| fault(&path, error))?;
    Ok(Source { path, text })
}

/// The sources of a folder of `src/control`.
fn read(root: &Path, folder: &str) -> Result<Vec<Source>, Fault> {
    let folder = format!("src/control/{folder}");
    let entries = fs::read_dir(root.join(&folder)).map_err(|error| fault(&folder, error))?;
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut paths: Vec<String> = names
        .map(|name| format!("{folder}/{}", name.to_string_lossy()))
        .collect();
    paths.sort();
    paths.into_iter().map(|path| file(root, path)).collect()
}

fn head(what: &str) -> String {
    format!(
        "/* @generated from src/control by `cargo run -p romc-translate`: {what} Names that are defined\n \
         * elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */\n\n"
    )
}

/// The C of the structured solver and of the controller, as paths below the workspace's folder and texts.
pub fn controller(root: &Path) -> Result<Vec<(&'static str, String)>, Fault> {
    let mut texts = solver_of(&read(root, "solver")?)?.to_vec();
    let unit = Unit {
        prefix: "online",
        roots: &[
            "Trajectory::state_at",
            "Trajectory::mean_input",
            "Trajectory::write_deviations",
            "Trajectory::comes_near",
            "Trajectory::schedule",
            "Trajectory::write_acceleration",
            "LatentDynamics::step",
            "LatentDynamics::write_gain",
            "write_still",
            "write_expected",
            "add_correction",
            "turn_force",
            "scale_dynamics",
            "row_size",
            "write_upright",
            "write_pyramid",
            "unscale",
            "write_defect",
            "clamped_torque",
            "clamped_joint",
            "Share::unknown",
            "Share::update",
            "write_torque",
            "free_optimum",
            "write_limits",
            "write_foot",
            "write_hessian",
            "change_rows",
            "add_wrench",
            "write_force_map",
            "write_world_axes",
        ],
        constants: &[
            "CURVATURE",
            "GAP",
            "LIFT_ITERATIONS",
            "MOST_TURN_RAD",
            "POSTURE_SHARE",
            "SLACK_PRICE",
            "SOFTENED_FROM",
        ],
        fixed: &["LegShape", "Settings"],
        header: &["Share"],
        elsewhere: &[
            ("MOST_LATENT", "D"),
            ("MOST_STATE", "X"),
            ("MOST_SQUARE", "D * D"),
            ("SQRT_HALF", "SQRT_HALF"),
            ("Settings", ""),
        ],
        attribute: "MAYBE_UNUSED ",
    };
    let mut sources = read(root, "online")?;
    sources.push(file(root, "src/robot/leg.rs".to_owned())?);
    let Translated { header, source } = translate(&sources, &unit)?;
    let state = head("state of the controller's own steps.") + &header;
    let steps = head("the controller's own steps.") + &source;
    texts.push(("templates/controller_c/online_state.h", state));
    texts.push(("templates/controller_c/online.c", steps));
    Ok(texts)
}

/// The C of sources of the solver.
pub fn solver_of(sources: &[Source]) -> Result<[(&'static str, String); 2], Fault> {
    let unit = Unit {
        prefix: "solver",
        roots: &[
            "Program::bounds_mut",
            "Program::shift",
            "Program::prepare",
            "Program::solve",
        ],
        header: &["Stage"],
        elsewhere: &[("is_linked", "LINKED")],
        ..Unit::default()
    };
    let Translated { header, source } = translate(sources, &unit)?;
    let types = head("a stage of the structured solver.") + &header;
    let functions = head("the structured solver.") + &source;
    Ok([
        ("templates/controller_c/solver_stage.h", types),
        ("templates/controller_c/solver.c", functions),
    ])
}
