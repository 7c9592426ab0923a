//! `romc compile`: a model file to equations and code.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::Answer;
use super::args::{CodeArguments, CompileArguments, EquationArguments, PrecisionChoice};
use super::output::Table;
use crate::backend::latex::{LatexOptions, NumberStyle};
use crate::backend::markdown::MarkdownOptions;
use crate::backend::mathml::MathmlOptions;
use crate::backend::typeset::{Rounding, SymbolTable};
use crate::backend::{self, EmitOptions, EmittedFile, Precision, Target};
use crate::files::Overwrite;
use crate::model::ReducedModel;
use crate::{Error, artifact};

/// Compiles a model into a folder.
///
/// # Errors
/// Whatever reading, lowering or writing refuses.
pub fn run(arguments: &CompileArguments) -> Result<Answer, Error> {
    let model = artifact::read(&arguments.model)?;
    let overwrite = Overwrite::when_forced(arguments.force);
    let files = emit(
        &model,
        &arguments.emit,
        &arguments.code,
        &arguments.equations,
    )?;
    let written = write(&arguments.out_dir, &files, overwrite)?;
    let mut table = Table::new(["file", "bytes"]);
    for (path, bytes) in &written {
        table.row([path.display().to_string(), bytes.to_string()]);
    }
    let mut text = format!(
        "model `{}`: {} latent coordinates, {}\n\n{table}",
        model.name(),
        model.latent_dim(),
        phases_in_words(&model)
    );
    if arguments.emit.contains(&Target::C) {
        let name = model.identifier().as_str();
        let folder = arguments.out_dir.display();
        let _ = writeln!(
            text,
            "\ncheck the C code on this machine:\n  cc -O2 -o {folder}/selftest {folder}/{name}.c {folder}/{name}_selftest.c -lm && {folder}/selftest"
        );
    }
    Ok(Answer {
        text,
        json: json!({
            "command": "compile",
            "model": arguments.model.display().to_string(),
            "name": model.name(),
            "digest": artifact::digest(&model).to_string(),
            "targets": arguments.emit.iter().map(|target| target.name()).collect::<Vec<_>>(),
            "files": written.iter().map(|(path, bytes)| file_json(path, *bytes)).collect::<Vec<_>>(),
        }),
    })
}

/// The files of the targets, in memory, with the model's digest in their headers.
///
/// # Errors
/// [`Error::Emit`] if the model cannot be lowered or typeset, [`Error::Rename`] for a new name that
/// cannot be used.
pub fn emit(
    model: &ReducedModel,
    targets: &[Target],
    code: &CodeArguments,
    equations: &EquationArguments,
) -> Result<Vec<EmittedFile>, Error> {
    let digest = Some(artifact::digest(model).short());
    let symbols = SymbolTable::parse(&equations.rename, model.latent_dim())?;
    let rounding = match (equations.digits, equations.significant) {
        (Some(places), _) => Rounding::Decimals(places),
        (None, Some(digits)) => Rounding::Significant(digits),
        (None, None) => Rounding::default(),
    };
    let latex = LatexOptions::default();
    let markdown = MarkdownOptions::default();
    let mathml = MathmlOptions::default();
    let options = EmitOptions {
        precision: match code.precision {
            PrecisionChoice::F64 => Precision::Double,
            PrecisionChoice::F32 => Precision::Single,
        },
        latex: LatexOptions {
            rounding,
            numbers: match equations.siunitx {
                true => NumberStyle::Siunitx,
                false => NumberStyle::Plain,
            },
            width_em: equations.width.unwrap_or(latex.width_em),
            symbols: symbols.clone(),
            digest: digest.clone(),
            ..latex
        },
        markdown: MarkdownOptions {
            rounding,
            width_em: equations.width.unwrap_or(markdown.width_em),
            symbols: symbols.clone(),
            digest: digest.clone(),
        },
        mathml: MathmlOptions {
            rounding,
            width_em: equations.width.unwrap_or(mathml.width_em),
            symbols,
            digest: digest.clone(),
        },
        digest,
        ..EmitOptions::default()
    };
    Ok(backend::emit(model, targets, &options)?)
}

/// Writes files into a folder; the path of each, with its size in bytes.
///
/// # Errors
/// [`Error::Folder`] for a file of that name that romc did not make.
pub fn write(
    folder: &Path,
    files: &[EmittedFile],
    overwrite: Overwrite,
) -> Result<Vec<(PathBuf, usize)>, Error> {
    let paths = backend::write_files(folder, files, overwrite)?;
    let sizes = files.iter().map(|file| file.contents.len());
    Ok(paths.into_iter().zip(sizes).collect())
}

fn phases_in_words(model: &ReducedModel) -> String {
    let phase = |phase: &crate::model::Phase| {
        format!("{} active terms in {}", phase.active_count(), phase.name)
    };
    model
        .phases()
        .iter()
        .map(phase)
        .collect::<Vec<_>>()
        .join(", ")
}

fn file_json(path: &Path, bytes: usize) -> Value {
    json!({ "path": path.display().to_string(), "bytes": bytes })
}
