//! `romc report`: a one-page assessment of a model, and its figures as files; or a page on a controller's log.

use super::mpc::{judged, of_usual_lift, run_with_both_lifts};
use super::simplification::LADDER_STEPS;
use super::*;
use crate::recording::ControllerLog;
use crate::report::{LogFacts, log_figures, log_page};

pub(super) fn run(arguments: &ReportArguments) -> Result<Answer> {
    match (&arguments.log, &arguments.model) {
        (Some(log), _) => of_log(arguments, log),
        (None, model) => {
            let model = model.as_ref().expect("the parser wants it without a log");
            of_model(arguments, model)
        }
    }
}

fn of_log(arguments: &ReportArguments, path: &Path) -> Result<Answer> {
    let output = &arguments.output;
    let inputs = Inputs::default()
        .and([path])
        .into_folder(arguments.figures.as_deref())?;
    inputs.check_output(Some(output), Format::PAGE, arguments.force)?;
    let log = ControllerLog::read(path)?;
    let facts = LogFacts::of(&log);
    let figures = log_figures(&log, &facts);
    let page = log_page(path, &facts, &figures)?;
    let (shown, bytes) = (output.display().to_string(), page.len());
    let mut text = lines("", [&facts.headline]) + &lines("", &facts.sentences);
    text += &format!("{shown}: {} kB, {} figures\n", bytes / 1000, figures.len());
    let json = json!({ "log": path.display().to_string(), "output": shown, "bytes": bytes });
    let mut answer = Answer::new(text, json);
    extend(&mut answer.json, json!(facts));
    let folder = arguments.figures.as_deref();
    inputs.write_figures(folder, || Ok(figures), arguments.force, &mut answer)?;
    write_file(output, page.as_bytes(), arguments.force)?;
    Ok(answer)
}

fn of_model(arguments: &ReportArguments, model_path: &PathBuf) -> Result<Answer> {
    let inputs = Inputs::reading(&arguments.reading)
        .and([model_path])
        .and(&arguments.recordings)
        .and(&arguments.plan)
        .into_folder(arguments.figures.as_deref())?;
    inputs.check_output(Some(&arguments.output), Format::PAGE, arguments.force)?;
    let model = arguments.reading.model(model_path)?;
    let recordings = read_for(&model, &arguments.recordings, &arguments.reading)?;
    note_turns(motions(&recordings), CUT);
    note_late_restarts(&recordings, arguments.restart_every);
    let study = (arguments.study.as_deref()).map(summary).transpose()?;
    let plan = (arguments.plan.as_ref()).map(|path| read_jump(&model, path, &arguments.reading));
    let plan = plan.transpose()?;
    let progress = spinner("rolling the model out");
    let assessment = Assessment::over(&model, &recordings, arguments.restart_every)?;
    progress.finish_and_clear();
    let can_control = without_statistics(&model).is_none();
    let runs = can_control.then(|| run_with_both_lifts(&model, &recordings));
    // Without statistics of the inputs there are no controller runs; the page states this.
    let [plain, consistent] = runs.transpose()?.unwrap_or_default();
    let usual = of_usual_lift(&model, [&plain, &consistent]);
    let paths = recordings.iter().map(|recording| &recording.path);
    // A file deleted since has no digest, and counts as one that the model does not name.
    let digest = |path: &PathBuf| Some((path.clone(), sha256(&std::fs::read(path).ok()?)));
    let content = Content {
        model: &model,
        assessment: &assessment,
        verdict: &verdict(&model, &assessment, &judged(usual)),
        plain: &plain,
        usual,
        consistent: &consistent,
        study: study.as_ref(),
        plan: plan.as_ref(),
        digests: &paths.filter_map(digest).collect::<Vec<_>>(),
    };
    let commands = commands(arguments, model_path, can_control);
    let made = page_of(&content, arguments.tolerance, commands)?;
    // The figures come first: if other files would be overwritten, nothing is written.
    let written = match &arguments.figures {
        Some(folder) => inputs.write_folder(folder, &made.files, arguments.force)?,
        None => Vec::new(),
    };
    write_file(&arguments.output, made.page.as_bytes(), arguments.force)?;
    Ok(answer((arguments, model_path), &content, &made, &written))
}

fn answer(
    (arguments, model_path): (&ReportArguments, &Path),
    content: &Content<'_>,
    made: &Made,
    written: &[PathBuf],
) -> Answer {
    let (output, verdict) = (arguments.output.display().to_string(), content.verdict);
    let (headline, reasons) = (&made.introduction.headline, made.introduction.sentences());
    let mut text = format!(
        "{headline}\n{}\n{}\n{output}: {} kB, {} figures\n",
        lines("", &reasons),
        lines("", verdict_lines(verdict).lines()),
        made.page.len() / 1000,
        made.n_figures
    );
    text += &lines("note: ", &content.assessment.remarks);
    if let Some(folder) = shown(&arguments.figures) {
        let files = written.len();
        text += &format!("{folder}: {files} files, each figure as .svg, .pdf and .csv\n");
    }
    let json = json!({
        "model": model_path.display().to_string(),
        "output": output,
        "bytes": made.page.len(),
        "headline": headline,
        "reasons": reasons,
        "verdict": verdict,
        "figures": names(written),
        "remarks": content.assessment.remarks,
    });
    Answer::new(text, json).failed_if(verdict.fit_for.is_empty())
}

fn summary(folder: &Path) -> Result<Summary> {
    let summary = Summary::of(&Store::open(folder)?.cells()?, LAMBDA);
    if summary.dimensions.is_empty() {
        let folder = folder.display();
        note(&format!(
            "{folder}: no training of the study has a model; the report does not contain its plots"
        ));
    }
    Ok(summary)
}

pub(super) struct Made {
    pub page: String,
    introduction: Introduction,
    files: Vec<EmittedFile>,
    n_figures: usize,
}

pub(super) fn page_of(
    content: &Content<'_>,
    tolerance: Tolerance,
    commands: Vec<String>,
) -> Result<Made> {
    let progress = progress_bar("drawing the page", LADDER_STEPS);
    let figures = all_figures(content)?;
    let [ladder, equations, changes] =
        simplification::ladder(content.model, content.assessment, tolerance, &progress)?;
    progress.finish_and_clear();
    let errors = format!("Error of each ddz within {tolerance}, scaled units per s²");
    let bounds = format!("Every change within {tolerance}, with the bound of its error");
    let options = PageOptions {
        commands,
        simplification: vec![
            ladder.captioned(LADDER_CAPTION),
            equations.captioned(errors),
            changes.captioned(bounds),
        ],
    };
    let introduction = introduction(content)?;
    Ok(Made {
        page: page(content, &introduction, &figures, &options)?,
        introduction,
        files: figures.iter().flat_map(figure_files).collect(),
        n_figures: figures.iter().count(),
    })
}

const LADDER_CAPTION: &str = "Equations within each tolerance: active terms, digits of all coefficients, operations; largest error as a share of the root mean square of its ddz; errors of predictions over whole motions and restarted";

fn commands(arguments: &ReportArguments, model_path: &Path, has_control: bool) -> Vec<String> {
    let (model, output) = (quoted(model_path), quoted(&arguments.output));
    let recordings = quoted_all(&arguments.recordings) + &arguments.reading.as_flags();
    let (every, tolerance) = (arguments.restart_every, arguments.tolerance);
    let within = format!("--tolerance {tolerance}");
    let flags = [("study", &arguments.study), ("plan", &arguments.plan)].into_iter();
    let flags =
        flags.filter_map(|(name, path)| Some(format!(" --{name} {}", quoted(path.as_ref()?))));
    let flags: String = flags.collect();
    let along = format!("{model} {recordings}");
    let mut commands = vec![
        format!("romc report {along} --restart-every {every} {within}{flags} --output {output}"),
        format!("romc simulate {along} --restart-every {every}"),
    ];
    if has_control {
        let mpc = ["transpose", "consistent"].map(|lift| format!("romc mpc {along} --lift {lift}"));
        commands.extend(mpc);
    }
    let domain = format!("--domain {recordings} --out-dir out");
    commands.extend([
        format!("romc compile {model} --emit latex --out-dir out"),
        format!("romc compile {model} --emit latex,c {within} {domain}"),
    ]);
    commands
}
