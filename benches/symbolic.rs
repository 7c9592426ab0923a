//! Times the computer algebra on a large model: `cargo bench --bench symbolic`.
//!
//! The model has latent dimension 8, all monomials of degree 3 and less in `z` and `dz`, sines,
//! cosines and inputs (1009 terms), with dense coefficients for all 8 accelerations.

use std::time::{Duration, Instant};

use romc::symbolic::{ExprId, ExprPool, Function, Interval, SymbolId};

const LATENT_DIM: usize = 8;
const REPEATS: u32 = 25;

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

/// The derivatives of all outputs by all symbols that are not zero.
fn jacobian(pool: &mut ExprPool, model: &Model) -> Vec<ExprId> {
    let mut entries = Vec::new();
    for &output in &model.outputs {
        for &symbol in &model.symbols {
            entries.push(pool.derivative(output, symbol));
        }
    }
    entries.retain(|&entry| entry != ExprId::ZERO);
    entries
}

/// The mean of several runs (the clock of [`cpu_time`] moves in steps of a few milliseconds).
fn mean(mut run: impl FnMut() -> Duration) -> Duration {
    (0..REPEATS).map(|_| run()).sum::<Duration>() / REPEATS
}

fn timed<T>(work: impl FnOnce() -> T) -> Duration {
    let (start, start_cpu) = (Instant::now(), cpu_time());
    std::hint::black_box(work());
    match (start_cpu, cpu_time()) {
        (Some(before), Some(after)) => after - before,
        _ => start.elapsed(),
    }
}

/// The time this thread has spent on a processor, where the system provides it (Linux): the machine may
/// be busy with other work.
fn cpu_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split(' ').next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

fn report(name: &str, time: Duration, note: &str) {
    println!("{name:<28} {:>9.3} ms  {note}", time.as_secs_f64() * 1e3);
}

fn main() {
    let model = build();
    let n_terms = model.pool.terms_of(model.outputs[0]).len();
    report(
        "build",
        mean(|| timed(build)),
        &format!("{n_terms} terms x {LATENT_DIM}"),
    );

    let mut n_entries = 0;
    let mut n_nodes = 0;
    let derivatives = mean(|| {
        let mut pool = model.pool.clone();
        let time = timed(|| n_entries = jacobian(&mut pool, &model).len());
        n_nodes = pool.n_nodes();
        time
    });
    report(
        "jacobian",
        derivatives,
        &format!("{n_entries} entries, {n_nodes} nodes in the pool"),
    );

    let mut pool = model.pool.clone();
    let mut roots = jacobian(&mut pool, &model);
    roots.extend(&model.outputs);
    report(
        "evaluate with jacobian",
        mean(|| timed(|| pool.evaluate_all(&roots, &|symbol| 0.1 * symbol.index() as f64))),
        &format!("{} distinct nodes", pool.reachable(&roots).len()),
    );
    time_rewriting(&model);
    time_text(&model);
    time_pool_of_distinct_sums();
}

/// Simplification and intervals.
fn time_rewriting(model: &Model) {
    let simplify = mean(|| {
        let mut pool = model.pool.clone();
        timed(|| {
            for &output in &model.outputs {
                std::hint::black_box(pool.simplify(output));
            }
        })
    });
    report("simplify", simplify, "all outputs");
    let interval = Interval::new(-0.5, 0.75);
    let bounds = mean(|| timed(|| model.pool.evaluate_intervals(&model.outputs, &|_| interval)));
    report("intervals", bounds, "all outputs");
}

/// Printing and reading.
fn time_text(model: &Model) {
    let print = || -> Vec<String> {
        let outputs = model.outputs.iter();
        outputs
            .map(|output| model.pool.display(*output).to_string())
            .collect()
    };
    let texts = print();
    let length: usize = texts.iter().map(String::len).sum();
    report("display", mean(|| timed(print)), &format!("{length} bytes"));
    let parse = mean(|| {
        let mut pool = ExprPool::new();
        timed(|| {
            for text in &texts {
                std::hint::black_box(pool.parse(text, &|_| true)).expect("printed text parses");
            }
        })
    });
    report("parse", parse, &format!("{length} bytes"));
}

/// A pool of more than a hundred thousand expressions, and one pass over them.
fn time_pool_of_distinct_sums() {
    let mut pool = ExprPool::new();
    let symbols: Vec<ExprId> = (0..200).map(|i| pool.symbol(&format!("x{i}"))).collect();
    let mut roots = Vec::new();
    let build = timed(|| {
        for &a in &symbols {
            for &b in &symbols {
                let product = pool.mul(a, b);
                let sine = pool.apply(Function::Sin, product);
                roots.push(pool.add(sine, a));
            }
        }
    });
    report(
        "build distinct sums",
        build,
        &format!("{} expressions", pool.n_nodes()),
    );
    let sum = timed(|| pool.sum(&roots));
    report("add them up", sum, &format!("{} operands", roots.len()));
    let symbol = pool.symbol_id("x7");
    let sum = pool.sum(&roots);
    let derivative = timed(|| pool.derivative(sum, symbol));
    report("derivative of the sum", derivative, "by one of 200 symbols");
}
