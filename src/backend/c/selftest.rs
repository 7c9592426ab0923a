//! The self-test that runs next to the generated C.

use askama::Template;

use crate::backend::code::Role;
use crate::backend::entries::{Entry, ModelEntries};
use crate::backend::target::EmitError;
use crate::backend::vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, vectors};
use crate::backend::wrap::braced;

#[derive(Template)]
#[template(path = "c/selftest.askama", config = "templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    name: &'a str,
    tolerance: String,
    points: usize,
    latent_dim: usize,
    tests: Vec<Test>,
    /// Phases, each with an angle that its batches meet.
    phases: Vec<(&'a str, &'static str)>,
}

struct Test {
    /// Name of the function without the model's.
    name: String,
    function: String,
    arrays: Vec<Array>,
    locals: Vec<Local>,
    arguments: String,
    checks: Vec<Check>,
}

/// A constant array with one row a point.
struct Array {
    name: String,
    rows: usize,
    cols: usize,
    entries: String,
}

/// A variable that the function writes.
struct Local {
    name: String,
    len: usize,
    copied_from: Option<String>,
}

struct Check {
    name: String,
    len: usize,
    expected: String,
}

pub(super) fn render(entries: &ModelEntries, banner: &str) -> Result<String, EmitError> {
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        tolerance: format!("{TOLERANCE_F64:?}"),
        points: N_POINTS,
        latent_dim: entries.latent_dim,
        tests: entries
            .all()
            .map(|entry| Test::new(&entries.identifier, entry))
            .collect(),
        phases: entries
            .phases
            .iter()
            .map(|phase| (phase.identifier.as_str(), phase.far_angle()))
            .collect(),
    };
    Ok(test.render()?)
}

impl Test {
    fn new(model: &str, entry: &Entry) -> Self {
        let mut test = Self {
            name: entry.name.clone(),
            function: format!("{model}_{}", entry.name),
            arrays: Vec::new(),
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
        let (before, after) = (format!("{name}_in"), format!("{name}_expected"));
        if !vectors.before.is_empty() {
            self.array(&before, vectors.len, &vectors.before);
        }
        if !vectors.after.is_empty() {
            self.array(&after, vectors.len, &vectors.after);
            self.checks.push(Check {
                name: name.clone(),
                len: vectors.len,
                expected: after,
            });
        }
        match vectors.role {
            Role::Input => format!("{before}[point]"),
            Role::Scalar => format!("{before}[point][0]"),
            Role::Output | Role::InOut => {
                self.locals.push(Local {
                    name: name.clone(),
                    // C has no empty arrays.
                    len: vectors.len.max(1),
                    copied_from: (vectors.role == Role::InOut).then_some(before),
                });
                name.clone()
            }
        }
    }

    fn array(&mut self, name: &str, cols: usize, values: &[f64]) {
        let rows: Vec<String> = values
            .chunks(cols)
            .map(|row| {
                let texts: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
                format!("\n        {}", braced(&texts, "\n         "))
            })
            .collect();
        self.arrays.push(Array {
            name: name.to_owned(),
            rows: rows.len(),
            cols,
            entries: format!("{{{}\n    }}", rows.join(",")),
        });
    }
}
