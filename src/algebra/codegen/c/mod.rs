//! C99: `NAME.h`, `NAME.c`, `NAME_selftest.c` and `CMakeLists.txt`.

mod dialect;
mod selftest;

use askama::Template;

use super::code::{Function, MathFunction, Stmt};
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::ModelFunctions;
use super::interface::{ModelInterface, PhaseInterface};
use super::line_wrapping::braced;
use super::precision::Precision;
use super::printer::Printer;
use super::requirements::{assigned_in_lanes, calls_function, calls_kernel, has_fours};
use super::sin_cos::KernelText;
use super::sines::SineCosine;
use crate::files::EmittedFile;
use dialect::CDialect;

#[derive(Template)]
#[template(path = "c/header.askama", config = "../../templates/askama.toml")]
struct Header<'a> {
    banner: String,
    model: &'a str,
    upper: String,
    is_single: bool,
    units: String,
    latent_dim: usize,
    state_dim: Option<usize>,
    maps: Vec<String>,
    phases: Vec<PhaseText>,
}

#[derive(Template)]
#[template(path = "c/source.askama", config = "../../templates/askama.toml")]
struct Source<'a> {
    banner: String,
    name: &'a str,
    real: &'static str,
    /// What numbers of that type end with.
    f: &'static str,
    latent_dim: usize,
    n_lanes: usize,
    kernel: Option<String>,
    lanes: Option<String>,
    sign: bool,
    tables: Vec<String>,
    maps: Vec<String>,
    phases: Vec<PhaseText>,
}

#[derive(Template)]
#[template(path = "c/kernel.askama", config = "../../templates/askama.toml")]
struct Kernel<'a> {
    name: &'a str,
    upper: String,
    real: &'static str,
    /// What numbers of that type end with.
    f: &'static str,
    /// An unsigned integer as wide.
    bits: &'static str,
    /// From bit 1 to the sign.
    to_sign: u32,
    is_single: bool,
    is_library: bool,
    k: KernelText,
}

#[derive(Template)]
#[template(path = "c/lanes.askama", config = "../../templates/askama.toml")]
struct LaneText<'a> {
    name: &'a str,
    upper: String,
    real: &'static str,
    /// Bytes of a number.
    size: usize,
    /// Whether rows of functions are added in eight lanes.
    has_rows: bool,
    /// Whether there are sums of vectors of four numbers.
    has_fours: bool,
}

#[derive(Template)]
#[template(path = "c/cmake.askama", config = "../../templates/askama.toml")]
struct CMake<'a> {
    banner: String,
    name: &'a str,
}

/// A phase in header and source.
#[derive(Clone)]
struct PhaseText {
    identifier: String,
    /// Beginning of its macros.
    upper: String,
    nnz: usize,
    /// Length of the pattern's arrays, which cannot be empty in C.
    stored: usize,
    rows: String,
    cols: String,
    prototypes: Vec<String>,
    functions: Vec<String>,
    /// Body of the loop over the lanes of a batch.
    lanes: Option<String>,
    /// Whether that loop has sines, whose arguments may be beyond the kernel's limit.
    lanes_have_angles: bool,
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
    let dialect = CDialect {
        name: name.to_owned(),
        precision,
    };
    let mut functions = ModelFunctions::new(entries, &dialect, &format!("{name}_"));
    if sines == SineCosine::Library {
        functions.sines_point_by_point();
    }
    let printer = Printer::new(&dialect);
    let print = |function: &Function| dialect.definition(function, &printer);
    let phases: Vec<PhaseText> = entries
        .phases
        .iter()
        .zip(functions.phases.iter().zip(&functions.lanes))
        .map(|(phase, (functions, lanes))| PhaseText {
            lanes: lanes.as_ref().map(|lanes| printer.statements(lanes, 3)),
            lanes_have_angles: lanes.as_ref().is_some_and(|lanes| calls_kernel(lanes)),
            ..PhaseText::new(name, phase, functions, &dialect, &print)
        })
        .collect();
    let banner = format!("/* {provenance} */");
    let header = Header {
        banner: banner.clone(),
        model: &entries.name,
        upper: dialect.upper(),
        is_single: precision == Precision::Single,
        units: entries.units_in_words(),
        latent_dim: entries.latent_dim,
        state_dim: entries.state_dim,
        maps: functions
            .maps
            .iter()
            .map(|map| dialect.prototype(map))
            .collect(),
        phases: phases.clone(),
    };
    let uses_kernel = functions.all().any(|function| calls_kernel(&function.body));
    let has = |is: fn(&[Stmt]) -> bool| functions.all().any(|function| is(&function.body));
    let (has_rows, has_fours) = (
        has(|body| !assigned_in_lanes(body).is_empty()),
        has(has_fours),
    );
    let uses_lanes = functions.tables.iter().any(|table| table.is_in_lanes);
    let source = Source {
        banner: banner.clone(),
        name,
        real: dialect.real(),
        f: dialect.suffix(),
        latent_dim: entries.latent_dim,
        n_lanes: precision.lanes(),
        kernel: uses_kernel.then(|| kernel(&dialect, sines)).transpose()?,
        lanes: uses_lanes
            .then(|| lanes(&dialect, has_rows, has_fours))
            .transpose()?,
        sign: functions
            .all()
            .any(|function| calls_function(&function.body, MathFunction::Sign)),
        tables: functions
            .tables
            .iter()
            .map(|table| printer.table(table))
            .collect(),
        maps: functions.maps.iter().map(print).collect(),
        phases,
    };
    let cmake = CMake {
        banner: format!("# {provenance}"),
        name,
    };
    Ok(vec![
        EmittedFile::new(format!("{name}.h"), finished(header.render()?)),
        EmittedFile::new(format!("{name}.c"), finished(source.render()?)),
        EmittedFile::new(
            format!("{name}_selftest.c"),
            finished(selftest::render(entries, &dialect, &banner)?),
        ),
        EmittedFile::new("CMakeLists.txt", finished(cmake.render()?)),
    ])
}

impl PhaseText {
    fn new(
        name: &str,
        phase: &PhaseInterface,
        functions: &[Function; 3],
        dialect: &CDialect,
        print: &dyn Fn(&Function) -> String,
    ) -> Self {
        let numbers = |values: &[usize]| {
            let mut texts: Vec<String> = values.iter().map(usize::to_string).collect();
            if texts.is_empty() {
                texts.push("0".to_owned());
            }
            braced(&texts, "\n    ")
        };
        let mut prototypes: Vec<String> = functions
            .iter()
            .map(|function| dialect.prototype(function))
            .collect();
        prototypes.push(batch_prototype(dialect, &phase.identifier));
        Self {
            identifier: phase.identifier.clone(),
            upper: format!("{name}_{}", phase.identifier).to_ascii_uppercase(),
            nnz: phase.pattern.len(),
            stored: phase.pattern.len().max(1),
            rows: numbers(&phase.pattern.rows),
            cols: numbers(&phase.pattern.cols),
            prototypes,
            functions: functions.iter().map(print).collect(),
            lanes: None,
            lanes_have_angles: false,
        }
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

fn kernel(dialect: &CDialect, sines: SineCosine) -> Result<String, CodegenError> {
    let name = dialect.name.as_str();
    let (bits, to_sign) = match dialect.precision {
        Precision::Double => ("uint64_t", 62),
        Precision::Single => ("uint32_t", 30),
    };
    let kernel = Kernel {
        name,
        upper: dialect.upper(),
        real: dialect.real(),
        f: dialect.suffix(),
        bits,
        to_sign,
        is_single: dialect.precision == Precision::Single,
        is_library: sines == SineCosine::Library,
        k: KernelText::new(dialect.precision, &|literal| dialect.literal(literal)),
    };
    Ok(kernel.render()?)
}

fn lanes(dialect: &CDialect, has_rows: bool, has_fours: bool) -> Result<String, CodegenError> {
    let lanes = LaneText {
        name: &dialect.name,
        upper: dialect.upper(),
        real: dialect.real(),
        size: match dialect.precision {
            Precision::Double => 8,
            Precision::Single => 4,
        },
        has_rows,
        has_fours,
    };
    Ok(lanes.render()?)
}

/// Ends with exactly one newline and has no blank lines in a row.
fn finished(text: String) -> String {
    super::line_wrapping::tidy(&text)
}
