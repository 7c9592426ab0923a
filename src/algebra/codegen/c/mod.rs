//! C99: `NAME.h`, `NAME.c`, `NAME_selftest.c` and `CMakeLists.txt`.

mod dialect;
mod selftest;

use askama::Template;

use super::code::{Function, MathFunction, Stmt};
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::ModelFunctions;
use super::interface::ModelInterface;
use super::line_wrapping::{braced, tidy};
use super::phase_text::PhaseText;
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
    /// Prototypes, as those of the phases.
    maps: Vec<String>,
    phases: Vec<PhaseText<String>>,
}

#[derive(Template)]
#[template(path = "c/source.askama", config = "../../templates/askama.toml")]
struct Source<'a> {
    banner: String,
    name: &'a str,
    upper: String,
    real: &'static str,
    /// What numbers of that type end with.
    f: &'static str,
    /// Bytes of a number.
    size: usize,
    is_single: bool,
    is_library: bool,
    latent_dim: usize,
    n_lanes: usize,
    kernel: Option<KernelText>,
    /// Whether rows of tables are read in lanes.
    has_lanes: bool,
    /// Whether rows of functions are added in eight lanes.
    has_rows: bool,
    /// Whether there are sums of vectors of four numbers.
    has_fours: bool,
    sign: bool,
    tables: Vec<String>,
    maps: Vec<String>,
    phases: Vec<PhaseText<String>>,
}

#[derive(Template)]
#[template(path = "c/cmake.askama", config = "../../templates/askama.toml")]
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
    let prototype = |function: &Function| dialect.prototype(function);
    let of_phases = || entries.phases.iter().zip(&functions.phases);
    let banner = format!("/* {provenance} */");
    let is_single = precision == Precision::Single;
    let header = Header {
        banner: banner.clone(),
        model: &entries.name,
        upper: dialect.upper(),
        is_single,
        units: entries.units_in_words(),
        latent_dim: entries.latent_dim,
        state_dim: entries.state_dim,
        maps: functions.maps.iter().map(prototype).collect(),
        phases: of_phases()
            .map(|(phase, functions)| {
                let batch = batch_prototype(&dialect, &phase.identifier);
                let functions = functions.iter().map(prototype).chain([batch]);
                PhaseText::new(phase, functions.collect(), numbers)
            })
            .collect(),
    };
    let has = |is: &dyn Fn(&[Stmt]) -> bool| functions.all().any(|function| is(&function.body));
    let source = Source {
        banner: banner.clone(),
        name,
        upper: dialect.upper(),
        real: dialect.real(),
        f: dialect.suffix(),
        size: precision.bits() / 8,
        is_single,
        is_library: sines == SineCosine::Library,
        latent_dim: entries.latent_dim,
        n_lanes: precision.lanes(),
        kernel: has(&calls_kernel)
            .then(|| KernelText::new(precision, &|literal| dialect.literal(literal))),
        has_lanes: functions.tables.iter().any(|table| table.is_in_lanes),
        has_rows: has(&|body| !assigned_in_lanes(body).is_empty()),
        has_fours: has(&has_fours),
        sign: has(&|body| calls_function(body, MathFunction::Sign)),
        tables: (functions.tables.iter())
            .map(|table| dialect.table(table))
            .collect(),
        maps: functions.maps.iter().map(print).collect(),
        phases: (of_phases().zip(&functions.lanes))
            .map(|((phase, functions), lanes)| {
                PhaseText::new(phase, functions.iter().map(print).collect(), numbers)
                    .with_lanes(lanes.as_deref(), &printer)
            })
            .collect(),
    };
    let cmake = CMake {
        banner: format!("# {provenance}"),
        name,
    };
    Ok(vec![
        EmittedFile::new(format!("{name}.h"), tidy(&header.render()?)),
        EmittedFile::new(format!("{name}.c"), tidy(&source.render()?)),
        EmittedFile::new(
            format!("{name}_selftest.c"),
            tidy(&selftest::render(entries, &dialect, &banner)?),
        ),
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
