//! `romc import`: a model trained elsewhere becomes a model file.

use super::*;
use crate::import::import;
use crate::sim::with_input_statistics;

pub(super) fn run(arguments: &ImportArguments) -> Result<Answer> {
    let library = match &arguments.library {
        Some(LibraryArgument::File(path)) => Some(path),
        Some(LibraryArgument::Shorthand(_) | LibraryArgument::Terms(_)) | None => None,
    };
    Inputs::reading(&arguments.reading)
        .and([&arguments.file])
        .and(library)
        .and(&arguments.actuators)
        .and(&arguments.inputs_from)
        .and_robot(arguments.robot.as_deref())
        .check_output(Some(&arguments.output), Format::MODEL, arguments.force)?;
    let options = options(arguments)?;
    let kind = (options.format).or_else(|| FileKind::of_path(&arguments.file).ok());
    let is_text = matches!(kind, Some(FileKind::Equations | FileKind::Latex));
    if is_text && !arguments.inputs_from.is_empty() {
        let (found, expected) = ("a file of equations", "a file with encoder and decoder");
        return Err(ImportError::option("--inputs-from", found, expected).into());
    }
    let recordings = read_recordings(&arguments.inputs_from, &arguments.reading, options.robot)?;
    let segments: Vec<&Segment> = recordings.iter().flat_map(|r| &r.segments).collect();
    let read = |options: &ImportOptions| import(&arguments.file, options);
    let Compared {
        imported: Imported { model, report },
        check,
        fault,
    } = import_compared(read, options, &segments, arguments.unchecked)?;
    artifact::write(&arguments.output, &model, arguments.force)?;
    let has_axes = model.robot().is_ok() && model.encoder_map().is_ok();
    let axes = (has_axes && arguments.wrench_frame.is_none()).then(|| {
        format!(
            "force and moment of the inputs are along the {}'s axes, as published \
             (change with --wrench-frame)",
            model.wrench_frame().name()
        )
    });
    let fault = fault.as_deref();
    let mut text = describe(&report) + &lines("note: ", &axes);
    let check = check.map(|check| describe_check(&check, fault));
    let (words, check) = check.unwrap_or_default(); // nothing, and null, without recordings
    text += &words;
    let (output, name) = (arguments.output.display().to_string(), model.name());
    let _ = writeln!(text, "{output}: model `{name}`");
    let lacking = lacking(&model);
    text += &lines("\n", lacking);
    let json = json!({
        "model": output,
        "name": name,
        "digest": artifact::digest(&model).to_string(),
        "report": report,
        "wrench_axes": axes,
        "lacking": lacking,
        "check": check,
    });
    Ok(Answer::new(text, json))
}

/// An imported model, compared with recordings if there are any.
#[derive(Debug)]
pub struct Compared {
    /// With the statistics of the recorded inputs.
    pub imported: Imported,
    /// Result of the comparison.
    pub check: Option<RoundTrip>,
    /// Reason to refuse the model; `None` if it is accepted.
    pub fault: Option<String>,
}

/// Imports a model by `read` and compares it with recordings, which decide an unstated order of a standard library.
///
/// # Errors
/// [`Error::Mismatch`] for a model that misses the recordings, unless `unchecked`; the importer's own.
pub fn import_compared(
    read: impl Fn(&ImportOptions) -> Result<Imported, ImportError>,
    mut options: ImportOptions,
    segments: &[&Segment],
    unchecked: bool,
) -> Result<Compared> {
    if segments.is_empty() {
        return Ok(Compared {
            imported: read(&options)?,
            check: None,
            fault: None,
        });
    }
    let compared = |options: &ImportOptions| -> Result<(Imported, RoundTrip)> {
        let mut imported = read(options)?;
        imported.model = with_input_statistics(imported.model, segments)?;
        let tensors = |part: &str| {
            let used = imported.report.used.iter().find(|used| used.role == part);
            used.map(|used| used.tensor.clone())
        };
        let order = options.library_order;
        let check = RoundTrip::of_import(&imported.model, segments, order, &tensors)?;
        let check = check.ok_or_else(|| needs_maps(&imported.report))?;
        Ok((imported, check))
    };
    let is_open = options.library_order.is_none()
        && matches!(options.library, Some(LibraryChoice::Standard(_)));
    if is_open {
        options.library_order = Some(LibraryOrder::ROMC);
    }
    let (mut imported, mut check) = compared(&options)?;
    let decided = check.trials.decided_order().filter(|_| check.maps_fit());
    if is_open && decided.is_some() && decided != options.library_order {
        options.library_order = decided;
        (imported, check) = compared(&options)?;
    } else if is_open && decided.is_none() && (unchecked || !check.is_refused()) {
        // Without an order the importer reports an error, unless all orders are equal.
        options.library_order = None;
        read(&options)?;
    }
    match check.fault() {
        Some(fault) if check.is_refused() && !unchecked => Err(Error::Mismatch {
            file: imported.report.file.into(),
            fault,
        }),
        fault => Ok(Compared {
            check: Some(check),
            imported,
            fault,
        }),
    }
}

fn needs_maps(report: &ImportReport) -> Error {
    let unused = report.unused.iter().map(|of| format!("`{}`", of.tensor));
    let left = match unused.collect::<Vec<_>>().join(", ").as_str() {
        "" => "no tensor is left".to_owned(),
        unused => format!("left are {unused}"),
    };
    let found = format!("a model without encoder or decoder to compare; {left}");
    let expected = "both (--map encoder.weight=TENSOR, --map decoder.weight=TENSOR)";
    ImportError::option("--inputs-from", found, expected).into()
}

fn lacking(model: &ReducedModel) -> Option<&'static str> {
    let has_maps = model.encoder_map().is_ok() && model.decoder_map().is_ok();
    let mut phases = 0..model.phases().len();
    Some(if !has_maps {
        "Equations only: use `compile`, `check` or `inspect`. All other commands need an encoder and a decoder."
    } else if model.robot().is_err() {
        "No robot: use `compile`, `check` or `inspect`. All other commands need `--robot`, such as `--robot go1`."
    } else if phases.any(|phase| model.input_statistics(phase).is_err()) {
        "No input statistics in some phase: the controller (`mpc`, `compile --emit controller`) cannot weigh inputs; \
         `--inputs-from jumps/*.csv` computes them from recordings."
    } else {
        return None;
    })
}

fn options(arguments: &ImportArguments) -> Result<ImportOptions> {
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
            Some(LibraryArgument::Terms(terms)) => Some(LibraryChoice::Terms(terms.clone())),
        },
        library_order: arguments.library_order,
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

fn describe(report: &ImportReport) -> String {
    let used = Table::of(&report.used)
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
    let order = (report.library_order.as_ref()).map(|of| format!(" (--library-order {of})"));
    let (order, terms) = (order.unwrap_or_default(), report.terms.join("; "));
    let terms = (!terms.is_empty()).then(|| format!("rows of xi{order}: {terms}\n"));
    let equations = Table::of(&report.equations)
        .column("equation", "", |equation| &equation.output)
        .column("phase", "", |equation| &equation.phase)
        .column("line", "", |equation| equation.line)
        .column("terms", "", |equation| equation.terms)
        .table();
    let filled = |table: Table| lines("", Some(table).filter(|table| !table.rows.is_empty()));
    let unused = report.unused.iter();
    let unused = unused.map(|of| format!("{} ({})", of.tensor, shape(&of.shape)));
    let state = (report.state_dim).map(|dim| format!("{dim} robot coordinates, "));
    format!(
        "{} ({}): {} latent coordinates, {}{} candidate terms\n\n",
        report.file,
        report.format,
        report.latent_dim,
        state.unwrap_or_default(),
        report.library_dim
    ) + &filled(used)
        + &lines("", terms)
        + &filled(equations)
        + &lines("not used: ", unused)
        + &lines("note: ", &report.notes)
}

fn shape(dims: &[usize]) -> String {
    let dims: Vec<String> = dims.iter().map(usize::to_string).collect();
    match dims.is_empty() {
        true => "1".to_owned(),
        false => dims.join(" x "),
    }
}

fn describe_check(check: &RoundTrip, fault: Option<&str>) -> (String, Value) {
    let mut text = format!(
        "\nOn the recordings: decode(encode(x)) misses {:.3} of the variance",
        check.error
    );
    let (mut phases, mut orders, mut words) = (Map::new(), Map::new(), Vec::new());
    for (phase, r2) in &check.acceleration_r2 {
        text.extend(r2.map(|r2| format!("; R^2 of ddz in {phase} {r2:.3}")));
        phases.insert(phase.clone(), json!(r2));
    }
    let by_order = check.trials.by_order.iter();
    for (name, r2) in by_order.filter_map(|(order, r2)| Some((order.name()?, r2))) {
        words.push(format!("{r2:.3} in the order {name}"));
        orders.insert(name.to_owned(), json!(r2));
    }
    if words.len() > 1 {
        let _ = write!(text, "; of all phases {}", words.join(", "));
    }
    let json = json!({
        "reconstruction_error": check.error,
        "acceleration_r2": phases,
        "library_order_r2": orders,
        "fault": fault,
    });
    (text + "\n" + &lines("warning: ", fault) + "\n", json)
}
