//! `romc compile`: a model file to equations and code.

use super::simplification::Outcome;
use super::*;

pub(super) fn run(arguments: &CompileArguments) -> Result<Answer> {
    let (inputs, simplification) = (inputs(arguments)?, &arguments.simplification);
    let save_model = simplification.save_model.as_deref();
    let read = artifact::read(&arguments.model)?;
    if arguments.code.units == UnitsChoice::Scaled && read.encoder_map().is_err() {
        let (flag, needs) = ("--units scaled", "a model with an encoder and a decoder");
        return Err(Error::Idle { flag, needs });
    }
    let form = match arguments.equations.as_learned {
        true => Equations::as_learned,
        false => Equations::of,
    };
    let exact = form(&read);
    let simplified = simplification::run(&exact, simplification)?;
    let model = simplified.as_ref().map_or(&read, |outcome| &outcome.model);
    let approximate = simplified.as_ref().map(|_| form(model));
    let equations = approximate.as_ref().unwrap_or(&exact);
    let rounding = match (arguments.equations.digits, arguments.equations.significant) {
        (Some(places), _) => Rounding::Decimals(places),
        (None, Some(digits)) => Rounding::Significant(digits),
        (None, None) => {
            let chosen = simplified.as_ref().and_then(Outcome::rounding);
            chosen.unwrap_or(arguments.code.units.usual_rounding())
        }
    };
    let mut files = emit(equations, arguments, rounding)?;
    let (summary, certificate) = match &simplified {
        Some(outcome) => outcome.add_to(&mut files, equations, rounding)?,
        None => (String::new(), Value::Null),
    };
    if let Some(path) = save_model {
        artifact::check_place(path, model, arguments.force)?;
    }
    let paths = inputs.write_folder(&arguments.out_dir, &files, arguments.force)?;
    let sizes = files.iter().map(|file| file.contents.len());
    let written: Vec<(String, usize)> = names(&paths).into_iter().zip(sizes).collect();
    let earlier = earlier_files(&arguments.out_dir, &files)?;
    if let Some(path) = save_model {
        artifact::write(path, model, arguments.force)?;
    }
    let text = twice(&arguments.emit)
        + &exact_words(&exact)
        + &summary
        + &text(arguments, equations, &written)
        + &earlier_in_words(&earlier);
    let files = written.iter();
    let files = files.map(|(path, bytes)| json!({ "path": path, "bytes": bytes }));
    let json = json!({
        "model": arguments.model.display().to_string(),
        "name": model.name(),
        "digest": artifact::digest(model).to_string(),
        "targets": arguments.emit.iter().map(|target| target.name()).collect::<Vec<_>>(),
        "exact": exact.steps,
        "simplification": certificate,
        "saved_model": shown(&simplification.save_model),
        "files": files.collect::<Vec<_>>(),
        "earlier_files": names(&earlier),
    });
    Ok(Answer::new(text, json))
}

fn inputs(arguments: &CompileArguments) -> Result<Inputs<'_>> {
    let simplification = &arguments.simplification;
    let inputs = Inputs::reading(&simplification.reading)
        .and([&arguments.model])
        .and(&arguments.plan)
        .and(&simplification.domain)
        .into_folder(Some(&arguments.out_dir))?;
    // A file that would be written unchanged may stay; it is compared once there is a model.
    match simplification.save_model.as_deref() {
        Some(path) if path.parent() == Some(&arguments.out_dir) => {
            inputs.check_name(path, Format::MODEL)?;
        }
        path => inputs.check_output(path, Format::MODEL, Overwrite::Replace)?,
    }
    Ok(inputs)
}

fn twice(targets: &[Target]) -> String {
    let mut named = targets.iter().enumerate();
    let twice = named.find(|(place, target)| targets[..*place].contains(target));
    let note =
        twice.map(|(_, target)| format!("`{}` is named twice and emitted once", target.name()));
    lines("note: ", note)
}

fn text(
    arguments: &CompileArguments,
    equations: &Equations<'_>,
    written: &[(String, usize)],
) -> String {
    let model = &*equations.model;
    let table = Table::of(written)
        .column("file", "", |(path, _)| path)
        .column("bytes", "", |(_, bytes)| *bytes)
        .table();
    let phases: Vec<String> = (equations.phases.iter())
        .map(|phase| format!("{} active terms in {}", phase.active_count(), phase.name))
        .collect();
    let (name, d, phases) = (model.name(), model.latent_dim(), phases.join(", "));
    let mut text = format!("model `{name}`: {d} latent coordinates, {phases}\n\n{table}");
    let saved = arguments.simplification.save_model.as_deref();
    text += &lines("simplified model: ", saved.map(Path::display));
    if arguments.emit.contains(&Target::C) {
        let file = |name: &str| quoted(&arguments.out_dir.join(name));
        let of_model = |end: &str| file(&format!("{}{end}", model.identifier()));
        let (program, source) = (file("selftest"), of_model(".c"));
        let test = of_model("_selftest.c");
        // Without a folder before it, a shell would look for the program elsewhere.
        let here = if program.contains('/') { "" } else { "./" };
        text += &format!(
            "\ncheck the C code on this machine:\n  cc -O2 -o {program} {source} {test} -lm && {here}{program}\n"
        );
    }
    text
}

fn jump(arguments: &CompileArguments, model: &ReducedModel) -> Result<Option<PlannedJump>> {
    let Some(path) = &arguments.plan else {
        return Ok(None);
    };
    let jumps = |target| arguments.emit.contains(&target);
    if !jumps(Target::Controller) && !jumps(Target::ControllerC) {
        let message =
            "--plan without a target that follows it; add --emit controller or controller-c";
        return Err(Error::refused(path, message));
    }
    let settings = plan_settings::read_for(path, &crate::mpc::settings_for(model))?;
    if settings.torque_rate_nm_s.is_some() {
        let message =
            "found `torque_rate_nm_s`, expected none: generated controllers have it as an option";
        return Err(Error::refused(&plan_settings::path_for(path), message));
    }
    let motion = read_jump(model, path, &arguments.simplification.reading)?;
    note_turns([&motion], UNROLLED);
    Ok(Some(PlannedJump {
        u: motion.input(&model.input_rule()?)?,
        time_s: motion.time_s,
        x: motion.x,
        dx: motion.dx,
        torque_nm: motion.torque_nm,
        feet: motion.feet,
        settings,
    }))
}

fn emit(
    equations: &Equations<'_>,
    arguments: &CompileArguments,
    rounding: Rounding,
) -> Result<Vec<EmittedFile>> {
    let model = &*equations.model;
    let (code, print) = (&arguments.code, &arguments.equations);
    let options = EmitOptions {
        precision: code.precision,
        sines: code.sincos,
        units: code.units.of_interface(),
        plan: jump(arguments, model)?,
        print: PrintOptions {
            rounding,
            width_em: print.width,
            symbols: SymbolTable::parse(&print.rename, model.latent_dim())?,
            digest: Some(artifact::digest(model).short()),
            numbers: match print.siunitx {
                true => NumberStyle::Siunitx,
                false => NumberStyle::Plain,
            },
            form: print.form.unwrap_or_default(),
        },
        ..EmitOptions::default()
    };
    let is_physical = code.units == UnitsChoice::Physical;
    let physical = is_physical.then(|| equations.in_physical_units());
    let physical = physical.transpose()?;
    let equations = physical.as_ref().unwrap_or(equations);
    Ok(deploy::emit(equations, &arguments.emit, &options)?)
}

fn earlier_in_words(earlier: &[PathBuf]) -> String {
    match names(earlier).as_slice() {
        [] => String::new(),
        [file] => format!("\nof an earlier run, not written now: {file}\n"),
        [file, others @ ..] => {
            let n = others.len();
            format!("\nof earlier runs, not written now: {file} and {n} more\n")
        }
    }
}
