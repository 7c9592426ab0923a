//! Models at the limits of accepted input. Generated code has failed on a model of each kind.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::model::{
    AffineMap, FeetRule, InputStatistics, Library, LibraryChoice, Phase, ReducedModel, Scaling,
    StandardLibrary, StateMap,
};

/// All these models.
pub fn all() -> Vec<ReducedModel> {
    vec![
        hollow(),
        idle(),
        one_phase(),
        one_coordinate(),
        empty(),
        sixty(),
        roots(),
        undefined(),
        huge(),
    ]
}

/// Whether a model has all parts that a controller needs.
pub fn has_controller(model: &ReducedModel) -> bool {
    model.robot().is_ok()
}

fn go1() -> ReducedModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/go1-d4.json");
    artifact::read(&path).expect("a shipped model")
}

/// A robot's model without terms in its contact phase.
fn hollow() -> ReducedModel {
    let model = go1();
    let mut phases = model.phases().to_vec();
    phases[0].xi.fill(0.0);
    let builder = model.into_builder().name("hollow").phases(phases);
    builder.build().expect("a valid model")
}

/// A robot's model without any term.
fn idle() -> ReducedModel {
    let model = go1();
    let mut phases = model.phases().to_vec();
    phases.iter_mut().for_each(|phase| phase.xi.fill(0.0));
    let builder = model.into_builder().name("idle").phases(phases);
    builder.build().expect("a valid model")
}

/// A robot's model with one phase.
fn one_phase() -> ReducedModel {
    let model = go1();
    let library = model.library().clone();
    let phases = vec![model.phases()[0].clone()];
    over_the_robot("one-phase", &model, library, phases, model.latent_dim())
}

/// A robot's model with one coordinate.
fn one_coordinate() -> ReducedModel {
    let model = go1();
    let standard = StandardLibrary {
        degree: 2,
        trigonometric: true,
        inputs: true,
    };
    let library = Library::of(1, LibraryChoice::Standard(standard)).expect("a short library");
    let phase = |feet, name: &str, first: f64| Phase {
        name: name.to_owned(),
        feet,
        xi: DMatrix::from_fn(library.terms().len(), 1, |row, _| {
            first / (1.0 + row as f64)
        }),
    };
    let phases = vec![
        phase(FeetRule::Any, "contact", -0.75),
        phase(FeetRule::None, "flight", 0.5),
    ];
    over_the_robot("one-coordinate", &model, library, phases, 1)
}

/// The first coordinates of a robot's model, with other dynamics.
fn over_the_robot(
    name: &str,
    model: &ReducedModel,
    library: Library,
    phases: Vec<Phase>,
    latent_dim: usize,
) -> ReducedModel {
    let map = |found: &StateMap| found.as_affine().expect("an affine map").clone();
    let encoder = map(model.encoder_map().expect("an encoder"));
    let decoder = map(model.decoder_map().expect("a decoder"));
    let rows = |matrix: &DMatrix<f64>| matrix.rows(0, latent_dim).into_owned();
    let columns = |matrix: &DMatrix<f64>| matrix.columns(0, latent_dim).into_owned();
    let bias = encoder.bias().rows(0, latent_dim).into_owned();
    let encoder = AffineMap::new("encoder", rows(encoder.weights()), bias).expect("shapes fit");
    let bias = decoder.bias().clone();
    let decoder = AffineMap::new("decoder", columns(decoder.weights()), bias).expect("shapes fit");
    let mut builder = ReducedModel::builder(name, library)
        .encoder(encoder)
        .decoder(decoder)
        .scaling(model.scaling().expect("factors").clone())
        .robot(model.robot().expect("a robot"))
        .sample_time_s(model.sample_time_s().expect("a period"));
    for (place, phase) in phases.iter().enumerate() {
        // statistics of inputs given states are in the whole model's coordinates
        let statistics = InputStatistics {
            given_state: None,
            ..model.input_statistics(place).expect("statistics").clone()
        };
        builder = builder.input_statistics(phase.name.clone(), statistics);
    }
    builder.phases(phases).build().expect("a valid model")
}

/// No term in any phase, and none in one equation of any phase.
fn empty() -> ReducedModel {
    let library = Library::from_terms(2, &["z1".to_owned(), "u2".to_owned()]).expect("two terms");
    let phase = |name: &str, feet, xi| Phase {
        name: name.to_owned(),
        feet,
        xi,
    };
    ReducedModel::builder("empty", library)
        .phase(phase("contact", FeetRule::Any, DMatrix::zeros(2, 2)))
        .phase(phase("flight", FeetRule::None, DMatrix::zeros(2, 2)))
        .build()
        .expect("a valid model")
}

/// Sixty coordinates out of sixty, and every kind of standard term.
fn sixty() -> ReducedModel {
    let d = 60;
    let standard = StandardLibrary {
        degree: 1,
        trigonometric: true,
        inputs: true,
    };
    let library = Library::of(d, LibraryChoice::Standard(standard)).expect("a library");
    let xi = |shift: usize| {
        DMatrix::from_fn(library.terms().len(), d, |row, column| {
            let is_active = (7 * row + 11 * column + shift).is_multiple_of(53);
            if is_active {
                0.5 - 0.01 * (row % 97) as f64
            } else {
                0.0
            }
        })
    };
    let phase = |name: &str, feet, shift| Phase {
        name: name.to_owned(),
        feet,
        xi: xi(shift),
    };
    let phases = vec![
        phase("contact", FeetRule::Any, 0),
        phase("flight", FeetRule::None, 29),
    ];
    let map = |first: f64| {
        let weight = DMatrix::from_fn(d, d, |row, column| match row == column {
            true => first,
            false => 0.001 * ((3 * row + column) % 7) as f64,
        });
        AffineMap::new("map", weight, DVector::from_element(d, 0.25)).expect("shapes fit")
    };
    ReducedModel::builder("sixty", library)
        .phases(phases)
        .encoder(map(1.0))
        .decoder(map(-1.5))
        .scaling(Scaling::uniform(0.1))
        .build()
        .expect("a valid model")
}

/// A model of one phase with these terms, all coefficients equal to a factor.
fn over_terms(name: &str, d: usize, terms: &[&str], factor: f64) -> ReducedModel {
    let terms: Vec<String> = terms.iter().map(|term| (*term).to_owned()).collect();
    let library = Library::from_terms(d, &terms).expect("terms of the syntax");
    let xi = DMatrix::from_fn(terms.len(), d, |row, column| {
        factor * (1 + row + column) as f64
    });
    let phase = Phase {
        name: "contact".to_owned(),
        feet: FeetRule::Any,
        xi,
    };
    let builder = ReducedModel::builder(name, library).phase(phase);
    builder.build().expect("a valid model")
}

/// Functions with real values at only some of the points.
fn roots() -> ReducedModel {
    let terms = [
        "sqrt(z1)",
        "log(dz1)",
        "u1",
        "z2^0.5",
        "dz2^(1/3)",
        "z1^dz1",
        "z2^999.5",
        "1/z1^2",
        "log(2 - u2)",
        "(z1*z2)^1.5",
        "sqrt(dz2)*u1",
    ];
    over_terms("roots", 2, &terms, 0.25)
}

/// A function without a real value at any point, together with terms that have values.
fn undefined() -> ReducedModel {
    over_terms(
        "undefined",
        1,
        &["(z1*dz1 - z1^2 - dz1^2 - 1)^0.5", "dz1", "u1"],
        1.0,
    )
}

/// Functions and coefficients above the largest finite number at most points.
fn huge() -> ReducedModel {
    over_terms("huge", 1, &["exp(800*dz1)", "z1^1000", "1e300*u1"], 1e7)
}
