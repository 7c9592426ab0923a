//! C99: `NAME.h`, `NAME.c`, `NAME_selftest.c` and `CMakeLists.txt`.

mod dialect;

use askama::Template;

use super::code::Role;
use super::interface::{ModelInterface, computes_angles};
use super::line_wrapping::{braced, tidy};
use super::model_text::ModelText;
use super::options::CodegenError;
use super::options::Precision;
use super::options::SineCosine;
use super::sin_cos::KernelText;
use super::tables::Tables;
use super::test_vectors::{N_POINTS, ParameterVectors, TOLERANCE_F64, TestVectors};
use crate::files::EmittedFile;
use crate::ir::{Binary, Statement, Unary};
use dialect::CDialect;

/// Functions are prototypes and definitions.
type Text<'a> = ModelText<'a, (String, String)>;

#[derive(Template)]
#[template(path = "c/header.askama", config = "templates/askama.toml")]
struct Header<'a> {
    banner: &'a str,
    d: &'a CDialect,
    m: &'a Text<'a>,
}

#[derive(Template)]
#[template(path = "c/source.askama", config = "templates/askama.toml")]
struct Source<'a> {
    banner: &'a str,
    d: &'a CDialect,
    m: &'a Text<'a>,
    is_library: bool,
    kernel: Option<KernelText>,
    sign: bool,
    pow: bool,
    select: bool,
}

#[derive(Template)]
#[template(path = "c/cmake.askama", config = "templates/askama.toml")]
struct CMake<'a> {
    banner: String,
    name: &'a str,
}

/// The C files of a model; `provenance` is the text of the first line.
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
    let d = &CDialect {
        name: name.to_owned(),
        precision,
    };
    let print = |f, _: &Tables| (d.prototype(&f), d.definition(&f));
    let text = ModelText::new(entries, d, &format!("{name}_"), print, numbers);
    let m = &text.with_lanes(d, sines);
    let banner = &format!("/* {provenance} */");
    let header = Header { banner, d, m };
    let source = Source {
        banner,
        d,
        m,
        is_library: sines == SineCosine::Library,
        kernel: (entries.has(computes_angles)).then(|| KernelText::new(precision, d)),
        sign: entries.has(|s| matches!(s, Statement::Unary(Unary::Sign, _))),
        pow: entries.has(|s| matches!(s, Statement::Binary(Binary::Pow, ..))),
        select: entries.has(|s| matches!(s, Statement::Select(_))),
    };
    let cmake = CMake {
        banner: format!("# {provenance}"),
        name,
    };
    let words = ["NAN", "INFINITY", "-INFINITY"];
    let selftest = SelfTest {
        banner,
        d,
        latent_dim: entries.latent_dim,
        vectors: TestVectors::new(entries, d, precision, words),
    };
    let file =
        |ending: &str, text: String| EmittedFile::new(format!("{name}{ending}"), tidy(&text));
    Ok(vec![
        file(".h", header.render()?),
        file(".c", source.render()?),
        file("_selftest.c", selftest.render()?),
        EmittedFile::new("CMakeLists.txt", tidy(&cmake.render()?)),
    ])
}

/// Initialiser of an array, which cannot be empty in C.
fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    match texts.is_empty() {
        true => "{0}".to_owned(),
        false => braced(&texts, "\n    "),
    }
}

fn batch_prototype(dialect: &CDialect, phase: &str) -> String {
    let (name, real) = (&dialect.name, dialect.real());
    let docs = [
        format!("{name}_{phase}_dynamics at `count` points."),
        "Points are contiguous per variable: element k of point p is z[k * count + p], and alike \
         for dz, u_lat and ddz."
            .to_owned(),
    ];
    format!(
        "{}void {name}_{phase}_dynamics_batch(size_t count, const {real} *z, const {real} *dz,\n    \
         const {real} *u_lat, {real} *ddz);",
        dialect::documentation(&docs)
    )
}

#[derive(Template)]
#[template(path = "c/selftest.askama", config = "templates/askama.toml")]
struct SelfTest<'a> {
    banner: &'a str,
    d: &'a CDialect,
    latent_dim: usize,
    vectors: TestVectors<'a>,
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
