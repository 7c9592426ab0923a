//! How far trainings from different seeds agree on which candidate terms matter.
//!
//! The order of the latent coordinates is free: two seeds can find the same model with `z1` and `z2` exchanged. So
//! the coordinates are matched first, by the correlation of what they measure on the training states, and the terms
//! are renamed with them. Signs are free as well and do not change which terms are active.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::dynamics_fit::Fitted;
use crate::model::{LatentVariable, Library};

/// Mean over pairs of runs of (coefficients active in both) / (coefficients active in either), all phases together,
/// after matching the latent coordinates; `None` for fewer than two runs.
///
/// `state_covariance` (18 x 18) is that of the training states in scaled units.
pub(super) fn support_overlap(
    library: &Library,
    runs: &[&Fitted],
    state_covariance: &DMatrix<f64>,
) -> Option<f64> {
    let mut overlaps = Vec::new();
    for (i, first) in runs.iter().enumerate() {
        for second in &runs[i + 1..] {
            let partner =
                match_latents(&first.maps.weights, &second.maps.weights, state_covariance);
            overlaps.push(overlap(library, first, second, &partner));
        }
    }
    (!overlaps.is_empty()).then(|| overlaps.iter().sum::<f64>() / overlaps.len() as f64)
}

/// For every latent coordinate of `first` the one of `second` that it correlates with most, each taken once, the
/// strongest pairs first.
fn match_latents(
    first: &DMatrix<f64>,
    second: &DMatrix<f64>,
    covariance: &DMatrix<f64>,
) -> Vec<usize> {
    let d = first.nrows();
    let energy = |w: &DMatrix<f64>, i: usize| (w.row(i) * covariance).dot(&w.row(i)).sqrt();
    let shared = first * covariance * second.transpose();
    let mut pairs: Vec<(f64, usize, usize)> = (0..d * d)
        .map(|k| (k / d, k % d))
        .map(|(i, j)| {
            let scale = energy(first, i) * energy(second, j);
            let strength = shared[(i, j)].abs() / scale;
            (if scale > 0.0 { strength } else { 0.0 }, i, j)
        })
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut partner, mut taken) = (vec![None; d], vec![false; d]);
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            (partner[i], taken[j]) = (Some(j), true);
        }
    }
    let partner: Option<Vec<usize>> = partner.into_iter().collect();
    partner.expect("as many coordinates on both sides")
}

fn overlap(library: &Library, first: &Fitted, second: &Fitted, partner: &[usize]) -> f64 {
    let renamed = renamed_terms(library, partner);
    let (mut both, mut either) = (0_usize, 0_usize);
    for (a, b) in first.xi.iter().zip(&second.xi) {
        let mut found = 0;
        for (column, &other) in partner.iter().enumerate() {
            for (row, other_row) in renamed.iter().enumerate() {
                let active = a[(row, column)] != 0.0;
                let other_active = other_row.is_some_and(|r| b[(r, other)] != 0.0);
                both += usize::from(active && other_active);
                found += usize::from(active);
            }
        }
        either += found + b.iter().filter(|xi| **xi != 0.0).count();
    }
    let either = either - both;
    match either {
        0 => 1.0,
        _ => both as f64 / either as f64,
    }
}

/// For every term the one that it becomes when latent coordinate `i` is called `partner[i]`, if the library has it.
fn renamed_terms(library: &Library, partner: &[usize]) -> Vec<Option<usize>> {
    let mut pool = library.pool().clone();
    let terms = library.terms().iter();
    let indexed = terms.clone().enumerate();
    let known: BTreeMap<_, _> = indexed.map(|(index, term)| (term.expr(), index)).collect();
    let replacements: Vec<_> = LatentVariable::all(library.latent_dim())
        .filter_map(|variable| {
            let renamed = match variable {
                LatentVariable::Z(i) => LatentVariable::Z(partner[i]),
                LatentVariable::Dz(i) => LatentVariable::Dz(partner[i]),
                LatentVariable::U(i) => LatentVariable::U(partner[i]),
            };
            let renamed = pool.symbol(&renamed.to_string());
            Some((library.symbol(variable)?, renamed))
        })
        .collect();
    let renamed = terms.map(|term| pool.substitute(term.expr(), &replacements));
    renamed.map(|term| known.get(&term).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator::{fitted, standard_library};

    #[test]
    fn exchanged_coordinates_overlap_fully_and_other_terms_do_not() {
        let library = standard_library(2, 2, false);
        let with = |weights: &DMatrix<f64>, active: [(&str, usize); 3]| {
            let row = |text| library.terms().iter().position(|term| term.text() == text);
            let mut xi = DMatrix::zeros(library.len(), 2);
            for (text, column) in active {
                xi[(row(text).expect(text), column)] = 1.0;
            }
            fitted(weights.clone(), xi)
        };
        let straight = DMatrix::from_row_slice(2, 3, &[1.0, 0.1, 0.0, 0.0, 1.0, 0.0]);
        let exchanged = DMatrix::from_row_slice(2, 3, &[0.0, -1.0, 0.0, 1.0, 0.2, 0.0]);
        let covariance = DMatrix::identity(3, 3);
        let first = with(&straight, [("z1", 0), ("u2", 1), ("dz1^2", 1)]);
        let same = with(&exchanged, [("z2", 1), ("u1", 0), ("dz2^2", 0)]);
        let half = with(&straight, [("z1", 0), ("u2", 0), ("dz1^2", 1)]);
        let overlap = |runs: &[&Fitted]| support_overlap(&library, runs, &covariance);
        assert_eq!(overlap(&[&first, &same]), Some(1.0));
        assert_eq!(overlap(&[&first, &half]), Some(0.5));
        assert_eq!(overlap(&[&first]), None);
    }
}
