//! The self-test that runs next to the generated C.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::error::CodegenError;
use crate::codegen::interface::{FunctionSpec, ModelInterface, PhaseInterface};
use crate::codegen::line_wrapping::braced;
use crate::codegen::literal::Literal;
use crate::codegen::precision::{Precision, rounded_up};
use crate::codegen::test_points::BatchPoints;
use crate::codegen::test_vectors::{
    N_POINTS, ParameterVectors, TOLERANCE_F64, batch_tolerance, vectors,
};

use super::dialect::CDialect;
use crate::codegen::dialect::Dialect;

#[derive(Template)]
#[template(path = "c/selftest.askama", config = "../../templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    name: &'a str,
    real: &'static str,
    /// What numbers of that type end with.
    f: &'static str,
    is_single: bool,
    /// Relative tolerance of double precision.
    tolerance: String,
    points: usize,
    latent_dim: usize,
    tests: Vec<Test>,
    phases: Vec<Batch<'a>>,
}

/// The batch of a phase.
struct Batch<'a> {
    phase: &'a str,
    /// First elements of the arrays, and an angle that the batch meets.
    z: String,
    dz: String,
    u_lat: String,
    far_angle: String,
    /// Absolute tolerance of single precision.
    tolerance: String,
}

struct Test {
    /// Name of the function without the model's.
    name: String,
    function: String,
    arrays: Vec<Array>,
    locals: Vec<Local>,
    arguments: String,
    checks: Vec<Check>,
    /// Whether all results are finite at one of the points.
    is_defined: bool,
}

/// A constant array with one row a point.
struct Array {
    name: String,
    /// Type of its elements.
    real: &'static str,
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
    /// Absolute tolerance of single precision.
    tolerance: String,
}

pub(super) fn render(
    entries: &ModelInterface,
    dialect: &CDialect,
    banner: &str,
) -> Result<String, CodegenError> {
    let precision = dialect.precision;
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        real: dialect.real(),
        f: dialect.suffix(),
        is_single: precision == Precision::Single,
        tolerance: format!("{TOLERANCE_F64:?}"),
        points: N_POINTS,
        latent_dim: entries.latent_dim,
        tests: entries
            .all()
            .map(|entry| Test::new(dialect, entry))
            .collect(),
        phases: entries
            .phases
            .iter()
            .map(|phase| Batch::new(phase, dialect))
            .collect(),
    };
    Ok(test.render()?)
}

impl<'a> Batch<'a> {
    fn new(phase: &'a PhaseInterface, dialect: &CDialect) -> Self {
        let points = BatchPoints::new(phase, dialect.precision);
        let number = |value: f64| format!("{value:?}{}", dialect.suffix());
        Self {
            phase: phase.identifier.as_str(),
            z: number(points.z),
            dz: number(points.dz),
            u_lat: number(points.u_lat),
            far_angle: number(points.far_angle),
            tolerance: match dialect.precision {
                Precision::Double => String::new(),
                Precision::Single => rounded_up(batch_tolerance(phase, &points)),
            },
        }
    }
}

impl Test {
    fn new(dialect: &CDialect, entry: &FunctionSpec) -> Self {
        let model = &dialect.name;
        let mut test = Self {
            name: entry.name.clone(),
            function: format!("{model}_{}", entry.name),
            arrays: Vec::new(),
            locals: Vec::new(),
            arguments: String::new(),
            checks: Vec::new(),
            is_defined: true,
        };
        let mut arguments = Vec::new();
        let vectors = vectors(entry, dialect.precision);
        test.is_defined = vectors.defined > 0;
        for vectors in &vectors.parameters {
            arguments.push(test.parameter(dialect, vectors));
        }
        test.arguments = arguments.join(", ");
        test
    }

    /// Adds the arrays of a parameter and returns the argument.
    fn parameter(&mut self, dialect: &CDialect, vectors: &ParameterVectors) -> String {
        let name = &vectors.name;
        let (before, after) = (format!("{name}_in"), format!("{name}_expected"));
        if !vectors.before.is_empty() {
            let spell = |value: f64| match Literal::new(value) {
                Some(literal) => dialect.literal(literal),
                None => non_finite(value),
            };
            let rows = rows(vectors.len, &vectors.before, &spell);
            self.array(&before, dialect.real(), vectors.len, rows);
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
            self.array(&after, "double", vectors.len, rows);
            self.checks.push(Check {
                name: name.clone(),
                len: vectors.len,
                expected: after,
                tolerance: rounded_up(vectors.tolerance_single),
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

    fn array(&mut self, name: &str, real: &'static str, cols: usize, rows: Vec<String>) {
        self.arrays.push(Array {
            name: name.to_owned(),
            real,
            rows: rows.len(),
            cols,
            entries: format!("{{{}\n    }}", rows.join(",")),
        });
    }
}

/// The macro of math.h for a value that has no literal.
fn non_finite(value: f64) -> String {
    match (value.is_nan(), value > 0.0) {
        (true, _) => "NAN".to_owned(),
        (false, true) => "INFINITY".to_owned(),
        (false, false) => "-INFINITY".to_owned(),
    }
}

fn rows(cols: usize, values: &[f64], spell: &dyn Fn(f64) -> String) -> Vec<String> {
    values
        .chunks(cols)
        .map(|row| {
            let texts: Vec<String> = row.iter().map(|&value| spell(value)).collect();
            format!("\n        {}", braced(&texts, "\n         "))
        })
        .collect()
}
