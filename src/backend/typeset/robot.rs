//! The model in robot coordinates: what the latent coordinates are made of, and the
//! accelerations of the robot that the latent dynamics mean.

use nalgebra::DVector;

use crate::model::{AffineMap, CandidateTerm, ReducedModel};

use super::decimal::{Decimal, Rounding};
use super::equations::{Equation, EquationSystem};
use super::expression::{UnknownSymbol, expression};
use super::rounder::{Rounder, RoundingReport};
use super::symbols::{Quantity, SymbolTable, Variable, glyph};
use super::tree::{Glyph, Math, Signed, Symbol};

/// Weights below this share of their row's largest are left out of the printed encoder.
const NEGLIGIBLE: f64 = 0.02;

/// A model in robot coordinates `q`, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotTypeset {
    /// `z = W_e (s_x q) + b_e`, one equation a latent coordinate.
    pub encoder: Vec<Equation>,
    /// How many weights of the encoder are too small to be printed: each below 2 % of the
    /// largest of its row.
    pub negligible_weights: usize,
    /// `ddq = (W_d ddz) / s_x` a phase, as sums of candidate terms.
    pub systems: Vec<EquationSystem>,
    /// What rounding changed in `systems`.
    pub rounding: RoundingReport,
}

impl RobotTypeset {
    /// Lays out `model` in robot coordinates; `None` for a model without encoder, decoder,
    /// scaling or names of its state.
    ///
    /// # Errors
    /// [`UnknownSymbol`] if a candidate term uses a variable that the latent model has not.
    pub fn new(
        model: &ReducedModel,
        symbols: &SymbolTable,
        rounding: Rounding,
    ) -> Result<Option<Self>, UnknownSymbol> {
        let (Some(state), Ok(map), Ok(decoder), Ok(factors)) = (
            model.state(),
            model.encoder(),
            model.decoder(),
            model.state_factors(),
        ) else {
            return Ok(None);
        };
        let decoder = decoder.weights();
        let coordinates = coordinate_symbols(&state.names);
        let library = model.library();
        let terms = library
            .terms()
            .iter()
            .map(|term| expression(library.pool(), term.expr(), symbols))
            .collect::<Result<Vec<_>, _>>()?;
        let (encoder, negligible_weights) = encoder(map, &factors, symbols, &coordinates);
        let mut rounder = Rounder::new(rounding);
        let mut systems = Vec::new();
        for phase in model.phases() {
            let xi = &phase.xi;
            let mut equations = Vec::with_capacity(coordinates.len());
            for (row, symbol) in coordinates.iter().enumerate() {
                let texts = library.terms().iter().map(CandidateTerm::text);
                let entries = terms
                    .iter()
                    .zip(texts)
                    .enumerate()
                    .map(|(term, (math, text))| {
                        let sum = decoder.row(row).transpose().dot(&xi.row(term).transpose());
                        (sum / factors[row], text, math)
                    });
                let left = Symbol {
                    dots: 2,
                    ..symbol.clone()
                };
                let output = format!("dd({})", state.names[row]);
                equations.push(rounder.equation(left, (&phase.name, &output), entries));
            }
            systems.push(EquationSystem {
                phase: phase.name.clone(),
                equations,
            });
        }
        Ok(Some(Self {
            encoder,
            negligible_weights,
            systems,
            rounding: rounder.into_report(),
        }))
    }
}

/// The rows of the encoder in SI units, and how many weights were left out.
fn encoder(
    encoder: &AffineMap,
    factors: &DVector<f64>,
    symbols: &SymbolTable,
    coordinates: &[Symbol],
) -> (Vec<Equation>, usize) {
    let one = Signed::plus(Math::Number(Decimal::integer(1)));
    let terms: Vec<Signed> = coordinates
        .iter()
        .map(|symbol| Signed::plus(Math::Symbol(symbol.clone())))
        .collect();
    let mut rounder = Rounder::new(Rounding::Significant(3));
    let mut left_out = 0;
    let mut equations = Vec::new();
    for row in 0..encoder.output_dim() {
        let weights = encoder
            .weights()
            .row(row)
            .transpose()
            .component_mul(factors);
        let smallest = NEGLIGIBLE * weights.amax();
        let is_printed = |weight: f64| weight.abs() >= smallest && weight != 0.0;
        left_out += weights
            .iter()
            .filter(|w| **w != 0.0 && !is_printed(**w))
            .count();
        let bias = std::iter::once((encoder.bias()[row], "1", &one));
        let entries = weights
            .iter()
            .zip(&terms)
            .filter(|(weight, _)| is_printed(**weight))
            .map(|(weight, term)| (*weight, "", term));
        let left = symbols.symbol(Variable {
            quantity: Quantity::Position,
            index: row + 1,
        });
        equations.push(rounder.equation(left, ("encoder", ""), bias.chain(entries)));
    }
    (equations, left_out)
}

/// `fr.hx` as q with the subscript fr,hx; numbers where two names would look the same.
fn coordinate_symbols(names: &[String]) -> Vec<Symbol> {
    let spelled = |subscript| Symbol {
        glyph: Glyph::Letter('q'),
        dots: 0,
        subscript,
    };
    let named: Option<Vec<Symbol>> = names
        .iter()
        .map(|name| {
            let parts = name.split(|c: char| !c.is_ascii_alphanumeric());
            parts.map(glyph).collect::<Option<Vec<_>>>().map(spelled)
        })
        .collect();
    match named {
        Some(symbols) if all_differ(&symbols) => symbols,
        Some(_) | None => (1..=names.len())
            .map(|number| spelled(vec![Glyph::Digits(number.to_string())]))
            .collect(),
    }
}

fn all_differ(symbols: &[Symbol]) -> bool {
    let mut sorted: Vec<&Symbol> = symbols.iter().collect();
    sorted.sort();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinate_symbols_fall_back_to_numbers_when_names_look_alike() {
        let names = ["a.b".to_owned(), "a-b".to_owned()];
        let symbols = coordinate_symbols(&names);
        assert_eq!(symbols[0].to_string(), "q_1");
        let names = ["fr.hx".to_owned(), "body.x".to_owned()];
        let symbols = coordinate_symbols(&names);
        assert_eq!(symbols[0].to_string(), "q_fr,hx");
        assert_eq!(symbols[1].to_string(), "q_body,x");
    }
}
