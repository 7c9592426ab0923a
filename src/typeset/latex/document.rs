//! The files of the LaTeX backend.

use askama::Template;

use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::model::ReducedModel;
use crate::typeset::TypesetError;
use crate::typeset::{
    EquationSystem, NumberStyle, PrintOptions, RobotTypeset, RoundingReport, Typeset, rendered,
    words,
};

use super::escape::{CommentText, TexText, label};
use super::lines;
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
/// - `NAME-preview.tex`: a document that shows them all.
///
/// The first lines of `NAME.tex` say how coefficients were rounded, the largest
/// error that this made, and which terms vanished by it.
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
    let equations = EquationsFile {
        header: header.equations(&typeset.rounding),
        systems: phases(model, &typeset.systems, "", options),
    };
    let robot = RobotTypeset::new(system, &options.symbols, options.rounding)?
        .map(|robot| robot_equations(model, &robot, system.latent_units().is_some(), &header));
    let coefficients = Table {
        header: header.short("Needs booktabs and, for more than 40 terms, longtable."),
        blocks: table::blocks(&typeset.table, model.name(), options.numbers),
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
        phases: equations.systems.iter().map(System::sentence).collect(),
        rounding: TexText(&words::rounding(options.rounding, &typeset.rounding)).to_string(),
        siunitx: options.numbers == NumberStyle::Siunitx,
        has_robot: robot.is_some(),
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
            header: header.short("One phase of the equations, with the same label."),
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
    config = "templates/askama.toml",
    syntax = "latex"
)]
struct EquationsFile {
    header: String,
    systems: Vec<System>,
}

/// One system of equations in the template.
#[derive(Clone)]
struct System {
    /// What it is, in a comment.
    comment: String,
    /// When it holds, escaped for the running text.
    condition: String,
    label: String,
    aligned: bool,
    lines: Vec<String>,
}

impl System {
    /// The number of its equation and when that holds.
    fn sentence(&self) -> String {
        let label = &self.label;
        let number = if self.aligned {
            format!(r"Equations \eqref{{{label}:1}} and on")
        } else {
            format!(r"Equation \eqref{{{label}}}")
        };
        format!("{number}: {}.", self.condition)
    }
}

#[derive(Template)]
#[template(
    path = "latex/table.askama",
    config = "templates/askama.toml",
    syntax = "latex"
)]
struct Table {
    header: String,
    blocks: Vec<TableBlock>,
}

#[derive(Template)]
#[template(
    path = "latex/nomenclature.askama",
    config = "templates/askama.toml",
    syntax = "latex"
)]
struct Nomenclature {
    header: String,
    entries: Vec<Entry>,
}

#[derive(Template)]
#[template(
    path = "latex/preview.askama",
    config = "templates/askama.toml",
    syntax = "latex"
)]
struct Preview {
    header: String,
    name: String,
    description: String,
    stem: String,
    phases: Vec<String>,
    rounding: String,
    siunitx: bool,
    has_robot: bool,
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
            let block = lines::block(system, &label, options);
            let feet = words::feet(&phase.feet);
            System {
                comment: format!("Phase {}: {feet}.", CommentText(&system.phase)),
                condition: format!("{}, {feet}", TexText(&system.phase)),
                aligned: block.aligned,
                lines: block.lines,
                label,
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
    let block = lines::block(&encoder, &label, header.options);
    let mut systems = vec![System {
        comment: format!(
            "Latent coordinates, 3 significant digits; {} weights below 2 % of the largest of \
             their row are left out.",
            robot.negligible_weights
        ),
        condition: String::new(),
        aligned: block.aligned,
        lines: block.lines,
        label,
    }];
    systems.extend(phases(model, &robot.systems, "-robot", header.options));
    let latent = match is_physical {
        true => "",
        false => ", scaled",
    };
    let note = format!(
        "Robot coordinates q in SI units (rad, m); z, u as in the latent equations{latent}."
    );
    EquationsFile {
        header: format!("{}\n% {note}", header.equations(&robot.rounding)),
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
        header.push_str(&CommentText(&words::rounding(self.options.rounding, report)).to_string());
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
