//! The test of the generated crate.

use askama::Template;

use crate::codegen::code::Role;
use crate::codegen::line_wrapping::wrapped;
use crate::codegen::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};

use super::dialect::RustDialect;

#[derive(Template)]
#[template(path = "rust/selftest.askama", config = "../../templates/askama.toml")]
pub(super) struct SelfTest<'a> {
    pub banner: &'a str,
    pub name: &'a str,
    pub d: RustDialect,
    pub latent_dim: usize,
    pub vectors: TestVectors<'a>,
}

fn array(row: &[String]) -> String {
    let lines = wrapped(&row.join(", "), 80, " ");
    format!("[{}]", lines.join("\n           "))
}

fn argument(parameter: &ParameterVectors) -> String {
    let upper = parameter.name.to_ascii_uppercase();
    match parameter.role {
        Role::Input => format!("&{upper}_IN[point]"),
        Role::Scalar => format!("{upper}_IN[point][0]"),
        Role::Output | Role::InOut => format!("&mut {}", parameter.name),
    }
}
