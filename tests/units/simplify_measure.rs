//! Of `src/simplify/measure.rs`.

use super::*;
use crate::model::{FeetRule, Library, Phase, ReducedModel};

#[test]
fn printing_error_is_bounded_by_what_was_cut_off() {
    let library = Library::from_terms(1, &["z1", "u1"].map(str::to_owned)).unwrap();
    let phase = Phase {
        name: "contact".to_owned(),
        feet: FeetRule::Any,
        xi: DMatrix::from_column_slice(2, 1, &[0.126, 1.0]),
    };
    let model = ReducedModel::builder("single", library)
        .phase(phase)
        .build()
        .unwrap();
    let domain = Domain::new(&model, vec![Some(vec![Interval::new(-2.0, 1.0); 3])]).unwrap();
    let rounding = Rounding::Decimals(2);
    let printed = printed(&Equations::of(&model), &domain, None, rounding).unwrap();
    let bound = printed[0].bound.expect("has a box");
    assert!((bound.magnitude() - 0.008).abs() < 1e-12, "{bound}");
}
