//! The modules of `src` and of its crates import only those that the table of ARCHITECTURE.md allows, all in rows above
//! their own. A controller setting, a kind of rows and an elementary function each appear in few files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use romc::mpc::problem::RowKind;

/// The sources of a crate by its name in the table: a module is one of their folders, or all of them.
fn sources_of(name: &str) -> String {
    match name {
        "romc" => "src".to_owned(),
        name => format!("src/{}", name.trim_matches('`')),
    }
}

/// A row of the table: a module, its crate and the modules that it may import.
struct Row {
    place: String,
    room: String,
    may_import: BTreeSet<String>,
}

/// Rows of the table whose header has the columns `crate`, `room` and `may import`.
fn table(text: &str) -> Vec<Row> {
    let cells = |line: &str| -> Vec<String> {
        (line
            .trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().to_owned()))
        .collect()
    };
    let mut lines = text.lines().filter(|line| line.starts_with('|'));
    let header = lines.find_map(|line| {
        let cells = cells(line);
        let column = |name: &str| cells.iter().position(|cell| cell == name);
        Some((column("crate")?, column("room")?, column("may import")?))
    });
    let (own, room, may_import) = header.expect("a table with these columns");
    let mut rows: Vec<Row> = Vec::new();
    for line in lines.skip(1) {
        let cells = cells(line);
        let names = |cell: &str| -> Vec<String> {
            cell.split('`')
                .skip(1)
                .step_by(2)
                .map(str::to_owned)
                .collect()
        };
        let may_import = match cells[may_import].as_str() {
            "all" => rows
                .iter()
                .map(|row| row.room.clone())
                .chain(["Error".to_owned()])
                .collect(),
            "nothing" => BTreeSet::new(),
            cell => names(cell).into_iter().collect(),
        };
        let place = sources_of(&cells[own]);
        let room = names(&cells[room]).remove(0);
        rows.push(Row {
            place,
            room,
            may_import,
        });
    }
    rows
}

/// A crate with a single module has no folder for it.
fn is_whole_crate(row: &Row, rows: &[Row]) -> bool {
    rows.iter().filter(|other| other.place == row.place).count() == 1
}

/// The lines of a source file outside comments and `#[cfg(test)]` items, and the modules that are
/// declared for tests alone. Relies on rustfmt: an item ends at the indentation at which it began.
fn product_code(text: &str) -> (String, Vec<String>) {
    let (mut code, mut test_modules) = (String::new(), Vec::new());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim_start().starts_with("#[cfg(test)]") {
            let item = lines.find(|line| !line.trim_start().starts_with("#["));
            let item = item.expect("an item follows its attribute");
            let indentation = &item[..item.len() - item.trim_start().len()];
            if let Some(name) = item
                .trim()
                .strip_prefix("mod ")
                .and_then(|rest| rest.strip_suffix(';'))
            {
                test_modules.push(name.to_owned());
            }
            let ends = |line: &str| line.ends_with(';') || line.ends_with('}');
            if !ends(item) {
                lines.find(|line| {
                    let at_start = line.strip_prefix(indentation);
                    at_start.is_some_and(|rest| !rest.starts_with([' ', ')']) && ends(rest))
                });
            }
            continue;
        }
        code.push_str(line.split("//").next().unwrap_or_default());
        code.push('\n');
    }
    (code, test_modules)
}

/// First names after `crate::`, of plain paths and of `crate::{a::b, c}`.
fn imported_rooms(code: &str) -> BTreeSet<String> {
    let name = |text: &str| -> String {
        text.chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    let mut rooms = BTreeSet::new();
    for (at, found) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let path = &code[at + found.len()..];
        let Some(group) = path.strip_prefix('{') else {
            rooms.insert(name(path));
            continue;
        };
        let (mut depth, mut item) = (0, String::new());
        for c in group.chars() {
            match c {
                ',' | '}' if depth == 0 => {
                    rooms.insert(name(item.trim()));
                    item.clear();
                    if c == '}' {
                        break;
                    }
                    continue;
                }
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            item.push(c);
        }
    }
    rooms.remove("");
    rooms
}

/// Longest chain of `super::` in a file.
fn supers(code: &str) -> usize {
    let chains = code
        .match_indices("super::")
        .filter(|(at, _)| !code[..*at].ends_with("super::"));
    let length =
        |text: &str| (text.len() - text.trim_start_matches("super::").len()) / "super::".len();
    chains.map(|(at, _)| length(&code[at..])).max().unwrap_or(0)
}

/// Visits the source files below a folder, except those declared for tests alone.
fn visit(folder: &Path, depth: usize, file: &mut impl FnMut(&Path, &str, usize)) {
    let entries = fs::read_dir(folder).expect("a readable folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    let sources: Vec<_> = (paths.iter())
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .map(|path| (path, product_code(&fs::read_to_string(path).expect("text"))))
        .collect();
    let test_modules: BTreeSet<&str> = sources
        .iter()
        .flat_map(|(_, (_, names))| names)
        .map(String::as_str)
        .collect();
    let is_test = |path: &Path| {
        path.file_stem()
            .and_then(|stem| stem.to_str())
            .is_some_and(|stem| test_modules.contains(stem))
    };
    for (path, (code, _)) in &sources {
        let module_depth = if path.ends_with("mod.rs") {
            depth
        } else {
            depth + 1
        };
        if !is_test(path) {
            file(path, code, module_depth);
        }
    }
    for path in paths.iter().filter(|path| path.is_dir() && !is_test(path)) {
        visit(path, depth + 1, file);
    }
}

#[test]
fn rooms_import_only_what_the_table_of_architecture_allows() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let map = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let rows = table(&map);
    let mut faults = Vec::new();
    let mut imports: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for row in &rows {
        let is_whole_crate = is_whole_crate(row, &rows);
        let folder = match is_whole_crate {
            true => root.join(&row.place),
            false => root.join(&row.place).join(&row.room),
        };
        if !folder.is_dir() {
            faults.push(format!(
                "the table has `{}`, {} has no such folder",
                row.room, row.place
            ));
            continue;
        }
        let used = imports.entry(&row.room).or_default();
        visit(&folder, 1, &mut |path, code, depth| {
            let path = path.strip_prefix(root).expect("below the root").display();
            for room in imported_rooms(code) {
                let is_own = room == row.room || is_whole_crate;
                if !is_own && !row.may_import.contains(&room) {
                    faults.push(format!(
                        "{path} imports `{room}`, which `{}` may not",
                        row.room
                    ));
                }
                used.insert(room);
            }
            let code_alone = code.replace("\"romc_version\"", "");
            let names_a_crate =
                code_alone.contains("romc_") && !code.contains("::sources::SOURCES");
            if names_a_crate && !path.to_string().ends_with("lib.rs") {
                faults.push(format!("{path} names a crate, expected `crate::`"));
            }
            if supers(code) >= depth && !is_whole_crate {
                faults.push(format!("{path} leaves its room by `super::`"));
            }
        });
    }
    let places: BTreeSet<&String> = (rows.iter())
        .filter(|row| !is_whole_crate(row, &rows))
        .map(|row| &row.place)
        .collect();
    let entries = (places.iter()).map(|place| fs::read_dir(root.join(place)).expect("a folder"));
    for entry in entries.flatten() {
        let path = entry.expect("an entry").path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a name");
        let is_crate = path.join("Cargo.toml").is_file();
        if path.is_dir()
            && !path.is_symlink()
            && !is_crate
            && rows.iter().all(|row| row.room != name)
        {
            faults.push(format!("src has `{name}`, the table has no such room"));
        }
    }
    let mut above = BTreeSet::from(["Error".to_owned()]);
    for row in &rows {
        for room in row.may_import.difference(&above) {
            faults.push(format!(
                "`{}` may import `{room}`, which is not above it",
                row.room
            ));
        }
        let used = &imports.get(row.room.as_str()).cloned().unwrap_or_default();
        if row.room != "cli" {
            for room in row.may_import.difference(used) {
                faults.push(format!("`{}` may import `{room}`, but does not", row.room));
            }
        }
        above.insert(row.room.clone());
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Files below a folder that contain a matching identifier. Unit tests, documentation and generated files do not count.
fn naming(folder: &Path, is_meant: &dyn Fn(&str) -> bool, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("an entry").path();
        if path.is_symlink() {
            continue; // a crate's link to the templates
        } else if path.is_dir() {
            naming(&path, is_meant, found);
        } else if let Ok(text) = fs::read_to_string(&path)
            && !path.ends_with("readme.askama")
            && !text
                .lines()
                .next()
                .unwrap_or_default()
                .contains("@generated")
        {
            let is_end = |c: char| !(c.is_alphanumeric() || c == '_');
            let code = text.split("\n#[cfg(test)]\nmod tests").next();
            if code.is_some_and(|code| code.split(is_end).any(is_meant)) {
                found.push(path);
            }
        }
    }
}

/// The same in the sources of all languages.
fn naming_anywhere(is_meant: &dyn Fn(&str) -> bool) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in ["src", "templates", "python/src", "python/python"] {
        naming(&root.join(folder), is_meant, &mut found);
    }
    found
}

#[test]
fn an_elementary_function_is_named_in_few_files() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    naming(&src, &|word| ["tan", "Tan"].contains(&word), &mut found);
    assert!((1..=8).contains(&found.len()), "{found:?}");
}

#[test]
fn a_setting_of_the_controller_stands_in_at_most_four_files() {
    for setting in [
        "swing_turn",
        "flight_torque",
        "lift_prior_weight",
        "joint_penalty",
        "effectiveness_time_s",
        "drive_stiffness_nm_rad",
        "torque_rate_nm_s",
        "body_friction",
    ] {
        let found = naming_anywhere(&|word| word == setting);
        assert!((1..=4).contains(&found.len()), "{setting}: {found:?}");
    }
}

/// `TorqueRate`, `TORQUE_RATES` and `torque_rates` in one spelling, behind an underscore.
fn spelled(identifier: &str) -> String {
    let is_upper = !identifier.contains(|c: char| c.is_lowercase());
    let mut out = "_".to_owned();
    for c in identifier.chars() {
        if c.is_uppercase() && !is_upper && out.len() > 1 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

/// Earlier names of kinds of rows, also in the layouts of the solvers and in the C.
const EARLIER_NAMES: [&str; 15] = [
    "motor_torque",
    "torque_row",
    "torque_bound",
    "n_torque",
    "rate_row",
    "rate_bound",
    "rate_at_reference",
    "n_rate",
    "joint_range",
    "joint_row",
    "joint_bound",
    "n_joint",
    "write_friction",
    "friction_shape",
    "has_pyramid",
];

/// Quantities of a robot, and a count of violations, whose names contain those of two kinds of rows.
const OF_ROBOTS: [&str; 6] = [
    "TORQUE_LIMIT",
    "torque_limit",
    "torque_limit_nm",
    "joint_limits",
    "joint_limit_rad",
    "beyond_joint_limit_rad",
];

/// The files in which one of these names begins a word of an identifier, in any spelling: `TorqueRate`,
/// `torque_rate_nm_s`, `UPPER_TORQUE_RATES`. Flags of the command line and their ranges do not count, nor does `data`:
/// its rows and rates are those of regressions.
fn naming_rows(names: &[&str]) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let names: Vec<String> = names.iter().map(|name| spelled(name)).collect();
    let mut found = naming_anywhere(&|word| {
        let spelled = spelled(word);
        !OF_ROBOTS.contains(&word) && names.iter().any(|name| spelled.contains(name))
    });
    let others = ["src/cli", "src/model/limits", "src/data"].map(|folder| root.join(folder));
    found.retain(|path| !others.iter().any(|folder| path.starts_with(folder)));
    found
}

#[test]
fn a_kind_of_rows_stands_in_at_most_three_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let problem = fs::read_to_string(root.join("src/control/online/problem.rs")).expect("text");
    let (_, kinds) = (problem.split_once("pub enum RowKind {")).expect("the kinds");
    let kinds = kinds.split_once("\n}").expect("their end").0.lines();
    let kinds: Vec<&str> = kinds
        .filter_map(|line| line.trim().strip_suffix(','))
        .filter(|line| !line.starts_with("//"))
        .collect();
    assert_eq!(kinds, RowKind::ALL.map(|kind| format!("{kind:?}")));
    for kind in kinds {
        let found = naming_rows(&[kind]);
        assert!((1..=3).contains(&found.len()), "{kind}: {found:?}");
    }
}

#[test]
fn rows_of_one_kind_have_no_names_of_their_own() {
    let found = naming_rows(&EARLIER_NAMES);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn imported_rooms_reads_paths_and_groups_but_not_comments_or_tests() {
    let text = "\
//! Docs name [`crate::cli`].
use crate::model::{Library, Phase};
use crate::{lower::{self, dynamics}, sim, symbolic::ExprPool};
#[cfg(test)]
mod fixtures;
fn f() -> crate::Error {
    mycrate::g() // crate::report
}

#[cfg(test)]
fn only_for_tests(
    a: usize,
) -> crate::study::Plan {
    let x = 1;
    crate::train::run(x)
}

pub use crate::ir::Program;

#[cfg(test)]
mod tests {
    use crate::mpc::Plant;
}
";
    let (code, test_modules) = product_code(text);
    assert_eq!(test_modules, ["fixtures"]);
    let rooms: Vec<_> = imported_rooms(&code).into_iter().collect();
    assert_eq!(rooms, ["Error", "ir", "lower", "model", "sim", "symbolic"]);
    assert_eq!(supers("use super::super::model::X; use super::y;"), 2);
}

#[test]
fn table_reads_its_columns_by_name() {
    let text = "\
| room | holds | crate | may import |
|---|---|---|---|
| `artifact` | x | `model` | nothing |
| `lower` | programs | `codegen` | `artifact`, `ir`'s types |
| `cli` | all | romc | all |
";
    let rows = table(text);
    let names = |row: &Row| row.may_import.iter().cloned().collect::<Vec<_>>();
    let places = rows.iter().map(|row| row.place.as_str());
    assert_eq!(
        places.collect::<Vec<_>>(),
        ["src/model", "src/codegen", "src"]
    );
    assert_eq!(rows[0].may_import.len(), 0);
    assert_eq!(names(&rows[1]), ["artifact", "ir"]);
    assert_eq!(names(&rows[2]), ["Error", "artifact", "lower"]);
}
