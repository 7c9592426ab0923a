//! The files of the LaTeX backend.

use std::fmt;

use askama::Template;

use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::model::ReducedModel;
use crate::typeset::TypesetError;
use crate::typeset::words::{self, Plain, Spelling};
use crate::typeset::{
    Decimal, EquationSystem, Form, Math, NumberStyle, PrintOptions, RobotTypeset, RoundingReport,
    Symbol, Typeset, rendered,
};

use super::escape::{CommentText, TexText, label};
use super::lines::{self, Block};
use super::math::{TexMath, TexNumber, TexSymbol};
use super::nomenclature::{self, Entry};
use super::table::{self, TableBlock};

/// The LaTeX files of a model; NAME is its identifier:
///
/// - `NAME.tex`: the equations of each phase, to be taken in by `\input`;
/// - `NAME_PHASE.tex`: the same equations, one phase a file, to be placed one by one;
/// - `NAME-table.tex`: the coefficients as booktabs tables;
/// - `NAME-nomenclature.tex`: what the symbols mean;
/// - `NAME-robot.tex`, if the model has encoder and decoder: what the latent coordinates
///   are made of, and the accelerations of the robot, in SI units;
/// - `NAME-preview.tex`: a document that shows them all, in two columns where the width asked for is
///   at most `TWO_COLUMNS_EM`.
///
/// The first lines of `NAME.tex` say how coefficients were rounded, the largest
/// error that this made, and which terms vanished by it. Files with labels list them.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn emit(
    system: &Equations<'_>,
    options: &PrintOptions,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let model = system.model();
    let typeset = Typeset::new(system, &options.symbols, options.rounding)?;
    let stem = model.identifier().as_str();
    let header = Header { model, options };
    let systems = phases(model, &typeset.systems, "", options);
    let equations = EquationsFile {
        header: header.equations(&typeset.rounding) + &labels(&systems),
        systems,
    };
    let is_physical = system.latent_units().is_some();
    let robot = RobotTypeset::new(system, &options.symbols, options.rounding)?;
    let robot = robot.map(|robot| robot_equations(model, &robot, is_physical, &header));
    let fit = Fit::to(options.width_em);
    let blocks = table::blocks(&typeset.table, model.name(), options.numbers, &fit);
    let packages = match blocks.iter().any(|block| block.long) {
        true => "Needs booktabs and longtable.",
        false => "Needs booktabs.",
    };
    let tables = table::references(&blocks);
    let coefficients = Table {
        header: header.short(packages) + &label_list(blocks.iter().flat_map(|block| &block.labels)),
        blocks,
    };
    let nomenclature = Nomenclature {
        header: header.short("A table as wide as the line; needs amsmath."),
        entries: nomenclature::entries(system, &options.symbols, options.numbers),
    };
    let preview = Preview {
        header: header.short("A document of its own; the files beside it are for \\input."),
        name: TexText(model.name()).to_string(),
        description: TexText(model.description()).to_string(),
        stem: stem.to_owned(),
        phases: (equations.systems.iter().enumerate())
            .map(|(place, system)| {
                (
                    system.introduction.clone(),
                    model.phase_identifier(place).to_string(),
                )
            })
            .collect(),
        rounding: words::rounding::<Tex>(options.rounding, &typeset.rounding),
        siunitx: options.numbers == NumberStyle::Siunitx,
        two_columns: fit.is_narrow,
        has_robot: robot.is_some(),
        latent: match is_physical {
            true => "latent coordinates and inputs have the units of the list of symbols",
            false => {
                "latent coordinates and inputs are scaled: those of the equations above, without a unit, \
                 accelerations per second squared"
            }
        },
        tables,
    };
    let mut files = vec![file(format!("{stem}.tex"), &equations)?];
    files.extend(phase_files(model, &equations, &header)?);
    files.extend([
        file(format!("{stem}-table.tex"), &coefficients)?,
        file(format!("{stem}-nomenclature.tex"), &nomenclature)?,
    ]);
    if let Some(robot) = &robot {
        files.push(file(format!("{stem}-robot.tex"), robot)?);
    }
    files.push(file(format!("{stem}-preview.tex"), &preview)?);
    Ok(files)
}

/// The equations of each phase in a file of their own.
fn phase_files(
    model: &ReducedModel,
    equations: &EquationsFile,
    header: &Header<'_>,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let stem = model.identifier();
    let one_phase = |(place, system): (usize, &System)| {
        let one = EquationsFile {
            header: header.short("One phase of the equations, with the same label.")
                + &labels(std::slice::from_ref(system)),
            systems: vec![system.clone()],
        };
        file(
            format!("{stem}_{}.tex", model.phase_identifier(place)),
            &one,
        )
    };
    equations
        .systems
        .iter()
        .enumerate()
        .map(one_phase)
        .collect()
}

#[derive(Template)]
#[template(
    path = "latex/equations.askama",
    config = "../../templates/askama.toml",
    syntax = "latex"
)]
struct EquationsFile {
    header: String,
    systems: Vec<System>,
}

/// Widest column, in em, for which previews have two.
pub const TWO_COLUMNS_EM: f64 = 26.0;

/// Equations, tables and lists that are fitted to a column.
pub(super) struct Fit {
    /// Width of the column, in em.
    pub width_em: f64,
    /// Whether it is one of two, in which no table can break across pages.
    pub is_narrow: bool,
}

impl Fit {
    fn to(width_em: Option<f64>) -> Self {
        let width_em = width_em.unwrap_or(lines::WIDTH_EM);
        Self {
            width_em,
            is_narrow: width_em <= TWO_COLUMNS_EM,
        }
    }
}

/// Running text of LaTeX.
struct Tex;

impl Spelling for Tex {
    fn text(text: &str) -> String {
        TexText(text).to_string()
    }

    fn number(number: &Decimal) -> String {
        let numbers = NumberStyle::Plain;
        format!("${}$", TexNumber { number, numbers })
    }

    fn term(math: &Math, _: &str) -> String {
        let numbers = NumberStyle::Plain;
        format!("${}$", TexMath { math, numbers })
    }

    fn left(symbol: &Symbol, _: &str) -> String {
        format!("${}$", TexSymbol(symbol))
    }
}

/// One system of equations in the template.
#[derive(Clone)]
struct System {
    /// What it is, in a comment.
    comment: String,
    /// What it is, in a sentence of the running text.
    introduction: String,
    /// The sentence before it, where its file holds more than the equations of motion.
    words: String,
    block: Block,
}

/// Comment lines that list labels, each line after a line end.
fn label_list(labels: impl IntoIterator<Item = impl fmt::Display>) -> String {
    let lines = labels.into_iter().map(|label| format!("\n%   {label}"));
    format!("\n% Labels:{}", lines.collect::<String>())
}

fn labels(systems: &[System]) -> String {
    label_list(systems.iter().map(|system| system.block.labels()))
}

#[derive(Template)]
#[template(
    path = "latex/table.askama",
    config = "../../templates/askama.toml",
    syntax = "latex"
)]
struct Table {
    header: String,
    blocks: Vec<TableBlock>,
}

#[derive(Template)]
#[template(
    path = "latex/nomenclature.askama",
    config = "../../templates/askama.toml",
    syntax = "latex"
)]
struct Nomenclature {
    header: String,
    entries: Vec<Entry>,
}

#[derive(Template)]
#[template(
    path = "latex/preview.askama",
    config = "../../templates/askama.toml",
    syntax = "latex"
)]
struct Preview {
    header: String,
    name: String,
    description: String,
    stem: String,
    /// Introduction and identifier of each phase.
    phases: Vec<(String, String)>,
    rounding: String,
    siunitx: bool,
    two_columns: bool,
    /// Whether there is a file of the robot's equations.
    has_robot: bool,
    /// Units of the latent quantities.
    latent: &'static str,
    /// References to the tables of coefficients.
    tables: String,
}

/// The systems of a model's phases; `part` tells their labels from those of another file.
fn phases(
    model: &ReducedModel,
    systems: &[EquationSystem],
    part: &str,
    options: &PrintOptions,
) -> Vec<System> {
    systems
        .iter()
        .zip(model.phases())
        .map(|(system, phase)| {
            let label = format!("eq:{}{part}:{}", label(model.name()), label(&system.phase));
            let block = lines::block(system, label, options);
            let feet = words::feet(&phase.feet);
            let tall = match options.form == Form::Cases && block.lines.len() > lines::CASES_LINES {
                true => " Taller than a page as cases: align breaks across pages.",
                false => "",
            };
            System {
                comment: format!("Phase {}: {feet}.{tall}", CommentText(&system.phase)),
                introduction: format!(r"Phase \emph{{{}}}, with {feet}:", TexText(&system.phase)),
                words: String::new(),
                block,
            }
        })
        .collect()
}

/// The encoder's rows, then the robot's accelerations a phase.
fn robot_equations(
    model: &ReducedModel,
    robot: &RobotTypeset,
    is_physical: bool,
    header: &Header<'_>,
) -> EquationsFile {
    let label = format!("eq:{}-robot:encoder", label(model.name()));
    let encoder = EquationSystem {
        phase: "encoder".to_owned(),
        equations: robot.encoder.clone(),
    };
    let introduction = match robot.negligible_weights {
        0 => "Latent coordinates:".to_owned(),
        count => format!(
            r"Latent coordinates, without weights below 2\,\% of the largest of their row ({count}):"
        ),
    };
    let mut systems = vec![System {
        comment: format!(
            "Latent coordinates, 3 significant digits; {} weights below 2 % of the largest of \
             their row are left out.",
            robot.negligible_weights
        ),
        words: introduction.clone(),
        introduction,
        block: lines::block(&encoder, label, header.options),
    }];
    let of_phases = phases(model, &robot.systems, "-robot", header.options);
    systems.extend(of_phases.into_iter().map(|system| System {
        words: system.introduction.clone(),
        ..system
    }));
    let latent = match is_physical {
        true => "",
        false => ", scaled",
    };
    let note = format!(
        "Robot coordinates q in SI units (rad, m); z, u as in the latent equations{latent}."
    );
    EquationsFile {
        header: format!(
            "{}\n% {note}{}",
            header.equations(&robot.rounding),
            labels(&systems)
        ),
        systems,
    }
}

/// The comments at the top of each file.
struct Header<'a> {
    model: &'a ReducedModel,
    options: &'a PrintOptions,
}

impl Header<'_> {
    fn short(&self, note: &str) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let name = CommentText(self.model.name());
        let digest = match &self.options.digest {
            Some(digest) => format!(", digest {}", CommentText(digest)),
            None => String::new(),
        };
        format!("% romc {version}, model {name}{digest}.\n% {note}")
    }

    fn equations(&self, report: &RoundingReport) -> String {
        let packages = match self.options.numbers {
            NumberStyle::Plain => "amsmath",
            NumberStyle::Siunitx => "amsmath and siunitx",
        };
        let mut header = self.short(&format!("For \\input; needs {packages}."));
        header.push_str("\n% ");
        let rounding = words::rounding::<Plain>(self.options.rounding, report);
        header.push_str(&CommentText(&rounding).to_string());
        for place in &report.dropped {
            let (phase, term) = (CommentText(&place.phase), CommentText(&place.term));
            header.push_str(&format!(
                "\n%   left out: {phase}, {}: {:e} * {term}",
                CommentText(&place.output),
                place.coefficient
            ));
        }
        header
    }
}

fn file(path: String, template: &impl Template) -> Result<EmittedFile, TypesetError> {
    Ok(EmittedFile::new(path, rendered(template)?))
}
