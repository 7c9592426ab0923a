//! The body of every fuzz target; `tests/corpus.rs` runs it with every file of the corpus.
//!
//! Nothing here may panic for any bytes: a panic is a finding.
#![allow(
    dead_code,
    reason = "each target is a program of its own and uses one of these"
)]

use romc::artifact;
use romc::check::{CheckOptions, Side, compare};
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::import::{Format, ImportOptions, import_from_bytes, parse_standard};
use romc::model::{LibraryChoice, ReducedModel, Scaling};
use romc::recording::check::{check, without};
use romc::recording::preprocess::prepare;
use romc::recording::{self, Recording, Segment};
use romc::recording::{Clocks, ColumnMap, PhaseRule, Reader};
use romc::recording::{Notation, WriteOptions, write_to};
use romc::robot::InputRule;
use romc::robot_file;
use romc::symbolic::ParseErrorKind::{Exponent, TooDeep, TooLong};
use romc::symbolic::{ExprPool, ParseError};

/// A valid model is written and reads back equal; small ones are compiled to every target.
pub fn model_file(bytes: &[u8]) {
    match artifact::read_from_bytes("fuzz.json", bytes) {
        Ok(model) => {
            written_and_read_back(&model);
            if model.latent_dim() <= 4 && model.library().terms().len() <= 24 && bytes.len() < 4096
            {
                compiled(&model);
            }
        }
        Err(error) => assert!(artifact::describe(&error).starts_with("fuzz.json")),
    }
}

fn written_and_read_back(model: &ReducedModel) {
    let text = artifact::to_text(model);
    let again = artifact::read_from_bytes("again.json", text.as_bytes());
    let again = again.unwrap_or_else(|error| panic!("{}\n{text}", artifact::describe(&error)));
    assert_eq!(*model, again);
    assert_eq!(artifact::to_text(&again), text);
}

/// Emission may refuse a model; repeated emission gives equal files.
fn compiled(model: &ReducedModel) {
    let options = EmitOptions::default();
    let first = emit(&Equations::of(model), Target::all(), &options);
    let second = emit(&Equations::of(model), Target::all(), &options);
    match (first, second) {
        (Ok(first), Ok(second)) => assert_eq!(first, second),
        (Err(first), Err(second)) => assert_eq!(first.to_string(), second.to_string()),
        (first, second) => panic!("{:?}\n{:?}", first.err(), second.err()),
    }
}

/// A parsed expression prints to a text that parses back to itself; its simplified forms and derivatives exist and can
/// also be printed.
pub fn expression(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let mut pool = ExprPool::new();
    let Ok(expr) = pool.parse(text, &|_| true) else {
        return;
    };
    let printed = reads_back(&mut pool, expr, text);
    if printed.len() > 400 || pool.reachable(&[expr]).len() > 60 {
        return;
    }
    let simpler = pool.simplify(expr);
    reads_back(&mut pool, simpler, text);
    let symbols = pool.symbols_of(expr);
    for symbol in symbols.into_iter().take(2) {
        let slope = pool.derivative(expr, symbol);
        reads_back(&mut pool, slope, text);
    }
}

/// The text of an expression, after a check that it reads back.
fn reads_back(pool: &mut ExprPool, expr: romc::symbolic::ExprId, text: &str) -> String {
    let printed = pool.display(expr).to_string();
    match pool.parse(&printed, &|_| true) {
        Ok(again) => assert_eq!(
            again,
            expr,
            "{text:?} prints as {printed:?}, which reads as {}",
            pool.display(again)
        ),
        // Derivatives and simplified forms may be longer and deeper than the limits for typed text.
        Err(ParseError {
            kind: TooLong { .. } | TooDeep(_) | Exponent { .. },
            ..
        }) => {}
        Err(error) => panic!("{text:?} prints as {printed:?}: {error}"),
    }
    printed
}

/// A valid recording is finite and ordered; it is checked, cut, written and reads back equal.
pub fn recording(bytes: &[u8]) {
    let Ok(found) = recording::read_from_bytes("fuzz.csv", bytes) else {
        return;
    };
    for segment in &found.segments {
        is_sound(segment);
    }
    for notation in [Notation::Semicolon, Notation::Comma] {
        same_when_written(&found, notation);
    }
    let go1 = romc::robot_file::by_name("go1").expect("go1 is registered");
    let findings = check(&found, go1);
    for finding in &findings {
        assert!(!finding.to_string().is_empty());
    }
    if let Ok((rest, dropped)) = without(&found, &findings) {
        assert_eq!(rest.sample_count() + dropped, found.sample_count());
    }
    for segment in &found.segments {
        if let Ok(input) = segment.input(&InputRule::published(go1)) {
            assert_eq!(input.shape(), (18, segment.len()));
        }
    }
    if let Ok(phases) = prepare(&found, &PhaseRule::two_phase().with_min_samples(5)) {
        assert!(phases.iter().all(|(_, samples)| samples.len() % 100 == 0));
    }
}

fn same_when_written(found: &Recording, notation: Notation) {
    let mut text = Vec::new();
    let options = WriteOptions {
        notation,
        accelerations: true,
    };
    write_to(&mut text, found, None, &options).expect("memory takes every byte");
    let again = recording::read_from_bytes("again.csv", &text);
    let again = again.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(again.segments.len(), found.segments.len());
    for (again, found) in again.segments.iter().zip(&found.segments) {
        assert_eq!(again.time_s, found.time_s);
        assert_eq!((&again.x, &again.dx), (&found.x, &found.dx));
        assert_eq!(
            (&again.ddx, &again.torque_nm),
            (&found.ddx, &found.torque_nm)
        );
        assert_eq!(again.feet, found.feet);
    }
}

fn is_sound(segment: &Segment) {
    assert!(segment.len() >= 2);
    assert!(segment.time_s.windows(2).all(|pair| pair[0] < pair[1]));
    for matrix in [&segment.x, &segment.dx, &segment.ddx, &segment.torque_nm] {
        assert_eq!(matrix.ncols(), segment.len());
        assert!(matrix.iter().all(|value| value.is_finite()));
    }
}

/// Any bytes as a gzip file.
pub fn recording_gz(bytes: &[u8]) {
    recording(bytes);
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        recording(&[&[0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3], bytes].concat());
    }
}

/// A map of columns; after a line `---` a log as text, which is read with the map.
pub fn column_map(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let (map, log) = text.split_once("\n---\n").unwrap_or((text, ""));
    let Ok(map) = ColumnMap::parse("fuzz.toml", map) else {
        return;
    };
    // One file only: files named by a map would be in its folder, and do not exist.
    if !log.is_empty() && map.files().is_empty() {
        read_from_disk("txt", log.as_bytes(), Some(map));
    }
}

/// An MCAP file, read by the names of its topics.
pub fn mcap(bytes: &[u8]) {
    read_from_disk("mcap", bytes, None);
}

/// A readable file gives sound recordings, with recorded and with repaired clocks.
fn read_from_disk(ending: &str, bytes: &[u8], map: Option<ColumnMap>) {
    let name = format!("romc-fuzz-{}.{ending}", std::process::id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, bytes).expect("a file of the fuzzer's own");
    for clocks in [Clocks::Recorded, Clocks::Repaired] {
        if let Ok(reading) = Reader::new(map.clone(), clocks).read(&path) {
            reading.recording.segments.iter().for_each(is_sound);
        }
    }
    std::fs::remove_file(&path).expect("it was there");
}

/// A robot as TOML, or as URDF if it begins as XML; a valid one is written and reads back equal.
pub fn robot_file(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let file = match text.trim_start().starts_with('<') {
        true => "fuzz.urdf",
        false => "fuzz.toml",
    };
    let read = |file: &str, text: &str| robot_file::from_text(file, text, &Default::default());
    if let Ok(read_first) = read(file, text) {
        let text = robot_file::to_toml(read_first.robot);
        let again = read("again.toml", &text);
        let again = again.unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(robot_file::to_toml(again.robot), text);
    }
}

/// Tensors of NumPy.
pub fn import_npz(bytes: &[u8]) {
    imported(Format::Npz, bytes);
}

/// Tensors of safetensors.
pub fn import_safetensors(bytes: &[u8]) {
    imported(Format::Safetensors, bytes);
}

/// Equations as text.
pub fn import_equations(bytes: &[u8]) {
    imported(Format::Equations, bytes);
}

pub fn import_latex(bytes: &[u8]) {
    imported(Format::Latex, bytes);
    let options = CheckOptions::default();
    if let Ok(side) = Side::from_bytes("fuzz.tex", bytes, &options, &[])
        && bytes.len() < 2048
    {
        assert!(compare(&side, &side, &options).is_equal());
    }
}

/// An imported model is written and reads back equal.
fn imported(format: Format, bytes: &[u8]) {
    let library = parse_standard("degree=1,inputs").expect("a shorthand");
    let options = ImportOptions {
        name: "fuzz".to_owned(),
        library: matches!(format, Format::Npz | Format::Safetensors)
            .then_some(LibraryChoice::Standard(library)),
        scaling: Some(Scaling::uniform(0.1)),
        ..ImportOptions::default()
    };
    match import_from_bytes("fuzz", format, bytes, &options) {
        Ok(imported) => written_and_read_back(&imported.model),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
