//! A model's latent dynamics as equations to print, and what rounding did to them.

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
    /// Whether small terms were left out, so that the sides are nearly equal.
    pub is_approximate: bool,
}

/// Every candidate term that is printed somewhere, with its coefficients; in library order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CoefficientTable {
    /// Column heads: the acceleration, with the phase it belongs to, and its unit where that is physical.
    pub columns: Vec<(String, Symbol, Option<Unit>)>,
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
        let terms = terms(system, symbols);
        let output = |output| (symbols.acceleration(output), format!("ddz{}", output + 1));
        let outputs: Vec<(Symbol, String)> = (0..system.latent_dim()).map(output).collect();
        let mut rounder = Rounder::new(rounding, coefficients(system));
        let phases = system.phases.iter().enumerate();
        let phases = phases.map(|(index, phase)| (&phase.name, system.coefficients(index)));
        let phases: Vec<(&String, DMatrix<f64>)> = phases.collect();
        let systems = phases.iter();
        Self {
            systems: systems
                .map(|(phase, xi)| rounder.system(phase, &outputs, &terms, xi))
                .collect(),
            table: table(system, &phases, &outputs, &terms, &rounder),
            rounding: rounder.report,
        }
    }
}

pub(super) fn coefficients(system: &Equations<'_>) -> impl Iterator<Item = f64> {
    let equations = system.phases.iter().flat_map(|phase| &phase.ddz);
    equations.flatten().map(|summand| summand.coefficient)
}

fn table(
    system: &Equations<'_>,
    phases: &[(&String, DMatrix<f64>)],
    outputs: &[(Symbol, String)],
    terms: &[(&str, Signed)],
    rounder: &Rounder,
) -> CoefficientTable {
    let units = system.latent_units();
    let cell = |value: &f64| Some(rounder.round(*value)).filter(|cell| !cell.is_zero());
    let row = |(row, (_, term)): (usize, &(&str, Signed))| CoefficientRow {
        term: term.clone().into_math(),
        unit: units
            .map(|units| units.of_term(&system.pool, system.terms[row].expr))
            .filter(|unit| *unit != Unit::default()),
        coefficients: (phases.iter())
            .flat_map(|(_, xi)| xi.row(row).iter().map(cell).collect::<Vec<_>>())
            .collect(),
    };
    CoefficientTable {
        rows: (terms.iter().enumerate().map(row))
            .filter(|row| row.coefficients.iter().any(Option::is_some))
            .collect(),
        columns: (phases.iter())
            .flat_map(|(phase, _)| {
                outputs.iter().enumerate().map(|(output, (left, _))| {
                    let unit = units.map(|units| units.acceleration(output));
                    ((*phase).clone(), left.clone(), unit)
                })
            })
            .collect(),
    }
}

impl CoefficientTable {
    /// Whether its columns have units: all of them or none.
    pub(super) fn has_units(&self) -> bool {
        self.columns.iter().any(|(.., unit)| unit.is_some())
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
