//! A Rust crate without `std` and without allocation: `NAME/Cargo.toml`, `NAME/src/lib.rs` and
//! `NAME/tests/selftest.rs`.

mod dialect;
mod selftest;

use askama::Template;

use super::code::Function;
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::ModelFunctions;
use super::interface::ModelInterface;
use super::line_wrapping::{comment_lines, tidy};
use super::phase_text::PhaseText;
use super::precision::Precision;
use super::printer::Printer;
use super::requirements::{calls_kernel, has_fours};
use super::sin_cos::KernelText;
use super::sines::SineCosine;
use crate::files::EmittedFile;
use dialect::RustDialect;

#[derive(Template)]
#[template(path = "rust/cargo.askama", config = "../../templates/askama.toml")]
struct Cargo<'a> {
    banner: String,
    name: &'a str,
}

#[derive(Template)]
#[template(path = "rust/lib.askama", config = "../../templates/askama.toml")]
struct Lib<'a> {
    banner: String,
    model: &'a str,
    real: &'static str,
    /// An unsigned integer as wide.
    bits: String,
    is_single: bool,
    is_library: bool,
    units: String,
    latent_dim: usize,
    n_lanes: usize,
    has_lanes: bool,
    state_dim: Option<usize>,
    kernel: Option<KernelText>,
    tables: Vec<String>,
    /// Whether there are sums of vectors of four numbers.
    has_fours: bool,
    /// Whether rows of tables are read by wide registers.
    has_aligned: bool,
    maps: Vec<String>,
    phases: Vec<PhaseText<String>>,
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
    let dialect = RustDialect { precision };
    let kernel = || KernelText::new(precision, &|literal| dialect.literal(literal));
    let mut functions = ModelFunctions::new(entries, &dialect, "");
    if sines == SineCosine::Library {
        functions.sines_point_by_point();
    }
    let printer = Printer::new(&dialect);
    let print = |function: &Function| dialect.definition(function, &printer);
    let uses_kernel = functions.all().any(|function| calls_kernel(&function.body));
    let lib = Lib {
        banner: format!("// {provenance}"),
        model: &entries.name,
        real: dialect.real(),
        bits: format!("u{}", precision.bits()),
        is_single: precision == Precision::Single,
        is_library: sines == SineCosine::Library,
        units: entries.units_in_words(),
        latent_dim: entries.latent_dim,
        n_lanes: precision.lanes(),
        has_lanes: functions.lanes.iter().any(Option::is_some),
        state_dim: entries.state_dim,
        kernel: uses_kernel.then(kernel),
        has_fours: functions.all().any(|function| has_fours(&function.body)),
        has_aligned: functions.tables.iter().any(|table| table.is_in_lanes),
        tables: (functions.tables.iter())
            .map(|table| dialect.table(table))
            .collect(),
        maps: functions.maps.iter().map(print).collect(),
        phases: (entries.phases.iter())
            .zip(functions.phases.iter().zip(&functions.lanes))
            .map(|(phase, (functions, lanes))| {
                PhaseText::new(phase, functions.iter().map(print).collect(), numbers)
                    .with_lanes(lanes.as_deref(), &printer)
            })
            .collect(),
    };
    let cargo = Cargo {
        banner: format!("# {provenance}"),
        name,
    };
    let selftest = selftest::render(entries, &dialect, &format!("// {provenance}"))?;
    Ok(vec![
        EmittedFile::new(format!("{name}/Cargo.toml"), tidy(&cargo.render()?)),
        EmittedFile::new(format!("{name}/src/lib.rs"), tidy(&lib.render()?)),
        EmittedFile::new(format!("{name}/tests/selftest.rs"), tidy(&selftest)),
    ])
}

fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    comment_lines(&[texts.join(", ")], 90).join("\n   ")
}
