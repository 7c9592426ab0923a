//! Magnitudes of the terms of a function's outputs at a point. They bound the difference of two correct evaluations
//! that round differently.
//!
//! An output is a sum of terms: coefficient times candidate term for `ddz`, coefficient times the candidate term's
//! derivative for the Jacobian, weight times coordinate and bias for affine maps, and for a step `z`, `h dz` and the
//! terms of each stage's `ddz` times the stage's weight. A candidate term that is itself a sum counts as its summands.
//!
//! A term may differ by four ulp (coefficient and addition), and by one more for each operation inside its candidate
//! term: `xi1*z1` by four, `xi2*z1*z2` by five ulp.

use nalgebra::DVector;
use romc::lower::JacobianPattern;
use romc::model::{LatentVariable, ReducedModel};
use romc::symbolic::{ExprId, ExprPool, Function as Elementary, Node, SymbolId};

use super::functions::{Function, Kind};

/// Ulp by which every term may differ.
const TERM: f64 = 4.0;

/// The distance from `|x|` to the next float.
fn ulp(x: f64) -> f64 {
    x.abs().next_up() - x.abs()
}

/// The terms of one function's outputs.
pub enum Terms<'m> {
    Latent(Sums),
    Step(&'m ReducedModel, usize, Sums),
    Affine {
        constant: Vec<f64>,
        /// One per input coordinate.
        columns: Vec<Vec<f64>>,
    },
}

impl<'m> Terms<'m> {
    /// `None` for maps through nonlinear layers and for feet's forces, which are not sums of terms.
    pub fn new(model: &'m ReducedModel, function: &Function) -> Option<Self> {
        Some(match &function.kind {
            Kind::Curved | Kind::Wrench => return None,
            Kind::Dynamics(phase) | Kind::Batch(phase) => {
                Terms::Latent(Sums::new(model, *phase, None))
            }
            Kind::Jacobian(phase, pattern) => {
                Terms::Latent(Sums::new(model, *phase, Some(pattern)))
            }
            Kind::Step(phase) => Terms::Step(model, *phase, Sums::new(model, *phase, None)),
            Kind::Affine => {
                let n = function.input_len();
                let constant = function.interpret(&vec![0.0; n]);
                let column = |col: usize| {
                    let mut unit = vec![0.0; n];
                    unit[col] = 1.0;
                    let at_unit = function.interpret(&unit);
                    at_unit.iter().zip(&constant).map(|(a, b)| a - b).collect()
                };
                let columns = (0..n).map(column).collect();
                Terms::Affine { constant, columns }
            }
        })
    }

    /// Allowed difference of each output at `point`.
    pub fn allowance(&self, point: &[f64]) -> Vec<f64> {
        match self {
            Terms::Latent(sums) => sums.allowance(point),
            Terms::Step(model, phase, sums) => step_allowance(model, *phase, sums, point),
            Terms::Affine { constant, columns } => (constant.iter().enumerate())
                .map(|(row, bias)| {
                    let terms = columns.iter().zip(point).map(|(column, x)| column[row] * x);
                    TERM * (ulp(*bias) + terms.map(ulp).sum::<f64>())
                })
                .collect(),
        }
    }
}

/// The terms of a classical Runge-Kutta step from `(z, dz)` with constant `u_lat`; `h` is last.
fn step_allowance(model: &ReducedModel, phase: usize, sums: &Sums, point: &[f64]) -> Vec<f64> {
    let d = model.latent_dim();
    let part = |k: usize| DVector::from_column_slice(&point[k * d..(k + 1) * d]);
    let (z, dz, u, h) = (part(0), part(1), part(2), point[3 * d]);
    let mut of_z: Vec<f64> = (0..d)
        .map(|k| TERM * (ulp(z[k]) + ulp(h * dz[k])))
        .collect();
    let mut of_dz: Vec<f64> = (0..d).map(|k| TERM * ulp(dz[k])).collect();
    let (mut stage_z, mut stage_dz) = (z.clone(), dz.clone());
    let stages = [
        (1.0, 1.0, 0.5 * h),
        (2.0, 1.0, 0.5 * h),
        (2.0, 1.0, h),
        (1.0, 0.0, h),
    ];
    for (weight, weight_z, next) in stages {
        let at: Vec<f64> = [stage_z.as_slice(), stage_dz.as_slice(), u.as_slice()].concat();
        for (k, size) in sums.allowance(&at).into_iter().enumerate() {
            of_dz[k] += h / 6.0 * weight * size;
            of_z[k] += h * h / 6.0 * weight_z * size;
        }
        let ddz = model.ddz(phase, &stage_z, &stage_dz, &u);
        let ddz = ddz.expect("dimensions fit");
        stage_z = &z + next * &stage_dz;
        stage_dz = &dz + next * ddz;
    }
    of_z.extend(of_dz);
    of_z
}

/// Sums of coefficients times expressions over `(z, dz, u_lat)`.
pub struct Sums {
    pool: ExprPool,
    /// All subexpressions of all terms, operands first.
    order: Vec<ExprId>,
    symbols: Vec<SymbolId>,
    outputs: Vec<Vec<(f64, ExprId)>>,
}

impl Sums {
    fn new(model: &ReducedModel, phase: usize, pattern: Option<&JacobianPattern>) -> Self {
        let library = model.library();
        let mut pool = library.pool().clone();
        let symbols: Vec<SymbolId> = LatentVariable::all(model.latent_dim())
            .map(|variable| library.symbol(variable).expect("a variable"))
            .collect();
        let of_row = |row: usize| -> Vec<(f64, ExprId)> {
            let active = model.phases()[phase].active_terms(row);
            active
                .map(|(term, xi)| (xi, library.terms()[term].expr))
                .collect()
        };
        let mut outputs: Vec<Vec<(f64, ExprId)>> = (0..model.latent_dim()).map(of_row).collect();
        for (&row, &col) in pattern.iter().flat_map(|p| p.rows.iter().zip(&p.cols)) {
            let slopes = of_row(row).into_iter();
            outputs.push(
                slopes
                    .map(|(xi, expr)| (xi, pool.derivative(expr, symbols[col])))
                    .collect(),
            );
        }
        let roots: Vec<ExprId> = outputs.iter().flatten().map(|(_, expr)| *expr).collect();
        Self {
            order: pool.reachable(&roots),
            pool,
            symbols,
            outputs,
        }
    }

    fn allowance(&self, point: &[f64]) -> Vec<f64> {
        let mut found: Vec<Sizes> = Vec::with_capacity(self.order.len());
        for &expr in &self.order {
            let next = self.sized(expr, &found, point);
            found.push(next);
        }
        let term = |(xi, expr): &(f64, ExprId)| {
            let of = found[self.place(*expr)];
            (TERM + of.operations) * ulp(xi * of.size)
        };
        let outputs = self.outputs.iter();
        outputs.map(|terms| terms.iter().map(term).sum()).collect()
    }

    fn place(&self, expr: ExprId) -> usize {
        self.order.binary_search(&expr).expect("a part of a term")
    }

    fn sized(&self, expr: ExprId, found: &[Sizes], point: &[f64]) -> Sizes {
        let of = |child: &ExprId| found[self.place(*child)];
        match self.pool.node(expr) {
            Node::Number(number) => Sizes::exact(number.to_f64()),
            Node::Symbol(symbol) => {
                let at = self.symbols.iter().position(|known| known == symbol);
                Sizes::exact(point[at.expect("a latent variable")])
            }
            Node::Sum(terms) => Sizes {
                value: terms.iter().map(|term| of(term).value).sum(),
                size: terms.iter().map(|term| of(term).size).sum(),
                operations: terms.iter().map(|term| of(term).operations + 1.0).sum(),
            },
            Node::Product(factors) => Sizes {
                value: factors.iter().map(|factor| of(factor).value).product(),
                size: factors.iter().map(|factor| of(factor).size).product(),
                operations: factors.iter().map(|f| of(f).operations + 1.0).sum::<f64>() - 1.0,
            },
            Node::Power(base, exponent) => {
                let (base, exponent) = (of(base), of(exponent).value);
                let operations = exponent.abs() * base.operations + exponent.abs().max(1.0);
                let value = base.value.powf(exponent);
                let size = match exponent > 0.0 {
                    true => base.size.powf(exponent),
                    false => value.abs(),
                };
                Sizes {
                    value,
                    size,
                    operations,
                }
            }
            Node::Apply(Elementary::Abs, argument) => Sizes {
                value: of(argument).value.abs(),
                ..of(argument)
            },
            Node::Apply(function, argument) => {
                let argument = of(argument);
                Sizes {
                    operations: argument.operations + 1.0,
                    ..Sizes::exact(function.evaluate(argument.value))
                }
            }
        }
    }
}

/// A value, and the sum of the magnitudes of its summands.
#[derive(Clone, Copy)]
struct Sizes {
    value: f64,
    size: f64,
    /// Count of rounding operations.
    operations: f64,
}

impl Sizes {
    fn exact(value: f64) -> Self {
        Self {
            value,
            size: value.abs(),
            operations: 0.0,
        }
    }
}
