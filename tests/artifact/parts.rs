//! Parts of a model: activations, layers, libraries and their orders, names; ranges of settings.

use nalgebra::{DMatrix, DVector};
use romc::limits::{Range, table};
use romc::model::{
    Activation, AffineMap, CoordinateOrder, FeetRule, Identifier, InputGivenState, LatentVariable,
    Layer, Library, LibraryOrder, MAX_LAYERS, ModelError, StandardLibrary, StateMap,
};
use romc::robot::STATE_DIM;
use romc::symbolic::{ExprId, ParseErrorKind, SymbolId};

#[test]
fn derivatives_of_activations_equal_central_differences() {
    let h = 1e-5;
    for phi in Activation::ALL {
        for a in [-3.0, -0.7, -0.02, 0.3, 2.5] {
            let (before, after) = (phi.jet(a - h), phi.jet(a + h));
            for (order, bound) in [(1, 1e-9), (2, 1e-9), (3, 1e-8)] {
                let difference = (after[order - 1] - before[order - 1]) / (2.0 * h);
                let found = phi.jet(a)[order];
                assert!((found - difference).abs() < bound, "{phi} at {a}: {order}");
            }
        }
    }
}

#[test]
fn activations_of_large_arguments_stay_finite_and_those_of_nan_are_nan() {
    for phi in Activation::ALL {
        for a in [-800.0, 800.0] {
            assert!(phi.jet(a).iter().all(|v| v.is_finite()), "{phi} at {a}");
        }
        assert!(phi.jet(f64::NAN)[0].is_nan(), "{phi}");
        assert!(phi == Activation::Linear || phi.jet(f64::NAN)[1].is_nan());
    }
}

#[test]
fn names_are_read_back_and_others_refused() {
    for phi in Activation::ALL {
        let name = serde_json::Value::from(phi.to_string());
        assert_eq!(serde_json::from_value::<Activation>(name).ok(), Some(phi));
    }
    assert!(serde_json::from_str::<Activation>("\"selu\"").is_err());
}

#[test]
fn values_are_those_of_pytorch() {
    // SciPy 1.16 by the formulas of torch.nn; its softplus is a itself beyond 20.
    for (phi, below, above) in [
        (Activation::Relu, 0.0, 0.7),
        (
            Activation::Gelu,
            -0.015_524_163_314_440_398,
            0.530_625_443_443_848_9,
        ),
        (
            Activation::GeluTanh,
            -0.015_084_266_089_998_577,
            0.530_570_134_705_116_7,
        ),
        (
            Activation::Silu,
            -0.189_645_450_053_108_87,
            0.467_731_440_517_716_26,
        ),
        (
            Activation::Softplus,
            0.078_889_734_292_549_63,
            1.103_186_048_885_458,
        ),
    ] {
        for (a, expected) in [(-2.5, below), (0.7, above)] {
            assert!(
                (phi.jet(a)[0] - expected).abs() < 1e-15,
                "{phi} at {a}: {}",
                phi.jet(a)[0]
            );
        }
    }
}

#[test]
fn gelu_has_the_normal_distribution_of_tables() {
    // scipy.stats.norm.cdf
    for (a, expected) in [
        (-8.0, 6.220960574271786e-16),
        (-3.0, 0.0013498980316300933),
        (-0.5, 0.3085375387259869),
        (1.0, 0.8413447460685429),
        (4.0, 0.9999683287581669),
    ] {
        let found = Activation::Gelu.jet(a)[0] / a;
        assert!(
            (found - expected).abs() < 4e-15 * expected,
            "{a}: {found:e}"
        );
    }
    assert_eq!(
        [-800.0, 800.0].map(|a| Activation::Gelu.jet(a)[0]),
        [0.0, 800.0]
    );
}

fn wave(rows: usize, cols: usize, seed: f64) -> DMatrix<f64> {
    DMatrix::from_fn(rows, cols, |i, j| {
        (seed + 1.7 * i as f64 + 0.9 * j as f64 + 0.3 * (i * j) as f64).sin()
    })
}

fn chain(activations: &[Activation]) -> StateMap {
    let widths = [5, 7, 6, 3];
    let layers = activations.iter().enumerate().map(|(k, &activation)| {
        let output = if k + 1 == activations.len() {
            3
        } else {
            widths[k + 1]
        };
        let input = widths[k];
        let bias = DVector::from_fn(output, |i, _| (0.4 * i as f64 - k as f64).cos());
        let map = AffineMap::new("encoder", wave(output, input, k as f64), bias);
        Layer {
            map: map.expect("shapes fit"),
            activation,
        }
    });
    StateMap::new("encoder", layers.collect()).expect("a chain")
}

fn chains() -> Vec<StateMap> {
    use Activation::{Elu, Linear, Sigmoid, Tanh};
    vec![
        chain(&[Linear]),
        chain(&[Tanh]),
        chain(&[Elu, Linear]),
        chain(&[Elu, Tanh, Linear]),
        chain(&[Sigmoid, Elu, Tanh]),
    ]
}

fn vector(seed: f64) -> DVector<f64> {
    DVector::from_fn(5, |i, _| (seed + 2.3 * i as f64).sin())
}

fn velocity(map: &StateMap, x: &DVector<f64>, dx: &DVector<f64>) -> DVector<f64> {
    let [_, dy, _] = map.apply_rates(x, dx, &vector(9.0)).unwrap();
    dy
}

#[test]
fn jacobian_and_velocity_equal_central_differences() {
    let (x, dx) = (vector(0.2), vector(1.4));
    let h = 1e-6;
    for map in chains() {
        let forward = map.apply(&(&x + &dx * h)).unwrap();
        let backward = map.apply(&(&x - &dx * h)).unwrap();
        let expected = (forward - backward) / (2.0 * h);
        let found = velocity(&map, &x, &dx);
        assert!((&found - &expected).amax() < 1e-8, "{found} {expected}");
        let product = map.jacobian(&x).unwrap() * &dx;
        assert!((&found - product).amax() < 1e-13);
    }
}

#[test]
fn acceleration_equals_central_difference_of_velocity_along_a_parabola() {
    let (x, dx, ddx) = (vector(0.2), vector(1.4), vector(-0.7));
    let h = 1e-5;
    for map in chains() {
        let velocity = |t: f64| {
            let at = &x + &dx * t + &ddx * (0.5 * t * t);
            velocity(&map, &at, &(&dx + &ddx * t))
        };
        let expected = (velocity(h) - velocity(-h)) / (2.0 * h);
        let [y, _, found] = map.apply_rates(&x, &dx, &ddx).unwrap();
        assert_eq!(Ok(y), map.apply(&x));
        assert!((&found - &expected).amax() < 1e-7, "{found} {expected}");
    }
}

#[test]
fn single_linear_layer_is_the_affine_map() {
    let map = chain(&[Activation::Linear]);
    let affine = map.as_affine().expect("linear");
    let x = vector(0.5);
    assert_eq!(map.apply(&x), Ok(affine.weights() * &x + affine.bias()));
    assert_eq!(velocity(&map, &vector(3.0), &x), affine.weights() * &x);
    assert!(chain(&[Activation::Tanh]).as_affine().is_none());
}

#[test]
fn summary_names_widths_and_activations() {
    let map = chain(&[Activation::Elu, Activation::Tanh, Activation::Linear]);
    assert_eq!(map.summary(), "5 -> 7 elu -> 6 tanh -> 3");
}

#[test]
fn layers_that_do_not_fit_are_refused() {
    let layer = |rows, cols| Layer {
        map: AffineMap::new("m", wave(rows, cols, 0.0), DVector::zeros(rows)).unwrap(),
        activation: Activation::Elu,
    };
    let refusal = |layers| {
        let error = StateMap::new("encoder", layers).expect_err("no chain");
        error.to_string()
    };
    assert_eq!(
        refusal(vec![layer(4, 5), layer(2, 3)]),
        "`encoder.layers[1].weights`: found 2 x 3, expected 2 x 4 (rows x columns)"
    );
    assert_eq!(
        refusal(Vec::new()),
        format!("`encoder.layers`: found 0 layers, expected 1 to {MAX_LAYERS}")
    );
    let wide = refusal(vec![layer(WIDEST + 1, 2)]);
    assert!(wide.contains("units, expected at most"), "{wide}");
}

const WIDEST: usize = 1024; // units of a layer

fn library_of(texts: &[&str]) -> Result<Library, ModelError> {
    let texts: Vec<String> = texts.iter().map(|&text| text.to_owned()).collect();
    Library::from_terms(2, &texts)
}

#[test]
fn terms_that_are_equal_zero_oversized_or_without_value_are_refused() {
    let equal = library_of(&["1", "z1*z2", "u1", "z2*z1"]).expect("readable");
    let refused = equal.check_distinct().unwrap_err().to_string();
    assert!(refused.starts_with("`library`[3]: found \"z2*z1\", which equals [1]"));
    for text in ["z1/0", "log(0)*z1", "z1^(1/0)", "sqrt(-1) + z1"] {
        let Err(ModelError::Term {
            index: 0, source, ..
        }) = library_of(&[text])
        else {
            panic!("{text}");
        };
        assert!(matches!(source.kind, ParseErrorKind::NoValue(_)), "{text}");
    }
    let long = "z1+".repeat(400) + "z1";
    for (text, said) in [
        ("z1 - z1", "not zero everywhere"),
        ("exp(1000)*z1", "values that floats hold"),
        (&long, "1202 bytes"),
        ("z1\n+1", "a control character"),
    ] {
        let refused = library_of(&[text]).unwrap_err().to_string();
        assert!(refused.starts_with("`library`[0]: found"), "{refused}");
        assert!(refused.contains(said), "{refused}");
    }
    let none = library_of(&[]).unwrap_err().to_string();
    assert_eq!(none, "`library`: found no term, expected at least one");
}

#[test]
fn values_agree_with_the_pool_for_every_node() {
    let texts = [
        "z1^7 - 2/z1^3",
        "abs(z1)^dz1",
        "tanh(log(2 + u1^2))^1.5",
        "cos(tan(z1)*sqrt(2))",
        "0.1*z1*dz1*u1",
    ];
    let library = Library::from_terms(1, &texts.map(str::to_owned)).unwrap();
    let points = [[0.3, -0.7, 2.0], [-1.25, 0.5, -0.1], [2.0, 3.0, 0.0]];
    let variables = DMatrix::from_fn(3, 3, |row, point| points[point][row]);
    let all = library.evaluate_points(&variables).unwrap();
    for (point, values) in points.iter().enumerate() {
        let [z, dz, u_lat] = values.map(|value| DVector::from_element(1, value));
        let alone = library.evaluate(&z, &dz, &u_lat).unwrap();
        assert_eq!(alone.transpose(), all.row(point));
        let exprs: Vec<ExprId> = library.terms().iter().map(|term| term.expr).collect();
        let value_of = |symbol: SymbolId| values[symbol.index()];
        let expected = library.pool().evaluate_all(&exprs, &value_of);
        assert_eq!(all.row(point), DVector::from_vec(expected).transpose());
    }
}

fn texts(standard: &StandardLibrary, latent_dim: usize) -> Vec<String> {
    standard.texts_in(LibraryOrder::ROMC, latent_dim).unwrap()
}

#[test]
fn standard_library_follows_the_published_order_with_indices_that_do_not_fall() {
    let degree_two = "1 z1 z2 dz1 dz2 \
        z1^2 z1*z2 z1*dz1 z1*dz2 z2^2 z2*dz1 z2*dz2 dz1^2 dz1*dz2 dz2^2 \
        sin(z1) sin(z2) sin(dz1) sin(dz2) cos(z1) cos(z2) cos(dz1) cos(dz2) u1 u2";
    let degree_three = "1 z1 dz1 z1^2 z1*dz1 dz1^2 z1^3 z1^2*dz1 z1*dz1^2 dz1^3";
    for (latent_dim, degree, has_more, expected) in
        [(2, 2, true, degree_two), (1, 3, false, degree_three)]
    {
        let standard = StandardLibrary {
            degree,
            trigonometric: has_more,
            inputs: has_more,
        };
        assert_eq!(texts(&standard, latent_dim).join(" "), expected);
    }
}

#[test]
fn orders_have_the_same_terms_and_rows_that_lead_back() {
    let standard = StandardLibrary {
        degree: 3,
        ..StandardLibrary::default()
    };
    let own = texts(&standard, 2);
    for order in LibraryOrder::common() {
        let texts = standard.texts_in(order, 2).unwrap();
        let rows = standard.rows_in(order, 2).unwrap();
        let back: Vec<&String> = rows.iter().map(|&row| &own[row]).collect();
        assert_eq!(back, texts.iter().collect::<Vec<_>>());
        let mut sorted = rows;
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..own.len()));
    }
    let trigonometric = |order| {
        let library = StandardLibrary {
            degree: 0,
            trigonometric: true,
            inputs: false,
        };
        library.texts_in(order, 2).unwrap()[1..].join(" ")
    };
    assert_eq!(
        trigonometric(LibraryOrder::NAMED[0]),
        "sin(z1) sin(z2) cos(z1) cos(z2) sin(dz1) sin(dz2) cos(dz1) cos(dz2)"
    );
    assert_eq!(
        trigonometric(LibraryOrder::NAMED[1]),
        "sin(z1) cos(z1) sin(z2) cos(z2) sin(dz1) cos(dz1) sin(dz2) cos(dz2)"
    );
}

#[test]
fn standard_library_count_agrees_with_terms_made() {
    for latent_dim in 1..=5 {
        for degree in 0..=4 {
            for (trigonometric, inputs) in [(false, true), (true, false), (true, true)] {
                let standard = StandardLibrary {
                    degree,
                    trigonometric,
                    inputs,
                };
                assert_eq!(
                    standard.term_count(latent_dim),
                    Some(texts(&standard, latent_dim).len())
                );
            }
        }
    }
}

#[test]
fn standard_library_of_published_degree_has_seven_d_plus_one_terms() {
    let count = |latent_dim| StandardLibrary::default().term_count(latent_dim);
    assert!((1..=18).all(|latent_dim| count(latent_dim) == Some(7 * latent_dim + 1)));
}

#[test]
fn identifier_of_usual_names_replaces_punctuation() {
    for (name, expected) in [
        ("paper-2d", "paper_2d"),
        ("go1.d6", "go1_d6"),
        ("rear stance", "rear_stance"),
        ("A1", "A1"),
    ] {
        assert_eq!(Identifier::from_name(name).unwrap().as_str(), expected);
    }
}

#[test]
fn names_that_are_no_identifiers_are_refused_with_the_reason() {
    let long = "a".repeat(41);
    for (name, expected) in [
        ("", "it is empty"),
        (&long, "it has 41 bytes, expected at most 40"),
        (
            "x; system(\"x\")",
            "found ';' at byte 1, expected ASCII letters",
        ),
        ("a\nb", "found '\\n' at byte 1"),
        ("a\u{0}", "found '\\0' at byte 1"),
        ("z\u{301}", "at byte 1"),
        ("\\input{x}", "found '\\\\' at byte 0"),
        ("../x", "found '/' at byte 2"),
        ("2d", "it begins with '2', expected an ASCII letter"),
        ("_x", "it begins with '_'"),
        ("a-_b", "`a__b` has two underscores in a row"),
        ("a_", "`a_` ends with an underscore"),
        ("a-", "`a_` ends with an underscore"),
        ("a.", "`a_` ends with an underscore"),
        ("a ", "`a_` ends with an underscore"),
        ("double", "`double` is a keyword of C"),
        ("template", "`template` is a keyword of C++"),
        ("and-eq", "`and_eq` is a keyword of C++"),
        ("loop", "`loop` is a keyword of Rust"),
        ("LOOP", "`LOOP` is a keyword of Rust"),
        ("math", "`math` is the name of a standard C header"),
        ("Stdint", "`Stdint` is the name of a standard C header"),
        ("main", "is the name of a standard function or macro of C"),
        (
            "core",
            "is the name of a crate that generated Rust builds on",
        ),
        ("nul", "is the name of a device file of Windows"),
    ] {
        let refused = Identifier::from_name(name).unwrap_err().to_string();
        assert!(refused.contains(expected), "{name:?}: {refused}");
    }
}

proptest::proptest! {
    #[test]
    fn identifier_of_any_text_is_plain_ascii_or_refused(
        text in proptest::prop_oneof![".{0,50}", "[a-zA-Z0-9_. -]{0,45}"]
    ) {
        if let Ok(identifier) = Identifier::from_name(&text) {
            let name = identifier.as_str();
            assert!(name.starts_with(|c: char| c.is_ascii_alphabetic()));
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'));
            assert!(!name.ends_with('_') && !name.contains("__"));
            assert!(name.len() <= 40);
        }
    }
}

#[test]
fn order_by_names_and_groups_sorts_into_that_of_romc() {
    let order: CoordinateOrder = "body, fl,fr,rl.kn,rl.hy,rl.hx,rr".parse().unwrap();
    assert_eq!(order.places[..9], [12, 13, 14, 15, 16, 17, 3, 4, 5]);
    assert_eq!(order.places[12..15], [11, 10, 9]);
    let foreign = DVector::from_fn(18, |place, _| order.places[place] as f64);
    let sorted = order.sorted(&foreign);
    assert_eq!(sorted, DVector::from_fn(18, |index, _| index as f64));
    let columns = DMatrix::from_columns(&[foreign.clone(), foreign]);
    assert_eq!(order.sorted(&columns).column(1), sorted);
    let by_kind: CoordinateOrder = "kn,hx,hy,body".parse().unwrap();
    assert_eq!(by_kind.places[..5], [2, 5, 8, 11, 0]);
}

#[test]
fn order_with_a_coordinate_twice_or_missing_or_unknown_is_refused() {
    for (text, said) in [
        ("body,fr,fl,rr", "no `rl.hx`"),
        ("body,joints,fr.kn", "`fr.kn` twice"),
        ("body,legs", "\"legs\""),
        ("", "\"\""),
    ] {
        let error = text.parse::<CoordinateOrder>().unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn common_orders_are_all_different() {
    let mut orders: Vec<_> = CoordinateOrder::common().iter().map(|o| o.places).collect();
    orders.sort_unstable();
    orders.dedup();
    assert_eq!(orders.len(), 96);
}

#[test]
fn variable_names_are_read_and_written_alike() {
    for variable in LatentVariable::all(12) {
        assert_eq!(
            LatentVariable::from_name(&variable.to_string(), 12),
            Some(variable)
        );
    }
    for name in [
        "z0",
        "z13",
        "z01",
        "z",
        "z1x",
        "ddz1",
        "1",
        "u99999999999999999999",
    ] {
        assert_eq!(LatentVariable::from_name(name, 12), None, "{name}");
    }
}

#[test]
fn ranges_are_those_that_the_rooms_keep_themselves() {
    assert_eq!(table::LATENT_DIM.most as usize, STATE_DIM);
    assert_eq!(table::LAYER_WIDTH.most as usize, WIDEST);
}

#[test]
fn ends_are_inside_and_what_lies_beyond_is_not() {
    const COUNT: Range = table::HORIZON; // 1 to 500
    const SHARE: Range = table::BPTT_DECAY; // above 0, at most 1
    for (text, expected) in [
        ("1", Ok(1)),
        (" 500", Ok(500)),
        ("0", Err(())),
        ("501", Err(())),
        ("1.5", Err(())),
        ("-1", Err(())),
        ("18446744073709551615", Err(())),
    ] {
        assert_eq!(
            COUNT.parse::<usize>(text).map_err(|_| ()),
            expected,
            "{text}"
        );
    }
    assert!(SHARE.check(1.0).is_ok() && SHARE.check(1e-300).is_ok());
    for outside in [0.0, 1.0 + 1e-9, f64::NAN, f64::INFINITY, -1.0] {
        assert!(SHARE.check(outside).is_err(), "{outside}");
    }
}

#[test]
fn refusal_names_the_setting_the_number_and_the_range() {
    let refused = table::STATE_SCALING.check(1e-200);
    assert_eq!(
        refused.expect_err("too small").to_string(),
        "state-scaling is 1e-200, expected a number from 1e-6 to 1e4"
    );
}

#[test]
fn rule_of_all_foot_patterns_matches_each() {
    let always = FeetRule::always();
    assert!(always.matches([false; 4]) && always.matches([true, false, false, true]));
    assert!(always.is_always() && always.to_string() == "always");
    assert!(!FeetRule::Patterns(vec![[true; 4]]).matches([false; 4]));
}

/// Inputs `u = 2 + 3 z2 - dz1 + e`, where `e` is 1 and -1 in turn.
fn inputs_and_states(n: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let wave = |k: usize, rate: f64| (rate * k as f64).sin();
    let variables = DMatrix::from_fn(n, 6, |k, column| {
        let state = [wave(k, 0.9), wave(k, 1.7), wave(k, 2.3), wave(k, 2.9)];
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        match column {
            4 => 2.0 + 3.0 * state[1] - state[2] + sign,
            5 => 0.0,
            _ => state[column],
        }
    });
    (
        variables,
        DMatrix::from_fn(n, 2, |_, column| [0.5, 0.0][column]),
    )
}

#[test]
fn states_explain_the_inputs_that_depend_on_them() {
    let n = 4000;
    let (variables, left) = inputs_and_states(n);
    let shifts = DMatrix::from_row_slice(2, 1, &[1.0, 0.0]);
    let given = InputGivenState::of_samples(&shifts, variables, &left).expect("enough samples");
    let expected = [2.0, 0.0, 3.0, -1.0, 0.0];
    for (found, expected) in given.mean.row(0).iter().zip(expected) {
        assert!((found - expected).abs() < 0.05, "{}", given.mean);
    }
    assert_eq!(given.mean[(0, 1)], 0.0);
    assert!(given.mean.row(1).amax() < 1e-12);
    assert!(
        (given.covariance[(0, 0)] - 1.0).abs() < 0.05,
        "{}",
        given.covariance
    );
    assert!((given.acceleration_error[(0, 0)] - 0.25).abs() < 1e-12);
}

#[test]
fn few_samples_say_nothing() {
    let (variables, left) = inputs_and_states(19);
    assert!(InputGivenState::of_samples(&DMatrix::zeros(2, 0), variables, &left).is_none());
}
