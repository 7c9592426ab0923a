//! The test of the generated crate.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::dialect::Dialect;
use crate::codegen::error::CodegenError;
use crate::codegen::interface::{FunctionSpec, ModelInterface, PhaseInterface};
use crate::codegen::line_wrapping::comment_lines;
use crate::codegen::literal::Literal;
use crate::codegen::precision::{Precision, rounded_up};
use crate::codegen::test_points::BatchPoints;
use crate::codegen::test_vectors::{ParameterVectors, TOLERANCE_F64, batch_tolerance, vectors};

use super::dialect::RustDialect;

#[derive(Template)]
#[template(path = "rust/selftest.askama", config = "../../templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    name: &'a str,
    real: &'static str,
    is_single: bool,
    /// Relative tolerance of double precision.
    tolerance: String,
    latent_dim: usize,
    tests: Vec<Test>,
    phases: Vec<Batch<'a>>,
}

/// The batch of a phase.
struct Batch<'a> {
    phase: &'a str,
    /// First elements of the arrays, and an angle that the batch meets.
    points: BatchPoints,
    /// Absolute tolerance of single precision.
    tolerance: String,
}

impl<'a> Batch<'a> {
    fn new(phase: &'a PhaseInterface, precision: Precision) -> Self {
        let points = BatchPoints::new(phase, precision);
        Self {
            phase: phase.identifier.as_str(),
            tolerance: match precision {
                Precision::Double => String::new(),
                Precision::Single => rounded_up(batch_tolerance(phase, &points)),
            },
            points,
        }
    }
}

struct Test {
    name: String,
    /// Whether all results are finite at one of the points.
    is_defined: bool,
    /// Constant arrays with one row a point: name, type, number of columns, rows.
    arrays: Vec<(String, &'static str, usize, Vec<String>)>,
    points: usize,
    /// Variables that the function writes: name and initial value.
    locals: Vec<(String, String)>,
    arguments: String,
    /// Variable, its expected values and the absolute tolerance of single precision.
    checks: Vec<(String, String, String)>,
}

pub(super) fn render(
    entries: &ModelInterface,
    dialect: &RustDialect,
    banner: &str,
) -> Result<String, CodegenError> {
    let precision = dialect.precision;
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        real: dialect.real(),
        is_single: precision == Precision::Single,
        tolerance: format!("{TOLERANCE_F64:?}"),
        latent_dim: entries.latent_dim,
        tests: entries
            .all()
            .map(|entry| Test::new(dialect, entry))
            .collect(),
        phases: entries
            .phases
            .iter()
            .map(|phase| Batch::new(phase, precision))
            .collect(),
    };
    Ok(test.render()?)
}

impl Test {
    fn new(dialect: &RustDialect, entry: &FunctionSpec) -> Self {
        let vectors = vectors(entry, dialect.precision);
        let mut test = Self {
            name: entry.name.clone(),
            is_defined: vectors.defined > 0,
            arrays: Vec::new(),
            points: crate::codegen::test_vectors::N_POINTS,
            locals: Vec::new(),
            arguments: String::new(),
            checks: Vec::new(),
        };
        let mut arguments = Vec::new();
        for vectors in &vectors.parameters {
            arguments.push(test.parameter(dialect, vectors));
        }
        test.arguments = arguments.join(", ");
        test
    }

    /// Adds the arrays of a parameter and returns the argument.
    fn parameter(&mut self, dialect: &RustDialect, vectors: &ParameterVectors) -> String {
        let name = &vectors.name;
        let upper = name.to_ascii_uppercase();
        let (before, after) = (format!("{upper}_IN"), format!("{upper}_EXPECTED"));
        if !vectors.before.is_empty() {
            let spell = |value: f64| match Literal::new(value) {
                Some(literal) => dialect.literal(literal),
                None => non_finite(value),
            };
            let rows = rows(vectors.len, &vectors.before, &spell);
            self.arrays
                .push((before.clone(), dialect.real(), vectors.len, rows));
        }
        if !vectors.after.is_empty() {
            // What is expected has all digits in either precision.
            let rows = rows(
                vectors.len,
                &vectors.after,
                &|value| match value.is_finite() {
                    true => format!("{value:?}"),
                    false => non_finite(value),
                },
            );
            self.arrays.push((after.clone(), "f64", vectors.len, rows));
            let tolerance = rounded_up(vectors.tolerance_single);
            self.checks.push((name.clone(), after, tolerance));
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
}

/// The constant for a value that has no literal.
fn non_finite(value: f64) -> String {
    match (value.is_nan(), value > 0.0) {
        (true, _) => "f64::NAN".to_owned(),
        (false, true) => "f64::INFINITY".to_owned(),
        (false, false) => "f64::NEG_INFINITY".to_owned(),
    }
}

fn rows(cols: usize, values: &[f64], spell: &dyn Fn(f64) -> String) -> Vec<String> {
    values
        .chunks(cols)
        .map(|row| {
            let texts: Vec<String> = row.iter().map(|&value| spell(value)).collect();
            format!(
                "[{}]",
                comment_lines(&[texts.join(", ")], 80).join("\n           ")
            )
        })
        .collect()
}
