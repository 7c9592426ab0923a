//! The candidate library over whole batches of samples, forwards and backwards.
//!
//! Each step of the library's tape is computed for all samples of a batch before the next one starts, with the vector
//! units of the machine. The reverse sweep turns the gradient with respect to the terms into the gradient with respect
//! to `z`, `dz` and `u_lat`, exactly.

use nalgebra::DMatrix;

use crate::ir::interpret::{LIMIT, reduced_sin_cos, sin_cos};
use crate::model::{LatentVariable, Library, Step, Tape};
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
                    // SAFETY: the processor has what this is compiled for.
                    return unsafe { with_avx2($($argument),*) };
                }
            }
            plain($($argument),*);
        }
    };
}

pub(super) use vectorised;

/// A library over batches.
#[derive(Clone, Debug)]
pub(super) struct Features {
    tape: Tape,
    latent_dim: usize,
    occurring: Vec<Vec<bool>>, // term, variable
    affine: Vec<bool>,
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
            let own = pool.symbols_of(term.expr());
            occurring.push(variables.iter().map(|v| own.contains(v)).collect());
            affine.push(own.into_iter().all(|variable| {
                let slope = pool.derivative(term.expr(), variable);
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

    pub(super) fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    /// For every term whether it is affine in `z`, `dz` and `u_lat`: dynamics of such terms do not run away within the
    /// time of a jump.
    pub(super) fn affine_terms(&self) -> &[bool] {
        &self.affine
    }

    /// Whether a variable, counted over `z`, `dz`, `u_lat`, occurs in a term.
    pub(super) fn depends_on(&self, term: usize, variable: usize) -> bool {
        self.occurring[term][variable]
    }

    /// The term that is 1.
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

    /// Adds to `gradient` (`n x 3 latent_dim`) what `theta_gradient` (`n x library_dim`) means for the variables.
    ///
    /// `values` must hold the forward pass of the same batch.
    pub(super) fn backward(
        &self,
        theta_gradient: &DMatrix<f64>,
        values: &mut FeatureValues,
        gradient: &mut DMatrix<f64>,
    ) {
        values.adjoints.resize(self.tape.steps.len(), Vec::new());
        for adjoint in &mut values.adjoints {
            adjoint.resize(theta_gradient.nrows(), 0.0);
        }
        sweep_back(&self.tape, theta_gradient, values, gradient.as_mut_slice());
    }

    /// Computes every step for all samples; see [`Self::evaluate`] for the shape of `variables`.
    pub(super) fn forward(&self, variables: &DMatrix<f64>, values: &mut FeatureValues) {
        compute(&self.tape.steps, variables, &mut values.values);
    }
}

vectorised! {
    fn compute(steps: &[Step], variables: &DMatrix<f64>, values: &mut Vec<Vec<f64>>) {
        let n = variables.nrows();
        values.resize(steps.len(), Vec::new());
        for (index, step) in steps.iter().enumerate() {
            let (earlier, rest) = values.split_at_mut(index);
            if let Step::Cosine(_) = step {
                continue;
            }
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
                Step::Cosine(_) => {} // done with its sine
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
        for adjoint in adjoints.iter_mut() {
            adjoint.fill(0.0);
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
        out.iter_mut()
            .zip(&earlier[part])
            .for_each(|(o, v)| *o = join(*o, *v));
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

/// Adds to `out` the adjoint times the values of the steps `factors`.
#[inline(always)]
fn add_times(out: &mut [f64], adjoint: &[f64], values: &[Vec<f64>], factors: &[usize]) {
    match *factors {
        [factor] => {
            for ((o, a), v) in out.iter_mut().zip(adjoint).zip(&values[factor]) {
                *o += a * v;
            }
        }
        _ => {
            for (i, (o, a)) in out.iter_mut().zip(adjoint).enumerate() {
                *o += a * factors
                    .iter()
                    .map(|&other| values[other][i])
                    .product::<f64>();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::train::random::Random;

    fn library() -> Library {
        let terms = [
            "1",
            "z1",
            "dz2",
            "z1*dz1*u2",
            "sin(z1 + 2*z2)",
            "cos(dz1)*z2",
            "exp(-z1^2)",
            "tanh(u1)/(2 + z2)",
            "sqrt(2 + z1)",
            "abs(z2)",
            "log(3 + dz2)",
            "tan(0.3*z1)",
            "(2 + z1)^z2",
        ];
        Library::from_terms(2, &terms.map(String::from)).expect("terms parse")
    }

    #[test]
    fn batch_values_equal_the_library_at_every_sample() {
        let library = library();
        let variables = Random::new(4).matrix(7, 6, 0.9);
        let theta = Features::new(&library).evaluate(&variables, &mut FeatureValues::default());
        for sample in 0..7 {
            let block =
                |i: usize| DVector::from(variables.row(sample).columns(2 * i, 2).transpose());
            let expected = library.evaluate(&block(0), &block(1), &block(2));
            let off = theta.row(sample).transpose() - expected.expect("dimensions fit");
            for (off, term) in off.iter().zip(library.terms()) {
                assert!(off.abs() < 1e-14, "{}", term.text());
            }
        }
    }

    #[test]
    fn backward_pass_agrees_with_finite_differences_for_every_function() {
        let features = Features::new(&library());
        let variables = Random::new(8).matrix(3, 6, 0.9);
        let weights = Random::new(9).matrix(3, features.library_dim(), 1.0);
        let mut values = FeatureValues::default();
        features.evaluate(&variables, &mut values);
        let mut gradient = DMatrix::zeros(3, 6);
        features.backward(&weights, &mut values, &mut gradient);
        for index in 0..variables.len() {
            let mut at = |step: f64| {
                let mut moved = variables.clone();
                moved[index] += step;
                features.evaluate(&moved, &mut values).dot(&weights)
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            let off = (difference - gradient[index]).abs();
            assert!(off < 1e-7 * difference.abs().max(1.0), "{index}");
        }
    }
}
