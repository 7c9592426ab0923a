//! `romc import`: a model trained elsewhere in, a model file out.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::Answer;
use super::args::{ImportArguments, LibraryArgument};
use super::destination::{Format, Inputs};
use super::output::{lines, named, read_recordings};
use super::robot;
use crate::evaluate::RoundTrip;
use crate::import::{Chosen, ImportOptions, ImportReport, SymbolNames, import, read_terms};
use crate::model::{LibraryChoice, ReducedModel};
use crate::recording::Segment;
use crate::robot_file::read_actuators;
use crate::sim::with_input_statistics;
use crate::typeset::Table;
use crate::{Error, artifact};

/// Imports a model and writes it.
pub fn run(arguments: &ImportArguments) -> Result<Answer, Error> {
    let library = match &arguments.library {
        Some(LibraryArgument::File(path)) => Some(path),
        Some(LibraryArgument::Shorthand(_)) | None => None,
    };
    Inputs::default()
        .and([&arguments.file])
        .and(library)
        .and(&arguments.actuators)
        .and(&arguments.inputs_from)
        .and(&arguments.reading.columns)
        .and_robot(arguments.robot.as_deref())
        .check_output(Some(&arguments.output), Format::MODEL, arguments.force)?;
    let imported = import(&arguments.file, &options(arguments)?)?;
    let recordings = read_recordings(&arguments.inputs_from, &arguments.reading, None)?;
    let segments: Vec<&Segment> = recordings.iter().flat_map(|r| &r.segments).collect();
    let model = match segments.is_empty() {
        true => imported.model,
        false => with_input_statistics(imported.model, &segments)?,
    };
    let check = checked(&model, &segments, arguments)?;
    artifact::write(&arguments.output, &model, arguments.force)?;
    let mut text = describe(&imported.report);
    let has_axes = model.robot().is_ok() && model.encoder_map().is_ok();
    let axes = (has_axes && arguments.wrench_frame.is_none()).then(|| {
        let frame = model.wrench_frame().name();
        format!(
            "force and moment of the inputs are along the {frame}'s axes, as published \
             (--wrench-frame says otherwise)"
        )
    });
    text += &lines("note: ", &axes);
    text.extend(check.as_ref().map(describe_check));
    let (output, name) = (arguments.output.display().to_string(), model.name());
    let _ = writeln!(text, "{output}: model `{name}`");
    let lacking = lacking(&model);
    text += &lines("\n", lacking);
    let json = json!({
        "model": output,
        "name": name,
        "digest": artifact::digest(&model).to_string(),
        "report": imported.report,
        "wrench_axes": axes,
        "lacking": lacking,
        "check": check.as_ref().map(check_json),
    });
    Ok(Answer { text, json })
}

/// Compares the model with the recordings, if there are any and it has both maps; refuses one that
/// misses them.
fn checked(
    model: &ReducedModel,
    segments: &[&Segment],
    arguments: &ImportArguments,
) -> Result<Option<RoundTrip>, Error> {
    let check = RoundTrip::of_import(model, segments)?;
    let is_refused = check.as_ref().is_some_and(RoundTrip::is_refused);
    match check.as_ref().and_then(RoundTrip::fault) {
        Some(fault) if is_refused && !arguments.unchecked => Err(Error::Mismatch {
            file: arguments.file.clone(),
            fault,
        }),
        _ => Ok(check),
    }
}

/// Commands that cannot use a model, and the option that mends it.
fn lacking(model: &ReducedModel) -> Option<&'static str> {
    if model.encoder_map().is_err() || model.decoder_map().is_err() {
        return Some(
            "Equations only: `romc compile` takes this model; everything else needs an encoder and a decoder.",
        );
    }
    if model.robot().is_err() {
        return Some(
            "No robot: `romc compile` takes this model; `--robot go1` lets `simulate`, `report` and `mpc` do so too.",
        );
    }
    let n_phases = model.phases().len();
    (0..n_phases).any(|phase| model.input_statistics(phase).is_err()).then_some(
        "No input statistics in some phase: the controller (`mpc`, `compile --emit controller`) cannot weigh inputs; \
         `--inputs-from jumps/*.csv` takes them from recordings.",
    )
}

fn options(arguments: &ImportArguments) -> Result<ImportOptions, Error> {
    let robot = arguments.robot.as_deref().map(robot::chosen).transpose()?;
    let actuators = arguments.actuators.as_deref();
    let actuators = actuators.map(|path| read_actuators(path, robot));
    Ok(ImportOptions {
        name: named(arguments.name.as_deref(), &arguments.output),
        description: arguments.description.clone(),
        format: arguments.format,
        mapping: arguments.map.clone(),
        weights: arguments.weights,
        activation: arguments.activation,
        xi_layout: arguments.xi_layout,
        symbols: SymbolNames::parse(&arguments.symbols)?,
        library: match &arguments.library {
            None => None,
            Some(LibraryArgument::Shorthand(standard)) => Some(LibraryChoice::Standard(*standard)),
            Some(LibraryArgument::File(path)) => Some(LibraryChoice::Terms(read_terms(path)?)),
        },
        latent_dim: arguments.latent_dim,
        phases: arguments.phase.clone(),
        order: arguments.order.clone(),
        robot,
        wrench_frame: arguments.wrench_frame.unwrap_or_default(),
        actuators: actuators.transpose()?,
        sample_time_s: arguments.sample_time,
        ..ImportOptions::of_factors(&arguments.scaling, &arguments.input_scaling)
    })
}

/// The report of an import as text.
fn describe(report: &ImportReport) -> String {
    let mut text = format!(
        "{} ({}): {} latent coordinates, ",
        report.file, report.format, report.latent_dim
    );
    if let Some(state_dim) = report.state_dim {
        let _ = write!(text, "{state_dim} robot coordinates, ");
    }
    let _ = writeln!(text, "{} candidate terms\n", report.library_dim);
    if !report.used.is_empty() {
        let table = Table::of(&report.used)
            .column("part", "", |used| &used.role)
            .column("tensor", "", |used| &used.tensor)
            .column("shape", "", |used| shape(&used.shape))
            .column("type", "", |used| &used.element)
            .column("chosen", "", |used| match used.chosen {
                Chosen::Mapped => "by --map",
                Chosen::Named => "by name",
            })
            .column("stored as", "", |used| used.layout.to_string())
            .table();
        let _ = writeln!(text, "{table}");
    }
    if !report.equations.is_empty() {
        let table = Table::of(&report.equations)
            .column("equation", "", |equation| &equation.output)
            .column("phase", "", |equation| &equation.phase)
            .column("line", "", |equation| equation.line)
            .column("terms", "", |equation| equation.terms)
            .table();
        let _ = writeln!(text, "{table}");
    }
    for unused in &report.unused {
        let shape = shape(&unused.shape);
        let _ = writeln!(text, "not used: {} ({shape})", unused.tensor);
    }
    text + &lines("note: ", &report.notes)
}

fn shape(dims: &[usize]) -> String {
    let dims: Vec<String> = dims.iter().map(usize::to_string).collect();
    match dims.is_empty() {
        true => "1".to_owned(),
        false => dims.join(" x "),
    }
}

/// What the recordings of `--inputs-from` say of the imported model, as text.
fn describe_check(check: &RoundTrip) -> String {
    let mut text = format!(
        "\nOn the recordings: decode(encode(x)) misses {:.3} of the variance",
        check.error
    );
    for (phase, r2) in &check.acceleration_r2 {
        if let Some(r2) = r2 {
            let _ = write!(text, "; R^2 of ddz in {phase} {r2:.3}");
        }
    }
    text + "\n" + &lines("warning: ", check.fault()) + "\n"
}

/// The same as JSON.
fn check_json(check: &RoundTrip) -> Value {
    let phases: Map<String, Value> = (check.acceleration_r2.iter())
        .map(|(phase, r2)| (phase.clone(), json!(r2)))
        .collect();
    json!({
        "reconstruction_error": check.error,
        "acceleration_r2": phases,
        "fault": check.fault(),
    })
}
