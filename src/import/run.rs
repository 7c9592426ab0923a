//! From a foreign file to a checked model, with the record of all decisions.
#![allow(missing_docs, reason = "the names are self-explanatory")]

use std::fs::File;

use serde::Serialize;

use super::options::refusal;
use super::*;

const MAX_FILE_BYTES: u64 = 256 << 20;

#[derive(Clone, Debug)]
pub struct Imported {
    pub model: ReducedModel,
    pub report: ImportReport,
}

/// Imports a model trained elsewhere.
///
/// # Errors
/// [`ImportError`] with the place, the text found and the expected text.
pub(crate) fn import(path: &Path, options: &ImportOptions) -> Read<Imported> {
    let (file, bytes) = read_file(path, MAX_FILE_BYTES).map_err(|fault| {
        let foreign = magic::arrays_by_neighbours(path);
        (foreign.and_then(|found| refusal(path, found))).unwrap_or(fault)
    })?;
    let format = Format::of_file(path, &bytes, options.format)?;
    import_from_bytes(&file, format, &bytes, options)
}

/// The name of a file and its bytes, at most one more than allowed.
pub(super) fn read_file(path: &Path, max: u64) -> Read<(String, Vec<u8>)> {
    let file = path.display().to_string();
    let mut bytes = Vec::new();
    match File::open(path).and_then(|open| open.take(max + 1).read_to_end(&mut bytes)) {
        Ok(_) => Ok((file, bytes)),
        Err(source) => Err(ImportError::io(&file, "read the file", source)),
    }
}

/// Imports a model from a file in memory; `file` names it in errors.
///
/// # Errors
/// As `import`. Never panics, for any bytes.
pub fn import_from_bytes(
    file: &str,
    format: Format,
    bytes: &[u8],
    options: &ImportOptions,
) -> Read<Imported> {
    let (parts, mut report) = match format {
        Format::Safetensors | Format::Npz => {
            check_size(file, bytes, MAX_FILE_BYTES)?;
            let tensors = match format {
                Format::Npz => tensors::open_npz(file, bytes)?,
                _ => tensors::open_safetensors(file, bytes)?,
            };
            assemble::parts(&tensors, options)?
        }
        Format::Equations | Format::Latex => {
            let usual = ["contact", "flight"].map(str::to_owned);
            let given = options.phases.iter().map(|rule| rule.name.clone());
            let known: Vec<String> = given.chain(usual).collect();
            let sections = sections(file, format, bytes, &options.symbols, &known)?;
            latent::parts(file, &sections, options)?
        }
    };
    (report.file, report.format) = (file.to_owned(), format.name());
    finish(parts, report, &Sha256::digest(bytes), options)
}

/// Imports tensors in memory, named as those of a file; `source` names them in errors, which are those of `import`.
pub fn import_tensors(
    source: &str,
    arrays: &[Tensor<'_>],
    options: &ImportOptions,
) -> Read<Imported> {
    let (parts, mut report) = assemble::parts(&tensors::open_arrays(source, arrays)?, options)?;
    (report.file, report.format) = (source.to_owned(), "arrays");
    finish(parts, report, &tensors::digest(arrays), options)
}

pub(super) fn check_size(file: &str, bytes: &[u8], max: u64) -> Read<()> {
    match bytes.len() as u64 > max {
        true => Err(too_large(file, Place::Whole, max, "bytes")),
        false => Ok(()),
    }
}

pub(super) fn too_large(file: &str, place: Place, max: u64, unit: &str) -> ImportError {
    let text = format!("found more than {max} {unit}, which no model needs");
    ImportError::text(file, place, text)
}

pub(super) fn damaged(file: &str, format: &str, found: impl fmt::Display) -> ImportError {
    let text = format!("not a usable {format} file: {found}");
    ImportError::text(file, Place::Whole, text)
}

fn sections(
    file: &str,
    format: Format,
    bytes: &[u8],
    symbols: &SymbolNames,
    known: &[String],
) -> Read<Sections> {
    check_size(file, bytes, equations::MAX_TEXT_BYTES)?;
    if format != Format::Latex {
        return equations::read(file, bytes);
    }
    let read = latex::read(file, bytes, symbols, known)?;
    let Some(found) = symbols.beyond(read.latent_dim) else {
        return Ok(read);
    };
    let dim = read.latent_dim;
    let expected = format!("variables of the {dim} latent coordinates of {file}");
    Err(ImportError::option("--symbols", found, expected))
}

/// Reads the equations of a file in memory; LaTeX has names of variables, and labels that end in `known` phases.
pub(crate) fn read_equations(
    file: &str,
    format: Format,
    bytes: &[u8],
    symbols: &SymbolNames,
    known: &[String],
) -> Read<Sections> {
    let read = sections(file, format, bytes, symbols, known)?;
    for equation in read.sections.iter().flat_map(|section| &section.equations) {
        // Each in a pool of its own: only faults are wanted.
        equation.parse(file, read.latent_dim, &mut ExprPool::new())?;
    }
    Ok(read)
}

fn finish(
    parts: Parts,
    mut report: ImportReport,
    digest: &[u8],
    options: &ImportOptions,
) -> Read<Imported> {
    report.state_dim = parts.state_dim();
    let model = build(&report.file, parts, provenance(&report, digest), options)?;
    report.latent_dim = model.latent_dim();
    report.library_dim = model.library().terms().len();
    Ok(Imported { model, report })
}

/// The origin as the model file keeps it: no folders, no time.
fn provenance(report: &ImportReport, digest: &[u8]) -> Map<String, Value> {
    let name = Path::new(&report.file).file_name();
    let name = name.map_or(report.file.as_str().into(), |name| name.to_string_lossy());
    let tensors = report.used.iter().map(|used| {
        let value = json!({ "tensor": used.tensor, "layout": used.layout });
        (used.role.clone(), value)
    });
    let mut entries = Map::new();
    entries.insert("imported_from".to_owned(), json!(name));
    entries.insert("format".to_owned(), json!(report.format));
    entries.insert("sha256".to_owned(), json!(hex(digest)));
    entries.insert("romc".to_owned(), json!(env!("CARGO_PKG_VERSION")));
    if !report.used.is_empty() {
        entries.insert("tensors".to_owned(), Value::Object(tensors.collect()));
    }
    entries
}

fn build(
    file: &str,
    parts: Parts,
    provenance: Map<String, Value>,
    options: &ImportOptions,
) -> Read<ReducedModel> {
    let (encoder, decoder) = (parts.encoder, parts.decoder);
    let map = (encoder.as_ref().map(|_| "an encoder")).or(decoder.as_ref().map(|_| "a decoder"));
    if let (Some(map), None) = (map, &parts.scaling) {
        let expected = "--scaling FACTOR (scaled value = factor times SI value: 0.1 for the \
                        published models, 1 for SI units)";
        let found = format!("{map} without scale factors");
        return Err(ImportError::at(file, Place::Whole, found, expected));
    }
    if options.robot.is_none() && options.actuators.is_some() {
        let found = "losses of joints without a robot";
        let expected = "--robot as well: go1, go2, a1, or a .toml or .urdf file";
        return Err(ImportError::option("--actuators", found, expected));
    }
    let mut builder = ReducedModel::builder(options.name.clone(), parts.library)
        .description(options.description.clone())
        .phases(parts.phases)
        .provenance(provenance)
        .scaling(parts.scaling)
        .all_input_statistics(parts.statistics)
        .robot(options.robot)
        .actuators(options.actuators.clone())
        .sample_time_s(options.sample_time_s);
    if let Some(encoder) = encoder {
        builder = builder.encoder(encoder);
    }
    if let Some(decoder) = decoder {
        builder = builder.decoder(decoder);
    }
    if options.robot.is_some() {
        builder = builder.wrench_frame(options.wrench_frame);
        if map.is_some() {
            let [state, input] = CoordinateNames::of_robot();
            builder = builder.state(state).input(input);
        }
    }
    (builder.build()).map_err(|source| ImportError::unusable(file, source))
}

/// Everything that was decided on the way from a foreign file to a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    pub file: String,
    /// Its kind: the name of a [`Format`](super::Format), or `arrays` for tensors in memory.
    pub format: &'static str,
    pub latent_dim: usize,
    /// Number of robot coordinates, if there is an encoder or decoder.
    pub state_dim: Option<usize>,
    pub library_dim: usize,
    /// The order of a standard library's terms in the file, by its name.
    pub library_order: Option<&'static str>,
    /// The candidate terms of a file of tensors in the order of its coefficients.
    pub terms: Vec<String>,
    pub(crate) used: Vec<UsedTensor>,
    pub(crate) unused: Vec<UnusedTensor>,
    pub(crate) equations: Vec<ReadEquation>,
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct UsedTensor {
    /// Its use, such as `encoder.weight`.
    pub role: String,
    pub tensor: String,
    pub shape: Vec<usize>,
    pub element: String,
    pub chosen: Chosen,
    pub layout: Layout,
}

/// Origin of the use of a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Chosen {
    Mapped,
    Named,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Layout {
    Column,
    Row,
    TermsByLatent,
    LatentByTerms,
    Plain,
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Layout::Column => "column vectors (W x), as in the model file",
            Layout::Row => "row vectors (x W), transposed",
            Layout::TermsByLatent => "one row per term, as in the model file",
            Layout::LatentByTerms => "one row per latent coordinate, transposed",
            Layout::Plain => "as stored",
        })
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct UnusedTensor {
    pub tensor: String,
    pub shape: Vec<usize>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct ReadEquation {
    pub phase: String,
    /// Its left side, such as `ddz1`.
    pub output: String,
    /// Line of its start, from 1.
    pub line: usize,
    pub terms: usize,
}
