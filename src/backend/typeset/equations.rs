//! A model's latent dynamics as equations to print, and what rounding did to them.

use crate::model::{Phase, ReducedModel};

use super::decimal::{Decimal, Rounding};
use super::expression::{Leading, UnknownSymbol, expression, with_coefficient};
use super::symbols::{Quantity, SymbolTable, Variable};
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
}

/// Every candidate term that is printed somewhere, with its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientTable {
    /// Column heads: the acceleration, with the phase it belongs to.
    pub columns: Vec<(String, Symbol)>,
    /// One row a candidate term, in library order.
    pub rows: Vec<CoefficientRow>,
}

/// One candidate term and its coefficient in each column.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientRow {
    /// The term.
    pub term: Signed,
    /// The printed coefficient, or nothing where the term is not active.
    pub coefficients: Vec<Option<Decimal>>,
}

/// A coefficient's place in the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The phase's name.
    pub phase: String,
    /// `ddz1` and so on.
    pub output: String,
    /// The candidate term in the library's syntax.
    pub term: String,
    /// The coefficient in full.
    pub coefficient: f64,
}

/// What rounding for print changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoundingReport {
    /// Largest |printed - coefficient|, where it is not zero, and where it occurs.
    pub largest: Option<(f64, Place)>,
    /// Largest |printed - coefficient| / |coefficient| of the terms that are printed.
    pub largest_relative: f64,
    /// Active terms whose coefficient prints as zero, so that they are left out.
    pub dropped: Vec<Place>,
    /// How many coefficients are active in all.
    pub active: usize,
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
    /// Lays out the equations of `model`: `ddz = Xi^T Theta(z, dz, u_lat)` a phase, terms in
    /// library order, coefficients rounded by `rounding`.
    ///
    /// # Errors
    /// [`UnknownSymbol`] if a candidate term uses a variable that the latent model has not.
    pub fn new(
        model: &ReducedModel,
        symbols: &SymbolTable,
        rounding: Rounding,
    ) -> Result<Self, UnknownSymbol> {
        let library = model.library();
        let terms = library
            .terms()
            .iter()
            .map(|term| expression(library.pool(), term.expr(), symbols))
            .collect::<Result<Vec<_>, _>>()?;
        let mut layout = Layout {
            model,
            symbols,
            rounding,
            terms,
            report: RoundingReport::default(),
        };
        let systems = model
            .phases()
            .iter()
            .map(|phase| layout.system(phase))
            .collect();
        let table = layout.table();
        Ok(Self {
            systems,
            table,
            rounding: layout.report,
        })
    }
}

struct Layout<'a> {
    model: &'a ReducedModel,
    symbols: &'a SymbolTable,
    rounding: Rounding,
    terms: Vec<Signed>,
    report: RoundingReport,
}

impl Layout<'_> {
    fn acceleration(&self, output: usize) -> Symbol {
        self.symbols.symbol(Variable {
            quantity: Quantity::Acceleration,
            index: output + 1,
        })
    }

    fn system(&mut self, phase: &Phase) -> EquationSystem {
        let equations = (0..self.model.latent_dim())
            .map(|output| self.equation(phase, output))
            .collect();
        EquationSystem {
            phase: phase.name.clone(),
            equations,
        }
    }

    fn equation(&mut self, phase: &Phase, output: usize) -> Equation {
        let mut terms = Vec::new();
        for (row, term) in self.terms.iter().enumerate() {
            let coefficient = phase.xi[(row, output)];
            if coefficient == 0.0 {
                continue;
            }
            let place = || Place {
                phase: phase.name.clone(),
                output: format!("ddz{}", output + 1),
                term: self.model.library().terms()[row].text().to_owned(),
                coefficient,
            };
            let printed = Decimal::rounded(coefficient, self.rounding);
            self.report.active += 1;
            let error = (printed.value() - coefficient).abs();
            let largest = self
                .report
                .largest
                .as_ref()
                .map_or(0.0, |(error, _)| *error);
            if error > largest {
                self.report.largest = Some((error, place()));
            }
            if printed.is_zero() {
                self.report.dropped.push(place());
            } else {
                let relative = error / coefficient.abs();
                self.report.largest_relative = self.report.largest_relative.max(relative);
                // Only a true one: a rounded 1.00 says how well it is known.
                let leading = if coefficient.abs() == 1.0 && self.rounding.omits_one() {
                    Leading::Omitted
                } else {
                    Leading::Printed
                };
                terms.push(with_coefficient(&printed, leading, term.clone()));
            }
        }
        Equation {
            left: self.acceleration(output),
            terms,
        }
    }

    fn table(&self) -> CoefficientTable {
        let outputs = 0..self.model.latent_dim();
        let phases = self.model.phases();
        let columns = phases
            .iter()
            .flat_map(|phase| {
                let name = &phase.name;
                outputs
                    .clone()
                    .map(|output| (name.clone(), self.acceleration(output)))
            })
            .collect();
        let rows = self
            .terms
            .iter()
            .enumerate()
            .map(|(row, term)| CoefficientRow {
                term: term.clone(),
                coefficients: phases
                    .iter()
                    .flat_map(|phase| outputs.clone().map(|output| phase.xi[(row, output)]))
                    .map(|value| {
                        let printed = Decimal::rounded(value, self.rounding);
                        (!printed.is_zero()).then_some(printed)
                    })
                    .collect(),
            })
            .filter(|row| row.coefficients.iter().any(Option::is_some))
            .collect();
        CoefficientTable { columns, rows }
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
