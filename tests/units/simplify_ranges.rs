//! Of `src/simplify/ranges.rs`.

use super::*;
use crate::model::{FeetRule, Phase};

/// The range of `sum delta_j theta_j` over a box, with the ranges of its products.
fn combination(parts: &[(&str, Interval)], [lo, hi]: [f64; 2]) -> (Interval, Vec<Interval>) {
    let texts: Vec<String> = parts.iter().map(|(text, _)| (*text).to_owned()).collect();
    let library = Library::from_terms(2, &texts).expect("terms parse");
    let phase = Phase {
        name: "contact".to_owned(),
        feet: FeetRule::Any,
        xi: DMatrix::from_element(texts.len(), 2, 1.0),
    };
    let model = ReducedModel::builder("ranges", library).phase(phase);
    let model = model.build().expect("a model");
    let workspace = Workspace::new(&Equations::as_learned(&model)).expect("terms parse");
    let mut ranges = Ranges::new(&workspace, &[Interval::new(lo, hi); 6]);
    let row = |text: &str| (0..texts.len()).find(|&row| workspace.text(row) == text);
    let parts = parts
        .iter()
        .map(|&(text, delta)| (row(text).expect("a term"), delta));
    let parts: Vec<Part> = parts.collect();
    let products = parts.iter().map(|&(row, delta)| delta * ranges.term(row));
    let products = products.collect();
    (ranges.combination(&parts), products)
}

#[test]
fn coefficients_anywhere_in_their_intervals_are_covered() {
    let parts = [
        ("sin(z1)", Interval::new(0.9, 1.1)),
        ("z1", Interval::new(-1.0, -0.8)),
    ];
    let (range, _) = combination(&parts, [-1.0, 1.0]);
    let largest = 1.1 * 1f64.sin() - 0.8;
    assert!(
        range.contains(largest) && range.contains(-largest),
        "{range}"
    );
}

#[test]
fn many_terms_that_share_variables_are_bounded_no_worse_than_one_by_one() {
    let texts = [
        "z1",
        "sin(z1)",
        "z1*z2",
        "z2*cos(z1)",
        "z1^2*z2",
        "z2^2",
        "cos(z1*z2)",
    ];
    let deltas = [0.3, -0.3, 0.2, -0.7, 0.1, 0.4, -0.9];
    let parts: Vec<_> = texts.into_iter().zip(deltas.map(Interval::point)).collect();
    let (together, products) = combination(&parts, [-1.0, 2.0]);
    let one_by_one = (products.into_iter()).fold(Interval::point(0.0), |sum, range| sum + range);
    assert!(one_by_one.lo() < together.lo() && together.hi() < one_by_one.hi());
    let corners = [(-1.0, -1.0), (2.0, 2.0), (-1.0, 2.0), (2.0, -1.0)];
    for (x, y) in corners.into_iter().chain([(0.7, 1.3)]) {
        let (sin, cos) = (f64::sin(x), f64::cos(x));
        let values = [x, sin, x * y, y * cos, x * x * y, y * y, (x * y).cos()];
        let sum: f64 = deltas.iter().zip(values).map(|(delta, v)| delta * v).sum();
        assert!(together.contains(sum), "{together} {sum}");
    }
}
