//! Tests of `src/learn/train/sparse.rs`.

use super::*;
use crate::train::random::Random;

#[test]
fn eliminations_of_many_terms_at_once_are_those_one_by_one() {
    let mut random = Random::new(5);
    let theta = random.matrix(400, 90, 1.0);
    let weights = DMatrix::from_fn(90, 1, |i, _| if i % 9 == 0 { 1.0 + i as f64 } else { 0.5 });
    let target = &theta * weights + random.matrix(400, 1, 3.0);
    let regression = Regression::new(&theta, &target, Knowledge::nothing(90, 1));
    let losses = [0.3, 1e-4, 0.02];
    let all: Vec<usize> = (0..90).collect();
    let found = regression.eliminate(0, all.clone(), 1e-3, &losses);
    for (found, loss) in found.iter().zip(losses) {
        let (mut support, mut lost) = (all.clone(), 0.0);
        loop {
            let fit = regression.support_fit(0, support.clone(), 1e-3);
            let energy = regression.target_rms[0].powi(2);
            let weakest = (0..support.len())
                .map(|j| (j, fit.rise(j) / energy))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            match weakest {
                Some((j, rise)) if lost + rise <= loss => {
                    lost += rise;
                    support.remove(j);
                }
                Some(_) | None => break,
            }
        }
        assert_eq!(*found, support, "{loss}");
    }
    assert!(found[0].len() < found[2].len() && found[2].len() < found[1].len());
}

#[test]
fn gains_of_terms_are_what_a_fit_with_them_explains_more() {
    let mut random = Random::new(6);
    let (theta, target) = (random.matrix(100, 5, 1.0), random.matrix(100, 1, 1.0));
    let regression = Regression::new(&theta, &target, Knowledge::nothing(5, 1));
    let mut support = DMatrix::from_column_slice(5, 1, &[true, false, true, false, false]);
    let gains = regression.gains(0, &support, 1e-2);
    assert!(gains.iter().map(|(row, _)| *row).eq([1, 3, 4]));
    // Removing an added term loses its gain.
    support[(3, 0)] = true;
    let losses = regression.losses(0, &support, 1e-2);
    let (_, loss) = losses[2]; // of rows 0, 2 and 3
    assert!((gains[1].1 - loss).abs() < 1e-12);
}

#[test]
fn no_term_is_left_of_an_elimination_of_everything_or_without_accelerations() {
    let theta = Random::new(7).matrix(200, 4, 1.0);
    let target = theta.columns(1, 1) * 30.0;
    let left = |target: &DMatrix<f64>, pruning| {
        let regression = Regression::new(&theta, target, Knowledge::nothing(4, 1));
        active_terms(&regression.fit_each(1e-3, &[pruning], &[true; 4])[0])
    };
    assert_eq!(left(&target, Pruning::Elimination(2.0)), 0);
    assert_eq!(left(&(&target * 0.0), Pruning::Threshold(0.03)), 0);
    assert_eq!(left(&target, Pruning::Elimination(1e-6)), 1);
}
