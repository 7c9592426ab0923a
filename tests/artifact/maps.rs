//! Laws of the whole model: maps in SI units, phases.

use nalgebra::{DMatrix, DVector, SVD};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use romc::model::{
    Activation, AffineMap, FeetRule, InputStatistics, Layer, Library, ModelError, Phase,
    ReducedModel, ScaleFactors, Scaling, StateMap,
};
use romc::robot::ContactFlags;

const FOUR_FEET: ContactFlags = [true; 4];
const REAR_PAIR: ContactFlags = [false, false, true, true];
const NO_FOOT: ContactFlags = [false; 4];

fn texts(terms: &[&str]) -> Vec<String> {
    terms.iter().map(|&term| term.to_owned()).collect()
}

fn phase(name: &str, feet: FeetRule, xi: DMatrix<f64>) -> Phase {
    Phase {
        name: name.into(),
        feet,
        xi,
    }
}

/// A model over `n` coordinates with one term and one phase.
fn linear_model(
    encoder: DMatrix<f64>,
    decoder: DMatrix<f64>,
    scaling: Scaling,
) -> Result<ReducedModel, ModelError> {
    let (d, n) = encoder.shape();
    let library = Library::from_terms(d, &texts(&["1"]))?;
    let bias = |dim: usize| DVector::from_fn(dim, |i, _| 0.5 - 0.25 * i as f64);
    ReducedModel::builder("linear", library)
        .phase(phase("contact", FeetRule::Any, DMatrix::zeros(1, d)))
        .scaling(scaling)
        .encoder(AffineMap::new("encoder", encoder, bias(d))?)
        .decoder(AffineMap::new("decoder", decoder, bias(n))?)
        .build()
}

fn example() -> ReducedModel {
    linear_model(
        DMatrix::from_row_slice(2, 3, &[1.0, 2.0, -1.0, 0.5, 0.0, 3.0]),
        DMatrix::from_row_slice(3, 2, &[0.2, 0.1, 0.3, -0.4, 0.0, 1.5]),
        Scaling {
            state: ScaleFactors::PerCoordinate(DVector::from_row_slice(&[0.1, 0.2, 0.5])),
            input: ScaleFactors::Uniform(0.25),
        },
    )
    .expect("the example is sound")
}

fn assert_close(found: &DVector<f64>, expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn encoder_scales_multiplies_and_adds_bias_to_positions_only() {
    let x = DVector::from_row_slice(&[10.0, -5.0, 2.0]);
    // Scaled: 1, -1, 1.
    assert_close(&example().encode(&x).unwrap(), &[-2.0 + 0.5, 3.5 + 0.25]);
    assert_close(&(example().tangent(&x).unwrap().encode * &x), &[-2.0, 3.5]);
}

#[test]
fn decoder_adds_bias_before_it_unscales() {
    let z = DVector::from_row_slice(&[1.0, -2.0]);
    let linear = [0.0, 1.1, -3.0];
    let bias = [0.5, 0.25, 0.0];
    let factors = [0.1, 0.2, 0.5];
    let expected: Vec<f64> = (0..3).map(|i| (linear[i] + bias[i]) / factors[i]).collect();
    assert_close(&example().decode(&z).unwrap(), &expected);
    let expected: Vec<f64> = (0..3).map(|i| linear[i] / factors[i]).collect();
    assert_close(&(example().decoder_jacobian(&z).unwrap() * &z), &expected);
}

#[test]
fn lift_is_the_transposed_encoder_in_si_units() {
    let u_lat = DVector::from_row_slice(&[2.0, -1.0]);
    let expected = [1.5 / 0.25, 4.0 / 0.25, -5.0 / 0.25];
    let tangent = example().tangent(&DVector::zeros(3)).unwrap();
    assert_close(&(tangent.lift * u_lat), &expected);
}

#[test]
fn maps_refuse_vectors_of_the_wrong_length() {
    let model = example();
    let three = DVector::zeros(3);
    let two = DVector::zeros(2);
    let four = DVector::zeros(4);
    for error in [
        model.encode(&four).unwrap_err(),
        model.tangent(&two).unwrap_err(),
        model.decode(&three).unwrap_err(),
        model.encoder_jacobian(&two).unwrap_err(),
        model.decoder_jacobian(&three).unwrap_err(),
        model.ddz(0, &two, &two, &three).unwrap_err(),
    ] {
        assert!(error.to_string().contains(" entries, expected "), "{error}");
    }
    assert_eq!(
        model.ddz(1, &two, &two, &two),
        Err(ModelError::PhaseIndex { found: 1, count: 1 })
    );
}

#[test]
fn projection_is_exact_where_the_singular_values_converge_slowly() {
    // nalgebra's singular vectors of this matrix, of condition 2.8, have errors of 1e-12.
    let columns = [
        [
            -0.7769688438189468,
            -1.2577828226251595,
            -0.2436841260084793,
        ],
        [-1.7533789315191364, 0.6605775258285481, 0.6714783108199709],
        [1.254574296880164, -0.32936693043632614, -0.730563380709926],
        [0.4684458419054671, 1.1601105402889815, -0.7118258863694065],
        [0.14041738823712316, -1.6122611753765324, 0.7541141701265696],
    ];
    let encoder = DMatrix::from_fn(3, 5, |row, col| columns[col][row]);
    let scaling = Scaling {
        state: ScaleFactors::Uniform(1.0),
        input: ScaleFactors::Uniform(1.0),
    };
    let model = linear_model(encoder.clone(), encoder.transpose(), scaling).unwrap();
    let projection = model.tangent(&DVector::zeros(5)).unwrap().project;
    let identity = projection * encoder.transpose();
    assert!((identity - DMatrix::identity(3, 3)).amax() < 1e-14);
}

#[test]
fn linearised_model_agrees_with_the_nonlinear_one_at_its_state() {
    let layer = |rows: usize, cols: usize, activation| Layer {
        map: AffineMap::new(
            "map",
            DMatrix::from_fn(rows, cols, |i, j| {
                (1.1 + 2.0 * i as f64 + 0.6 * j as f64).sin()
            }),
            DVector::from_fn(rows, |i, _| 0.2 - 0.1 * i as f64),
        )
        .unwrap(),
        activation,
    };
    let encoder = vec![
        layer(4, 3, Activation::Elu),
        layer(2, 4, Activation::Linear),
    ];
    let decoder = vec![
        layer(5, 2, Activation::Tanh),
        layer(3, 5, Activation::Linear),
    ];
    let model = example()
        .into_builder()
        .encoder(StateMap::new("encoder", encoder).unwrap())
        .decoder(StateMap::new("decoder", decoder).unwrap())
        .build()
        .unwrap();
    let x = DVector::from_row_slice(&[4.0, -3.0, 1.5]);
    let v = DVector::from_row_slice(&[0.3, 1.0, -2.0]);
    let linear = model.linearised_at(&x).unwrap();
    assert!(linear.is_linear() && !model.is_linear());
    let z = model.encode(&x).unwrap();
    assert_close(&linear.encode(&x).unwrap(), z.as_slice());
    let (expected, found) = (model.tangent(&x).unwrap(), linear.tangent(&v).unwrap());
    assert!((&found.encode - &expected.encode).amax() < 1e-12);
    assert!((&found.project - &expected.project).amax() < 1e-12);
    assert!((&found.lift - &expected.lift).amax() < 1e-12);
    assert_eq!(model.encoder_jacobian(&x).unwrap(), expected.encode);
    let expected = model.decode(&z).unwrap();
    assert_close(&linear.decode(&z).unwrap(), expected.as_slice());
    let expected = model.decoder_jacobian(&z).unwrap();
    assert!((linear.decoder_jacobian(&x.rows(0, 2).into()).unwrap() - expected).amax() < 1e-12);
    assert_eq!(example().linearised_at(&x).unwrap(), example());
}

#[test]
fn latent_input_statistics_follow_the_projection() {
    let statistics = InputStatistics {
        mean: DVector::from_row_slice(&[1.0, 2.0, -3.0]),
        covariance: DMatrix::from_diagonal(&DVector::from_row_slice(&[4.0, 1.0, 0.25])),
        given_state: None,
    };
    let project = example().tangent(&statistics.mean).unwrap().project;
    let (mean, covariance) = statistics.projected(&project);
    assert_close(&mean, (&project * &statistics.mean).as_slice());
    // Independent directions add up: covariance = sum of s_i^2 p_i p_i^T.
    let part =
        |i| statistics.covariance[(i, i)] * project.column(i) * project.column(i).transpose();
    assert!((covariance - part(0) - part(1) - part(2)).amax() < 1e-12);
}

#[test]
fn first_phase_whose_rule_matches_the_feet_wins_if_any_does() {
    let library = Library::from_terms(1, &texts(&["1"])).unwrap();
    let one = DMatrix::zeros(1, 1);
    let model = ReducedModel::builder("hybrid", library)
        .phase(phase(
            "rear",
            FeetRule::Patterns(vec![REAR_PAIR]),
            one.clone(),
        ))
        .phase(phase("stance", FeetRule::Any, one.clone()))
        .phase(phase("flight", FeetRule::None, one))
        .build()
        .unwrap();
    assert_eq!(model.phase_for(REAR_PAIR), Some(0));
    assert_eq!(model.phase_for(FOUR_FEET), Some(1));
    assert_eq!(model.phase_for([true, false, false, false]), Some(1));
    assert_eq!(model.phase_for(NO_FOOT), Some(2));
    assert_eq!(model.phases()[1].name, "stance");
    assert_eq!(model.phase_identifier(1).as_str(), "stance");
    let without_flight = model.phases()[..2].to_vec();
    let partial = model.into_builder().phases(without_flight).build().unwrap();
    assert_eq!(partial.phase_for(NO_FOOT), None);
}

#[test]
fn active_terms_come_in_library_order_without_zeros() {
    let library = Library::from_terms(2, &texts(&["1", "u1", "z1*dz2"])).unwrap();
    let xi = DMatrix::from_row_slice(3, 2, &[0.0, 1.5, -2.0, 0.0, 3.0, 0.0]);
    let model = ReducedModel::builder("sparse", library)
        .phase(phase("contact", FeetRule::Any, xi))
        .build()
        .unwrap();
    let phase = &model.phases()[0];
    assert_eq!(phase.active_count(), 3);
    let rows = |output| -> Vec<usize> { phase.active_terms(output).map(|(row, _)| row).collect() };
    assert_eq!((rows(0), rows(1)), (vec![1, 2], vec![0]));
    let terms = model.active_terms(0, 0).unwrap();
    let texts: Vec<(f64, &str)> = terms.iter().map(|&(c, t)| (c, t.text.as_str())).collect();
    assert_eq!(texts, [(-2.0, "u1"), (3.0, "z1*dz2")]);
    assert!(model.active_terms(0, 2).is_err());
}

#[test]
fn builder_of_a_model_gives_the_same_model_back() {
    let model = example();
    assert_eq!(model.clone().into_builder().build().unwrap(), model);
}

/// A well-conditioned random encoder with its factors and a latent input.
fn arbitrary_lift() -> impl Strategy<Value = (DMatrix<f64>, Vec<f64>, Vec<f64>)> {
    (1usize..6, 0usize..12).prop_flat_map(|(d, more)| {
        let n = d + more;
        (
            proptest::collection::vec(-2.0..2.0f64, d * n),
            proptest::collection::vec(0.01..10.0f64, n),
            proptest::collection::vec(-50.0..50.0f64, d),
        )
            .prop_map(move |(weights, factors, u_lat)| {
                (DMatrix::from_vec(d, n, weights), factors, u_lat)
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn projection_of_a_lifted_input_is_that_input(
        (encoder, factors, u_lat) in arbitrary_lift()
    ) {
        let values = SVD::new(encoder.clone(), false, false).singular_values;
        let condition = values.max() / values.min();
        prop_assume!(condition < 1e6);
        let scaling = Scaling {
            state: ScaleFactors::Uniform(0.1),
            input: ScaleFactors::PerCoordinate(DVector::from_vec(factors)),
        };
        let model = linear_model(encoder.clone(), encoder.transpose(), scaling).unwrap();
        let u_lat = DVector::from_vec(u_lat);
        let tangent = model.tangent(&DVector::zeros(encoder.ncols())).unwrap();
        let again = tangent.project * (tangent.lift * &u_lat);
        let error = (&again - &u_lat).amax();
        prop_assert!(error <= 1e-14 * condition * condition.max(100.0) * (1.0 + u_lat.amax()), "{error}");
    }
}
