//! `romc report`: one page that tells whether a model is any good, and its figures as files.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::Answer;
use super::args::ReportArguments;
use super::mpc::{NamedRun, run_all, run_table};
use super::output::{Table, check_output, read_recordings, significant, spinner, write_file};
use super::simplification;
use super::simulate::{baseline_table, coordinate_table, dynamics_table, phase_table, remarks};
use crate::evaluate::ReferenceInput;
use crate::evaluate::{Assessment, LAMBDA};
use crate::files::Overwrite;
use crate::files::{EmittedFile, write_files};
use crate::model::ReducedModel;
use crate::mpc::{Lift, MpcSettings};
use crate::recording::Recording;
use crate::report::figures::{Figure, csv, pdf, standalone_svg};
use crate::report::{Content, PageOptions, PageTable, all_figures, page};
use crate::simplify::Tolerance;
use crate::study::{Store, Summary};
use crate::{Error, artifact};

/// Writes the page, and the figures if a folder for them is given.
///
/// # Errors
/// Whatever reading, simulating, controlling or writing refuses.
pub fn run(arguments: &ReportArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(Some(&arguments.output), overwrite)?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_recordings(&arguments.recordings)?;
    let study = match &arguments.study {
        None => None,
        Some(folder) => Some(Summary::of(&Store::open(folder)?.cells()?, LAMBDA)),
    };
    let made = make(&model, &recordings, study.as_ref(), arguments)?;
    // The figures come first: files that romc did not make are refused with nothing written.
    let written = match &arguments.figures {
        Some(folder) => write_files(folder, &made.files, overwrite)?,
        None => Vec::new(),
    };
    write_file(&arguments.output, made.page.as_bytes(), overwrite)?;
    let mut text = format!(
        "{}: {} kB, {} figures\n",
        arguments.output.display(),
        made.page.len() / 1000,
        made.n_figures
    );
    if let Some(folder) = &arguments.figures {
        let _ = writeln!(
            text,
            "{}: {} files, each figure as .svg, .pdf and .csv",
            folder.display(),
            written.len()
        );
    }
    Ok(Answer {
        text,
        json: json!({
            "command": "report",
            "model": arguments.model.display().to_string(),
            "output": arguments.output.display().to_string(),
            "bytes": made.page.len(),
            "figures": written.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        }),
    })
}

/// A report in memory.
pub struct Made {
    /// The page.
    pub page: String,
    /// Every figure as SVG, PDF and CSV.
    pub files: Vec<EmittedFile>,
    /// Number of figures.
    pub n_figures: usize,
}

/// Assesses the model, runs the controller and draws everything.
///
/// # Errors
/// Whatever simulating, controlling or typesetting refuses.
fn make(
    model: &ReducedModel,
    recordings: &[Recording],
    study: Option<&Summary>,
    arguments: &ReportArguments,
) -> Result<Made, Error> {
    let progress = spinner("rolling the model out");
    let assessment = Assessment::over(model, recordings, arguments.restart_every)?;
    progress.set_message("running the controller");
    let along = |lift| {
        let settings = MpcSettings {
            lift,
            ..MpcSettings::default()
        };
        run_all(model, recordings, settings, ReferenceInput::Recorded)
    };
    let (plain, consistent) = match without_statistics(model) {
        None => (along(Lift::Transpose)?, along(Lift::Consistent)?),
        Some(_) => (Vec::new(), Vec::new()),
    };
    progress.set_message("drawing");
    let commands = commands(arguments, without_statistics(model).is_none());
    let tolerance = arguments.tolerance;
    let runs = [&plain[..], &consistent];
    let made = page_of(model, &assessment, runs, study, tolerance, &commands);
    progress.finish_and_clear();
    made
}

/// The first phase whose inputs the controller cannot weigh.
fn without_statistics(model: &ReducedModel) -> Option<&str> {
    let phases = model.phases().iter().enumerate();
    let mut without = phases.filter(|&(index, _)| model.input_statistics(index).is_err());
    without.next().map(|(_, phase)| phase.name.as_str())
}

const LADDER_CAPTION: &str = "What is left within each tolerance: active terms, digits of all coefficients, operations; errors as shares of the root mean square of their ddz, the largest of all equations; errors of rollouts over whole jumps and restarted";

/// Draws what was assessed, and the controller's runs with the plain and with the consistent lift.
///
/// # Errors
/// [`Error::Model`] for a model without encoder or decoder, [`Error::Emit`] for one that cannot be
/// typeset.
pub fn page_of(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    [plain, consistent]: [&[NamedRun]; 2],
    study: Option<&Summary>,
    tolerance: Tolerance,
    commands: &[String],
) -> Result<Made, Error> {
    let content = Content {
        model,
        assessment,
        runs: consistent,
        study,
    };
    let figures = all_figures(&content)?;
    let ladder = simplification::ladder(model, assessment, tolerance)?;
    let options = PageOptions {
        commands: commands.to_vec(),
        simplification: vec![
            page_table(LADDER_CAPTION, &ladder.tolerances),
            page_table(
                &format!("Errors of each ddz within {tolerance}, scaled units per s²"),
                &ladder.equations,
            ),
        ],
        changes: Some(&ladder.changes)
            .filter(|changes| !changes.rows().is_empty())
            .map(|changes| {
                let caption = format!("Every change within {tolerance}, with its bound");
                page_table(&caption, changes)
            })
            .into_iter()
            .collect(),
        ..options(model, assessment, plain, consistent)
    };
    let page = page(&content, &figures, &options)?;
    Ok(Made {
        page,
        files: figures.iter().flat_map(figure_files).collect(),
        n_figures: figures.iter().count(),
    })
}

/// A figure as SVG, PDF and CSV.
pub fn figure_files(figure: &Figure) -> [EmittedFile; 3] {
    let id = &figure.id;
    [
        EmittedFile::new(format!("{id}.svg"), standalone_svg(figure)),
        EmittedFile::new(format!("{id}.pdf"), pdf(figure)),
        EmittedFile::new(format!("{id}.csv"), csv(figure)),
    ]
}

fn options(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    plain: &[NamedRun],
    consistent: &[NamedRun],
) -> PageOptions {
    let every = assessment.restart_every_s;
    let rms = |sums, name: &str| {
        let fit = assessment.fit(sums, name);
        fit.map_or("-".to_owned(), |fit| format!("{} m", significant(fit.rms)))
    };
    let optional = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let card = |name: &str, value: String| (name.to_owned(), value);
    PageOptions {
        headline: vec![
            card("latent coordinates", model.latent_dim().to_string()),
            card(
                "active terms, all phases",
                assessment.active_terms.to_string(),
            ),
            card("body.z error, whole jump", rms(&assessment.full, "body.z")),
            card(
                &format!("body.z error, restarted every {every} s"),
                rms(&assessment.restarted, "body.z"),
            ),
            card(
                "torque R² of the plain lift, contact",
                optional(assessment.lift.torque_r2().contact),
            ),
            card("L_mod (29)", optional(assessment.combined_loss())),
        ],
        coordinates: vec![
            page_table("Errors of every coordinate", &coordinate_table(assessment)),
            page_table(
                &format!("Root mean square errors by phase, restarted every {every} s"),
                &phase_table(model, assessment),
            ),
        ],
        baselines: vec![page_table(
            "Body position: the model and the pendulum",
            &baseline_table(assessment),
        )],
        baseline_notes: (assessment.baselines.iter())
            .map(|b| format!("{}: {}.", b.name, b.template.constants()))
            .collect(),
        dynamics: vec![page_table(
            "Each phase of the model",
            &dynamics_table(model, assessment),
        )],
        remarks: remarks(model, assessment),
        control: match plain.is_empty() {
            true => Vec::new(),
            false => vec![
                page_table("Plain lift, u = W_eᵀ u_lat", &run_table(plain)),
                page_table("Consistent lift", &run_table(consistent)),
            ],
        },
        control_notes: (without_statistics(model).into_iter())
            .map(|phase| {
                format!(
                    "The controller did not run: the model has no input statistics of phase {phase}, \
                     which weigh its inputs. romc import --inputs-from takes them from recordings."
                )
            })
            .collect(),
        ..PageOptions::default()
    }
}

fn page_table(caption: &str, table: &Table) -> PageTable {
    PageTable {
        caption: caption.to_owned(),
        header: table.header().to_vec(),
        rows: table.rows().to_vec(),
    }
}

/// The commands whose output the page shows.
fn commands(arguments: &ReportArguments, has_control: bool) -> Vec<String> {
    let paths = |paths: &[PathBuf]| {
        let quoted = paths.iter().map(|path| quoted(path));
        quoted.collect::<Vec<_>>().join(" ")
    };
    let (model, recordings) = (quoted(&arguments.model), paths(&arguments.recordings));
    let every = arguments.restart_every;
    let study = (arguments.study.as_ref()).map_or(String::new(), |folder| {
        format!(" --study {}", quoted(folder))
    });
    let tolerance = arguments.tolerance;
    let mut commands = vec![
        format!(
            "romc report {model} {recordings} --restart-every {every} --tolerance {tolerance}{study} --output {}",
            quoted(&arguments.output)
        ),
        format!("romc simulate {model} {recordings} --restart-every {every}"),
    ];
    if has_control {
        for lift in ["transpose", "consistent"] {
            commands.push(format!("romc mpc {model} {recordings} --lift {lift}"));
        }
    }
    commands.extend([
        format!("romc compile {model} --emit latex --out-dir out"),
        format!(
            "romc compile {model} --emit latex,c --tolerance {tolerance} --domain {recordings} --out-dir out"
        ),
    ]);
    commands
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |letter: char| letter.is_alphanumeric() || "-_./".contains(letter);
    if text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}
