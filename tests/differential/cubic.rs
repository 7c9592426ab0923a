//! A large cubic polynomial, for unit tests of lowering and for tests of emitted code.

use super::*;

/// Five equations, an odd number, with two fifths of all monomials up to degree 3 in seven variables, a product of four,
/// sines alone and in products, and an input.
pub fn cubic() -> ReducedModel {
    let variables = ["z1", "z3", "z4", "dz1", "dz2", "dz5", "u1"];
    let others = [
        "1",
        "sin(dz1)",
        "u2",
        "z2",
        "z1*z3*dz2*dz2",
        "z1*cos(z4)",
        "sin(z5)*z1",
    ];
    let mut terms = others.map(str::to_owned).to_vec();
    for (i, a) in variables.iter().enumerate() {
        terms.push((*a).to_owned());
        for (j, b) in variables.iter().enumerate().skip(i) {
            terms.push(format!("{a}*{b}"));
            terms.extend(variables[j..].iter().map(|c| format!("{a}*{b}*{c}")));
        }
    }
    let xi = DMatrix::from_fn(terms.len(), 5, |term, row| match (7 * term + 3 * row) % 5 {
        0 | 2 => 0.02 * (term as f64 - 61.5) - 0.1 * row as f64,
        _ => 0.0,
    });
    let library = Library::from_terms(5, &terms).expect("terms parse");
    let (name, feet) = ("contact".to_owned(), FeetRule::Any);
    let builder = ReducedModel::builder("cubic", library).phase(Phase { name, feet, xi });
    builder.build().expect("a valid model")
}
