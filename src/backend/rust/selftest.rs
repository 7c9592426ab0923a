//! The test of the generated crate.

use askama::Template;

use crate::backend::code::Role;
use crate::backend::entries::{Entry, ModelEntries};
use crate::backend::target::EmitError;
use crate::backend::vectors::{ParameterVectors, TOLERANCE_F64, vectors};
use crate::backend::wrap::comment_lines;

#[derive(Template)]
#[template(path = "rust/selftest.askama", config = "templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    name: &'a str,
    tolerance: String,
    latent_dim: usize,
    tests: Vec<Test>,
    /// Phases, each with an angle that its batches meet.
    phases: Vec<(&'a str, &'static str)>,
}

struct Test {
    name: String,
    /// Constant arrays with one row a point: name, number of columns, rows.
    arrays: Vec<(String, usize, Vec<String>)>,
    points: usize,
    /// Variables that the function writes: name and initial value.
    locals: Vec<(String, String)>,
    arguments: String,
    /// Variable and its expected values.
    checks: Vec<(String, String)>,
}

pub(super) fn render(entries: &ModelEntries, banner: &str) -> Result<String, EmitError> {
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        tolerance: format!("{TOLERANCE_F64:?}"),
        latent_dim: entries.latent_dim,
        tests: entries.all().map(Test::new).collect(),
        phases: entries
            .phases
            .iter()
            .map(|phase| (phase.identifier.as_str(), phase.far_angle()))
            .collect(),
    };
    Ok(test.render()?)
}

impl Test {
    fn new(entry: &Entry) -> Self {
        let mut test = Self {
            name: entry.name.clone(),
            arrays: Vec::new(),
            points: crate::backend::vectors::N_POINTS,
            locals: Vec::new(),
            arguments: String::new(),
            checks: Vec::new(),
        };
        let mut arguments = Vec::new();
        for vectors in vectors(entry) {
            arguments.push(test.parameter(&vectors));
        }
        test.arguments = arguments.join(", ");
        test
    }

    /// Adds the arrays of a parameter and returns the argument.
    fn parameter(&mut self, vectors: &ParameterVectors) -> String {
        let name = &vectors.name;
        let upper = name.to_ascii_uppercase();
        let (before, after) = (format!("{upper}_IN"), format!("{upper}_EXPECTED"));
        if !vectors.before.is_empty() {
            self.array(&before, vectors.len, &vectors.before);
        }
        if !vectors.after.is_empty() {
            self.array(&after, vectors.len, &vectors.after);
            self.checks.push((name.clone(), after));
        }
        match vectors.role {
            Role::Input => format!("&{before}[point]"),
            Role::Scalar => format!("{before}[point][0]"),
            Role::Output => {
                let initial = format!("[0.0; {}]", vectors.len);
                self.locals.push((name.clone(), initial));
                format!("&mut {name}")
            }
            Role::InOut => {
                self.locals.push((name.clone(), format!("{before}[point]")));
                format!("&mut {name}")
            }
        }
    }

    fn array(&mut self, name: &str, cols: usize, values: &[f64]) {
        let rows = values
            .chunks(cols)
            .map(|row| {
                let texts: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
                format!(
                    "[{}]",
                    comment_lines(&[texts.join(", ")], 80).join("\n           ")
                )
            })
            .collect();
        self.arrays.push((name.to_owned(), cols, rows));
    }
}
