//! The model in robot coordinates: the rows of the encoder, and the robot accelerations of the latent dynamics.

use std::collections::BTreeSet;

use super::equations::coefficients;
use super::symbols::glyph;
use super::*;

/// Weights below this share of their row's largest are left out of the printed encoder.
const NEGLIGIBLE: f64 = 0.02;
/// Difference of two accelerations that is explained, as a share of the largest.
const NOTABLE: f64 = 0.01;
const SAME: f64 = 1e-9; // difference of weights
const NOISE: f64 = 1e-12; // share of the largest

/// A model in robot coordinates `q`, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RobotTypeset {
    /// `z = W_e (s_x q) + b_e`, one equation per latent coordinate.
    pub encoder: EquationSystem,
    /// How many weights of the encoder are too small to be printed: each below 2 % of the largest of its row.
    pub negligible_weights: usize,
    /// `ddq = (W_d ddz) / s_x` per phase, as sums of candidate terms.
    pub systems: Vec<EquationSystem>,
    /// Rounding errors of `systems`.
    pub rounding: RoundingReport,
    /// Decoded positions whose acceleration differs from that of the nearly equal latent coordinate.
    pub deviations: Vec<Deviation>,
}

/// A constant term of a robot coordinate's acceleration that differs from that of its latent coordinate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Deviation {
    /// Place of the phase in the model.
    pub phase: usize,
    pub coordinate: Symbol,
    pub latent: Symbol,
    /// The constant terms of both.
    pub constants: [Decimal; 2],
}

impl RobotTypeset {
    /// Lays out a model; `None` without encoder, decoder, scaling or names of its state.
    ///
    /// # Errors
    /// [`TypesetError::NotFinite`] if a coefficient is too large for a float in SI units.
    pub(crate) fn new(
        system: &Equations<'_>,
        symbols: &SymbolTable,
        rounding: Rounding,
    ) -> Result<Option<Self>, TypesetError> {
        let model = &*system.model;
        let maps = (model.encoder(), model.decoder(), model.state_factors());
        let (Some(state), (Ok(map), Ok(decoder), Ok(factors))) = (model.state(), maps) else {
            return Ok(None);
        };
        let decoder = decoder.weights();
        let coordinates = coordinate_symbols(&state.names);
        let terms = terms(system, symbols, rounding);
        let (encoder, negligible_weights) = encoder(map, &factors, symbols, &coordinates)?;
        let mut rounder = Rounder::new(rounding, coefficients(system));
        rounder.report.are_terms_rounded = are_rounded(&terms, system, symbols);
        let mut systems = Vec::new();
        let doubled = coordinates.iter().map(|symbol| Symbol {
            dots: 2,
            ..symbol.clone()
        });
        let names = state.names.iter().map(|name| format!("dd({name})"));
        let outputs: Vec<(Symbol, String)> = doubled.zip(names).collect();
        let (pairs, mut deviations) = (positions(map, &factors, &state.units), Vec::new());
        for (index, phase) in system.phases.iter().enumerate() {
            let xi = system.coefficients(index);
            let mut ddq = DMatrix::zeros(terms.len(), outputs.len());
            for (row, (_, output)) in outputs.iter().enumerate() {
                for (term, (text, _)) in terms.iter().enumerate() {
                    let sum = decoder.row(row).transpose().dot(&xi.row(term).transpose());
                    ddq[(term, row)] = finite(sum / factors[row], output, text)?;
                }
            }
            if rounding != Rounding::Exact {
                ddq.row_iter_mut()
                    .for_each(|mut of_term| drop_noise(of_term.iter_mut()));
            }
            if let Some(constant) = terms.iter().position(|(text, _)| *text == "1") {
                let constants = [ddq.row(constant).transpose(), xi.row(constant).transpose()];
                let differing = differing(&pairs, &constants).into_iter();
                deviations.extend(differing.map(|(latent, coordinate, constants)| Deviation {
                    phase: index,
                    coordinate: outputs[coordinate].0.clone(),
                    latent: symbols.acceleration(latent),
                    constants: constants.map(|value| rounder.round(value)),
                }));
            }
            systems.push(rounder.system(&phase.name, &outputs, &terms, &ddq));
        }
        Ok(Some(Self {
            encoder,
            negligible_weights,
            systems,
            rounding: rounder.report,
            deviations,
        }))
    }
}

/// Latent coordinates that are a position of the robot plus angles, with that position.
fn positions(encoder: &AffineMap, factors: &DVector<f64>, units: &[String]) -> Vec<(usize, usize)> {
    let rows = encoder.weights().row_iter().enumerate();
    let pairs = rows.filter_map(|(row, weights)| {
        let weights = weights.transpose().component_mul(factors);
        let is_metre = |place: &usize| units[*place] == "m" && weights[*place].abs() > SAME;
        let metres: Vec<usize> = (0..weights.len()).filter(is_metre).collect();
        match metres.as_slice() {
            [one] if (weights[*one] - 1.0).abs() < SAME && weights.norm() > 1.0 => {
                Some((row, *one))
            }
            _ => None,
        }
    });
    pairs.collect()
}

/// Those of the `pairs` whose constant accelerations, of the robot and latent, differ notably, with both.
fn differing(
    pairs: &[(usize, usize)],
    [robot, latent]: &[DVector<f64>; 2],
) -> Vec<(usize, usize, [f64; 2])> {
    let constants = pairs
        .iter()
        .map(|&(row, coordinate)| (row, coordinate, [robot[coordinate], latent[row]]));
    let sizes = constants.clone().map(|(.., [_, latent])| latent.abs());
    let least = NOTABLE * sizes.fold(0.0, f64::max);
    constants
        .filter(|(.., [robot, latent])| (robot - latent).abs() > least)
        .collect()
}

/// Zeroes for values of one unit that are rounding errors compared with the largest of them.
fn drop_noise<'a>(values: impl IntoIterator<Item = &'a mut f64>) {
    let mut values: Vec<&mut f64> = values.into_iter().collect();
    let largest = values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    let noise = values
        .iter_mut()
        .filter(|value| value.abs() < NOISE * largest);
    noise.for_each(|value| **value = 0.0);
}

fn encoder(
    encoder: &AffineMap,
    factors: &DVector<f64>,
    symbols: &SymbolTable,
    coordinates: &[Symbol],
) -> Result<(EquationSystem, usize), TypesetError> {
    let mut terms = vec![("1", Signed::plus(Math::Number(Decimal::integer(1))))];
    let of_symbol = |symbol: &Symbol| ("", Signed::plus(Math::Symbol(symbol.clone())));
    terms.extend(coordinates.iter().map(of_symbol));
    let mut printed = DMatrix::zeros(terms.len(), encoder.output_dim());
    let mut absent = vec![0; encoder.output_dim()];
    let mut bias = encoder.bias().clone();
    drop_noise(bias.iter_mut());
    for (row, mut column) in printed.column_iter_mut().enumerate() {
        let weights = encoder.weights().row(row).transpose();
        let weights = weights.component_mul(factors);
        for (&weight, symbol) in weights.iter().zip(coordinates) {
            finite(weight, &format!("z{}", row + 1), &symbol.to_string())?;
        }
        let smallest = NEGLIGIBLE * weights.amax();
        column[0] = bias[row];
        for (index, &weight) in weights.iter().enumerate() {
            if weight.abs() >= smallest {
                column[index + 1] = weight;
            } else if weight != 0.0 {
                absent[row] += 1;
            }
        }
    }
    let output = |row| (symbols.symbol(LatentVariable::Z(row)), String::new());
    let outputs: Vec<_> = (0..encoder.output_dim()).map(output).collect();
    let mut rounder = Rounder::new(Rounding::Significant(3), std::iter::empty());
    let mut system = rounder.system("encoder", &outputs, &terms, &printed);
    for (equation, absent) in system.equations.iter_mut().zip(&absent) {
        equation.is_approximate = *absent > 0;
    }
    Ok((system, absent.iter().sum()))
}

fn finite(value: f64, output: &str, term: &str) -> Result<f64, TypesetError> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(TypesetError::NotFinite {
            output: output.to_owned(),
            term: term.to_owned(),
            value,
        }),
    }
}

/// `fr.hx` as q with the subscript fr,hx; numbers where two names would look the same.
pub(super) fn coordinate_symbols(names: &[String]) -> Vec<Symbol> {
    let spelled = |subscript| Symbol {
        glyph: Glyph::Letter('q'),
        dots: 0,
        subscript,
    };
    let named = names.iter().map(|name| {
        let parts = name.split(|c: char| !c.is_ascii_alphanumeric());
        parts.map(glyph).collect::<Option<_>>().map(spelled)
    });
    match named.collect::<Option<Vec<Symbol>>>() {
        Some(symbols) if BTreeSet::from_iter(&symbols).len() == symbols.len() => symbols,
        Some(_) | None => (1..=names.len())
            .map(|number| spelled(vec![Glyph::Digits(number.to_string())]))
            .collect(),
    }
}
