//! Writer of the recordings' CSV format. Numbers have the fewest digits that read back to the same bits. Files appear
//! whole or not at all: they are written under a temporary name in the same folder and then renamed.

use std::fmt::Write as _;
use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::*;
use crate::files::{Overwrite, write_whole};

/// Cell separator and decimal mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Notation {
    /// `;` and decimal comma, as published.
    #[default]
    Semicolon,
    /// `,` and decimal point.
    Comma,
}

/// The notation and columns of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteOptions {
    /// Cell separator and decimal mark.
    pub notation: Notation,
    /// Whether accelerations are written.
    pub accelerations: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        WriteOptions {
            notation: Notation::Semicolon,
            accelerations: true,
        }
    }
}

/// Writes a recording as published files are, gzip if the name ends in `.gz`; an existing file is replaced.
pub fn write(path: &Path, recording: &Recording) -> Outcome<()> {
    let options = WriteOptions::default();
    write_as(path, recording, None, &options, Overwrite::Replace)
}

/// [`write()`] with a choice of notation and columns, and, if given, the inputs of each segment (18 x samples), as
/// columns `Input fr.hx` and so on, which reading ignores. A file that may not be replaced is an error.
pub fn write_as(
    path: &Path,
    recording: &Recording,
    inputs: Option<&[DMatrix<f64>]>,
    options: &WriteOptions,
    overwrite: Overwrite,
) -> Outcome<()> {
    let is_gzip = (path.extension()).is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let written = write_whole(path, overwrite, |mut file| {
        if !is_gzip {
            return write_to(&mut file, recording, inputs, options);
        }
        let mut packed = GzEncoder::new(file, Compression::best());
        write_to(&mut packed, recording, inputs, options)?;
        packed.finish().map(|_| ())
    });
    written.map_err(|source| io_fault("write", source).of(path))
}

/// Writes a segment as an MCAP file: joint states, odometry, contact, and if given the inputs (18 x samples).
pub fn write_mcap(
    path: &Path,
    segment: &Segment,
    inputs: Option<&DMatrix<f64>>,
    overwrite: Overwrite,
) -> Outcome<()> {
    let mut bytes = io::Cursor::new(Vec::new());
    foreign::write_mcap(&mut bytes, segment, inputs)
        .map_err(|error| RecordingFault::mcap(error).of(path))?;
    let written = write_whole(path, overwrite, |file| file.write_all(bytes.get_ref()));
    written.map_err(|source| io_fault("write", source).of(path))
}

/// Writes a recording as text, its inputs as [`write_as`], the wrench if every segment carries one.
pub fn write_to(
    destination: &mut impl Write,
    recording: &Recording,
    inputs: Option<&[DMatrix<f64>]>,
    options: &WriteOptions,
) -> io::Result<()> {
    let with_force = recording.segments.iter().all(|s| s.body_wrench.is_some());
    let columns = Column::all(options.accelerations, with_force);
    let separator = match options.notation {
        Notation::Semicolon => ";",
        Notation::Comma => ",",
    };
    let mut names: Vec<String> = columns.iter().map(|column| column.name()).collect();
    if inputs.is_some() {
        names.extend(Robot::input_names().map(|name| format!("Input {name}")));
    }
    writeln!(destination, "{}", names.join(separator))?;
    let mut line = String::new();
    for (index, segment) in recording.segments.iter().enumerate() {
        for sample in 0..segment.len() {
            line.clear();
            for column in &columns {
                let value = segment.get(*column, sample);
                // Debug has an exponent where Display would print hundreds of zeros.
                let written = match column {
                    Column::Foot(_) => write!(line, "{value}{separator}"),
                    _ => write!(line, "{value:?}{separator}"),
                };
                written.expect(ANY_TEXT);
            }
            let inputs = inputs.map(|inputs| inputs[index].column(sample));
            for value in inputs.iter().flatten() {
                write!(line, "{value:?}{separator}").expect(ANY_TEXT);
            }
            line.pop();
            line.push('\n');
            if options.notation == Notation::Semicolon {
                line = line.replace('.', ",");
            }
            destination.write_all(line.as_bytes())?;
        }
    }
    Ok(())
}

const ANY_TEXT: &str = "writing to a String cannot fail";
