//! Generated C and Rust compared with the interpreter, and the interpreter with the model.

#[path = "differential/agreement.rs"]
mod agreement;
#[path = "differential/checkers.rs"]
mod checkers;
#[path = "differential/driver_text.rs"]
mod driver_text;
#[path = "differential/drivers.rs"]
mod drivers;
#[path = "differential/functions.rs"]
mod functions;
#[path = "differential/kinks.rs"]
mod kinks;
#[path = "differential/models.rs"]
mod models;
#[path = "differential/single.rs"]
mod single;
#[path = "differential/slopes.rs"]
mod slopes;
#[path = "differential/terms.rs"]
mod terms;
mod tools;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use agreement::{Rule, Tally, compare};
use drivers::{Build, Workshop, contents};
use functions::{Function, Random, functions as functions_of};
use nalgebra::DVector;
use romc::equations::Equations;
use romc::ir::{Interpreter, Statement};
use romc::lower::CompiledModel;
use romc::lower::{Form, Map, dynamics_jacobian};
use romc::model::{LatentVariable, ReducedModel};
use romc::symbolic::{ExprId, ExprPool};

/// Random models in tests that compile nothing.
const SOME_MODELS: u64 = 24;

/// Random models in a comparison that compiles all of them into one program.
fn n_models_a_program() -> u64 {
    SOME_MODELS / tools::thorough_or(2, 3)
}

/// Random models in the comparison with builds that must have the interpreter's bits.
fn n_random_models() -> u64 {
    let asked = std::env::var("ROMC_RANDOM_MODELS").ok();
    asked.map_or(tools::thorough_or(4, 1) * n_models_a_program(), |count| {
        count.parse().expect("ROMC_RANDOM_MODELS is a number")
    })
}

/// Every nth of the shipped models and fixtures, for comparisons that take long.
fn some_shipped(n: usize) -> Vec<ReducedModel> {
    models::shipped().into_iter().step_by(n).collect()
}

/// Functions, points and expected results of some models.
struct Case {
    models: Vec<ReducedModel>,
    functions: Vec<Function>,
    /// The model of each function.
    model_of: Vec<usize>,
    points: Vec<Vec<f64>>,
    expected: Vec<Vec<f64>>,
    form: Form,
}

impl Case {
    fn new(models: Vec<ReducedModel>, n_points: usize, form: Form) -> Self {
        let (mut functions, mut model_of) = (Vec::new(), Vec::new());
        for (index, model) in models.iter().enumerate() {
            functions.extend(functions_of(model, n_points, form));
            model_of.resize(functions.len(), index);
        }
        let mut random = Random(7);
        let points = functions.iter().map(|f| f.points(&mut random)).collect();
        let mut case = Self {
            models,
            functions,
            model_of,
            points,
            expected: Vec::new(),
            form,
        };
        case.interpret();
        case
    }

    fn interpret(&mut self) {
        let pairs = self.functions.iter().zip(&self.points);
        self.expected = pairs.map(|(f, points)| f.interpret(points)).collect();
    }

    fn workshop(&self) -> Workshop {
        Workshop::new(&self.models, self.form)
    }

    /// Runs the functions as compiled by `build` and compares every result.
    fn check(&self, workshop: &Workshop, build: &Build) -> Tally {
        let found = workshop.run(build, &self.functions, &self.points);
        let mut tally = Tally::default();
        for (k, found) in found.iter().enumerate() {
            tally.add(compare(
                &self.models[self.model_of[k]],
                &self.functions[k],
                (&self.points[k], &self.expected[k], found),
                (build.rule, build.name),
            ));
        }
        tally
    }
}

/// Every build of every case, several compilers in parallel; prints counts and differences.
fn check_all(what: &str, cases: &[Case], builds: impl Fn(usize) -> Vec<Build>) {
    let workshops: Vec<Workshop> = cases.iter().map(Case::workshop).collect();
    let mut jobs: Vec<(usize, Build)> = Vec::new();
    for case in 0..cases.len() {
        jobs.extend(builds(case).into_iter().map(|build| (case, build)));
    }
    let tallies: Mutex<BTreeMap<&str, (usize, Rule, Tally)>> = Mutex::default();
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some((case, build)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            let tally = cases[*case].check(&workshops[*case], build);
            let mut tallies = tallies.lock().expect("no comparison failed");
            let empty = || (0, build.rule, Tally::default());
            let sum = tallies.entry(build.name).or_insert_with(empty);
            sum.0 += cases[*case].models.len();
            sum.2.add(tally);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    for (name, (models, rule, tally)) in tallies.into_inner().expect("no comparison failed") {
        print!(
            "{what}: {name}: {models} models, {} functions ({} with transcendental functions), {} \
             results, {} of equal bits",
            tally.functions, tally.transcendental, tally.results, tally.equal_bits
        );
        match rule {
            Rule::SameBits => println!(),
            Rule::UlpsATerm => {
                println!(
                    "; worst {:.2} of what is allowed, {}",
                    tally.worst.0, tally.worst.1
                );
            }
        }
    }
}

#[test]
fn generated_code_of_shipped_models_equals_the_interpreter() {
    let n_points = tools::thorough_or(2_000, 1_000);
    // Contracted code takes the longest to compile.
    let [all, some] = [models::shipped(), some_shipped(3)]
        .map(|models| Case::new(models, n_points, Form::Automatic));
    check_all("shipped", &[all, some], |case| match case {
        0 => Build::exact(),
        _ => Build::inexact(),
    });
}

#[test]
fn generated_code_of_random_models_equals_the_interpreter() {
    let seeds: Vec<u64> = (0..n_random_models()).collect();
    let cases: Vec<Case> = seeds
        .chunks(n_models_a_program() as usize)
        .map(|seeds| {
            let models = seeds.iter().map(|seed| models::random(*seed)).collect();
            Case::new(models, 50, Form::Automatic)
        })
        .collect();
    check_all("random", &cases, |case| {
        if case == 0 && tools::is_thorough() {
            Build::all()
        } else {
            Build::exact()
        }
    });
}

#[test]
fn generated_code_of_a_large_polynomial_equals_the_interpreter() {
    let mut case = Case::new(vec![models::cubic()], 50, Form::Automatic);
    // Zeros have the same sign as the interpreter's.
    for (function, points) in case.functions.iter().zip(&mut case.points) {
        points[..function.input_len()].fill(0.0);
    }
    case.interpret();
    let is_of_lanes = |s: &Statement| matches!(s, Statement::Lanes { .. });
    let mut programs = case.functions.iter().map(|function| &function.program);
    assert!(programs.any(|program| program.statements.iter().any(is_of_lanes)));
    check_all("cubic", &[case], |_| {
        tools::thorough_or(Build::all(), Build::exact())
    });
    let workshop = Workshop::new(&[models::cubic()], Form::Automatic);
    workshop.run_c_selftest(&Build::c_plain(), "cubic");
    workshop.run_rust_selftest("cubic");
}

#[test]
fn random_models_have_all_shapes() {
    let models: Vec<ReducedModel> = (0..200).map(models::random).collect();
    let some = |what: &str, is: &dyn Fn(&ReducedModel) -> bool| {
        let count = models.iter().filter(|model| is(model)).count();
        assert!(count >= 5, "{what}: {count} models");
    };
    for d in 1..=8 {
        some("dimension", &|model| model.latent_dim() == d);
    }
    for count in 1..=3 {
        some("phases", &|model| model.phases().len() == count);
    }
    let has = |model: &ReducedModel, part: &str| {
        let terms = model.library().terms();
        terms.iter().any(|term| term.text.contains(part))
    };
    for part in [
        "sin(", "tanh(", "exp(", "log(", "sqrt(", "abs(", "^1.5", "^3",
    ] {
        some(part, &|model| has(model, part));
    }
    some("no inputs", &|model| !has(model, "u"));
    some("no maps", &|model| model.encoder_map().is_err());
    let is_affine = |model: &ReducedModel| model.encoder_map().map(|m| m.as_affine().is_some());
    some("affine maps", &|model| is_affine(model) == Ok(true));
    some("curved encoder", &|model| is_affine(model) == Ok(false));
    some("an equation without terms", &|model| {
        let mut columns = model
            .phases()
            .iter()
            .flat_map(|phase| phase.xi.column_iter());
        columns.any(|column| column.iter().all(|xi| *xi == 0.0))
    });
    let density = |model: &ReducedModel| {
        let xi = &model.phases()[0].xi;
        model.phases()[0].active_count() as f64 / xi.len() as f64
    };
    some("dense Xi", &|model| density(model) > 0.8);
    some("sparse Xi", &|model| density(model) < 0.2);
}

#[test]
fn generated_code_with_tables_equals_the_interpreter() {
    let random_models = (1000..1000 + n_models_a_program()).map(models::random);
    let shipped = tools::thorough_or(some_shipped(3), Vec::new());
    let models = shipped.into_iter().chain(random_models).collect();
    let cases = [Case::new(models, 100, Form::Tables)];
    check_all("tables", &cases, |_| {
        let mut builds = Build::exact();
        builds.extend(tools::thorough_or(Some(Build::c_fast()), None));
        builds
    });
}

#[test]
fn generated_maps_of_nonlinear_models_equal_the_interpreter() {
    let n_models = tools::thorough_or(8, 3);
    let models = (0..n_models).map(models::random_nonlinear).collect();
    let cases = [Case::new(models, 50, Form::Automatic)];
    check_all("nonlinear", &cases, |_| {
        tools::thorough_or(Build::all(), Build::exact())
    });
    let workshop = cases[0].workshop();
    for model in &cases[0].models {
        workshop.run_c_selftest(&Build::c_plain(), model.identifier().as_str());
    }
    workshop.run_rust_selftest(cases[0].models[0].identifier().as_str());
}

#[test]
fn lowered_maps_of_nonlinear_models_equal_the_models_own_evaluation() {
    for model in (0..40).map(models::random_nonlinear) {
        let n = model.state_dim().expect("an encoder");
        let mut random = Random(17);
        for _ in 0..20 {
            let mut vector = |len: usize| DVector::from_fn(len, |_, _| random.between(-2.0, 2.0));
            let (x, dx, u) = (vector(n), vector(n), vector(n));
            let d = model.latent_dim();
            let (z, dz, u_lat) = (vector(d), vector(d), vector(d));
            let tangent = model.tangent(&x).expect("full rank");
            let pairs = [
                (Map::Encode.lower(&model), vec![&x], model.encode(&x)),
                (
                    Map::EncodeVelocity.lower(&model),
                    vec![&x, &dx],
                    Ok(&tangent.encode * &dx),
                ),
                (Map::Decode.lower(&model), vec![&z], model.decode(&z)),
                (
                    Map::DecodeVelocity.lower(&model),
                    vec![&z, &dz],
                    model.decoder_jacobian(&z).map(|jacobian| jacobian * &dz),
                ),
                (
                    Map::LiftInput.lower(&model),
                    vec![&x, &u_lat],
                    Ok(&tangent.lift * &u_lat),
                ),
                (
                    Map::ProjectInput.lower(&model),
                    vec![&x, &u],
                    Ok(&tangent.project * &u),
                ),
            ];
            for (program, arguments, expected) in pairs {
                let (program, expected) = (program.expect("lowers"), expected.expect("fits"));
                let mut found = DVector::zeros(expected.len());
                let read: Vec<&[f64]> = arguments.iter().map(|v| v.as_slice()).collect();
                Interpreter::new(&program).run(&read, &mut [found.as_mut_slice()]);
                let error = (&found - &expected).amax();
                let scale = 1.0 + expected.amax();
                assert!(
                    error <= 1e-9 * scale,
                    "{} {}: {found} {expected}",
                    model.name(),
                    program.name
                );
            }
            let back = &tangent.project * (&tangent.lift * &u_lat);
            assert!((back - &u_lat).amax() < 1e-9, "{}", model.name());
        }
    }
}

#[test]
fn tables_and_straight_lines_agree() {
    for model in models::shipped()
        .into_iter()
        .chain((0..n_models_a_program()).map(models::random))
    {
        let [lines, tables] =
            [Form::StraightLine, Form::Tables].map(|form| functions_of(&model, 50, form));
        for (lines, tables) in lines.iter().zip(&tables) {
            let points = lines.points(&mut Random(5));
            let (found, expected) = (tables.interpret(&points), lines.interpret(&points));
            let len = lines.output_len();
            for (found, expected) in found.chunks(len).zip(expected.chunks(len)) {
                let scale = expected.iter().fold(1.0_f64, |scale, x| scale.max(x.abs()));
                for (f, e) in found.iter().zip(expected) {
                    let same = (f - e).abs() <= 1e-11 * scale || (f.is_nan() && e.is_nan());
                    assert!(same, "{}_{}: {f} against {e}", lines.model, lines.name);
                }
            }
        }
    }
}

#[test]
fn generated_code_beyond_the_reduction_limit_equals_the_interpreter() {
    let mut case = Case::new(models::shipped(), 200, Form::Automatic);
    for (function, points) in case.functions.iter().zip(&mut case.points) {
        for (k, x) in points.iter_mut().enumerate() {
            // Far points only for accelerations: a step's intermediate states may overflow.
            if k % 3 == 0 && !function.is_step() {
                *x *= 1e5;
            }
        }
    }
    case.interpret();
    check_all("beyond", &[case], |_| {
        tools::thorough_or(Build::exact(), vec![Build::c()])
    });
}

#[test]
fn selftests_of_generated_code_pass() {
    let models = models::shipped();
    let workshop = Workshop::new(&models, Form::default());
    for model in models.iter().step_by(tools::thorough_or(1, 3)) {
        workshop.run_c_selftest(&Build::c_plain(), model.identifier().as_str());
    }
    for model in models.iter().filter(|model| model.latent_dim() <= 2) {
        workshop.run_rust_selftest(model.identifier().as_str());
    }
}

#[test]
fn emission_twice_gives_identical_bytes() {
    let models: Vec<ReducedModel> = models::shipped();
    let (first, second) = (
        Workshop::new(&models, Form::default()),
        Workshop::new(&models, Form::default()),
    );
    let (first, second) = (contents(first.path()), contents(second.path()));
    assert!(first.len() >= 7 * models.len());
    assert_eq!(first, second);
}

/// Random `(z, dz, u_lat)`.
fn random_point(random: &mut Random, d: usize) -> [DVector<f64>; 3] {
    std::array::from_fn(|_| DVector::from_fn(d, |_, _| random.between(-2.0, 2.0)))
}

#[test]
fn compiled_accelerations_equal_the_models_own_evaluation() {
    let random_models = (0..SOME_MODELS).map(models::random);
    for model in models::shipped().into_iter().chain(random_models) {
        let mut compiled = CompiledModel::new(&model).expect("lowers");
        let d = model.latent_dim();
        let mut random = Random(3);
        let mut ddz = vec![0.0; d];
        for phase in 0..model.phases().len() {
            for _ in 0..50 {
                let [z, dz, u] = random_point(&mut random, d);
                compiled.ddz(phase, z.as_slice(), dz.as_slice(), u.as_slice(), &mut ddz);
                let expected = model.ddz(phase, &z, &dz, &u).expect("dimensions fit");
                let theta = model
                    .library()
                    .evaluate(&z, &dz, &u)
                    .expect("dimensions fit");
                for row in 0..d {
                    let column = model.phases()[phase].xi.column(row).into_owned();
                    let terms = column.iter().zip(theta.iter());
                    let size: f64 = terms.map(|(c, t)| (c * t).abs()).sum();
                    let difference = (ddz[row] - expected[row]).abs();
                    assert!(
                        difference <= 1e-12 * size || (size.is_nan() && ddz[row].is_nan()),
                        "{}: {} against {}",
                        model.name(),
                        ddz[row],
                        expected[row]
                    );
                }
            }
        }
    }
}

#[test]
fn compiled_jacobians_equal_symbolic_derivatives_and_finite_differences() {
    let random_models = (0..SOME_MODELS).map(models::random);
    for model in models::shipped().into_iter().chain(random_models) {
        for phase in 0..model.phases().len() {
            check_jacobian(&model, phase);
        }
    }
}

/// The accelerations of one phase as canonical sums, in a clone of the pool.
fn sums(equations: &Equations<'_>, phase: usize) -> (ExprPool, Vec<ExprId>) {
    let mut pool = equations.pool.clone();
    let phase = equations.phase(phase).expect("the phase exists");
    let mut sum = |output| {
        let mut products = Vec::new();
        for (coefficient, term) in phase.summands(equations, output) {
            let factor = pool.number(coefficient);
            products.push(pool.mul(factor, term.expr));
        }
        pool.sum(&products)
    };
    let sums = (0..phase.ddz.len()).map(&mut sum).collect();
    (pool, sums)
}

fn check_jacobian(model: &ReducedModel, phase: usize) {
    let d = model.latent_dim();
    let mut compiled = CompiledModel::new(model).expect("lowers");
    let (mut pool, sums) = sums(&Equations::as_learned(model), phase);
    let mut random = Random(11);
    let mut ddz = vec![0.0; d];
    let mut jacobian = nalgebra::DMatrix::zeros(d, 3 * d);
    let [z, dz, u] = random_point(&mut random, d);
    let point: Vec<f64> = [z.as_slice(), dz.as_slice(), u.as_slice()].concat();
    compiled.jacobian(
        phase,
        &point[..d],
        &point[d..2 * d],
        &point[2 * d..],
        &mut ddz,
        &mut jacobian,
    );
    for (col, variable) in LatentVariable::all(d).enumerate() {
        let step = 1e-6;
        let mut side = |sign: f64| {
            let mut at = point.clone();
            at[col] += sign * step;
            let mut ddz = vec![0.0; d];
            compiled.ddz(phase, &at[..d], &at[d..2 * d], &at[2 * d..], &mut ddz);
            ddz
        };
        let (above, below) = (side(1.0), side(-1.0));
        let symbol = model.library().symbol(variable).expect("a variable");
        for row in 0..d {
            let exact = pool.derivative(sums[row], symbol);
            let value_of = |symbol| {
                let position = LatentVariable::all(d)
                    .position(|v| model.library().symbol(v) == Some(symbol))
                    .expect("a variable of the model");
                point[position]
            };
            let exact = pool.evaluate(exact, &value_of);
            let found = jacobian[(row, col)];
            let name = format!("{} phase {phase} entry ({row}, {col})", model.name());
            assert!(
                (found - exact).abs() <= 1e-11 * (1.0 + exact.abs()),
                "{name}: {found} {exact}"
            );
            let difference = (above[row] - below[row]) / (2.0 * step);
            let tolerance = 1e-4 * (1.0 + exact.abs() + ddz[row].abs());
            assert!(
                (found - difference).abs() <= tolerance,
                "{name}: {found} {difference}"
            );
        }
    }
}

#[test]
fn jacobian_pattern_lists_each_entry_once_in_row_major_order() {
    for model in models::shipped() {
        for phase in 0..model.phases().len() {
            let form = Form::default();
            let (program, pattern) =
                dynamics_jacobian(&Equations::of(&model), phase, form).expect("lowers");
            let places: Vec<(usize, usize)> = pattern
                .rows
                .iter()
                .copied()
                .zip(pattern.cols.iter().copied())
                .collect();
            assert!(places.is_sorted(), "{places:?}");
            assert!(places.windows(2).all(|pair| pair[0] != pair[1]));
            let stored = program.outputs.get(1).map_or(0, |slot| slot.len);
            assert_eq!(stored, places.len());
        }
    }
}
