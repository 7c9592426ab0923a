//! Times the computer algebra on a large model: `cargo bench --bench symbolic`.
//!
//! The model has latent dimension 8, all monomials of degree 3 and less in `z` and `dz`, sines,
//! cosines and inputs (1009 terms), with dense coefficients for all 8 accelerations.

use std::time::{Duration, Instant};

use romc::symbolic::{ExprId, ExprPool, Function, SymbolId};

const LATENT_DIM: usize = 8;
const REPEATS: usize = 7;

struct Model {
    pool: ExprPool,
    symbols: Vec<SymbolId>,
    outputs: Vec<ExprId>,
}

/// Builds library and accelerations; coefficients come from a fixed linear congruence.
fn build() -> Model {
    let mut pool = ExprPool::new();
    let names = ["z", "dz", "u"].map(|kind| (1..=LATENT_DIM).map(move |i| format!("{kind}{i}")));
    let symbols: Vec<SymbolId> = names
        .into_iter()
        .flatten()
        .map(|n| pool.symbol_id(&n))
        .collect();
    let state: Vec<ExprId> = symbols[..2 * LATENT_DIM]
        .iter()
        .map(|s| pool.symbol_expr(*s))
        .collect();
    let mut library = vec![ExprId::ONE];
    let mut layer: Vec<(usize, ExprId)> = vec![(0, ExprId::ONE)];
    for _degree in 1..=3 {
        let mut next = Vec::new();
        for &(first, monomial) in &layer {
            for (offset, &factor) in state[first..].iter().enumerate() {
                next.push((first + offset, pool.mul(monomial, factor)));
            }
        }
        library.extend(next.iter().map(|(_, monomial)| *monomial));
        layer = next;
    }
    for function in [Function::Sin, Function::Cos] {
        for &x in &state {
            library.push(pool.apply(function, x));
        }
    }
    for &input in &symbols[2 * LATENT_DIM..] {
        library.push(pool.symbol_expr(input));
    }
    let mut seed = 1_u64;
    let outputs = (0..LATENT_DIM)
        .map(|_| {
            let terms: Vec<ExprId> = library
                .iter()
                .map(|term| {
                    seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let coefficient = (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                    let coefficient = pool.number(coefficient);
                    pool.mul(coefficient, *term)
                })
                .collect();
            pool.sum(&terms)
        })
        .collect();
    Model {
        pool,
        symbols,
        outputs,
    }
}

/// The shortest of several runs.
fn fastest(mut run: impl FnMut() -> Duration) -> Duration {
    (0..REPEATS)
        .map(|_| run())
        .min()
        .expect("there is at least one run")
}

fn timed<T>(work: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed()
}

fn report(name: &str, time: Duration, note: &str) {
    println!("{name:<28} {:>9.3} ms  {note}", time.as_secs_f64() * 1e3);
}

fn main() {
    let model = build();
    let n_terms = model.pool.terms_of(model.outputs[0]).len();
    report(
        "build",
        fastest(|| timed(build)),
        &format!("{n_terms} terms x {LATENT_DIM}"),
    );

    let mut n_entries = 0;
    let mut n_nodes = 0;
    let jacobian = fastest(|| {
        let mut pool = model.pool.clone();
        let time = timed(|| n_entries = pool.jacobian(&model.outputs, &model.symbols).len());
        n_nodes = pool.len();
        time
    });
    report(
        "jacobian",
        jacobian,
        &format!("{n_entries} entries, {n_nodes} nodes in the pool"),
    );

    let mut pool = model.pool.clone();
    let mut roots: Vec<ExprId> = pool
        .jacobian(&model.outputs, &model.symbols)
        .into_iter()
        .map(|entry| entry.value)
        .collect();
    roots.extend(&model.outputs);
    report(
        "evaluate with jacobian",
        fastest(|| timed(|| pool.evaluate_all(&roots, &|symbol| 0.1 * symbol.index() as f64))),
        &format!("{} distinct nodes", pool.reachable(&roots).len()),
    );
    let texts: Vec<String> = model
        .outputs
        .iter()
        .map(|e| model.pool.display(*e).to_string())
        .collect();
    let length: usize = texts.iter().map(String::len).sum();
    report(
        "display",
        fastest(|| {
            timed(|| {
                model
                    .outputs
                    .iter()
                    .map(|e| model.pool.display(*e).to_string().len())
                    .sum::<usize>()
            })
        }),
        &format!("{length} bytes"),
    );
    report(
        "parse",
        fastest(|| {
            let mut pool = ExprPool::new();
            timed(|| {
                for text in &texts {
                    std::hint::black_box(pool.parse(text, &|_| true)).expect("printed text parses");
                }
            })
        }),
        &format!("{length} bytes"),
    );
}
