//! A Rust crate without `std` and without allocation: `NAME/Cargo.toml`, `NAME/src/lib.rs` and
//! `NAME/tests/selftest.rs`.

mod dialect;

use askama::Template;

use super::code::Role;
use super::interface::{ModelInterface, computes_angles};
use super::line_wrapping::{tidy, wrapped};
use super::model_text::ModelText;
use super::options::CodegenError;
use super::options::Precision;
use super::options::SineCosine;
use super::sin_cos::KernelText;
use super::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};
use crate::files::EmittedFile;
use dialect::RustDialect;

#[derive(Template)]
#[template(path = "rust/cargo.askama", config = "templates/askama.toml")]
struct Cargo<'a> {
    banner: String,
    name: &'a str,
}

#[derive(Template)]
#[template(path = "rust/lib.askama", config = "templates/askama.toml")]
struct Lib<'a> {
    banner: &'a str,
    d: RustDialect,
    m: ModelText<'a, String>,
    is_library: bool,
    kernel: Option<KernelText>,
}

/// The crate of a model; `provenance` is the text of each file's first line.
///
/// # Errors
/// [`CodegenError::Template`] if a template fails.
pub fn emit(
    entries: &ModelInterface,
    provenance: &str,
    precision: Precision,
    sines: SineCosine,
) -> Result<Vec<EmittedFile>, CodegenError> {
    let name = entries.identifier.as_str();
    let d = RustDialect { precision };
    let text = ModelText::new(entries, &d, "", |f, _| d.definition(&f), numbers);
    let banner = &format!("// {provenance}");
    let lib = Lib {
        banner,
        d,
        m: text.with_lanes(&d, sines),
        is_library: sines == SineCosine::Library,
        kernel: (entries.has(computes_angles)).then(|| KernelText::new(precision, &d)),
    };
    let cargo = Cargo {
        banner: format!("# {provenance}"),
        name,
    };
    let words = ["f64::NAN", "f64::INFINITY", "f64::NEG_INFINITY"];
    let selftest = SelfTest {
        banner,
        name,
        d,
        latent_dim: entries.latent_dim,
        vectors: TestVectors::new(entries, &d, precision, words),
    };
    let file = |path: &str, text: String| EmittedFile::new(format!("{name}/{path}"), tidy(&text));
    Ok(vec![
        file("Cargo.toml", cargo.render()?),
        file("src/lib.rs", lib.render()?),
        file("tests/selftest.rs", selftest.render()?),
    ])
}

fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    wrapped(&texts.join(", "), 90, " ").join("\n   ")
}

#[derive(Template)]
#[template(path = "rust/selftest.askama", config = "templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    name: &'a str,
    d: RustDialect,
    latent_dim: usize,
    vectors: TestVectors<'a>,
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
