//! The test of the generated crate.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::dialect::Dialect;
use crate::codegen::error::CodegenError;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::comment_lines;
use crate::codegen::literal::Literal;
use crate::codegen::precision::Precision;
use crate::codegen::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};

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
    points: usize,
    latent_dim: usize,
    dialect: &'a RustDialect,
    vectors: TestVectors<'a>,
}

pub(super) fn render(
    entries: &ModelInterface,
    dialect: &RustDialect,
    banner: &str,
) -> Result<String, CodegenError> {
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        real: dialect.real(),
        is_single: dialect.precision == Precision::Single,
        tolerance: format!("{TOLERANCE_F64:?}"),
        points: N_POINTS,
        latent_dim: entries.latent_dim,
        dialect,
        vectors: TestVectors::new(entries, dialect.precision),
    };
    Ok(test.render()?)
}

impl SelfTest<'_> {
    /// What a parameter holds before the calls, a line a row.
    fn before(&self, parameter: &ParameterVectors) -> Vec<String> {
        rows(parameter, &parameter.before, |literal| {
            self.dialect.literal(literal)
        })
    }

    /// What is expected after them, with all digits in either precision.
    fn after(&self, parameter: &ParameterVectors) -> Vec<String> {
        rows(parameter, &parameter.after, |literal| literal.to_string())
    }
}

fn rows(
    parameter: &ParameterVectors,
    values: &[f64],
    spell: impl Fn(Literal) -> String,
) -> Vec<String> {
    let words = ["f64::NAN", "f64::INFINITY", "f64::NEG_INFINITY"];
    let rows = parameter.rows(values, spell, words).into_iter();
    rows.map(|row| {
        let lines = comment_lines(&[row.join(", ")], 80);
        format!("[{}]", lines.join("\n           "))
    })
    .collect()
}

fn argument(parameter: &ParameterVectors) -> String {
    let upper = parameter.name.to_ascii_uppercase();
    match parameter.role {
        Role::Input => format!("&{upper}_IN[point]"),
        Role::Scalar => format!("{upper}_IN[point][0]"),
        Role::Output | Role::InOut => format!("&mut {}", parameter.name),
    }
}
