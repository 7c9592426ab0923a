//! `romc report`: a one-page assessment of a model, and its figures as files.

use super::args::ReportArguments;
use super::mpc::{judged, run_with_both_lifts};
use super::*;
use crate::evaluate::{Assessment, LAMBDA, Verdict, verdict};
use crate::report::{
    Content, Introduction, PageOptions, all_figures, figure_files, introduction, page,
    verdict_lines, without_statistics,
};
use crate::simplify::Tolerance;
use crate::study::{Store, Summary};
use crate::train::sha256;

/// Writes the page, and the figures if a folder for them is given. The exit code is 1 if the model is fit for nothing.
pub(super) fn run(arguments: &ReportArguments) -> Result<Answer, Error> {
    let inputs = Inputs::default()
        .and([&arguments.model])
        .and(&arguments.recordings)
        .and(&arguments.plan)
        .and(&arguments.reading.columns)
        .into_folder(arguments.figures.as_deref())?;
    inputs.check_output(Some(&arguments.output), Format::PAGE, arguments.force)?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_for(&model, &arguments.recordings, &arguments.reading)?;
    note_late_restarts(&recordings, arguments.restart_every);
    let study = (arguments.study.as_deref()).map(summary).transpose()?;
    let plan = (arguments.plan.as_ref()).map(|path| read_jump(&model, path, &arguments.reading));
    let plan = plan.transpose()?;
    let made = make(&model, &recordings, (&study, &plan), arguments)?;
    // The figures come first: files that romc did not make are refused with nothing written.
    let written = match &arguments.figures {
        Some(folder) => inputs.write_folder(folder, &made.files, arguments.force)?,
        None => Vec::new(),
    };
    write_file(&arguments.output, made.page.as_bytes(), arguments.force)?;
    let output = arguments.output.display().to_string();
    let Introduction {
        headline,
        sentences,
        ..
    } = &made.introduction;
    let mut text = format!(
        "{headline}\n{}\n\n{}\n{output}: {} kB, {} figures\n",
        sentences.join("\n"),
        verdict_lines(&made.verdict),
        made.page.len() / 1000,
        made.n_figures
    );
    text += &lines("note: ", &made.remarks);
    let files = format!(
        "{} files, each figure as .svg, .pdf and .csv",
        written.len()
    );
    let folder = shown(&arguments.figures);
    text += &lines("", folder.map(|folder| format!("{folder}: {files}")));
    let json = json!({
        "model": arguments.model.display().to_string(),
        "output": output,
        "bytes": made.page.len(),
        "headline": headline,
        "reasons": sentences,
        "verdict": made.verdict,
        "figures": names(&written),
        "remarks": made.remarks,
    });
    Ok(Answer::new(text, json).failed_if(made.verdict.fit_for.is_empty()))
}

fn summary(folder: &Path) -> Result<Summary, Error> {
    let summary = Summary::of(&Store::open(folder)?.cells()?, LAMBDA);
    if summary.dimensions.is_empty() {
        let folder = folder.display();
        note(&format!(
            "{folder}: no training of the study has a model, so that its figures are left out"
        ));
    }
    Ok(summary)
}

pub(super) struct Made {
    pub page: String,
    pub introduction: Introduction,
    pub verdict: Verdict,
    pub files: Vec<EmittedFile>,
    pub n_figures: usize,
    /// What speaks against using the model on these recordings.
    pub remarks: Vec<String>,
}

fn make(
    model: &ReducedModel,
    recordings: &[Recording],
    (study, plan): (&Option<Summary>, &Option<Segment>),
    arguments: &ReportArguments,
) -> Result<Made, Error> {
    let progress = spinner("rolling the model out");
    let assessment = Assessment::over(model, recordings, arguments.restart_every)?;
    progress.set_message("running the controller");
    let can_control = without_statistics(model).is_none();
    let runs = can_control.then(|| run_with_both_lifts(model, recordings));
    let [plain, consistent] = runs.transpose()?.unwrap_or_default();
    let verdict = verdict(model, &assessment, &judged(&plain));
    progress.set_message("drawing");
    let paths = recordings.iter().map(|recording| &recording.path);
    let digests: Vec<(PathBuf, String)> = paths
        .filter_map(|path| Some((path.clone(), sha256(&std::fs::read(path).ok()?))))
        .collect();
    let content = Content {
        model,
        assessment: &assessment,
        verdict: &verdict,
        plain: &plain,
        consistent: &consistent,
        study: study.as_ref(),
        plan: plan.as_ref(),
        digests: &digests,
    };
    let commands = commands(arguments, can_control);
    let made = page_of(&content, arguments.tolerance, commands);
    progress.finish_and_clear();
    made
}

pub(super) fn page_of(
    content: &Content<'_>,
    tolerance: Tolerance,
    commands: Vec<String>,
) -> Result<Made, Error> {
    let figures = all_figures(content)?;
    let [ladder, equations, changes] =
        simplification::ladder(content.model, content.assessment, tolerance)?;
    let errors = format!("Errors of each ddz within {tolerance}, scaled units per s²");
    let bounds = format!("Every change within {tolerance}, with its bound");
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
        verdict: content.verdict.clone(),
        files: figures.iter().flat_map(figure_files).collect(),
        n_figures: figures.iter().count(),
        remarks: content.assessment.remarks.clone(),
    })
}

const LADDER_CAPTION: &str = "Size of the equations within each tolerance: active terms, digits of all coefficients, operations; errors as shares of the root mean square of their ddz, the largest of all equations; errors of rollouts over whole jumps and restarted";

fn commands(arguments: &ReportArguments, has_control: bool) -> Vec<String> {
    let (model, output) = (quoted(&arguments.model), quoted(&arguments.output));
    let recordings = quoted_all(&arguments.recordings) + &arguments.reading.as_flags();
    let along = format!("{model} {recordings}");
    let (every, tolerance) = (arguments.restart_every, arguments.tolerance);
    let study = arguments
        .study
        .iter()
        .map(|path| format!(" --study {}", quoted(path)));
    let plan = arguments
        .plan
        .iter()
        .map(|path| format!(" --plan {}", quoted(path)));
    let beside: String = study.chain(plan).collect();
    let mut commands = vec![
        format!(
            "report {along} --restart-every {every} --tolerance {tolerance}{beside} --output {output}"
        ),
        format!("simulate {along} --restart-every {every}"),
        format!("mpc {along} --lift transpose"),
        format!("mpc {along} --lift consistent"),
        format!("compile {model} --emit latex --out-dir out"),
        format!(
            "compile {model} --emit latex,c --tolerance {tolerance} --domain {recordings} --out-dir out"
        ),
    ];
    commands.retain(|command| has_control || !command.starts_with("mpc"));
    commands
        .iter()
        .map(|command| format!("romc {command}"))
        .collect()
}
