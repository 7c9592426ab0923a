//! The way from a foreign file to a checked model.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};

use super::assemble::{self, ImportNotes, Parts};
use super::equations;
use super::error::ImportError;
use super::latent;
use super::latex;
use super::npz;
use super::options::{Format, ImportOptions};
use super::report::{ImportReport, ReadEquation};
use super::safetensors;
use super::tensors::{TensorFile, short_name};
use crate::model::{CoordinateNames, ReducedModel, StateMap};
use crate::robot::Robot;

/// Largest file that is read.
const MAX_FILE_BYTES: u64 = 256 << 20;

/// An imported model and what was decided on the way.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The model, checked like any other.
    pub model: ReducedModel,
    /// What became of each tensor or equation.
    pub report: ImportReport,
}

/// Imports a model trained elsewhere.
///
/// # Errors
/// [`ImportError`]; every variant says what was found and what was expected.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    let format = match options.format {
        Some(format) => format,
        None => Format::of_path(path)?,
    };
    let io = |source| ImportError::Io {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large from one that just fits.
    File::open(path)
        .and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(io)?;
    import_from_bytes(&path.display().to_string(), format, &bytes, options)
}

/// Imports a model from a file in memory; `file` names it in errors.
///
/// # Errors
/// As [`import`]. Never panics, whatever the bytes are.
pub fn import_from_bytes(
    file: &str,
    format: Format,
    bytes: &[u8],
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let max = match format {
        Format::Equations | Format::Latex => equations::MAX_TEXT_BYTES,
        Format::Safetensors | Format::Npz => MAX_FILE_BYTES,
    };
    if bytes.len() as u64 > max {
        return Err(ImportError::TooLarge {
            file: file.to_owned(),
            what: "the file".to_owned(),
            max,
            unit: "bytes",
        });
    }
    let (parts, news, equations) = match format {
        Format::Safetensors => {
            let infos = safetensors::infos(file, bytes)?;
            let (parts, news) = assemble::parts(&TensorFile::new(file, bytes, infos)?, options)?;
            (parts, news, Vec::new())
        }
        Format::Npz => {
            let infos = npz::infos(file, bytes)?;
            let (parts, news) = assemble::parts(&TensorFile::new(file, bytes, infos)?, options)?;
            (parts, news, Vec::new())
        }
        Format::Equations => of_equations(file, &equations::read(file, bytes)?, options)?,
        Format::Latex => {
            let usual = ["contact", "flight"].map(str::to_owned).into_iter();
            let known: Vec<String> = (options.phases.iter().map(|rule| rule.name.clone()))
                .chain(usual)
                .collect();
            let sections = latex::read(file, bytes, &options.symbols, &known)?;
            of_equations(file, &sections, options)?
        }
    };
    let origin = Origin {
        file,
        format,
        bytes,
    };
    finish(&origin, parts, news, equations, options)
}

fn of_equations(
    file: &str,
    sections: &equations::Sections,
    options: &ImportOptions,
) -> Result<(Parts, ImportNotes, Vec<ReadEquation>), ImportError> {
    let found = latent::latent(file, sections, options)?;
    let parts = Parts {
        library: found.library,
        phases: found.phases,
        encoder: None,
        decoder: None,
        scaling: options.scaling.clone(),
        statistics: Vec::new(),
    };
    let news = ImportNotes {
        notes: found.notes,
        ..ImportNotes::default()
    };
    Ok((parts, news, found.equations))
}

struct Origin<'o> {
    file: &'o str,
    format: Format,
    bytes: &'o [u8],
}

impl Origin<'_> {
    /// What the model file keeps of it: no folders, no time.
    fn provenance(&self, news: &ImportNotes) -> Map<String, Value> {
        let mut entries = Map::new();
        entries.insert("imported_from".to_owned(), json!(short_name(self.file)));
        entries.insert("format".to_owned(), json!(self.format));
        let digest = Sha256::digest(self.bytes);
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        entries.insert("sha256".to_owned(), json!(digest));
        entries.insert("romc".to_owned(), json!(env!("CARGO_PKG_VERSION")));
        if !news.used.is_empty() {
            let tensors = news.used.iter().map(|used| {
                let value = json!({ "tensor": used.tensor, "layout": used.layout });
                (used.role.clone(), value)
            });
            entries.insert("tensors".to_owned(), Value::Object(tensors.collect()));
        }
        entries
    }
}

/// Hands the parts to the builder that checks every model.
fn finish(
    origin: &Origin<'_>,
    parts: Parts,
    news: ImportNotes,
    equations: Vec<ReadEquation>,
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let has_map = parts.encoder.is_some() || parts.decoder.is_some();
    if has_map && parts.scaling.is_none() {
        return Err(ImportError::NoScaling {
            file: origin.file.to_owned(),
            part: match parts.encoder {
                Some(_) => "encoder",
                None => "decoder",
            },
        });
    }
    let state_dim = (parts.encoder.as_ref().map(StateMap::input_dim))
        .or(parts.decoder.as_ref().map(StateMap::output_dim));
    let mut builder = ReducedModel::builder(options.name.clone(), parts.library)
        .description(options.description.clone())
        .phases(parts.phases)
        .provenance(origin.provenance(&news));
    if let Some(encoder) = parts.encoder {
        builder = builder.encoder(encoder);
    }
    if let Some(decoder) = parts.decoder {
        builder = builder.decoder(decoder);
    }
    if let Some(scaling) = parts.scaling {
        builder = builder.scaling(scaling);
    }
    for (phase, statistics) in parts.statistics {
        builder = builder.input_statistics(phase, statistics);
    }
    if let Some(robot) = options.robot {
        builder = builder.robot(robot);
        if has_map {
            builder = builder.state(state_signals()).input(input_signals());
        }
    }
    if let Some(sample_time_s) = options.sample_time_s {
        builder = builder.sample_time_s(sample_time_s);
    }
    let model = builder.build().map_err(|source| ImportError::Model {
        file: origin.file.to_owned(),
        source: Box::new(source),
    })?;
    let report = ImportReport {
        file: origin.file.to_owned(),
        format: origin.format,
        latent_dim: model.latent_dim(),
        state_dim,
        library_dim: model.library().len(),
        used: news.used,
        unused: news.unused,
        equations,
        notes: news.notes,
    };
    Ok(Imported { model, report })
}

fn state_signals() -> CoordinateNames {
    CoordinateNames {
        names: Robot::state_names().to_vec(),
        units: Robot::state_units().to_vec(),
    }
}

fn input_signals() -> CoordinateNames {
    CoordinateNames {
        names: Robot::input_names().to_vec(),
        units: Robot::input_units().to_vec(),
    }
}
