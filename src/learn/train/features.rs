//! The candidate library over whole batches of samples, forwards and backwards.
//!
//! Each step of the library's tape is computed for all samples of a batch before the next one starts.

use super::*;
use crate::ir::{LIMIT, reduced_sin_cos, sin_cos};
use crate::model::{Step, Tape};
use crate::symbolic::SymbolId;

/// Declares a function without result that runs with the widest vectors that the processor has.
macro_rules! vectorised {
    ($(#[$doc:meta])* $visibility:vis fn $name:ident($($argument:ident: $type:ty),* $(,)?) $body:block) => {
        $(#[$doc])*
        $visibility fn $name($($argument: $type),*) {
            #[inline(always)]
            fn plain($($argument: $type),*) $body

            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                fn with_avx2($($argument: $type),*) {
                    plain($($argument),*);
                }
                if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                    // SAFETY: the processor supports the compiled instructions.
                    return unsafe { with_avx2($($argument),*) };
                }
            }
            plain($($argument),*);
        }
    };
}

pub(super) use vectorised;

#[derive(Clone, Debug)]
pub(super) struct Features {
    tape: Tape,
    pub latent_dim: usize,
    /// Whether a variable, counted over `z`, `dz`, `u_lat`, occurs in a term.
    pub occurring: Vec<Vec<bool>>,
    /// Whether a term is affine: dynamics of such terms do not run away within the time of a jump.
    pub affine: Vec<bool>,
}

/// Values of all steps on one batch, reused between batches.
#[derive(Clone, Debug, Default)]
pub(super) struct FeatureValues {
    values: Vec<Vec<f64>>,
    adjoints: Vec<Vec<f64>>,
}

impl Features {
    pub(super) fn new(library: &Library) -> Self {
        let latent_dim = library.latent_dim();
        let variables = LatentVariable::all(latent_dim).filter_map(|v| library.symbol(v));
        let variables: Vec<SymbolId> = variables.collect();
        let mut pool = library.pool().clone();
        let (mut occurring, mut affine) = (Vec::new(), Vec::new());
        for term in library.terms() {
            let own = pool.symbols_of(term.expr);
            occurring.push(variables.iter().map(|v| own.contains(v)).collect());
            affine.push(own.into_iter().all(|variable| {
                let slope = pool.derivative(term.expr, variable);
                pool.is_constant(slope)
            }));
        }
        Self {
            tape: library.tape().clone(),
            latent_dim,
            occurring,
            affine,
        }
    }

    pub(super) fn library_dim(&self) -> usize {
        self.tape.terms.len()
    }

    /// Every term with the variables that occur in it.
    pub(super) fn variables(&self) -> impl Iterator<Item = (usize, Vec<usize>)> {
        let occurring = self.occurring.iter().enumerate();
        occurring.map(|(term, of)| (term, (0..of.len()).filter(|&v| of[v]).collect()))
    }

    pub(super) fn constant_term(&self) -> Option<usize> {
        self.term_of(|step| matches!(step, Step::Number(value) if *value == 1.0))
    }

    /// The term that is a variable, counted over `z`, `dz`, `u_lat`.
    pub(super) fn variable_term(&self, variable: usize) -> Option<usize> {
        self.term_of(|step| matches!(step, Step::Variable(own) if *own == variable))
    }

    fn term_of(&self, wanted: impl Fn(&Step) -> bool) -> Option<usize> {
        let mut terms = self.tape.terms.iter();
        terms.position(|&step| wanted(&self.tape.steps[step]))
    }

    /// `Theta` (`n x library_dim`) from `variables` (`n x 3 latent_dim`, columns z, dz, u_lat).
    pub(super) fn evaluate(
        &self,
        variables: &DMatrix<f64>,
        values: &mut FeatureValues,
    ) -> DMatrix<f64> {
        self.forward(variables, values);
        let mut theta = DMatrix::zeros(variables.nrows(), self.tape.terms.len());
        for (mut column, &step) in theta.column_iter_mut().zip(&self.tape.terms) {
            column.copy_from_slice(&values.values[step]);
        }
        theta
    }

    /// Values of one term after [`Self::forward`], one per sample.
    #[inline(always)]
    pub(super) fn term<'a>(&self, values: &'a FeatureValues, term: usize) -> &'a [f64] {
        &values.values[self.tape.terms[term]]
    }

    /// Adds to `gradient` (`n x 3 latent_dim`) the gradient by the variables of the batch in `values`, from
    /// `theta_gradient` (`n x library_dim`).
    pub(super) fn backward(
        &self,
        theta_gradient: &DMatrix<f64>,
        values: &mut FeatureValues,
        gradient: &mut DMatrix<f64>,
    ) {
        sweep_back(&self.tape, theta_gradient, values, gradient.as_mut_slice());
    }

    pub(super) fn forward(&self, variables: &DMatrix<f64>, values: &mut FeatureValues) {
        compute(&self.tape.steps, variables, &mut values.values);
    }
}

vectorised! {
    fn compute(steps: &[Step], variables: &DMatrix<f64>, values: &mut Vec<Vec<f64>>) {
        let n = variables.nrows();
        values.resize(steps.len(), Vec::new());
        for (index, step) in steps.iter().enumerate() {
            if let Step::Cosine(_) = step {
                continue; // done with its sine
            }
            let (earlier, rest) = values.split_at_mut(index);
            let out = &mut rest[0];
            out.clear();
            match step {
                Step::Number(value) => out.resize(n, *value),
                Step::Variable(column) => {
                    out.extend_from_slice(variables.column(*column).as_slice())
                }
                Step::Sum(parts) => fold(out, earlier, parts, n, 0.0, |a, b| a + b),
                Step::Product(parts) if let [a, b] = parts[..] => {
                    out.extend(earlier[a].iter().zip(&earlier[b]).map(|(a, b)| a * b))
                }
                Step::Product(parts) => fold(out, earlier, parts, n, 1.0, |a, b| a * b),
                Step::Integer(base, 2) => out.extend(earlier[*base].iter().map(|v| v * v)),
                Step::Integer(base, exponent) => {
                    out.extend(earlier[*base].iter().map(|v| v.powi(*exponent)))
                }
                Step::Power(base, exponent) => {
                    let pairs = earlier[*base].iter().zip(&earlier[*exponent]);
                    out.extend(pairs.map(|(b, e)| b.powf(*e)));
                }
                Step::Sine(argument) => {
                    let (sines, cosines) = rest.split_at_mut(1);
                    both(&earlier[*argument], &mut sines[0], &mut cosines[0]);
                }
                Step::Cosine(_) => {}
                Step::Apply(function, argument) => {
                    out.extend(earlier[*argument].iter().map(|v| function.evaluate(*v)))
                }
            }
        }
    }
}

vectorised! {
    fn sweep_back(
        tape: &Tape,
        theta_gradient: &DMatrix<f64>,
        values: &mut FeatureValues,
        gradient: &mut [f64],
    ) {
        let FeatureValues { values, adjoints } = values;
        let n = theta_gradient.nrows();
        adjoints.resize(tape.steps.len(), Vec::new());
        for adjoint in adjoints.iter_mut() {
            adjoint.clear();
            adjoint.resize(n, 0.0);
        }
        let columns = theta_gradient.as_slice().chunks_exact(n);
        for (column, &step) in columns.zip(&tape.terms) {
            add(&mut adjoints[step], column);
        }
        for (index, step) in tape.steps.iter().enumerate().rev() {
            let (earlier, rest) = adjoints.split_at_mut(index);
            add_adjoints(step, values, index, &rest[0], earlier);
            if let Step::Variable(column) = *step {
                add(&mut gradient[n * column..n * (column + 1)], &rest[0]);
            }
        }
    }
}

#[inline(always)]
fn fold(
    out: &mut Vec<f64>,
    earlier: &[Vec<f64>],
    parts: &[usize],
    n: usize,
    start: f64,
    join: impl Fn(f64, f64) -> f64,
) {
    out.resize(n, start);
    for &part in parts {
        let each = out.iter_mut().zip(&earlier[part]);
        each.for_each(|(o, v)| *o = join(*o, *v));
    }
}

#[inline(always)]
fn add(out: &mut [f64], values: &[f64]) {
    for (o, v) in out.iter_mut().zip(values) {
        *o += v;
    }
}

#[inline(always)]
fn both(arguments: &[f64], sines: &mut Vec<f64>, cosines: &mut Vec<f64>) {
    sines.resize(arguments.len(), 0.0);
    cosines.resize(arguments.len(), 0.0);
    let each = arguments.iter().zip(sines).zip(cosines);
    if arguments.iter().fold(0.0, |m: f64, v| m.max(v.abs())) <= LIMIT {
        each.for_each(|((v, sine), cosine)| (*sine, *cosine) = reduced_sin_cos(*v));
    } else {
        each.for_each(|((v, sine), cosine)| (*sine, *cosine) = sin_cos(*v));
    }
}

/// Adds a step's adjoint, times its derivatives, to the adjoints of its operands.
#[inline(always)]
fn add_adjoints(
    step: &Step,
    values: &[Vec<f64>],
    own: usize,
    adjoint: &[f64],
    earlier: &mut [Vec<f64>],
) {
    match step {
        Step::Number(_) | Step::Variable(_) => {}
        Step::Sum(parts) => {
            for &part in parts {
                add(&mut earlier[part], adjoint);
            }
        }
        Step::Product(parts) => {
            for (position, &part) in parts.iter().enumerate() {
                let mut others = parts.clone();
                others.remove(position);
                add_times(&mut earlier[part], adjoint, values, &others);
            }
        }
        Step::Integer(base, 2) => {
            add_times(&mut earlier[*base], adjoint, values, &[*base]);
            add_times(&mut earlier[*base], adjoint, values, &[*base]);
        }
        Step::Integer(base, exponent) => {
            for (i, a) in adjoint.iter().enumerate() {
                earlier[*base][i] += a * f64::from(*exponent) * values[*base][i].powi(exponent - 1);
            }
        }
        Step::Power(base, exponent) => {
            for (i, a) in adjoint.iter().enumerate() {
                let (b, e) = (values[*base][i], values[*exponent][i]);
                earlier[*base][i] += a * e * b.powf(e - 1.0);
                if b > 0.0 {
                    earlier[*exponent][i] += a * values[own][i] * b.ln();
                }
            }
        }
        Step::Sine(argument) => {
            add_times(&mut earlier[*argument], adjoint, values, &[own + 1]);
        }
        Step::Cosine(argument) => {
            let target = earlier[*argument].iter_mut().zip(adjoint);
            for ((e, a), sine) in target.zip(&values[own - 1]) {
                *e -= a * sine;
            }
        }
        Step::Apply(function, argument) => {
            for (i, a) in adjoint.iter().enumerate() {
                earlier[*argument][i] += a * function.slope(values[*argument][i], values[own][i]);
            }
        }
    }
}

#[inline(always)]
fn add_times(out: &mut [f64], adjoint: &[f64], values: &[Vec<f64>], factors: &[usize]) {
    let each = out.iter_mut().zip(adjoint);
    match *factors {
        [factor] => (each.zip(&values[factor])).for_each(|((o, a), v)| *o += a * v),
        _ => each.enumerate().for_each(|(i, (o, a))| {
            let factors = factors.iter().map(|&other| values[other][i]);
            *o += a * factors.product::<f64>();
        }),
    }
}
