//! A model's latent dynamics as printed equations, and the effect of rounding on them.

use super::*;

#[derive(Clone, Debug, PartialEq)]
pub struct EquationSystem {
    pub phase: String,
    pub equations: Vec<Equation>,
}

/// `left = terms`, in library order; no terms is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation {
    pub(crate) left: Symbol,
    pub(crate) terms: Vec<Signed>,
    /// Whether small terms were left out, so the two sides are only nearly equal.
    pub is_approximate: bool,
}

/// The printed coefficients, phase below phase.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CoefficientTable {
    /// Column heads: the accelerations and their units where these are physical.
    pub columns: Vec<(Symbol, Option<Unit>)>,
    pub parts: Vec<CoefficientPart>,
}

/// The coefficients of phases with equal equations.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CoefficientPart {
    pub phases: Vec<String>,
    /// The candidate terms that one of the equations has, in library order; none where all accelerations are zero.
    pub rows: Vec<CoefficientRow>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CoefficientRow {
    pub term: Math,
    /// Unit of the term, for equations in physical units; that of a coefficient is the column's over this.
    pub unit: Option<Unit>,
    /// The printed coefficient, or nothing where the term is not active.
    pub coefficients: Vec<Option<Decimal>>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Typeset {
    pub systems: Vec<EquationSystem>, // one per phase, in the model's order
    pub(crate) table: CoefficientTable,
    pub rounding: RoundingReport,
}

impl Typeset {
    /// Lays out the equations of each phase, terms in their order, coefficients rounded by `rounding`.
    pub fn new(system: &Equations<'_>, symbols: &SymbolTable, rounding: Rounding) -> Self {
        let terms = terms(system, symbols, rounding);
        let output = |output| (symbols.acceleration(output), format!("ddz{}", output + 1));
        let outputs: Vec<(Symbol, String)> = (0..system.latent_dim()).map(output).collect();
        let mut rounder = Rounder::new(rounding, coefficients(system));
        rounder.report.are_terms_rounded = are_rounded(&terms, system, symbols);
        let phases = system.phases.iter().enumerate();
        let phases = phases.map(|(index, phase)| (&phase.name, system.coefficients(index)));
        let phases: Vec<(&String, DMatrix<f64>)> = phases.collect();
        let systems = phases.iter();
        let systems: Vec<EquationSystem> = systems
            .map(|(phase, xi)| rounder.system(phase, &outputs, &terms, xi))
            .collect();
        let parts = alike(&systems).into_iter().map(|group| CoefficientPart {
            phases: (group.iter()).map(|&at| phases[at].0.clone()).collect(),
            rows: rows(system, &phases[group[0]].1, &terms, &rounder),
        });
        let units = system.latent_units();
        let unit = |output| units.map(|units| units.acceleration(output));
        let columns = outputs.iter().enumerate();
        Self {
            table: CoefficientTable {
                parts: parts.collect(),
                columns: (columns.map(|(output, (left, _))| (left.clone(), unit(output))))
                    .collect(),
            },
            systems,
            rounding: rounder.report,
        }
    }
}

/// Indices of systems grouped by equal printed equations, each group in the order of its first system.
pub fn alike(systems: &[EquationSystem]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (place, system) in systems.iter().enumerate() {
        let is_same = |group: &&mut Vec<usize>| systems[group[0]].equations == system.equations;
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(place),
            None => groups.push(vec![place]),
        }
    }
    groups
}

pub(super) fn coefficients(system: &Equations<'_>) -> impl Iterator<Item = f64> {
    let equations = system.phases.iter().flat_map(|phase| &phase.ddz);
    equations.flatten().map(|summand| summand.coefficient)
}

/// The rows of a phase with the coefficients `xi`.
fn rows(
    system: &Equations<'_>,
    xi: &DMatrix<f64>,
    terms: &[(&str, Signed)],
    rounder: &Rounder,
) -> Vec<CoefficientRow> {
    let units = system.latent_units();
    let cell = |value: &f64| Some(rounder.round(*value)).filter(|cell| !cell.is_zero());
    let row = |(row, (_, term)): (usize, &(&str, Signed))| CoefficientRow {
        term: term.clone().into_math(),
        unit: units
            .map(|units| units.of_term(&system.pool, system.terms[row].expr))
            .filter(|unit| *unit != Unit::default()),
        coefficients: xi.row(row).iter().map(cell).collect(),
    };
    (terms.iter().enumerate().map(row))
        .filter(|row| row.coefficients.iter().any(Option::is_some))
        .collect()
}

impl CoefficientTable {
    /// Whether its columns have units: all of them or none.
    pub(super) fn has_units(&self) -> bool {
        self.columns.iter().any(|(_, unit)| unit.is_some())
    }

    /// The unit of a coefficient as a sentence; nothing where there are no units.
    pub(super) fn unit_rule(&self) -> &'static str {
        match self.has_units() {
            true => "The unit of a coefficient is that of its column divided by that of its term.",
            false => "",
        }
    }
}

impl CoefficientPart {
    /// `Phase contact`, `Phases fr_rl, all`.
    pub(super) fn title(&self, spelling: &Spelling) -> String {
        let word = if self.phases.len() == 1 {
            "Phase"
        } else {
            "Phases"
        };
        let names: Vec<String> = self
            .phases
            .iter()
            .map(|name| (spelling.text)(name))
            .collect();
        format!("{word} {}", names.join(", "))
    }

    /// The title as a row of a table, with a note where no row follows.
    pub(super) fn row_title(&self, spelling: &Spelling) -> String {
        let title = self.title(spelling);
        match self.rows.is_empty() {
            true => title + ": all accelerations zero",
            false => title,
        }
    }
}

impl Equation {
    pub(crate) fn is_tall(&self) -> bool {
        self.terms.iter().any(|term| term.math.is_tall())
    }

    /// The right side as one piece: a lone zero when there are no terms.
    pub(crate) fn right(&self) -> Math {
        match self.terms.is_empty() {
            true => Math::Number(Decimal::integer(0)),
            false => Math::Sum(self.terms.clone()),
        }
    }
}
