//! The files of the LaTeX backend.

use super::math::{Block, comment_text};
use super::table::TableBlock;
use super::*;
use crate::model::{Activation, Identifier, ReducedModel, ScaleFactors, StateMap};
use crate::typeset::words;

/// The LaTeX files of a model; NAME is its identifier:
///
/// - `NAME.tex`: the equations of each phase, below how rounding changed them; `NAME_PHASE.tex`: those of one phase;
/// - `NAME-table.tex`: the coefficients as booktabs tables; `NAME-nomenclature.tex`: the list of symbols;
/// - `NAME-robot.tex`, with encoder and decoder: the latent coordinates and robot accelerations in SI units;
/// - `NAME-preview.tex`: a document that shows them all, in two columns for narrow equations.
///
/// # Errors
/// [`TypesetError`] if a coefficient is too large for a float in robot coordinates.
pub fn emit(system: &Equations<'_>, options: &PrintOptions) -> Emitted {
    let model = &*system.model;
    let typeset = Typeset::new(system, &options.symbols, options.rounding);
    let robot = RobotTypeset::new(system, &options.symbols, options.rounding)?;
    let stem = model.identifier().as_str();
    let header = Header { model, options };
    let systems = &phases(model, &typeset.systems, "", options);
    let of_all = header.equations(&typeset.rounding);
    let mut files = vec![equations(format!("{stem}.tex"), of_all, systems, false)?];
    for (place, system) in systems.iter().enumerate() {
        let path = format!("{stem}_{}.tex", model.phase_identifier(place));
        let of_phase = header.short("One phase of the equations, with the same label.");
        let system = std::slice::from_ref(system);
        files.push(equations(path, of_phase, system, false)?);
    }
    let width_em = options.width_em.unwrap_or(math::WIDTH_EM);
    let blocks = table::blocks(&typeset.table, model.name(), options.numbers, width_em);
    let packages = match blocks.iter().any(|block| block.long) {
        true => "Needs booktabs and longtable.",
        false => "Needs booktabs.",
    };
    let tables = table::references(&blocks);
    let coefficients = Document::Tables {
        header: header.short(packages) + &label_list(blocks.iter().flat_map(|block| &block.labels)),
        blocks,
    };
    files.push(file(format!("{stem}-table.tex"), &coefficients)?);
    let of_symbols = header.short("A table as wide as the line; needs amsmath.");
    let symbols = symbol_list(system, of_symbols, options);
    files.push(file(format!("{stem}-nomenclature.tex"), &symbols)?);
    let is_physical = system.latent_units().is_some();
    if let Some(robot) = &robot {
        let comments = header.robot(robot, is_physical);
        let systems = of_robot(model, robot, options);
        let path = format!("{stem}-robot.tex");
        files.push(equations(path, comments, &systems, true)?);
    }
    let preview = Document::Preview {
        header: header.short("A document of its own; the files beside it are for \\input."),
        model,
        phases: (systems.iter().enumerate())
            .map(|(place, system)| (system.introduction.as_str(), model.phase_identifier(place)))
            .collect(),
        rounding: words::rounding(&TEX, options.rounding, &typeset.rounding),
        siunitx: options.numbers == NumberStyle::Siunitx,
        two_columns: is_narrow(width_em),
        has_robot: robot.is_some(),
        is_physical,
        tables,
    };
    files.push(file(format!("{stem}-preview.tex"), &preview)?);
    Ok(files)
}

fn equations(
    path: String,
    header: String,
    systems: &[System],
    is_introduced: bool,
) -> Result<EmittedFile, TypesetError> {
    let equations = Document::Equations {
        header: header + &label_list(systems.iter().map(|system| system.block.labels())),
        is_introduced,
        systems,
    };
    file(path, &equations)
}

/// What the templates show below the comments at the top.
#[derive(Template)]
#[template(config = "templates/askama.toml", syntax = "latex")]
enum Document<'a> {
    #[template(path = "latex/equations.askama")]
    Equations {
        header: String,
        /// Whether a sentence stands before each system: the file holds more than the equations of motion.
        is_introduced: bool,
        systems: &'a [System],
    },
    #[template(path = "latex/table.askama")]
    Tables {
        header: String,
        blocks: Vec<TableBlock>,
    },
    #[template(path = "latex/nomenclature.askama")]
    Nomenclature {
        header: String,
        positions: Vec<(String, Option<String>, String)>, // symbol, unit, meaning
        velocities: String,
        inputs: Vec<(String, String, usize)>, // symbol, unit and number
        all_inputs: String,
        is_physical: bool,
        /// The map of velocities: the weights of an affine encoder, the Jacobian of another.
        map: Option<&'static str>,
        layers: Option<String>,
        factors: Vec<(char, String)>,
    },
    #[template(path = "latex/preview.askama")]
    Preview {
        header: String,
        model: &'a ReducedModel,
        phases: Vec<(&'a str, &'a Identifier)>, // introduction and identifier
        rounding: String,
        siunitx: bool,
        two_columns: bool,
        has_robot: bool,
        is_physical: bool,
        tables: String,
    },
}

/// Widest column, in em, for which previews have two.
const TWO_COLUMNS_EM: f64 = 26.0;

/// Whether a column is one of two, in which no table can break across pages.
pub(super) fn is_narrow(width_em: f64) -> bool {
    width_em <= TWO_COLUMNS_EM
}

const TEX: Spelling = Spelling {
    text: tex_text,
    math: |math, _| format!("${}$", tex(math, NumberStyle::Plain)),
};

struct System {
    comment: String,
    introduction: String,
    block: Block,
}

/// Comment lines that list labels, each line after a line end.
fn label_list(labels: impl IntoIterator<Item = impl fmt::Display>) -> String {
    let lines = labels.into_iter().map(|label| format!("\n%   {label}"));
    format!("\n% Labels:{}", lines.collect::<String>())
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
            let block = math::block(system, label, options);
            let feet = words::feet(&phase.feet);
            let tall = match options.form == Form::Cases && block.lines.len() > math::CASES_LINES {
                true => " Taller than a page as cases: align breaks across pages.",
                false => "",
            };
            System {
                comment: format!("Phase {}: {feet}.{tall}", comment_text(&system.phase)),
                introduction: format!(r"Phase \emph{{{}}}, with {feet}:", tex_text(&system.phase)),
                block,
            }
        })
        .collect()
}

/// The encoder's rows, then the robot's accelerations a phase.
fn of_robot(model: &ReducedModel, robot: &RobotTypeset, options: &PrintOptions) -> Vec<System> {
    let label = format!("eq:{}-robot:encoder", label(model.name()));
    let count = robot.negligible_weights;
    let without = match count {
        0 => String::new(),
        _ => format!(r", without weights below 2\,\% of the largest of their row ({count})"),
    };
    let encoder = System {
        comment: format!(
            "Latent coordinates, 3 significant digits; {count} weights below 2 % of the largest of \
             their row are left out."
        ),
        introduction: format!("Latent coordinates{without}:"),
        block: math::block(&robot.encoder, label, options),
    };
    let of_phases = phases(model, &robot.systems, "-robot", options);
    [encoder].into_iter().chain(of_phases).collect()
}

struct Header<'a> {
    model: &'a ReducedModel,
    options: &'a PrintOptions,
}

impl Header<'_> {
    fn short(&self, note: &str) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let name = comment_text(self.model.name());
        let digest = match &self.options.digest {
            Some(digest) => format!(", digest {}", comment_text(digest)),
            None => String::new(),
        };
        format!("% romc {version}, model {name}{digest}.\n% {note}")
    }

    fn equations(&self, report: &RoundingReport) -> String {
        let packages = match self.options.numbers {
            NumberStyle::Plain => "amsmath",
            NumberStyle::Siunitx => "amsmath and siunitx",
        };
        let short = self.short(&format!("For \\input; needs {packages}."));
        let rounding = words::rounding(&words::PLAIN, self.options.rounding, report);
        let dropped = report.dropped.iter().map(|term| {
            let names = [&term.phase, &term.output, &term.term].map(|name| comment_text(name));
            let ([phase, output, text], xi) = (names, term.coefficient);
            format!("\n%   left out: {phase}, {output}: {xi:e} * {text}")
        });
        let dropped: String = dropped.collect();
        format!("{short}\n% {}{dropped}", comment_text(&rounding))
    }

    fn robot(&self, robot: &RobotTypeset, is_physical: bool) -> String {
        let latent = if is_physical { "" } else { ", scaled" };
        let header = self.equations(&robot.rounding);
        format!(
            "{header}\n% Robot coordinates q in SI units (rad, m); z, u as in the latent equations{latent}."
        )
    }
}

fn file(path: String, template: &Document<'_>) -> Result<EmittedFile, TypesetError> {
    Ok(EmittedFile::new(path, rendered(template)?))
}

const STRONGEST: usize = 3; // of an encoder row's weights are named
const NEGLIGIBLE: f64 = 0.1; // share of the row's largest weight below which none is named

fn symbol_list<'a>(system: &Equations<'_>, header: String, options: &PrintOptions) -> Document<'a> {
    let (model, units) = (&*system.model, system.latent_units());
    let (dim, numbers) = (model.latent_dim(), options.numbers);
    let symbol = |variable| format!("${}$", tex_symbol(&options.symbols.symbol(variable)));
    // `$z_1, \dots, z_6$`, or all of up to three.
    let range = |of: fn(usize) -> LatentVariable| match dim {
        ..=3 => (0..dim)
            .map(|index| symbol(of(index)))
            .collect::<Vec<_>>()
            .join(", "),
        _ => format!(r"{}, \dots, {}", symbol(of(0)), symbol(of(dim - 1))),
    };
    let words = system.latent_words();
    let position = |index: usize| {
        let unit = units.map(|units| tex_unit(units.position[index]));
        let words = words.get(index).map(|words| match unit {
            Some(_) => words.quantity.clone(),
            None => words.to_string(),
        });
        let words = words.map_or(String::new(), |words| format!(": {}", tex_text(&words)));
        let meaning = coordinate(model, index, &words, numbers);
        (symbol(LatentVariable::Z(index)), unit, meaning)
    };
    let input = |(index, unit): (usize, &Unit)| {
        (symbol(LatentVariable::U(index)), tex_unit(*unit), index + 1)
    };
    let inputs = units
        .iter()
        .flat_map(|units| units.input.iter().enumerate().map(input));
    Document::Nomenclature {
        header,
        positions: (0..dim).map(position).collect(),
        velocities: range(LatentVariable::Dz),
        inputs: inputs.collect(),
        all_inputs: range(LatentVariable::U),
        is_physical: units.is_some(),
        map: match (model.encoder(), model.encoder_map()) {
            (Ok(_), _) => Some(r"\mathbf{W}_e"),
            (Err(_), Ok(_)) => Some(r"\mathbf{J}"),
            (Err(_), Err(_)) => None,
        },
        layers: (model
            .encoder_map()
            .ok()
            .filter(|_| model.encoder().is_err()))
        .map(layers),
        factors: scale_factors(model, numbers),
    }
}

/// A latent coordinate with its words, and the robot coordinates that it mostly consists of.
fn coordinate(model: &ReducedModel, row: usize, words: &str, numbers: NumberStyle) -> String {
    let (Ok(encoder), Some(state)) = (model.encoder(), model.state()) else {
        return format!("latent coordinate {}", row + 1);
    };
    let weights = encoder.weights().row(row);
    let weights = state.names.iter().zip(weights.iter().copied());
    let mut weights: Vec<(&String, f64)> = weights.collect();
    weights.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest = weights.first().map_or(0.0, |(_, weight)| weight.abs());
    let strongest: Vec<String> = (weights.iter().take(STRONGEST))
        .filter(|(_, weight)| weight.abs() > NEGLIGIBLE * largest)
        .map(|(name, weight)| {
            let weight = Decimal::rounded(*weight, Rounding::default());
            let (name, weight) = (tex_text(name), tex_number(&weight, numbers));
            format!(r"\texttt{{{name}}} (${weight}$)")
        })
        .collect();
    let (number, strongest) = (row + 1, strongest.join(", "));
    format!("latent coordinate {number}{words}; largest weights: {strongest}")
}

/// A nonlinear encoder by the widths of its layers; its weights stay in the model file.
fn layers(encoder: &StateMap) -> String {
    let widths = encoder.layers().iter().map(|layer| {
        let width = layer.map.output_dim();
        match layer.activation {
            Activation::Linear => width.to_string(),
            activation => format!("{width} ({activation})"),
        }
    });
    let (inputs, widths) = (encoder.input_dim(), widths.collect::<Vec<_>>().join(", "));
    format!("inputs {inputs}, layers {widths}")
}

fn scale_factors(model: &ReducedModel, numbers: NumberStyle) -> Vec<(char, String)> {
    let value = |factors: &ScaleFactors| match factors {
        ScaleFactors::Uniform(factor) => {
            format!(
                "${}$ for all",
                tex_number(&Decimal::exact(*factor), numbers)
            )
        }
        ScaleFactors::PerCoordinate(_) => "one per coordinate".to_owned(),
    };
    let scaling = model.scaling().into_iter();
    scaling
        .flat_map(|of| [('x', value(&of.state)), ('u', value(&of.input))])
        .collect()
}
