//! The self-test that runs next to the generated C.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::dialect::Dialect;
use crate::codegen::error::CodegenError;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::braced;
use crate::codegen::literal::Literal;
use crate::codegen::precision::Precision;
use crate::codegen::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};

use super::dialect::CDialect;

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
    dialect: &'a CDialect,
    vectors: TestVectors<'a>,
}

pub(super) fn render(
    entries: &ModelInterface,
    dialect: &CDialect,
    banner: &str,
) -> Result<String, CodegenError> {
    let test = SelfTest {
        banner,
        name: &entries.identifier,
        real: dialect.real(),
        f: dialect.suffix(),
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
    /// What a parameter holds before the calls, as an initialiser.
    fn before(&self, parameter: &ParameterVectors) -> String {
        initialiser(parameter, &parameter.before, |literal| {
            self.dialect.literal(literal)
        })
    }

    /// What is expected after them, with all digits in either precision.
    fn after(&self, parameter: &ParameterVectors) -> String {
        initialiser(parameter, &parameter.after, |literal| literal.to_string())
    }
}

fn initialiser(
    parameter: &ParameterVectors,
    values: &[f64],
    spell: impl Fn(Literal) -> String,
) -> String {
    let rows = parameter.rows(values, spell, ["NAN", "INFINITY", "-INFINITY"]);
    let rows = rows
        .iter()
        .map(|row| format!("\n        {}", braced(row, "\n         ")));
    format!("{{{}\n    }}", rows.collect::<Vec<_>>().join(","))
}

fn argument(parameter: &ParameterVectors) -> String {
    let name = &parameter.name;
    match parameter.role {
        Role::Input => format!("{name}_in[point]"),
        Role::Scalar => format!("{name}_in[point][0]"),
        Role::Output | Role::InOut => name.clone(),
    }
}
