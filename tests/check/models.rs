//! Random models compared with their printed forms, and with models that differ in one coefficient.

use std::fmt::Write as _;
use std::path::Path;

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::check::{CheckOptions, Comparison, Side, Verdict, compare};
use romc::equations::Equations;
use romc::import::SymbolNames;
use romc::model::{FeetRule, Library, Phase, ReducedModel};
use romc::symbolic::ExprPool;
use romc::typeset::latex;
use romc::typeset::markdown;
use romc::typeset::{Form, NumberStyle, PrintOptions};
use romc::typeset::{Rounding, SymbolTable};

const COUNT: u64 = 200;

/// Patterns of candidate terms: `A` and `B` become variables.
const TERMS: [&str; 26] = [
    "1",
    "A",
    "A",
    "A",
    "A*B",
    "A^2",
    "A^2*B",
    "sin(A)",
    "cos(A)",
    "sin(A + 2*B)",
    "cos(A)*sin(B)",
    "sin(A)^2",
    "cos(2*A - B)*A",
    "tanh(A*B)",
    "tan(A/4)",
    "exp(-A^2)",
    "exp(A)*exp(B/2)",
    "log(1 + A^2)",
    "sqrt(1 + A^2)",
    "abs(A)",
    "A/(1 + B^2)",
    "(A - B)^3",
    "(1 + A^2)^-2",
    "(1 + A^2)^1.5",
    "sign(A)*B",
    "2.5*A - 0.75*A*B",
];

struct Random(ChaCha8Rng);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0.next_u32() as usize % count
    }

    /// A coefficient as trainings produce them: of any size, some with few digits, some integers.
    fn coefficient(&mut self) -> f64 {
        let share = f64::from(self.0.next_u32()) / f64::from(u32::MAX);
        let size = [0.02, 0.3, 1.0, 5.0, 60.0][self.below(5)] * (0.3 + share);
        let size = match self.below(6) {
            0 => 1.0,
            1 => (100.0 * size).round().max(1.0) / 100.0,
            2 => size.ceil(),
            _ => size,
        };
        if self.below(2) == 0 { size } else { -size }
    }
}

/// A model with up to ten terms per phase; the seed decides which functions occur.
fn random_model(seed: u64) -> ReducedModel {
    let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
    let latent_dim = 1 + random.below(3);
    let mut pool = ExprPool::new();
    let mut ids = Vec::new();
    let mut terms = Vec::new();
    while terms.len() < 4 + random.below(7) {
        let mut variable = || {
            let name = ["z", "dz", "u"][random.below(3)];
            format!("{name}{}", 1 + random.below(latent_dim))
        };
        let (a, b) = (variable(), variable());
        let text = TERMS[random.below(TERMS.len())]
            .replace('A', &a)
            .replace('B', &b);
        let id = pool.parse(&text, &|_| true).expect("a term");
        let (_, rest) = pool.split(id);
        if pool.as_number(id).is_none_or(|_| text == "1") && !ids.contains(&rest) {
            ids.push(rest);
            terms.push(text);
        }
    }
    let phases = ["contact", "flight"].into_iter().map(|name| Phase {
        name: name.into(),
        feet: if name == "contact" {
            FeetRule::Any
        } else {
            FeetRule::None
        },
        xi: DMatrix::from_fn(terms.len(), latent_dim, |_, _| match random.below(3) {
            0 => 0.0,
            _ => random.coefficient(),
        }),
    });
    let phases: Vec<Phase> = phases.collect();
    let library = Library::from_terms(latent_dim, &terms).expect("distinct terms");
    ReducedModel::builder(format!("random-{seed}"), library)
        .phases(phases)
        .build()
        .expect("a model")
}

/// The model's equations as text.
fn text_of(model: &ReducedModel) -> String {
    let mut text = String::new();
    for (index, phase) in model.phases().iter().enumerate() {
        let _ = writeln!(text, "[{}]", phase.name);
        for output in 0..model.latent_dim() {
            let _ = write!(text, "ddz{} = 0", output + 1);
            for (coefficient, term) in model.active_terms(index, output).expect("in range") {
                let _ = write!(text, " + {coefficient:?}*({})", term.text);
            }
            text.push('\n');
        }
    }
    text
}

const RENAMED: [&str; 3] = ["z1=x", "u1=F_lin,x", "u2=tau_2"];

/// A model as one of ten kinds of files, and the names of variables in it.
fn printed(model: &ReducedModel, kind: u64) -> (String, String, SymbolNames) {
    let equations = Equations::of(model);
    let renamed = &RENAMED[..if model.latent_dim() == 1 { 2 } else { 3 }];
    let plain = PrintOptions::default();
    let options = match kind {
        0 => return ("own.txt".into(), text_of(model), SymbolNames::default()),
        1 | 2 => {
            let rounding = if kind == 1 {
                Rounding::default()
            } else {
                Rounding::Exact
            };
            let options = PrintOptions {
                rounding,
                ..PrintOptions::default()
            };
            let files = markdown::emit(&equations, &options).expect("Markdown");
            return (
                "own.md".into(),
                files[0].contents.clone(),
                SymbolNames::default(),
            );
        }
        3 => plain,
        4 => PrintOptions {
            rounding: Rounding::Significant(2),
            ..plain
        },
        5 => PrintOptions {
            numbers: NumberStyle::Siunitx,
            ..plain
        },
        6 => PrintOptions {
            form: Form::Align,
            width_em: Some(18.0),
            ..plain
        },
        7 => PrintOptions {
            form: Form::Cases,
            rounding: Rounding::Significant(6),
            ..plain
        },
        8 => {
            let symbols = SymbolTable::parse(renamed, model.latent_dim()).expect("names");
            PrintOptions {
                symbols,
                numbers: NumberStyle::Siunitx,
                ..plain
            }
        }
        _ => PrintOptions {
            rounding: Rounding::Exact,
            width_em: Some(20.0),
            ..plain
        },
    };
    let files = latex::emit(&equations, &options).expect("LaTeX");
    let names = match kind {
        8 => SymbolNames::parse(renamed).expect("names"),
        _ => SymbolNames::default(),
    };
    ("own.tex".into(), files[0].contents.clone(), names)
}

fn against(
    model: &ReducedModel,
    kind: u64,
    (file, text, symbols): (String, String, SymbolNames),
) -> Comparison {
    let options = CheckOptions {
        symbols,
        // These print every digit, however few there are.
        exact: [0, 2, 9].contains(&kind),
        ..CheckOptions::default()
    };
    let side = Side::from_bytes(&file, text.as_bytes(), &options, &[]);
    let side = side.unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    compare(&Side::of_model("model.json", model), &side, &options)
}

#[test]
fn random_models_are_proven_equal_to_what_romc_prints_of_them() {
    let mut exact = 0;
    for seed in 0..COUNT {
        let model = random_model(seed);
        let printed = printed(&model, seed % 10);
        let text = printed.1.clone();
        let comparison = against(&model, seed % 10, printed);
        assert!(comparison.is_equal(), "{seed}: {comparison:?}\n{text}");
        let all_exact = comparison
            .verdicts()
            .all(|verdict| *verdict == Verdict::Equal);
        exact += usize::from(all_exact);
        // Text and shortest decimals are exact.
        assert!(
            all_exact || ![0, 2, 9].contains(&(seed % 10)),
            "{seed}: {comparison:?}\n{text}"
        );
    }
    assert!(exact < COUNT as usize, "some were rounded");
}

#[test]
fn phases_that_are_printed_once_are_all_compared() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/models/go1-trot-d6.json");
    let model = artifact::read(Path::new(path)).expect("a shipped model");
    // Markdown, cases and align
    for kind in [1, 3, 6] {
        let comparison = against(&model, kind, printed(&model, kind));
        let names = comparison.phases.iter().map(|phase| phase.name.as_str());
        let names: Vec<&str> = names.collect();
        assert_eq!(names, ["fr_rl", "fl_rr", "all", "flight"]);
        assert!(comparison.is_equal(), "{kind}: {comparison:?}");
    }
}

/// The model with one active coefficient's sign or size changed, and where.
fn mutated(model: &ReducedModel, seed: u64) -> (ReducedModel, usize, usize) {
    let mut random = Random(ChaCha8Rng::seed_from_u64(seed + 1_000));
    let mut phases = model.phases().to_vec();
    loop {
        let (phase, output) = (random.below(phases.len()), random.below(model.latent_dim()));
        let term = random.below(model.library().terms().len());
        let coefficient = &mut phases[phase].xi[(term, output)];
        if *coefficient == 0.0 {
            continue;
        }
        *coefficient *= [-1.0, 1.3, 0.7][random.below(3)];
        let changed = ReducedModel::builder("mutated", model.library().clone()).phases(phases);
        return (changed.build().expect("a model"), phase, output);
    }
}

#[test]
fn models_with_one_coefficient_changed_are_found_with_a_point() {
    for seed in 0..COUNT {
        let model = random_model(seed);
        let (changed, phase, output) = mutated(&model, seed);
        let printed = printed(&model, seed % 10);
        let text = printed.1.clone();
        let comparison = against(&changed, seed % 10, printed);
        for (p, found) in comparison.phases.iter().enumerate() {
            for (o, equation) in found.equations.iter().enumerate() {
                let is_changed = (p, o) == (phase, output);
                let Verdict::Different(difference) = &equation.verdict else {
                    assert!(
                        !is_changed && equation.verdict.is_equal(),
                        "{seed}: {equation:?}
{text}"
                    );
                    continue;
                };
                assert!(is_changed, "{seed}: {equation:?}");
                let gap = &difference.gap;
                let at = |name: &str| {
                    DVector::from_fn(model.latent_dim(), |k, _| {
                        gap.point
                            .get(&format!("{name}{}", k + 1))
                            .copied()
                            .unwrap_or(0.0)
                    })
                };
                let exact = changed
                    .ddz(phase, &at("z"), &at("dz"), &at("u"))
                    .expect("values");
                assert!(
                    (exact[output] - gap.left).abs() <= 1e-9 * (1.0 + exact[output].abs()),
                    "{seed}"
                );
                assert!(gap.left != gap.right, "{seed}");
            }
        }
    }
}
