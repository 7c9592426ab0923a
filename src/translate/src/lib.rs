//! C99 from the small subset of Rust that romc's solver and the steps of its controller are written in. In: Rust sources,
//! a prefix for names, the C templates that use them. Out: C of the functions that the templates call, and of the
//! functions, types and constants that these need, with comments. `cargo run -p romc-translate` writes `templates/controller_c/`; `tests/controller_c.rs`
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

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{fmt, fs};

use syn::{Block, Expr, Pat, spanned::Spanned};

use expression::Value;
use function::{Instance, Writer};
use items::{Function, Items};
use text::comment;
use types::Type;

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
    /// The construct, and the expected one.
    pub message: String,
}

pub(crate) type Found<T = Value> = Result<T, Fault>;

impl Fault {
    fn at(path: &str, line: usize, message: impl ToString) -> Self {
        let (path, message) = (path.to_owned(), message.to_string());
        Self {
            path,
            line,
            message,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.path, self.line, self.message)
    }
}

impl std::error::Error for Fault {}

/// The names in the C.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unit<'a> {
    /// Before every name: `solver` for `solver_solve` and `SOLVER_WIDE`.
    pub prefix: &'a str,
    /// C templates: every function that they call with the prefix is translated, with all that it needs.
    pub users: &'a [Source],
    /// Structs that are never changed: pointers to them are `const`.
    pub fixed: &'a [&'a str],
    /// Structs whose text is separate, to be put into a header.
    pub header: &'a [&'a str],
    /// Constants, structs and methods stating a condition that the including code defines, with their names there; a
    /// struct keeps its own.
    pub elsewhere: &'a [(&'a str, &'a str)],
    /// Text before the type of every function, with a space.
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
    /// Structs of [`Unit::header`] and the items that they need.
    pub header: String,
    /// All else, in an order in which everything is declared before it is used.
    pub source: String,
}

/// Words of C with the file and line where each is first, those that are called also with their parenthesis.
fn words(users: &[Source]) -> BTreeMap<&str, (&str, usize)> {
    let is_other = |letter: char| !letter.is_ascii_alphanumeric() && letter != '_';
    let mut words = BTreeMap::new();
    for Source { path, text } in users {
        for (number, line) in text.lines().enumerate() {
            for word in line.split_inclusive(is_other) {
                for word in [word, word.trim_end_matches(is_other)] {
                    words.entry(word).or_insert((path.as_str(), number + 1));
                }
            }
        }
    }
    words
}

/// Translates the functions that a unit is for, and all that they need.
pub fn translate(sources: &[Source], unit: &Unit<'_>) -> Result<Translated, Fault> {
    let items = Items::read(sources, unit)?;
    let mut writer = Writer::new(&items);
    let words = words(unit.users);
    for ((owner, name), function) in &items.functions {
        let is_called = words.contains_key(format!("{}(", items.method(owner, name)).as_str());
        if is_called && function.sizes.is_empty() {
            writer.function(owner, name, function, BTreeMap::new())?;
        }
    }
    for name in items.constants.keys() {
        if words.contains_key(items.constant_name(name).as_str()) {
            writer.constant(name);
        }
    }
    for (word, (path, line)) in words {
        let name = word.strip_suffix('(').unwrap_or("");
        if name.starts_with(&items.name(&[])) && !writer.done.contains_key(name) {
            let missing = || Fault::at(path, line, format!("no such function: `{name}`"));
            return Err(items.left_out.get(name).cloned().unwrap_or_else(missing));
        }
    }
    writer.finish(unit)
}

fn file(root: &Path, path: String) -> Result<Source, Fault> {
    let text = fs::read_to_string(root.join(&path)).map_err(|error| Fault::at(&path, 0, error))?;
    Ok(Source { path, text })
}

/// The files of a folder whose names have this ending.
fn read(root: &Path, folder: &str, end: &str) -> Result<Vec<Source>, Fault> {
    let entries = fs::read_dir(root.join(folder)).map_err(|error| Fault::at(folder, 0, error))?;
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut paths: Vec<String> = names
        .map(|name| format!("{folder}/{}", name.to_string_lossy()))
        .filter(|path| path.ends_with(end))
        .collect();
    paths.sort();
    paths.into_iter().map(|path| file(root, path)).collect()
}

/// Types and functions of a unit made from the sources of folders, each after a comment that names it.
fn texts(root: &Path, folders: &[&str], what: &str, unit: &Unit<'_>) -> Found<[String; 2]> {
    let mut sources = Vec::new();
    for folder in folders {
        sources.extend(read(root, folder, ".rs")?);
    }
    let Translated { header, source } = translate(&sources, unit)?;
    let from = folders.join(" and ");
    let head = |part: &str| {
        format!(
            "/* @generated from {from} by `cargo run -p romc-translate`: {part}{what}.\n * Names that are defined elsewhere: \
             real, the type of numbers; NX and NU, how many states and inputs there are. */\n\n"
        )
    };
    Ok([head("types of ") + &header, head("") + &source])
}

/// The C of the structured solver and of the controller, as paths below the workspace's folder and texts.
pub fn controller(root: &Path) -> Result<[(&'static str, String); 6], Fault> {
    let users = read(root, "templates/controller_c", ".askama")?;
    let solver = Unit {
        prefix: "solver",
        users: &users,
        header: &["Stage"],
        elsewhere: &[("is_linked", "LINKED")],
        attribute: "inline ",
        ..Unit::default()
    };
    let online = Unit {
        prefix: "online",
        users: &users,
        fixed: &[
            "LegShape",
            "FallbackSettings",
            "Settings",
            "Bounds",
            "Timing",
        ],
        header: &[
            "Share",
            "Memory",
            "PlanTime",
            "Supervisor",
            "Timing",
            "Routine",
        ],
        elsewhere: &[
            ("MOST_LATENT", "D"),
            ("MOST_STATE", "X"),
            ("MOST_SQUARE", "D * D"),
            ("SQRT_HALF", "SQRT_HALF"),
            ("Settings", ""),
        ],
        attribute: "MAYBE_UNUSED ",
    };
    let walk = Unit {
        prefix: "walk",
        users: &users,
        fixed: &["Gait"],
        header: &["Walker", "Gait"],
        attribute: "MAYBE_UNUSED ",
        ..Unit::default()
    };
    let folders = ["src/control/online"];
    let [walker, walk] = texts(root, &folders, "walks", &walk)?;
    let folders = ["src/control/solver"];
    let [stage, solver] = texts(root, &folders, "the structured solver", &solver)?;
    let folders = ["src/control/online", "src/robot"];
    let [state, steps] = texts(root, &folders, "the controller's own steps", &online)?;
    Ok([
        ("templates/controller_c/solver_stage.h", stage),
        ("templates/controller_c/solver.c", solver),
        ("templates/controller_c/online_state.h", state),
        ("templates/controller_c/online.c", steps),
        ("templates/controller_c/walk_state.h", walker),
        ("templates/controller_c/walk.c", walk),
    ])
}
