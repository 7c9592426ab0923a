//! Conditions under which a result of generated code agrees with the interpreter's.
//!
//! - [`Rule::SameBits`]: every operation is rounded as in the program, so every result has the interpreter's bits. It
//!   holds for C without contraction and for Rust: always without transcendental functions; with them because both call
//!   one mathematics library.
//! - [`Rule::UlpsATerm`]: fused operations or another mathematics library. A result differs by at most 4 ulp per term
//!   of its sum, and one more per operation inside the term (`terms.rs`). Outputs of nonlinear layers, of the solve in
//!   the projection of their inputs, the feet's forces and the motors' torques are not such sums: 1e-11 of the largest
//!   output.

use romc::ir::{Binary, Program, Statement, Unary};
use romc::model::ReducedModel;

use super::functions::Function;
use super::terms::Terms;

/// Largest difference of maps through nonlinear layers and of feet's forces, relative to the largest output.
const CURVED: f64 = 1e-11;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    SameBits,
    UlpsATerm,
}

/// Counts of compared functions and results, and the largest difference.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    pub functions: usize,
    pub transcendental: usize,
    pub results: usize,
    pub equal_bits: usize,
    /// As a share of the allowance, and its place.
    pub worst: (f64, String),
}

impl Tally {
    pub fn add(&mut self, other: Tally) {
        self.functions += other.functions;
        self.transcendental += other.transcendental;
        self.results += other.results;
        self.equal_bits += other.equal_bits;
        if other.worst.0 > self.worst.0 {
            self.worst = other.worst;
        }
    }
}

/// Compares one function's results at its points; the test fails if `rule` is broken.
pub fn compare(
    model: &ReducedModel,
    function: &Function,
    (points, expected, found): (&[f64], &[f64], &[f64]),
    (rule, by): (Rule, &str),
) -> Tally {
    let name = format!("{}_{}", function.model, function.name);
    let mut tally = Tally {
        functions: 1,
        transcendental: usize::from(is_transcendental(&function.program)),
        ..Tally::default()
    };
    let terms = match rule {
        Rule::SameBits => None,
        Rule::UlpsATerm => Terms::new(model, function),
    };
    let len = function.output_len();
    assert_eq!(found.len(), expected.len(), "{by}: {name}");
    let inputs = points.chunks(function.input_len());
    let results = expected.chunks(len).zip(found.chunks(len));
    for (point, (expected, found)) in inputs.zip(results) {
        let same = |k: &usize| {
            let (e, f) = (expected[*k], found[*k]);
            e.to_bits() == f.to_bits() || (e.is_nan() && f.is_nan())
        };
        let other: Vec<usize> = (0..len).filter(|k| !same(k)).collect();
        tally.results += len;
        tally.equal_bits += len - other.len();
        if other.is_empty() {
            continue;
        }
        let allowances = terms.as_ref().map(|terms| terms.allowance(point));
        let largest = expected.iter().fold(1.0_f64, |scale, x| scale.max(x.abs()));
        for k in other {
            let (e, f) = (expected[k], found[k]);
            let difference = (f - e).abs();
            let place = format!("{by}: {name}, output {k}: found {f:e}, interpreter {e:e}");
            match (&allowances, rule) {
                (_, Rule::SameBits) => panic!("{place}"),
                (None, Rule::UlpsATerm) => {
                    assert!(difference <= CURVED * largest, "{place}");
                }
                (Some(allowances), Rule::UlpsATerm) => {
                    let share = difference / allowances[k];
                    assert!(share <= 1.0, "{place}: {share:.2} of what is allowed");
                    if share > tally.worst.0 {
                        tally.worst = (share, name.clone());
                    }
                }
            }
        }
    }
    tally
}

/// Whether a program calls a mathematics library, or the kernel of sines.
fn is_transcendental(program: &Program) -> bool {
    let own = program.statements.iter().any(|statement| match statement {
        Statement::SinCos { .. } => true,
        Statement::Unary(op, _) => {
            matches!(op, Unary::Tan | Unary::Tanh | Unary::Exp | Unary::Log)
        }
        Statement::Binary(op, ..) => *op == Binary::Pow,
        Statement::Constant(_)
        | Statement::Input { .. }
        | Statement::Select(_)
        | Statement::Accumulate { .. }
        | Statement::Scaled { .. }
        | Statement::Lanes { .. }
        | Statement::Call { .. } => false,
    });
    own || program.callees.iter().any(is_transcendental)
}
