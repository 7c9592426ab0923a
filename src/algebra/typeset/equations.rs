//! A model's latent dynamics as equations to print, and what rounding did to them.

use crate::equations::{Equations, PhaseEquations, Unit};

use super::decimal::{Decimal, Rounding};
use super::expression::terms;
use super::rounder::{Rounder, RoundingReport};
use super::symbols::SymbolTable;
use super::tree::{Math, Signed, Symbol};

/// The equations of one phase, ready for a printer.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationSystem {
    /// The phase's name as in the model file.
    pub phase: String,
    /// One equation a latent coordinate.
    pub equations: Vec<Equation>,
}

/// `left = terms`, in library order; no terms is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation {
    /// The acceleration.
    pub left: Symbol,
    /// Coefficient and candidate term, one entry each.
    pub terms: Vec<Signed>,
    /// Whether small terms were left out, so that the sides are nearly equal.
    pub is_approximate: bool,
}

/// Every candidate term that is printed somewhere, with its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientTable {
    /// Column heads: the acceleration, with the phase it belongs to.
    pub columns: Vec<(String, Symbol)>,
    /// Unit of each column's acceleration, for equations in physical units.
    pub units: Option<Vec<Unit>>,
    /// One row a candidate term, in library order.
    pub rows: Vec<CoefficientRow>,
}

/// One candidate term and its coefficient in each column.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientRow {
    /// The term.
    pub term: Math,
    /// Unit of the term, for equations in physical units; that of a coefficient is the column's over this.
    pub unit: Option<Unit>,
    /// The printed coefficient, or nothing where the term is not active.
    pub coefficients: Vec<Option<Decimal>>,
}

/// A model's equations with all that printers need of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Typeset {
    /// One system a phase, in the model's order.
    pub systems: Vec<EquationSystem>,
    /// The same coefficients as a table.
    pub table: CoefficientTable,
    /// What rounding changed.
    pub rounding: RoundingReport,
}

impl Typeset {
    /// Lays out the equations of each phase, terms in their order, coefficients rounded by
    /// `rounding`.
    pub fn new(system: &Equations<'_>, symbols: &SymbolTable, rounding: Rounding) -> Self {
        let mut layout = Layout {
            system,
            symbols,
            terms: terms(system, symbols),
            rounder: Rounder::new(rounding, coefficients(system)),
        };
        let systems = system
            .phases()
            .iter()
            .map(|phase| layout.system(phase))
            .collect();
        let table = layout.table();
        Self {
            systems,
            table,
            rounding: layout.rounder.report,
        }
    }
}

/// Every coefficient of all equations.
pub(super) fn coefficients(system: &Equations<'_>) -> impl Iterator<Item = f64> {
    let summands = system
        .phases()
        .iter()
        .flat_map(|phase| phase.ddz.iter().flatten());
    summands.map(|summand| summand.coefficient)
}

struct Layout<'a> {
    system: &'a Equations<'a>,
    symbols: &'a SymbolTable,
    terms: Vec<Signed>,
    rounder: Rounder,
}

impl Layout<'_> {
    fn system(&mut self, phase: &PhaseEquations) -> EquationSystem {
        let equations = (0..self.system.latent_dim())
            .map(|output| self.equation(phase, output))
            .collect();
        EquationSystem {
            phase: phase.name.clone(),
            equations,
        }
    }

    fn equation(&mut self, phase: &PhaseEquations, output: usize) -> Equation {
        let left = self.symbols.acceleration(output);
        let texts = self.system.terms();
        let summands = phase.ddz[output].iter().map(|summand| {
            let term = summand.term;
            (summand.coefficient, texts[term].text(), &self.terms[term])
        });
        let output = format!("ddz{}", output + 1);
        self.rounder
            .equation(left, (&phase.name, &output), summands)
    }

    fn table(&self) -> CoefficientTable {
        let phases = self.system.phases();
        let columns: Vec<(usize, usize)> = (0..phases.len())
            .flat_map(|phase| (0..self.system.latent_dim()).map(move |output| (phase, output)))
            .collect();
        let xi: Vec<_> = (0..phases.len())
            .map(|phase| self.system.coefficients(phase))
            .collect();
        let cell = |value: f64| Some(self.rounder.round(value)).filter(|cell| !cell.is_zero());
        let row = |(row, term): (usize, &Signed)| CoefficientRow {
            term: term.clone().into_math(),
            unit: self.unit_of_term(row),
            coefficients: (columns.iter())
                .map(|&(phase, output)| cell(xi[phase][(row, output)]))
                .collect(),
        };
        let units = self.system.latent_units().map(|units| {
            let outputs = columns.iter().map(|(_, output)| *output);
            outputs.map(|output| units.acceleration(output)).collect()
        });
        CoefficientTable {
            rows: (self.terms.iter().enumerate().map(row))
                .filter(|row| row.coefficients.iter().any(Option::is_some))
                .collect(),
            columns: (columns.iter())
                .map(|&(phase, output)| {
                    (
                        phases[phase].name.clone(),
                        self.symbols.acceleration(output),
                    )
                })
                .collect(),
            units,
        }
    }

    fn unit_of_term(&self, row: usize) -> Option<Unit> {
        let units = self.system.latent_units()?;
        let unit = units.of_term(self.system, self.system.terms()[row].expr());
        Some(unit).filter(|unit| *unit != Unit::default())
    }
}

impl Equation {
    /// Whether any term is taller than a line of text.
    pub fn is_tall(&self) -> bool {
        self.terms.iter().any(|term| term.math.is_tall())
    }

    /// The right side as one piece: a lone zero when there are no terms.
    pub fn right(&self) -> Math {
        if self.terms.is_empty() {
            Math::Number(Decimal::integer(0))
        } else {
            Math::Sum(self.terms.clone())
        }
    }
}
