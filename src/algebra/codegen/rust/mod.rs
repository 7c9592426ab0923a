//! A Rust crate without `std` and without allocation: `NAME/Cargo.toml`, `NAME/src/lib.rs` and
//! `NAME/tests/selftest.rs`.

mod dialect;
mod selftest;

use askama::Template;

use super::code::Function;
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::ModelFunctions;
use super::interface::{ModelInterface, PhaseInterface};
use super::line_wrapping::{comment_lines, tidy};
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
    bits: &'static str,
    /// From bit 1 to the sign.
    to_sign: u32,
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
    phases: Vec<PhaseText>,
}

struct PhaseText {
    identifier: String,
    /// Beginning of its constants.
    upper: String,
    nnz: usize,
    rows: String,
    cols: String,
    functions: Vec<String>,
    /// Body of the loop over the lanes of a batch.
    lanes: Option<String>,
    /// Whether that loop has sines, whose arguments may be beyond the kernel's limit.
    lanes_have_angles: bool,
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
    let (bits, to_sign) = match precision {
        Precision::Double => ("u64", 62),
        Precision::Single => ("u32", 30),
    };
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
        bits,
        to_sign,
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
        tables: functions
            .tables
            .iter()
            .map(|table| printer.table(table))
            .collect(),
        maps: functions.maps.iter().map(print).collect(),
        phases: entries
            .phases
            .iter()
            .zip(functions.phases.iter().zip(&functions.lanes))
            .map(|(phase, (functions, lanes))| PhaseText {
                lanes: lanes.as_ref().map(|lanes| printer.statements(lanes, 3)),
                lanes_have_angles: lanes.as_ref().is_some_and(|lanes| calls_kernel(lanes)),
                ..PhaseText::new(phase, functions, &print)
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

impl PhaseText {
    fn new(
        phase: &PhaseInterface,
        functions: &[Function; 3],
        print: &dyn Fn(&Function) -> String,
    ) -> Self {
        let numbers = |values: &[usize]| {
            let texts: Vec<String> = values.iter().map(usize::to_string).collect();
            comment_lines(&[texts.join(", ")], 90).join("\n   ")
        };
        Self {
            identifier: phase.identifier.clone(),
            upper: phase.identifier.to_ascii_uppercase(),
            nnz: phase.pattern.len(),
            rows: numbers(&phase.pattern.rows),
            cols: numbers(&phase.pattern.cols),
            functions: functions.iter().map(print).collect(),
            lanes: None,
            lanes_have_angles: false,
        }
    }
}
