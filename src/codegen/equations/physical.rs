//! Equations in metres, radians and newtons.
//!
//! A latent coordinate is `z_i = W_e,i (s_x x) + b_e,i`. A unit rules its row if the weights in SI units
//! `w_ij = W_e,ij s_x,j` of that unit have more than half of the row's sum of squares. Then the coordinate becomes a
//! length or an angle `Z_i = z_i / sigma_i` with `sigma_i = +- sum_j |w_ij|` over the coordinates of the ruling unit.
//! It is a weighted mean of these: the weights add up to one, the largest is positive.
//!
//! Its input becomes a force or a moment, `U_i = u_i / upsilon_i` with `1 / upsilon_i = +- sum_j |W_e,ij| / s_u,j` over
//! the inputs of the unit that does work along it. The shares of `u = W_e^T u_lat / s_u` in that unit then add up to
//! one. Rows that no unit rules keep pure numbers: `sigma_i = sqrt(sum_j w_ij^2)`, and inputs alike.
//!
//! Substituted, `dd Z_i = 1/sigma_i sum_k xi_ki theta_k(sigma Z, sigma dZ, upsilon U)`, with numeric factors moved from
//! every term into its coefficient.

use std::ops::{Div, Mul};

use super::*;

const RULES: f64 = 0.5; // share of a row's sum of squares from which its unit rules it

/// Why equations cannot be in physical units.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhysicalError {
    #[error(
        "physical units need an affine encoder and decoder, scale factors, and names and units of state and input"
    )]
    Maps(#[from] ModelError),
    #[error(
        "model `{model}`: physical units need an encoder and a decoder, which the model does not have; leave --units out"
    )]
    LatentOnly { model: String },
    #[error(
        "model `{model}`: physical units need `{part}` with names and units, which the model does not have"
    )]
    NoUnits { model: String, part: &'static str },
    #[error("model `{model}`: {place} has no finite value in physical units")]
    NotFinite { model: String, place: String },
}

/// Units of latent coordinates and inputs, and the input maps in them.
#[derive(Clone, Debug, PartialEq)]
pub struct LatentUnits {
    /// Unit of each latent coordinate: m, rad or 1.
    pub position: Vec<Unit>,
    /// Unit of each latent input: N, N m or 1.
    pub input: Vec<Unit>,
    /// `latent_dim x input_dim`: generalised inputs in SI units to latent inputs.
    pub project: DMatrix<f64>,
    /// `input_dim x latent_dim`: latent inputs to generalised inputs in SI units.
    pub lift: DMatrix<f64>,
}

impl LatentUnits {
    pub(crate) fn of(&self, variable: LatentVariable) -> Unit {
        match variable {
            LatentVariable::Z(i) => self.position[i],
            LatentVariable::Dz(i) => self.position[i].per_second(),
            LatentVariable::U(i) => self.input[i],
        }
    }

    pub(crate) fn acceleration(&self, output: usize) -> Unit {
        self.position[output].per_second().per_second()
    }

    /// The unit of a product of powers of variables; in any other term, a pure number, inner numbers carry the units.
    pub(crate) fn of_term(&self, pool: &ExprPool, term: ExprId) -> Unit {
        let factors = pool.factors_of(term).iter().map(|&factor| {
            let (base, exponent) = match pool.node(factor) {
                Node::Power(base, exponent) => (*base, pool.as_number(*exponent)?.as_integer()?),
                _ => (factor, 1),
            };
            let name = pool.symbol_name(pool.as_symbol(base)?);
            let variable = LatentVariable::from_name(name, self.position.len())?;
            Some(self.of(variable).power(i8::try_from(exponent).ok()?))
        });
        let mut factors = factors.into_iter();
        let product = factors.try_fold(Unit::default(), |unit, factor| Some(unit * factor?));
        product.unwrap_or_default()
    }
}

struct Scale {
    position: (f64, Unit),
    input: (f64, Unit),
}

impl Equations<'_> {
    /// The same equations in metres, radians, seconds, newtons and newton metres, with the model's maps.
    ///
    /// # Errors
    /// [`PhysicalError`] without robot coordinates or units, for nonlinear maps, or for values beyond floats.
    pub fn in_physical_units(&self) -> Result<Equations<'static>, PhysicalError> {
        let model = &*self.model;
        if model.encoder_map().is_err() && model.decoder_map().is_err() {
            let model = model.name().to_owned();
            return Err(PhysicalError::LatentOnly { model });
        }
        let scales = scales(model)?;
        let (terms, factors, pool) = self.substituted(&scales);
        let mut phases = Vec::with_capacity(self.phases.len());
        for phase in &self.phases {
            let ddz = (phase.ddz.iter().enumerate()).map(|(output, equation)| {
                let summands = equation.iter().map(|&Summand { coefficient, term }| {
                    let factor = factors[term] / scales[output].position.0;
                    let (phase, ddz, text) = (&phase.name, output + 1, &terms[term].text);
                    let place = || format!("phase {phase}, ddz{ddz}: the coefficient of {text}");
                    let coefficient = finite(coefficient * factor, model, place)?;
                    Ok::<_, PhysicalError>(Summand { coefficient, term })
                });
                summands.collect::<Result<Vec<_>, _>>()
            });
            phases.push(PhaseEquations {
                ddz: ddz.collect::<Result<_, _>>()?,
                ..phase.clone()
            });
        }
        let units = units(model, &scales)?;
        Ok(Equations {
            model: Cow::Owned(in_metres(model, &scales)?),
            pool,
            terms,
            phases,
            steps: self.steps.clone(),
            physical: Some((units, Box::new(self.clone().into_owned()))),
        })
    }

    /// Quantity and unit of each latent coordinate of these equations; empty where the model does not determine them.
    pub fn latent_words(&self) -> Vec<LatentWords> {
        let scaled = self.in_scaled_units().model.latent_words();
        let Some(units) = self.latent_units() else {
            return scaled;
        };
        let all = scaled.into_iter().zip(self.model.latent_words());
        let all = all.zip(&units.position).map(|((scaled, own), unit)| {
            let unit = unit.to_string();
            let has_unit = own.unit.is_empty() || own.unit == unit;
            let factor = match has_unit && own.quantity == scaled.quantity {
                true => "",
                false => ", times a constant",
            };
            let quantity = scaled.quantity + factor;
            LatentWords { quantity, unit }
        });
        all.collect()
    }

    /// Terms of scaled variables, and the numeric factor that went out of each.
    fn substituted(&self, scales: &[Scale]) -> (Vec<CandidateTerm>, Vec<f64>, ExprPool) {
        let mut pool = self.pool.clone();
        let replacements: Vec<(SymbolId, ExprId)> = LatentVariable::all(scales.len())
            .map(|variable| {
                let factor = match variable {
                    LatentVariable::Z(i) | LatentVariable::Dz(i) => scales[i].position.0,
                    LatentVariable::U(i) => scales[i].input.0,
                };
                let symbol = self.symbol(variable);
                let (number, expr) = (pool.number(factor), pool.symbol_expr(symbol));
                (symbol, pool.mul(number, expr))
            })
            .collect();
        let exprs: Vec<ExprId> = self.terms.iter().map(|term| term.expr).collect();
        let scaled = pool.substitute_all(&exprs, &replacements);
        let split = |expr: ExprId| match pool.terms_of(expr).as_slice() {
            [(number, rest)] => (number.to_f64(), *rest),
            _ => (1.0, expr),
        };
        let (factors, exprs): (Vec<f64>, Vec<ExprId>) = scaled.into_iter().map(split).unzip();
        let terms = (exprs.iter().zip(&self.terms)).map(|(&expr, term)| match expr == term.expr {
            true => term.clone(),
            false => CandidateTerm {
                text: pool.display(expr).to_string(),
                expr,
            },
        });
        (terms.collect(), factors, pool)
    }
}

fn finite(
    value: f64,
    model: &ReducedModel,
    place: impl FnOnce() -> String,
) -> Result<f64, PhysicalError> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(PhysicalError::NotFinite {
            model: model.name().to_owned(),
            place: place(),
        }),
    }
}

fn scales(model: &ReducedModel) -> Result<Vec<Scale>, PhysicalError> {
    let missing = |part| PhysicalError::NoUnits {
        model: model.name().to_owned(),
        part,
    };
    let state = model.state().ok_or_else(|| missing("state"))?;
    let input = model.input().ok_or_else(|| missing("input"))?;
    let weights = model.encoder()?.weights();
    let (s_x, s_u) = (model.state_factors()?, model.input_factors()?);
    let scale = |row: usize| {
        let weights = weights.row(row).transpose();
        let unit = ruling_unit(&weights.component_mul(&s_x), state);
        let forces = weights.component_div(&s_u);
        let position = scale_of(&weights.component_mul(&s_x), state, unit);
        let sign = position.signum();
        let dual = unit.and_then(Unit::dual);
        let strength = scale_of(&forces, input, dual).abs();
        let place = |what: &str| format!("`encoder.weights`[{row}]: {what}");
        let position = finite(position, model, || place("the latent coordinate"))?;
        let input = finite(sign / strength, model, || place("the latent input"))?;
        Ok(Scale {
            position: (position, unit.unwrap_or_default()),
            input: (input, dual.unwrap_or_default()),
        })
    };
    (0..model.latent_dim()).map(scale).collect()
}

fn ruling_unit(weights: &DVector<f64>, names: &CoordinateNames) -> Option<Unit> {
    let units = names.units.iter().map(|name| Unit::from_name(name));
    let mut shares: Vec<(Unit, f64)> = Vec::new();
    for (unit, weight) in units.zip(weights.iter()) {
        let unit = unit?;
        match shares.iter_mut().find(|(known, _)| *known == unit) {
            Some((_, share)) => *share += weight * weight,
            None => shares.push((unit, weight * weight)),
        }
    }
    let rules = |&(_, share): &(Unit, f64)| share > RULES * weights.norm_squared();
    shares.into_iter().find(rules).map(|(unit, _)| unit)
}

/// Sum of a unit's absolute weights, with the sign of the largest; the norm of all without a unit or its weights.
fn scale_of(weights: &DVector<f64>, names: &CoordinateNames, unit: Option<Unit>) -> f64 {
    let of_unit = (weights.iter().zip(&names.units))
        .filter(|(_, name)| unit.is_some() && Unit::from_name(name) == unit)
        .map(|(&weight, _)| weight);
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    let largest = of_unit.clone().fold(0.0, larger);
    let sum: f64 = of_unit.map(f64::abs).sum();
    match sum > 0.0 {
        true => sum.copysign(largest),
        false => weights.norm(),
    }
}

fn units(model: &ReducedModel, scales: &[Scale]) -> Result<LatentUnits, PhysicalError> {
    let (encoder, s_u) = (model.encoder()?.weights(), model.input_factors()?);
    let projection = model.input_projection()?;
    let input = |latent: usize| scales[latent].input.0;
    Ok(LatentUnits {
        position: scales.iter().map(|scale| scale.position.1).collect(),
        input: scales.iter().map(|scale| scale.input.1).collect(),
        project: projection.map_with_location(|row, col, p| p * s_u[col] / input(row)),
        lift: (encoder.transpose()).map_with_location(|row, col, w| w * input(col) / s_u[row]),
    })
}

/// The model with SI values on both sides of encoder and decoder.
fn in_metres(model: &ReducedModel, scales: &[Scale]) -> Result<ReducedModel, PhysicalError> {
    let s_x = model.state_factors()?;
    let sigma = |row: usize| scales[row].position.0;
    let (encoder, decoder) = (model.encoder()?, model.decoder()?);
    let scaled = |row, col, weight: f64| weight * s_x[col] / sigma(row);
    let weights = encoder.weights().map_with_location(scaled);
    let bias = (encoder.bias()).map_with_location(|row, _, bias| bias / sigma(row));
    let encoder = AffineMap::new("encoder", weights, bias)?;
    let scaled = |row, col, weight: f64| weight * sigma(col) / s_x[row];
    let weights = decoder.weights().map_with_location(scaled);
    let decoder = AffineMap::new("decoder", weights, decoder.bias().component_div(&s_x))?;
    let scaling = Scaling {
        state: ScaleFactors::Uniform(1.0),
        input: model.scaling()?.input.clone(),
    };
    let builder = model.clone().into_builder().encoder(encoder);
    Ok(builder.decoder(decoder).scaling(scaling).build()?)
}

/// Exponents of m, rad, kg and s; 1 by default. Radians are kept apart from 1, so that angles are no pure numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unit([i8; 4]);

const SYMBOLS: [&str; 4] = ["m", "rad", "kg", "s"];
const METRE: Unit = Unit([1, 0, 0, 0]);
const RADIAN: Unit = Unit([0, 1, 0, 0]);
const SECOND: Unit = Unit([0, 0, 0, 1]);
const NEWTON: Unit = Unit([1, 0, 1, -2]);
const NEWTON_METRE: Unit = Unit([2, 0, 1, -2]);

impl Unit {
    /// The unit of a position or generalised force that a model file names, if it is one of `m`, `rad`, `N`, `N m`.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        match name {
            "m" => Some(METRE),
            "rad" => Some(RADIAN),
            "N" => Some(NEWTON),
            "N m" => Some(NEWTON_METRE),
            _ => None,
        }
    }

    /// The unit of the generalised force that does work along a position: N for m, N m for rad.
    pub(crate) fn dual(self) -> Option<Self> {
        match self {
            METRE => Some(NEWTON),
            RADIAN => Some(NEWTON_METRE),
            _ => None,
        }
    }

    pub(crate) fn per_second(self) -> Self {
        self / SECOND
    }

    pub(crate) fn power(self, exponent: i8) -> Self {
        Self(self.0.map(|own| own.saturating_mul(exponent)))
    }

    /// The unit with this text between factors, and powers above 1 in this spelling.
    pub(crate) fn spelled(self, between: &str, power: impl Fn(i8) -> String) -> String {
        let product = |factors: &[(&str, i8)]| {
            let factors = factors.iter().map(|&(symbol, exponent)| match exponent {
                1 => symbol.to_owned(),
                _ => format!("{symbol}{}", power(exponent)),
            });
            factors.collect::<Vec<_>>().join(between)
        };
        let [above, below] = self.fraction();
        let above = match above.is_empty() {
            true => "1".to_owned(),
            false => product(&above),
        };
        match below.len() {
            0 => above,
            1 => format!("{above}/{}", product(&below)),
            _ => format!("{above}/({})", product(&below)),
        }
    }

    /// Numerator and denominator as lists of symbol and positive power.
    fn fraction(self) -> [Vec<(&'static str, i8)>; 2] {
        match self {
            NEWTON => [vec![("N", 1)], Vec::new()],
            NEWTON_METRE => [vec![("N", 1), ("m", 1)], Vec::new()],
            Self(exponents) => [1, -1].map(|sign| {
                let order = [2, 0, 1, 3].map(|at| (SYMBOLS[at], exponents[at] * sign));
                order.into_iter().filter(|&(_, power)| power > 0).collect()
            }),
        }
    }
}

impl Mul for Unit {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|at| {
            self.0[at].saturating_add(other.0[at])
        }))
    }
}

impl Div for Unit {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        self * other.power(-1)
    }
}

/// `1`, `m/s^2`, `1/kg`, `rad/(kg m^2)`.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(" ", |power| format!("^{power}")))
    }
}
