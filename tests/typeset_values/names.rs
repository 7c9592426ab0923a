//! Names of variables, coordinates and patterns of feet in print.

use romc_model::artifact;

use crate::equations::Equations;
use crate::model::{FeetRule, LatentVariable};
use crate::typeset::words::feet;
use crate::typeset::{RobotTypeset, Rounding, SymbolTable, TypesetError};

/// A model of one latent coordinate over two robot coordinates.
const TWO: &str = r#"{ "schema": "romc-model/1", "name": "two", "latent_dim": 1,
    "state": { "names": ["a", "b"], "units": ["m", "m"] }, "scaling": { "state": 0.5, "input": 1.0 },
    "encoder": { "weights": [[1.0, 0.0]], "bias": [0.0] },
    "decoder": { "weights": [[1.0], [0.0]], "bias": [0.0, 0.0] }, "library": ["z1"],
    "phases": [ { "name": "contact", "feet": "any", "xi": [[2.5]] } ] }"#;

/// The model of a text in robot coordinates.
fn in_robot_coordinates(text: &str) -> Result<RobotTypeset, TypesetError> {
    let model = artifact::read_from_bytes("two.json", text.as_bytes()).expect("a valid model");
    let (equations, symbols) = (Equations::of(&model), SymbolTable::default());
    let robot = RobotTypeset::new(&equations, &symbols, Rounding::Exact);
    robot.map(|robot| robot.expect("a robot's coordinates"))
}

#[test]
fn robot_equations_with_an_overflowing_coefficient_are_refused() {
    let found = |text: &str| {
        in_robot_coordinates(text)
            .expect_err("too large")
            .to_string()
    };
    let text = &TWO.replace("2.5", "1e308");
    assert_eq!(
        found(text),
        "robot coordinates, dd(a): the coefficient of \"z1\" is inf in SI units"
    );
    let large_weight = text
        .replace("1e308", "1.0")
        .replace("[[1.0, 0.0]]", "[[1e308, 0.0]]");
    let large_weight = large_weight.replace("\"state\": 0.5", "\"state\": 2.5");
    assert_eq!(
        found(&large_weight),
        "robot coordinates, z1: the coefficient of \"q_a\" is inf in SI units"
    );
}

#[test]
fn coordinate_symbols_fall_back_to_numbers_when_names_look_alike() {
    let symbols = |[a, b]: [&str; 2]| -> Vec<String> {
        let names = format!(r#""names": ["{a}", "{b}"]"#);
        let text = TWO.replace(r#""names": ["a", "b"]"#, &names);
        let robot = in_robot_coordinates(&text).expect("finite");
        let equations = robot.systems[0].equations.iter();
        equations
            .map(|equation| equation.left.to_string())
            .collect()
    };
    assert_eq!(symbols(["a.b", "a-b"]), ["ddq_1", "ddq_2"]);
    assert_eq!(symbols(["fr.hx", "body.x"]), ["ddq_fr,hx", "ddq_body,x"]);
}

#[test]
fn table_renames_the_coordinate_and_all_its_derivatives() {
    let table = SymbolTable::parse(&["z1 = x", "u2=F_lin,z", "z2=theta"], 2).unwrap();
    let show = |variable| table.symbol(variable).to_string();
    assert_eq!(show(LatentVariable::Z(0)), "x");
    assert_eq!(show(LatentVariable::Dz(0)), "dx");
    assert_eq!(show(LatentVariable::Dz(1)), "dtheta");
    assert_eq!(show(LatentVariable::U(1)), "F_lin,z");
    assert_eq!(show(LatentVariable::U(0)), "u_1");
}

#[test]
fn table_refuses_names_that_carry_tex_variables_that_the_model_lacks_and_one_look_of_two() {
    let refused = |entry: &str| {
        let error = SymbolTable::parse(&[entry], 2).expect_err(entry);
        error.to_string()
    };
    let names = [
        r"\input{x}",
        "x%",
        "a b",
        "$",
        "^^5c",
        r"\def",
        "",
        "1",
        "x_",
        "x_{a",
    ];
    for name in names {
        let error = refused(&format!("z1={name}"));
        assert!(error.contains("expected a letter, a word"), "{error}");
    }
    for entry in ["z3=x", "dz1=v", "u0=a", "q=a"] {
        let error = refused(entry);
        assert!(error.contains("cannot be renamed"), "{error}");
    }
    let clash = refused("z1=z_2");
    assert!(clash.contains("would both be printed as"), "{clash}");
    assert!(SymbolTable::parse(&["z1=z_2", "z2=z_1"], 2).is_ok());
}

fn words(patterns: &[[u8; 4]]) -> String {
    let flags = |pattern: &[u8; 4]| pattern.map(|foot| foot == 1);
    feet(&FeetRule::Patterns(patterns.iter().map(flags).collect()))
}

#[test]
fn patterns_read_as_pairs_where_they_are_pairs() {
    let mut front = Vec::new();
    for bits in 0..16u8 {
        let feet: [u8; 4] = std::array::from_fn(|foot| bits >> foot & 1);
        if feet[0] + feet[1] > 0 {
            front.push(feet);
        }
    }
    assert_eq!(words(&front), "a front foot on the ground");
    assert_ne!(words(&front[1..]), "a front foot on the ground");
    let rear = &[[0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 1, 1]];
    for (patterns, text) in [
        (&rear[..], "a rear foot and no front foot"),
        (&[[1, 1, 0, 0]], "both front feet and no rear foot"),
        (&[[1, 1, 1, 1]], "all four feet"),
        (&[[0; 4]], "no foot"),
        (&[[1, 0, 0, 1], [0, 1, 1, 0]], "fr and rl, or fl and rr"),
        (&[[1, 0, 0, 0], [1, 1, 1, 0]], "fr alone, or fr, fl and rr"),
    ] {
        assert_eq!(words(patterns), format!("{text} on the ground"));
    }
}
