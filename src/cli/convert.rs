//! `romc convert`: recordings and logs of other programs into one format.

use std::path::Path;

use nalgebra::DMatrix;
use serde_json::json;

use super::Answer;
use super::args::ConvertArguments;
use super::output::{check_output, names, read_with, reader};
use crate::files::Overwrite;
use crate::recording::{Clocks, Recording, Segment, WriteOptions, write_inputs_with, write_mcap};
use crate::{Error, artifact};

/// Reads, chains and writes.
///
/// # Errors
/// Whatever reading or writing refuses; [`Error::Exists`] for the output, [`Error::OneSegment`] for an MCAP file
/// of several.
pub fn run(arguments: &ConvertArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(Some(&arguments.output), overwrite)?;
    check_ending(&arguments.output)?;
    let rule = match &arguments.inputs_of {
        None => None,
        Some(path) => Some(artifact::read(path)?.input_rule()?),
    };
    let reader = reader(&arguments.reading, Clocks::Recorded)?;
    let recordings = read_with(&reader, &arguments.recordings)?;
    let segments = chained(recordings);
    let inputs = match &rule {
        None => None,
        Some(rule) => {
            let inputs = segments.iter().map(|segment| segment.input(rule));
            Some(inputs.collect::<Result<Vec<DMatrix<f64>>, _>>()?)
        }
    };
    let (samples, count) = (
        segments.iter().map(Segment::len).sum::<usize>(),
        segments.len(),
    );
    write(&arguments.output, segments, inputs.as_deref())?;
    let output = arguments.output.display().to_string();
    Ok(Answer {
        text: format!("{output}: {samples} samples in {count} segments\n"),
        json: json!({
            "command": "convert",
            "recordings": names(&arguments.recordings),
            "output": output,
            "samples": samples,
            "segments": count,
            "inputs": rule.is_some(),
        }),
    })
}

/// Refuses an output whose name does not say its format.
fn check_ending(path: &Path) -> Result<(), Error> {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    // What is no file of the disk, such as a pipe, may have any name.
    let is_special = path.exists() && !path.is_file();
    match is_special
        || [".csv", ".csv.gz", ".mcap"]
            .iter()
            .any(|ending| name.ends_with(ending))
    {
        true => Ok(()),
        false => Err(Error::Ending {
            path: path.to_owned(),
            found: match name.split_once('.') {
                Some((_, ending)) => format!(".{ending}"),
                None => "no ending".to_owned(),
            },
        }),
    }
}

/// The segments one after the other; where there are several, each begins at 0 s.
fn chained(recordings: Vec<Recording>) -> Vec<Segment> {
    let segments = recordings
        .into_iter()
        .flat_map(|recording| recording.segments);
    let mut segments: Vec<Segment> = segments.collect();
    if segments.len() > 1 {
        for segment in &mut segments {
            let start = segment.time_s[0];
            segment.time_s.iter_mut().for_each(|time| *time -= start);
        }
    }
    segments
}

fn write(
    path: &Path,
    segments: Vec<Segment>,
    inputs: Option<&[DMatrix<f64>]>,
) -> Result<(), Error> {
    if path.extension().is_some_and(|ending| ending == "mcap") {
        let [segment] = &segments[..] else {
            return Err(Error::OneSegment(segments.len()));
        };
        return Ok(write_mcap(path, segment, inputs.map(|inputs| &inputs[0]))?);
    }
    let recording = Recording {
        path: path.to_owned(),
        segments,
        ignored_columns: Vec::new(),
    };
    Ok(write_inputs_with(
        path,
        &recording,
        inputs,
        &WriteOptions::default(),
    )?)
}
