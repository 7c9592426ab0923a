//! The self-test that runs next to the generated C.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::line_wrapping::braced;
use crate::codegen::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};

use super::dialect::CDialect;

#[derive(Template)]
#[template(path = "c/selftest.askama", config = "../../templates/askama.toml")]
pub(super) struct SelfTest<'a> {
    pub banner: &'a str,
    pub d: &'a CDialect,
    pub latent_dim: usize,
    pub vectors: TestVectors<'a>,
}

fn initialiser(rows: &[Vec<String>]) -> String {
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
