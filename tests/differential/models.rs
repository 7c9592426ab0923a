//! Models for tests of generated code: shipped ones, fixtures and random ones.

#[path = "cubic.rs"]
mod cubic;

use std::path::Path;

pub use cubic::cubic;
use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::model::{
    Activation, AffineMap, FeetRule, Layer, Library, LibraryChoice, Phase, ReducedModel,
    ScaleFactors, Scaling, StandardLibrary, StateMap,
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

/// A random model. The seed varies: one to eight coordinates, the library (standard of degree 0 to 3 with and without
/// sines, or terms of the syntax), inputs or none, one to three phases, density of Xi, equations and phases without a
/// term, no maps, affine maps, nonlinear maps. Models of even seeds call no mathematics library and have no sines.
pub fn random(seed: u64) -> ReducedModel {
    let mut random = Random(seed.wrapping_mul(0x1234_5677) + 1);
    let d = 1 + random.below(8);
    let polynomial = seed.is_multiple_of(2);
    let inputs = random.below(4) > 0;
    let library = if random.below(3) == 0 {
        random_standard(&mut random, d, polynomial, inputs)
    } else {
        random_terms(&mut random, d, polynomial, inputs)
    };
    let mut density = [0.05, 0.15, 0.5, 1.0][random.below(4)];
    // Thousands of terms compile slowly and test nothing more.
    density = f64::min(density, 160.0 / (library.terms().len() * d) as f64);
    let rear = FeetRule::Patterns(vec![
        [false, false, true, true],
        [false, false, false, true],
    ]);
    let all = [
        ("rear stance", rear),
        ("contact", FeetRule::Any),
        ("flight", FeetRule::None),
    ];
    let (first, count) = [(1, 1), (1, 2), (0, 3)][random.below(3)];
    let mut phases = Vec::new();
    for (name, feet) in all.into_iter().skip(first).take(count) {
        let silent = (random.below(4) == 0).then(|| random.below(d));
        let empty = random.below(12) == 0;
        let xi = DMatrix::from_fn(library.terms().len(), d, |_, column| {
            let value = random.between(-2.0, 2.0);
            let is_active = random.unit() < density && !empty && silent != Some(column);
            if is_active { value } else { 0.0 }
        });
        let name = name.to_owned();
        phases.push(Phase { name, feet, xi });
    }
    let mut builder = ReducedModel::builder(format!("random{seed}"), library).phases(phases);
    let n = d + random.below(8);
    let shape = random.below(8);
    if shape < 3 {
        let mut map = |rows, cols, bias| {
            let weights = DMatrix::from_fn(rows, cols, |_, _| random.between(-1.0, 1.0));
            let map = AffineMap::new("map", weights, DVector::from_element(rows, bias));
            StateMap::from(map.expect("shapes fit"))
        };
        let encoder = map(d, n, 0.25);
        let decoder = map(n, d, -0.5);
        let encoder = if shape == 0 && !polynomial {
            random_map(&mut random, seed as usize, n, d)
        } else {
            encoder
        };
        builder = builder.encoder(encoder).decoder(decoder).scaling(Scaling {
            state: ScaleFactors::PerCoordinate(DVector::from_fn(n, |i, _| 0.1 + 0.05 * i as f64)),
            input: ScaleFactors::Uniform(0.3),
        });
    }
    builder.build().expect("a valid model")
}

/// The highest degree, at most 3, whose library is not too long.
fn random_standard(random: &mut Random, d: usize, polynomial: bool, inputs: bool) -> Library {
    let mut standard = StandardLibrary {
        degree: random.below(4) as u32,
        trigonometric: !polynomial,
        inputs,
    };
    while standard.term_count(d).is_none_or(|count| count > 170) {
        standard.degree -= 1;
    }
    Library::of(d, LibraryChoice::Standard(standard)).expect("a short library")
}

fn random_terms(random: &mut Random, d: usize, polynomial: bool, inputs: bool) -> Library {
    let mut terms: Vec<String> = Vec::new();
    for _ in 0..2 + random.below(30) {
        let term = random_term(random, d, polynomial, inputs);
        if Library::from_terms(d, &[terms.clone(), vec![term.clone()]].concat()).is_ok() {
            terms.push(term);
        }
    }
    Library::from_terms(d, &terms).expect("terms were tried one by one")
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

/// One of the shapes of networks: one nonlinear layer, hidden layers, a nonlinear last layer.
fn random_map(random: &mut Random, shape: usize, from: usize, to: usize) -> StateMap {
    use Activation::{Elu, Gelu, GeluTanh, Linear, Relu, Sigmoid, Silu, Softplus, Tanh};
    let activations: &[Activation] = [
        &[Elu, Linear][..],
        &[Tanh, Sigmoid, Linear],
        &[Sigmoid, Tanh],
        &[Elu, Elu, Linear],
        &[Tanh],
        &[Relu, Silu, Linear],
        &[Gelu, Linear],
        &[GeluTanh, Softplus, Linear],
    ][shape % 8];
    let mut layers = Vec::new();
    let mut cols = from;
    for (index, &activation) in activations.iter().enumerate() {
        let is_last = index + 1 == activations.len();
        let rows = if is_last {
            to
        } else {
            // Half of relu's units are inactive.
            let share = if activation == Relu { 3 } else { 1 };
            share * from.max(to) + random.below(9)
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

fn random_term(random: &mut Random, d: usize, polynomial: bool, inputs: bool) -> String {
    let kinds = if polynomial { 6 } else { 14 };
    let mut v = || {
        let kind = ["z", "dz", "u"][random.below(if inputs { 3 } else { 2 })];
        format!("{kind}{}", 1 + random.below(d))
    };
    let (a, b, c) = (v(), v(), v());
    match random.below(kinds) {
        0 => "1".to_owned(),
        1 => a,
        2 => format!("{a}*{b}^2"),
        3 => format!("({a} - 0.5*{b})*{c}^3"),
        4 => format!("sqrt(1 + {a}^2 + {b}^2)"),
        5 => format!("abs({a})*{b}/(2 + {c}^2)"),
        6 => format!("sin({a})"),
        7 => format!("cos({a})"),
        8 => format!("{a}*sin({b} + 2*{c})"),
        9 => format!("tanh({a})/(1 + {b}^2)"),
        10 => format!("exp(-{a}^2)*cos({b})"),
        11 => format!("sin({a})^2*cos({b} - {c})"),
        12 => format!("(1 + {a}^2)^1.5*exp(0.5*{b})"),
        _ => format!("log(2 + {a}^2) + tan(0.3*{b})"),
    }
}
