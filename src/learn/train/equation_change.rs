//! The least change of one equation that predicts left-out parts of recordings better: of single coefficients, or of
//! the equation as a whole.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

const RIDGES: [f64; 5] = [1.0, 0.1, 1e-2, 1e-3, 1e-4]; // strongest first
const LEAST_SHARE: f64 = 0.1; // from 1, by which an equation is multiplied
const LEAST_GAIN: f64 = 0.25; // of the left-out squared error, below which an equation's share stays 1

/// Normal equations of one left-out part.
#[derive(Clone)]
pub(super) struct Sums {
    pub(super) rows: usize,
    pub(super) gram: DMatrix<f64>,
    product: DMatrix<f64>,
    squares: Vec<f64>, // of the targets
}

impl Sums {
    pub(super) fn of(theta: &DMatrix<f64>, target: &DMatrix<f64>) -> Self {
        Self {
            rows: theta.nrows(),
            gram: theta.tr_mul(theta),
            product: theta.tr_mul(target),
            squares: target.column_iter().map(|of| of.norm_squared()).collect(),
        }
    }

    /// The sums of the other parts.
    pub(super) fn without(parts: &[Self], left_out: usize) -> Self {
        let mut others = parts
            .iter()
            .enumerate()
            .filter(|(part, _)| *part != left_out);
        let (_, first) = others.next().expect("invariant: two parts or more");
        others.fold(first.clone(), |sum, (_, part)| Self {
            rows: sum.rows + part.rows,
            gram: sum.gram + &part.gram,
            product: sum.product + &part.product,
            squares: sum
                .squares
                .iter()
                .zip(&part.squares)
                .map(|(a, b)| a + b)
                .collect(),
        })
    }

    fn error(&self, k: usize, xi: &DVector<f64>) -> f64 {
        self.squares[k] - 2.0 * xi.dot(&self.product.column(k)) + xi.dot(&(&self.gram * xi))
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Terms,
    Share,
}

/// Changes of an equation: after a shift its coefficients change along these directions, `library_dim x m`.
pub(super) struct Family {
    pub(super) kind: Kind,
    directions: DMatrix<f64>,
    shift: Option<Shift>,
}

/// Change of the coefficients before all others: found in all parts, and without each.
pub(super) struct Shift {
    pub(super) of_all: DVector<f64>,
    pub(super) without: Vec<DVector<f64>>,
}

impl Shift {
    /// Squared standard deviations, of the values without each part (jackknife).
    fn variances(&self) -> DVector<f64> {
        let count = self.without.len() as f64;
        let mean = self.without.iter().sum::<DVector<f64>>() / count;
        let squares = self.without.iter().map(|of| (of - &mean).map(|d| d * d));
        squares.sum::<DVector<f64>>() * ((count - 1.0) / count)
    }
}

/// The change of a family that predicts left-out parts best.
pub(super) struct Change {
    pub(super) change: DVector<f64>,     // along the directions
    pub(super) after: DVector<f64>,      // coefficients
    pub(super) deviations: DVector<f64>, // standard deviations of these
    pub(super) gain: f64,                // of the squared error of left-out parts, per row
}

impl Family {
    /// Each term for itself.
    pub(super) fn terms(support: &[usize], library_dim: usize) -> Self {
        let unit = |i: usize, m: usize| f64::from(u8::from(support[m] == i));
        Self {
            kind: Kind::Terms,
            directions: DMatrix::from_fn(library_dim, support.len(), unit),
            shift: None,
        }
    }

    /// The equation as a whole, multiplied by a number that is not negative; and perhaps a constant.
    pub(super) fn share(xi: &DVector<f64>, added: Option<usize>) -> Self {
        let unit = |term: usize| DVector::from_fn(xi.len(), |i, _| f64::from(u8::from(i == term)));
        let whole = std::iter::once(xi.clone());
        let directions: Vec<DVector<f64>> = whole.chain(added.map(unit)).collect();
        Self {
            kind: Kind::Share,
            directions: DMatrix::from_columns(&directions),
            shift: None,
        }
    }

    pub(super) fn shifted(self, shift: Option<Shift>) -> Self {
        Self { shift, ..self }
    }

    fn gram(&self, sums: &Sums, ridge: f64) -> DMatrix<f64> {
        let gram = self.directions.tr_mul(&sums.gram) * &self.directions;
        ridged(gram, ridge)
    }

    /// Slopes of half the squared error at `xi` along the directions, downwards.
    fn slopes(&self, sums: &Sums, k: usize, xi: &DVector<f64>) -> DVector<f64> {
        let slopes = sums.product.column(k) - &sums.gram * xi;
        self.directions.tr_mul(&slopes)
    }

    fn solved(&self, sums: &Sums, k: usize, xi: &DVector<f64>, ridge: f64) -> Option<DVector<f64>> {
        let factor = self.gram(sums, ridge).cholesky()?;
        let mut change = factor.solve(&self.slopes(sums, k, xi));
        if self.kind == Kind::Share {
            change[0] = change[0].max(-1.0);
        }
        Some(change)
    }

    /// Normal equations of two more terms once the changes of the family are eliminated.
    pub(super) fn without_its_changes(
        &self,
        sums: &Sums,
        k: usize,
        xi: &DVector<f64>,
        terms: [usize; 2],
    ) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let own = self.gram(sums, RIDGES[RIDGES.len() - 1]).cholesky()?;
        let by_terms = self.directions.tr_mul(&sums.gram.select_columns(&terms));
        let slopes = sums.product.column(k) - &sums.gram * xi;
        let gram = Matrix2::from_fn(|i, j| sums.gram[(terms[i], terms[j])]);
        let gram = gram - (by_terms.transpose() * own.solve(&by_terms)).fixed_view::<2, 2>(0, 0);
        let slopes = DVector::from_fn(2, |i, _| slopes[terms[i]])
            - by_terms.transpose() * own.solve(&self.slopes(sums, k, xi));
        Some((gram, slopes.fixed_rows::<2>(0).into_owned()))
    }

    /// The change that predicts left-out parts better than `xi`; none if none does. Of single terms the least change
    /// within a standard error of the best; of the equation as a whole the best that gains [`LEAST_GAIN`].
    pub(super) fn change(
        &self,
        all: &Sums,
        parts: &[Sums],
        k: usize,
        xi: &DVector<f64>,
    ) -> Option<Change> {
        let start = |left_out: Option<usize>| match (&self.shift, left_out) {
            (None, _) => xi.clone(),
            (Some(shift), None) => xi + &shift.of_all,
            (Some(shift), Some(part)) => xi + &shift.without[part],
        };
        let after = |from: &DVector<f64>, change: &DVector<f64>| from + &self.directions * change;
        let others: Vec<Sums> = (0..parts.len())
            .map(|left_out| Sums::without(parts, left_out))
            .collect();
        let gain = |ridge: f64, part: usize| {
            let from = start(Some(part));
            let change = self.solved(&others[part], k, &from, ridge);
            let own = &parts[part];
            let gained =
                change.map(|change| own.error(k, xi) - own.error(k, &after(&from, &change)));
            gained.unwrap_or(0.0) / own.rows as f64
        };
        let of_ridge = |ridge: &f64| (0..parts.len()).map(|part| gain(*ridge, part)).collect();
        let gains: Vec<Vec<f64>> = RIDGES.iter().map(of_ridge).collect();
        let mean = |gains: &[f64]| gains.iter().sum::<f64>() / gains.len() as f64;
        let error = |gains: &[f64]| {
            let own = mean(gains);
            let square: f64 = gains.iter().map(|gain| (gain - own).powi(2)).sum();
            (square / (gains.len() * (gains.len() - 1).max(1)) as f64).sqrt()
        };
        let best = gains.iter().max_by(|a, b| mean(a).total_cmp(&mean(b)))?;
        let (needed, least) = match self.kind {
            Kind::Terms => (error(best), mean(best) - error(best)),
            Kind::Share => {
                let now = parts.iter().map(|of| of.error(k, xi) / of.rows as f64);
                let now = now.sum::<f64>() / parts.len() as f64;
                (LEAST_GAIN * now, mean(best))
            }
        };
        if mean(best) <= needed {
            return None;
        }
        let chosen = gains.iter().position(|gains| mean(gains) >= least)?;
        let from = start(None);
        let change = self.solved(all, k, &from, RIDGES[chosen])?;
        if self.kind == Kind::Share && change[0].abs() < LEAST_SHARE {
            return None;
        }
        let after = after(&from, &change);
        // Of parts as a whole: errors within one are correlated.
        let inverse = self.gram(all, RIDGES[chosen]).try_inverse()?;
        let slopes = parts.iter().map(|part| self.slopes(part, k, &after));
        let squares = slopes.fold(DMatrix::zeros(change.len(), change.len()), |sum, slope| {
            sum + &slope * slope.transpose()
        });
        let covariance = &inverse * squares * &inverse;
        let of_terms = &self.directions * covariance * self.directions.transpose();
        let mut variances = of_terms.diagonal();
        if let Some(shift) = &self.shift {
            variances += shift.variances();
        }
        let deviations = variances.map(|square| square.max(0.0).sqrt());
        Some(Change {
            gain: mean(&gains[chosen]),
            change,
            after,
            deviations,
        })
    }
}

fn ridged(gram: DMatrix<f64>, ridge: f64) -> DMatrix<f64> {
    let largest = gram.diagonal().amax().max(f64::MIN_POSITIVE);
    let scales = gram
        .diagonal()
        .map(|square| ridge * square.max(1e-12 * largest));
    gram + DMatrix::from_diagonal(&scales)
}
