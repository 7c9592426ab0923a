//! Expressions with roots, magnitudes, signs and powers, and their slopes where arguments of these vanish, by limits in
//! 800 digits: `tests/fixtures/slopes.txt`, made by `tests/scripts/slopes.py`. With ROMC_REQUIRE_TOOLS=1 the script makes
//! 2,000 others, from the seed in ROMC_SEED if there is one.

use std::path::Path;

use nalgebra::DMatrix;
use romc::model::{FeetRule, Library, Phase, ReducedModel};

use super::tools;

/// The variables of the expressions, as the script prints them.
pub const N_VARIABLES: usize = 4;

/// An expression, and points at which it has a value.
pub struct Kink {
    pub expression: String,
    pub points: Vec<KinkPoint>,
}

/// Values of z1, z2, dz1 and u1, and the slopes by them.
pub struct KinkPoint {
    pub at: [f64; N_VARIABLES],
    #[allow(dead_code, reason = "scripts are compared with the interpreter")]
    pub slopes: [f64; N_VARIABLES],
}

impl KinkPoint {
    /// The inputs `z`, `dz`, `u_lat` of a model; zero except for the four variables.
    pub fn inputs(&self, latent_dim: usize) -> Vec<f64> {
        let d = latent_dim.max(2);
        let mut inputs = vec![0.0; 3 * d];
        for (position, value) in columns(d).into_iter().zip(self.at) {
            inputs[position] = value;
        }
        inputs
    }
}

/// Where the four variables stand among the inputs of a model.
pub fn columns(latent_dim: usize) -> [usize; N_VARIABLES] {
    [0, 1, latent_dim, 2 * latent_dim]
}

/// The expressions of the fixture, or new ones if everything is asked for.
pub fn kinks() -> Vec<Kink> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let known = || std::fs::read_to_string(folder.join("fixtures/slopes.txt")).expect("a fixture");
    let mut text = known();
    if tools::is_thorough() && tools::answers(tools::python().args(["-c", "import mpmath"])) {
        let seed = std::env::var("ROMC_SEED").unwrap_or_else(|_| "2026".to_owned());
        let script = folder.join("scripts/slopes.py");
        let output = tools::python().arg(script).args(["200", &seed]).output();
        let output = output.expect("Python starts");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        text.push_str(&String::from_utf8(output.stdout).expect("text"));
    }
    let mut kinks: Vec<Kink> = Vec::new();
    for line in text.lines() {
        let (expression, numbers) = line.split_once('\t').expect("an expression and numbers");
        let numbers: Vec<f64> = numbers
            .split('\t')
            .map(|n| n.parse().expect("a number"))
            .collect();
        let half = |from: usize| std::array::from_fn(|k| numbers[from + k]);
        let point = KinkPoint {
            at: half(0),
            slopes: half(N_VARIABLES),
        };
        match kinks
            .last_mut()
            .filter(|kink| kink.expression == expression)
        {
            Some(kink) => kink.points.push(point),
            None => kinks.push(Kink {
                expression: expression.to_owned(),
                points: vec![point],
            }),
        }
    }
    kinks
}

/// A model whose accelerations are expressions, and zero behind them; of two coordinates at least.
pub fn model(name: &str, latent_dim: usize, expressions: &[&str]) -> ReducedModel {
    let d = latent_dim.max(2);
    let terms: Vec<String> = expressions.iter().map(|&text| text.to_owned()).collect();
    let library = Library::from_terms(d, &terms).expect("terms parse");
    let xi = DMatrix::from_fn(expressions.len(), d, |term, row| {
        f64::from(u8::from(term == row))
    });
    let phase = Phase {
        name: "phase".to_owned(),
        feet: FeetRule::Any,
        xi,
    };
    let model = ReducedModel::builder(name, library).phase(phase).build();
    model.expect("a valid model")
}
