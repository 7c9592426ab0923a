//! The page: introduction, equations, jumps, sections, placed by a template; a model's origin as tables.

use askama::Template;

use super::sections::{Section, sections};
use super::verdict::{Light, UseRow, total, use_rows, verdict_table};
use super::*;
use crate::artifact;
use crate::equations::{Equations, PhaseEquations};
use crate::typeset::latex::tex_cases;

const WIDTH_EM: f64 = 44.0;
const WIDE: f64 = 500.0; // width of a panel that is drawn across the page

pub(crate) struct PageOptions {
    pub simplification: Vec<Table>,
    pub commands: Vec<String>,
}

/// The report as one HTML page: no request to anywhere, one small script for animations and for copying equations.
pub(crate) fn page(
    content: &Content<'_>,
    introduction: &Introduction,
    figures: &AllFigures,
    options: &PageOptions,
) -> Result<String, TypesetError> {
    let model = content.model;
    let scaled = &Equations::of(model);
    let physical = scaled.in_physical_units();
    let typeset = |of, rounding| Typeset::new(of, &SymbolTable::default(), rounding);
    let (shown, rule) = match &physical {
        Ok(physical) => (physical, Rounding::PHYSICAL),
        Err(_) => (scaled, Rounding::default()),
    };
    let printed = typeset(shown, rule);
    let in_file = (physical.is_ok()).then(|| typeset(scaled, Rounding::default()));
    let invariance = Invariance::of(model);
    let not_checked = (invariance.as_ref().err())
        .map(|error| format!("Known physics cannot be checked: {error}."));
    let (light, passed) = total(content.verdict);
    let page = Page {
        model,
        version: env!("CARGO_PKG_VERSION"),
        digest: artifact::digest(model).to_string(),
        introduction,
        light,
        passed,
        uses: use_rows(content.verdict),
        verdict: verdict_table(content.verdict).captioned("Every row of the verdict"),
        overview: &figures.overview,
        coordinates: coordinates(shown),
        remarks: &content.assessment.remarks,
        phases: grouped(&printed, &shown.phases),
        rounding: rounding(&HTML, rule, &printed.rounding),
        not_physical: (physical.as_ref().err()).map(ToString::to_string),
        scaled: (in_file.iter())
            .flat_map(|typeset| grouped(typeset, &scaled.phases))
            .collect(),
        physics: (invariance.ok().flatten()).map(|of| invariance_table(model, &of)),
        not_checked,
        jumps: &figures.jumps,
        rest: content.assessment.runs.len() - figures.jumps.len(),
        sections: sections(content, introduction, figures, options),
        origin: origin(model.provenance()),
        commands: &options.commands,
    };
    Ok(rendered(&page)?)
}

/// Quantity and unit of each latent coordinate and its input; empty where the model does not determine them.
fn coordinates(equations: &Equations<'_>) -> Vec<String> {
    let words = equations.latent_words().into_iter().enumerate();
    let words = words.map(|(index, words)| {
        let unit = equations.latent_units().map(|units| units.input[index]);
        let number = index + 1;
        let input = unit.map(|unit| format!("; input u{number} in {unit}"));
        format!("z{number}: {words}{}", input.unwrap_or_default())
    });
    words.collect()
}

/// Equations with the phases that have them.
type Alike<'a> = Vec<(&'a EquationSystem, Vec<&'a PhaseEquations>)>;

#[derive(Template)]
#[template(path = "report/page.askama", config = "templates/askama.toml")]
struct Page<'a> {
    model: &'a ReducedModel,
    version: &'static str,
    digest: String,
    introduction: &'a Introduction,
    light: Light,
    passed: String,
    uses: Vec<UseRow>,
    verdict: Table,
    overview: &'a Option<Figure>,
    coordinates: Vec<String>,
    remarks: &'a [String],
    phases: Alike<'a>,
    rounding: String,
    /// Why the equations are in the scaled units of the model file.
    not_physical: Option<String>,
    /// The same in the units of the model file, if those are others.
    scaled: Alike<'a>,
    physics: Option<Table>,
    not_checked: Option<String>,
    jumps: &'a [JumpFigures],
    rest: usize,
    sections: Vec<Section<'a>>,
    origin: Origin,
    commands: &'a [String],
}

pub(super) fn html(text: &str) -> String {
    HtmlText(text).to_string()
}

pub(super) fn prose(text: &str) -> String {
    HtmlProse(text).to_string()
}

/// Phases of the same equations together, each list where its first phase is.
fn grouped<'a>(typeset: &'a Typeset, phases: &'a [PhaseEquations]) -> Alike<'a> {
    let of_group = |group: Vec<usize>| {
        let phases = group.iter().map(|&at| &phases[at]);
        (&typeset.systems[group[0]], phases.collect())
    };
    alike(&typeset.systems).into_iter().map(of_group).collect()
}

fn title(phases: &[&PhaseEquations]) -> String {
    let names: Vec<String> = phases.iter().map(|phase| html(&phase.name)).collect();
    let word = if names.len() == 1 { "Phase" } else { "Phases" };
    format!("{word} {}", listed(&names))
}

fn active(phase: &PhaseEquations) -> String {
    counted(phase.active_count(), "active term")
}

fn holds(phase: &PhaseEquations) -> String {
    html(&feet(&phase.feet))
}

fn math(equations: &EquationSystem) -> String {
    system(equations, WIDTH_EM)
}

fn latex(equations: &EquationSystem) -> String {
    let latex = tex_cases(equations, WIDTH_EM);
    let lines = latex.lines().map(|line| format!("{}\n", HtmlText(line)));
    lines.collect()
}

pub(super) fn layout(figure: &Figure) -> &'static str {
    match (figure.panels.len(), figure.columns) {
        (1, _) if figure.panel_size.0 > WIDE => "wide",
        (1, _) => "one",
        (_, 2) => "two",
        _ => "many",
    }
}

const LONGEST_LIST: usize = 24;
const DIGEST: usize = 12;

#[derive(Default)]
pub(crate) struct Origin {
    pub facts: Vec<(String, String)>,
    /// The others as tables with their names as captions: objects by place and value, lists of objects by their keys.
    pub lists: Vec<Table>,
}

pub(crate) fn origin(provenance: &Map<String, Value>) -> Origin {
    let mut origin = Origin::default();
    for (key, value) in provenance {
        let Value::Object(entries) = value else {
            add(&mut origin.facts, &mut origin.lists, key, value);
            continue;
        };
        let (mut facts, place) = (Vec::new(), origin.lists.len());
        for (key, value) in entries {
            add(&mut facts, &mut origin.lists, key, value);
        }
        let table = Table::of(&facts)
            .column("entry", "", |(entry, _)| entry)
            .column("value", "", |(_, value)| value);
        (origin.lists).insert(place, table.table().captioned(spaced(key)));
    }
    origin
}

fn add(facts: &mut Vec<(String, String)>, lists: &mut Vec<Table>, place: &str, value: &Value) {
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                add(facts, lists, &format!("{place}, {key}"), value);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_object) => {
            let keys = items.iter().find_map(Value::as_object).into_iter();
            let keys: Vec<&String> = keys.flat_map(Map::keys).collect();
            let mut table = Table::new(keys.iter().map(|key| spaced(key)));
            for item in items {
                table.row(
                    (keys.iter()).map(|key| item.get(key.as_str()).map_or(String::new(), text)),
                );
            }
            lists.push(table.captioned(format!("{}: {}", spaced(place), items.len())));
        }
        value => facts.push((spaced(place), text(value))),
    }
}

fn spaced(key: &str) -> String {
    key.replace('_', " ")
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        Value::Number(number) => match number.as_f64() {
            Some(value) if !number.is_i64() && !number.is_u64() => significant(value),
            Some(_) | None => number.to_string(),
        },
        Value::String(text) => match text.strip_prefix("sha256:") {
            Some(digest) if digest.len() > DIGEST && digest.is_ascii() => {
                format!("sha256:{}…", &digest[..DIGEST])
            }
            Some(_) | None => text.clone(),
        },
        Value::Array(items) => {
            let shown: Vec<String> = items.iter().take(LONGEST_LIST).map(text).collect();
            let rest = match items.len().saturating_sub(LONGEST_LIST) {
                0 => String::new(),
                rest => format!(" and {rest} more"),
            };
            shown.join(", ") + &rest
        }
        Value::Object(entries) => {
            let shown = |(key, value): (&String, &Value)| format!("{key}: {}", text(value));
            entries.iter().map(shown).collect::<Vec<_>>().join(", ")
        }
    }
}
