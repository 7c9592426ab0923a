//! The models that generated code is tested on: shipped ones, fixtures and random ones.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::model::{
    Activation, AffineMap, FeetRule, Layer, Library, Phase, ReducedModel, ScaleFactors, Scaling,
    StateMap,
};

use super::functions::Random;

/// All model files of the repository.
pub fn shipped() -> Vec<ReducedModel> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["models", "tests/fixtures/models"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("the folder exists") {
            let path = entry.expect("an entry").path();
            if path
                .extension()
                .is_some_and(|extension| extension == "json")
            {
                paths.push(path);
            }
        }
    }
    paths.sort();
    assert!(paths.len() >= 5, "models are missing: {paths:?}");
    paths
        .iter()
        .map(|path| artifact::read(path).unwrap_or_else(|error| panic!("{path:?}: {error}")))
        .collect()
}

/// A random model: dimension, library, sparsity and phases all vary with the seed.
/// Polynomial models have no function that a mathematics library rounds.
pub fn random(seed: u64) -> ReducedModel {
    let mut random = Random(seed.wrapping_mul(0x1234_5677) + 1);
    let d = 1 + random.below(6);
    let polynomial = seed.is_multiple_of(3);
    let mut terms: Vec<String> = Vec::new();
    for _ in 0..2 + random.below(30) {
        let term = random_term(&mut random, d, polynomial);
        if Library::from_terms(d, &[terms.clone(), vec![term.clone()]].concat()).is_ok() {
            terms.push(term);
        }
    }
    let library = Library::from_terms(d, &terms).expect("terms were tried one by one");
    let density = [0.15, 0.5, 1.0][random.below(3)];
    let name = format!("random{seed}");
    let mut builder = ReducedModel::builder(name, library);
    let rules = [("contact", FeetRule::Any), ("flight", FeetRule::None)];
    for (name, feet) in rules.into_iter().take(1 + random.below(2)) {
        let xi = DMatrix::from_fn(terms.len(), d, |_, _| {
            let value = random.between(-2.0, 2.0);
            if random.unit() < density { value } else { 0.0 }
        });
        builder = builder.phase(Phase {
            name: name.to_owned(),
            feet,
            xi,
        });
    }
    if random.below(4) == 0 {
        let n = d + random.below(8);
        let mut matrix =
            |rows, cols| DMatrix::from_fn(rows, cols, |_, _| random.between(-1.0, 1.0));
        let encoder = AffineMap::new("encoder", matrix(d, n), DVector::from_element(d, 0.25));
        let decoder = AffineMap::new("decoder", matrix(n, d), DVector::from_element(n, -0.5));
        builder = builder
            .encoder(encoder.expect("shapes fit"))
            .decoder(decoder.expect("shapes fit"))
            .scaling(Scaling {
                state: ScaleFactors::Uniform(0.1),
                input: ScaleFactors::Uniform(0.3),
            });
    }
    builder.build().expect("a valid model")
}

/// A model with random layers: depth, widths and activations vary with the seed.
pub fn random_nonlinear(seed: u64) -> ReducedModel {
    let mut random = Random(seed.wrapping_mul(0x7654_3211) + 1);
    let d = 1 + random.below(6);
    let n = d + 1 + random.below(12);
    let library = Library::from_terms(d, &["z1".into(), "dz1".into(), "u1^2".into()]);
    let xi = DMatrix::from_fn(3, d, |i, j| 0.5 * i as f64 - 0.25 * j as f64);
    let factors = DVector::from_fn(n, |_, _| random.between(0.1, 1.0));
    let encoder = random_map(&mut random, seed as usize, n, d);
    let decoder = random_map(&mut random, seed as usize + 1, d, n);
    ReducedModel::builder(format!("nonlinear{seed}"), library.expect("three terms"))
        .phase(Phase {
            name: "contact".to_owned(),
            feet: FeetRule::Any,
            xi,
        })
        .encoder(encoder)
        .decoder(decoder)
        .scaling(Scaling {
            state: ScaleFactors::PerCoordinate(factors),
            input: ScaleFactors::Uniform(0.3),
        })
        .build()
        .expect("a valid model")
}

/// One of the shapes of networks: one curved layer, hidden layers, a curved last layer.
fn random_map(random: &mut Random, shape: usize, from: usize, to: usize) -> StateMap {
    use Activation::{Elu, Linear, Sigmoid, Tanh};
    let activations: &[Activation] = [
        &[Elu, Linear][..],
        &[Tanh, Sigmoid, Linear],
        &[Sigmoid, Tanh],
        &[Elu, Elu, Linear],
        &[Tanh],
    ][shape % 5];
    let mut layers = Vec::new();
    let mut cols = from;
    for (index, &activation) in activations.iter().enumerate() {
        let is_last = index + 1 == activations.len();
        let rows = if is_last {
            to
        } else {
            from.max(to) + random.below(9)
        };
        // About unit variance of each sum, so that no unit saturates.
        let size = 1.7 / (cols as f64).sqrt();
        let weights = DMatrix::from_fn(rows, cols, |_, _| random.between(-size, size));
        let bias = DVector::from_fn(rows, |_, _| random.between(-0.5, 0.5));
        let map = AffineMap::new("map", weights, bias).expect("shapes fit");
        layers.push(Layer { map, activation });
        cols = rows;
    }
    StateMap::new("map", layers).expect("layers fit")
}

fn random_term(random: &mut Random, d: usize, polynomial: bool) -> String {
    let kinds = if polynomial { 4 } else { 12 };
    let mut v = || {
        let kind = ["z", "dz", "u"][random.below(3)];
        format!("{kind}{}", 1 + random.below(d))
    };
    let (a, b, c) = (v(), v(), v());
    match random.below(kinds) {
        0 => "1".to_owned(),
        1 => a,
        2 => format!("{a}*{b}^2"),
        3 => format!("({a} - 0.5*{b})*{c}^3"),
        4 => format!("sin({a})"),
        5 => format!("cos({a})"),
        6 => format!("{a}*sin({b} + 2*{c})"),
        7 => format!("tanh({a})/(1 + {b}^2)"),
        8 => format!("exp(-{a}^2)*cos({b})"),
        9 => format!("sqrt(1 + {a}^2 + {b}^2)"),
        10 => format!("abs({a})*{b}"),
        _ => format!("log(2 + {a}^2) + tan(0.3*{b})"),
    }
}
