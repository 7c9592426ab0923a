//! `romc convert`: recordings and logs of other programs into one format.

use super::*;

pub(super) fn run(arguments: &ConvertArguments) -> Result<Answer> {
    Inputs::reading(&arguments.reading)
        .and(&arguments.recordings)
        .and(&arguments.inputs_of)
        .check_output(Some(&arguments.output), Format::RECORDING, arguments.force)?;
    let rule = match &arguments.inputs_of {
        None => None,
        Some(path) => Some(artifact::read(path)?.input_rule()?),
    };
    let robot = rule.as_ref().map(|rule| rule.robot());
    let reader = reader(&arguments.reading, Clocks::Recorded, robot)?;
    let segments = chained(read_with(&reader, &arguments.recordings)?);
    let inputs = rule.as_ref().map(|rule| {
        let inputs = segments.iter().map(|segment| segment.input(rule));
        inputs.collect::<Result<Vec<DMatrix<f64>>, _>>()
    });
    let inputs = inputs.transpose()?;
    let count = segments.len();
    let samples: usize = segments.iter().map(Segment::len).sum();
    let inputs = inputs.as_deref();
    write_recording(&arguments.output, segments, inputs, arguments.force)?;
    let output = arguments.output.display().to_string();
    let text = format!(
        "{output}: {samples} samples in {}\n",
        counted(count, "segment")
    );
    let json = json!({
        "recordings": names(&arguments.recordings),
        "output": output,
        "samples": samples,
        "segments": count,
        "inputs": rule.is_some(),
    });
    Ok(Answer::new(text, json))
}

/// The segments one after the other; where there are several, each begins at 0 s.
fn chained(recordings: Vec<Recording>) -> Vec<Segment> {
    let segments = recordings.into_iter().flat_map(|of| of.segments);
    let mut segments: Vec<Segment> = segments.collect();
    if segments.len() > 1 {
        for segment in &mut segments {
            let start = segment.time_s[0];
            segment.time_s.iter_mut().for_each(|time| *time -= start);
        }
    }
    segments
}

pub(super) fn write_recording(
    path: &Path,
    segments: Vec<Segment>,
    inputs: Option<&[DMatrix<f64>]>,
    overwrite: Overwrite,
) -> Result<()> {
    let is_mcap = (path.extension()).is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    let written = match &segments[..] {
        [segment] if is_mcap => {
            write_mcap(path, segment, inputs.map(|inputs| &inputs[0]), overwrite)
        }
        several if is_mcap => {
            return Err(Error::NotOne {
                found: format!("{} segments", several.len()),
                expected: "for an MCAP file",
            });
        }
        _ => {
            let recording = Recording {
                path: path.to_owned(),
                segments,
                ignored_columns: Vec::new(),
            };
            let options = WriteOptions::default();
            write_as(path, &recording, inputs, &options, overwrite)
        }
    };
    written.map_err(|error| match &error.kind {
        RecordingFault::Io { source, .. } if source.kind() == io::ErrorKind::AlreadyExists => {
            Error::Exists(path.to_owned())
        }
        _ => error.into(),
    })
}
