//! The files of the LaTeX backend.

use std::collections::BTreeMap;

use super::math::{Block, comment_text};
use super::table::TableBlock;
use super::*;
use crate::model::{Identifier, ReducedModel};
use crate::typeset::robot::Deviation;
use crate::typeset::words;

/// The LaTeX files of a model; NAME is its identifier:
///
/// - `NAME.tex`: the equations of each phase, phases of equal equations once, below how rounding changed them, and in
///   physical units above the units; `NAME_PHASE.tex`: those of one phase;
/// - `NAME-table.tex`: the coefficients as a booktabs table; `NAME-nomenclature.tex`: the list of symbols;
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
    let units = nomenclature::units_sentence(system, &options.symbols);
    let header = Header { model, options };
    let groups = alike(&typeset.systems);
    let systems = &of_groups(model, &typeset.systems, &groups, "", options);
    let of_all = header.equations(&typeset.rounding);
    let remark = units.clone().unwrap_or_default();
    let path = format!("{stem}.tex");
    let mut files = vec![equations(path, of_all, systems, false, &remark)?];
    let of_phase = header.short(&format!(
        "One phase of the equations; instead of {stem}.tex."
    ));
    let of_phase = of_phase + &units.map_or(String::new(), |units| format!("\n% {units}"));
    for place in 0..model.phases().len() {
        let path = format!("{stem}_{}.tex", model.phase_identifier(place));
        let system = [of_group(model, &typeset.systems, &[place], "", options)];
        files.push(equations(path, of_phase.clone(), &system, false, "")?);
    }
    let width_em = options.width_em.unwrap_or(math::WIDTH_EM);
    let blocks = table::blocks(&typeset.table, model.name(), options.numbers, width_em);
    let tables = table::references(&blocks);
    files.push(file(format!("{stem}-table.tex"), &header.tables(blocks))?);
    let of_symbols = header.short("A list of symbols; needs amsmath.");
    files.push(nomenclature::file(system, of_symbols, options)?);
    let is_physical = system.latent_units().is_some();
    if let Some(robot) = &robot {
        let comments = header.robot(robot, is_physical);
        let systems = of_robot(model, robot, options);
        let path = format!("{stem}-robot.tex");
        let remark = deviations(model, robot, options);
        files.push(equations(path, comments, &systems, true, &remark)?);
    }
    let phases = systems.iter().zip(&groups).map(|(system, group)| {
        let identifier = model.phase_identifier(group[0]);
        (system.introduction.as_str(), identifier)
    });
    let preview = Document::Preview {
        header: header.short("A complete document; the other .tex files are for \\input."),
        model,
        phases: phases.collect(),
        units: remark,
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
    remark: &str,
) -> Result<EmittedFile, TypesetError> {
    let equations = Document::Equations {
        header: header + &label_list(systems.iter().map(|system| system.block.labels())),
        is_introduced,
        systems,
        remark,
    };
    file(path, &equations)
}

/// Contents of the templates below the comments at the top.
#[derive(Template)]
#[template(config = "templates/askama.toml", syntax = "latex")]
enum Document<'a> {
    #[template(path = "latex/equations.askama")]
    Equations {
        header: String,
        /// Whether a sentence is before each system: the file contains more than the equations of motion.
        is_introduced: bool,
        systems: &'a [System],
        /// Sentences below the equations.
        remark: &'a str,
    },
    #[template(path = "latex/table.askama")]
    Tables {
        header: String,
        blocks: Vec<TableBlock>,
    },
    #[template(path = "latex/preview.askama")]
    Preview {
        header: String,
        model: &'a ReducedModel,
        phases: Vec<(&'a str, &'a Identifier)>, // introduction and identifier
        units: String,
        rounding: String,
        siunitx: bool,
        two_columns: bool,
        has_robot: bool,
        is_physical: bool,
        tables: String,
    },
}

/// Widest column, in em, for which previews have two columns.
const TWO_COLUMNS_EM: f64 = 26.0;

/// Whether a column is one of two, in which no table can break across pages.
pub(super) fn is_narrow(width_em: f64) -> bool {
    width_em <= TWO_COLUMNS_EM
}

pub(super) const TEX: Spelling = Spelling {
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

fn of_groups(
    model: &ReducedModel,
    systems: &[EquationSystem],
    groups: &[Vec<usize>],
    part: &str,
    options: &PrintOptions,
) -> Vec<System> {
    let groups = groups.iter();
    let system = |group: &Vec<usize>| of_group(model, systems, group, part, options);
    groups.map(system).collect()
}

/// The system of phases with equal equations; `part` distinguishes its label from that of another file.
fn of_group(
    model: &ReducedModel,
    systems: &[EquationSystem],
    group: &[usize],
    part: &str,
    options: &PrintOptions,
) -> System {
    let system = &systems[group[0]];
    let label = format!("eq:{}{part}:{}", label(model.name()), label(&system.phase));
    let block = math::block(system, label, options);
    let tall = match options.form == Form::Cases && block.lines.len() > math::CASES_LINES {
        true => " Tall, and cases do not break across pages: align does.",
        false => "",
    };
    let phases = group.iter().map(|&place| &model.phases()[place]);
    let phases = phases.map(|phase| (phase.name.as_str(), words::feet(&phase.feet)));
    let phases: Vec<(&str, String)> = phases.collect();
    let (word, introduction) = match phases.as_slice() {
        [(name, feet)] => (
            "Phase",
            format!(r"Phase \emph{{{}}}, with {feet}:", tex_text(name)),
        ),
        _ => {
            let each = phases.iter();
            let each = each.map(|(name, feet)| format!(r"\emph{{{}}} ({feet})", tex_text(name)));
            (
                "Phases",
                format!("Phases {}:", words::listed(&each.collect::<Vec<_>>())),
            )
        }
    };
    let (names, feet): (Vec<&str>, Vec<String>) = phases.into_iter().unzip();
    let names = comment_text(&names.join(", "));
    System {
        comment: format!("{word} {names}: {}.{tall}", feet.join("; ")),
        introduction,
        block,
    }
}

/// The encoder's rows, then the robot's accelerations in each phase.
fn of_robot(model: &ReducedModel, robot: &RobotTypeset, options: &PrintOptions) -> Vec<System> {
    let label = format!("eq:{}-robot:encoder", label(model.name()));
    let count = robot.negligible_weights;
    let without = match count {
        0 => String::new(),
        _ => format!(r" ({count} weights below 2\,\% of the largest of their row are left out)"),
    };
    let encoder = System {
        comment: format!(
            "Latent coordinates, 3 significant digits; {count} weights below 2 % of the largest of \
             their row are left out."
        ),
        introduction: format!("Latent coordinates{without}:"),
        block: math::block(&robot.encoder, label, options),
    };
    let groups = alike(&robot.systems);
    let of_phases = of_groups(model, &robot.systems, &groups, "-robot", options);
    [encoder].into_iter().chain(of_phases).collect()
}

/// Reasons for positions of the robot whose acceleration differs from that of the nearly equal latent coordinate.
fn deviations(model: &ReducedModel, robot: &RobotTypeset, options: &PrintOptions) -> String {
    let groups = alike(&robot.systems);
    let is_printed = |of: &&Deviation| groups.iter().any(|group| group[0] == of.phase);
    let printed = robot.deviations.iter().filter(is_printed);
    let mut of_latents: BTreeMap<&Symbol, Vec<&Deviation>> = BTreeMap::new();
    for deviation in printed {
        of_latents
            .entry(&deviation.latent)
            .or_default()
            .push(deviation);
    }
    let value = |of: &&Deviation| {
        let name = tex_text(&model.phases()[of.phase].name);
        let [robot, latent] = (of.constants.each_ref()).map(|c| tex_number(c, options.numbers));
        format!(r"\emph{{{name}}}: ${robot}$ instead of ${latent}$")
    };
    let sentence = |(latent, all): (&&Symbol, &Vec<&Deviation>)| {
        let values: Vec<String> = all.iter().map(value).collect();
        let symbols = [&all[0].coordinate, *latent].map(tex_symbol);
        let [coordinate, latent] = symbols;
        let values = values.join("; ");
        format!("The constant term of ${coordinate}$ differs from that of ${latent}$ ({values}). ")
    };
    let sentences: String = of_latents.iter().map(sentence).collect();
    let positions = of_latents.keys().map(|latent| {
        let position = Symbol {
            dots: 0,
            ..(**latent).clone()
        };
        format!("${}$", tex_symbol(&position))
    });
    let positions: Vec<String> = positions.collect();
    let include = if positions.len() == 1 {
        "includes"
    } else {
        "include"
    };
    match positions.is_empty() {
        true => String::new(),
        false => format!(
            "{sentences}The decoder causes the difference: {} {include} joint angles, and decoded joints \
             accelerate with $\\ddot{{\\mathbf{{z}}}}$ where those of the robot do not.",
            words::listed(&positions)
        ),
    }
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

    fn tables<'a>(&self, blocks: Vec<TableBlock>) -> Document<'a> {
        let is_long = blocks.iter().any(|block| block.environment == "longtable");
        let packages = match is_long {
            true => "Needs booktabs and longtable.",
            false => "Needs booktabs.",
        };
        let labels = label_list(blocks.iter().flat_map(|block| &block.labels));
        Document::Tables {
            header: self.short(packages) + &labels,
            blocks,
        }
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
