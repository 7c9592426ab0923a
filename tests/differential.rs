//! Generated C and Rust against the interpreter, and the interpreter against the model.

#[path = "differential/drivers.rs"]
mod drivers;
#[path = "differential/functions.rs"]
mod functions;
#[path = "differential/models.rs"]
mod models;
#[path = "differential/single.rs"]
mod single;

use drivers::{Workshop, c_compilers, contents};
use functions::{Function, Random, functions as functions_of};
use nalgebra::DVector;
use romc::ir::Interpreter;
use romc::lower::{self, Form, LowerOptions, dynamics_jacobian};
use romc::model::{LatentVariable, ReducedModel};
use romc::sim::CompiledModel;

const N_POINTS: usize = 10_000;

/// Random models compared in one run; more on request.
fn n_random_models() -> u64 {
    let asked = std::env::var("ROMC_RANDOM_MODELS").ok();
    asked.map_or(24, |count| {
        count.parse().expect("ROMC_RANDOM_MODELS is a number")
    })
}

/// Functions, points and expected results of some models.
struct Case {
    models: Vec<ReducedModel>,
    functions: Vec<Function>,
    points: Vec<Vec<f64>>,
    expected: Vec<Vec<f64>>,
    options: LowerOptions,
}

impl Case {
    fn new(models: Vec<ReducedModel>, n_points: usize, form: Form) -> Self {
        let options = LowerOptions { form };
        let functions: Vec<Function> = models
            .iter()
            .flat_map(|model| functions_of(model, n_points, &options))
            .collect();
        let mut random = Random(7);
        let points: Vec<Vec<f64>> = functions.iter().map(|f| f.points(&mut random)).collect();
        let expected = functions
            .iter()
            .zip(&points)
            .map(|(f, p)| f.interpret(p))
            .collect();
        Self {
            models,
            functions,
            points,
            expected,
            options,
        }
    }

    fn workshop(&self) -> Workshop {
        Workshop::new(&self.models, &self.options)
    }

    fn assert_same_bits(&self, found: &[Vec<f64>], by: &str) {
        for ((function, found), expected) in self.functions.iter().zip(found).zip(&self.expected) {
            for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
                let same =
                    found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan());
                assert!(
                    same,
                    "{by}: {}_{}, result {k}: found {found:e}, interpreter {expected:e}",
                    function.model, function.name
                );
            }
        }
    }

    /// Contracted operations round less often, so results differ, by a little.
    fn assert_close(&self, found: &[Vec<f64>], by: &str) {
        for ((function, found), expected) in self.functions.iter().zip(found).zip(&self.expected) {
            let len = function.output_len();
            for (found, expected) in found.chunks(len).zip(expected.chunks(len)) {
                let scale = expected.iter().fold(1.0_f64, |scale, x| scale.max(x.abs()));
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (found - expected).abs() <= 1e-11 * scale
                            || (found.is_nan() && expected.is_nan()),
                        "{by}: {}_{}: found {found:e}, interpreter {expected:e}",
                        function.model,
                        function.name
                    );
                }
            }
        }
    }
}

fn check_c_and_rust(case: &Case) {
    let workshop = case.workshop();
    for compiler in c_compilers() {
        let flags = ["-O1", "-ffp-contract=off"];
        let found = workshop.run_c(&compiler, &flags, &case.functions, &case.points);
        case.assert_same_bits(&found, &format!("{compiler} -ffp-contract=off"));
    }
    let found = workshop.run_rust(&case.functions, &case.points);
    case.assert_same_bits(&found, "rustc");
    let flags = ["-O3", "-march=native", "-ffp-contract=fast"];
    let compiler = &c_compilers()[0];
    let found = workshop.run_c(compiler, &flags, &case.functions, &case.points);
    case.assert_close(&found, &format!("{compiler} -O3 -march=native"));
}

#[test]
fn generated_code_of_shipped_models_equals_the_interpreter_bit_for_bit() {
    check_c_and_rust(&Case::new(models::shipped(), N_POINTS, Form::Automatic));
}

#[test]
fn generated_code_of_random_models_equals_the_interpreter_bit_for_bit() {
    let models = (0..n_random_models()).map(models::random).collect();
    check_c_and_rust(&Case::new(models, 50, Form::Automatic));
}

#[test]
fn generated_code_with_tables_equals_the_interpreter_bit_for_bit() {
    let random_models = (1000..1000 + n_random_models()).map(models::random);
    let models = models::shipped().into_iter().chain(random_models).collect();
    check_c_and_rust(&Case::new(models, 100, Form::Tables));
}

#[test]
fn generated_maps_of_nonlinear_models_equal_the_interpreter_bit_for_bit() {
    let models = (0..5).map(models::random_nonlinear).collect();
    let case = Case::new(models, 50, Form::Automatic);
    check_c_and_rust(&case);
    let workshop = case.workshop();
    for model in &case.models {
        workshop.run_c_selftest(&c_compilers()[0], model.identifier().as_str());
    }
    workshop.run_rust_selftest(case.models[0].identifier().as_str());
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
            let projected = model.project_input_at(&x, &u).expect("full rank");
            let pairs = [
                (lower::encode(&model), vec![&x], model.encode(&x)),
                (
                    lower::encode_velocity(&model),
                    vec![&x, &dx],
                    model.encode_velocity_at(&x, &dx),
                ),
                (lower::decode(&model), vec![&z], model.decode(&z)),
                (
                    lower::decode_velocity(&model),
                    vec![&z, &dz],
                    model.decode_velocity_at(&z, &dz),
                ),
                (
                    lower::lift_input(&model),
                    vec![&x, &u_lat],
                    model.lift_input_at(&x, &u_lat),
                ),
                (lower::project_input(&model), vec![&x, &u], Ok(projected)),
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
                    program.name()
                );
            }
            let lifted = model.lift_input_at(&x, &u_lat).expect("fits");
            let back = model.project_input_at(&x, &lifted).expect("full rank");
            assert!((back - &u_lat).amax() < 1e-9, "{}", model.name());
        }
    }
}

#[test]
fn tables_and_straight_lines_agree() {
    for model in models::shipped()
        .into_iter()
        .chain((0..n_random_models()).map(models::random))
    {
        let [lines, tables] = [Form::StraightLine, Form::Tables]
            .map(|form| functions_of(&model, 50, &LowerOptions { form }));
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
    case.expected = case
        .functions
        .iter()
        .zip(&case.points)
        .map(|(function, points)| function.interpret(points))
        .collect();
    let workshop = case.workshop();
    let flags = ["-O3", "-ffp-contract=off"];
    let found = workshop.run_c(&c_compilers()[0], &flags, &case.functions, &case.points);
    case.assert_same_bits(&found, "C");
    let found = workshop.run_rust(&case.functions, &case.points);
    case.assert_same_bits(&found, "Rust");
}

#[test]
fn selftests_of_generated_code_pass() {
    let models = models::shipped();
    let workshop = Workshop::new(&models, &LowerOptions::default());
    for model in &models {
        workshop.run_c_selftest(&c_compilers()[0], model.identifier().as_str());
    }
    for model in models.iter().filter(|model| model.latent_dim() <= 2) {
        workshop.run_rust_selftest(model.identifier().as_str());
    }
}

#[test]
fn emission_twice_gives_identical_bytes() {
    let models: Vec<ReducedModel> = models::shipped();
    let (first, second) = (
        Workshop::new(&models, &LowerOptions::default()),
        Workshop::new(&models, &LowerOptions::default()),
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
    let random_models = (0..n_random_models()).map(models::random);
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
    let random_models = (0..n_random_models()).map(models::random);
    for model in models::shipped().into_iter().chain(random_models) {
        for phase in 0..model.phases().len() {
            check_jacobian(&model, phase);
        }
    }
}

fn check_jacobian(model: &ReducedModel, phase: usize) {
    let d = model.latent_dim();
    let mut compiled = CompiledModel::new(model).expect("lowers");
    let equations = model.equations(phase).expect("the phase exists");
    let mut pool = equations.pool.clone();
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
            let exact = pool.derivative(equations.ddz[row], symbol);
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
            let options = LowerOptions::default();
            let (program, pattern) = dynamics_jacobian(&model, phase, &options).expect("lowers");
            let places: Vec<(usize, usize)> = pattern
                .rows
                .iter()
                .copied()
                .zip(pattern.cols.iter().copied())
                .collect();
            assert!(places.is_sorted(), "{places:?}");
            assert!(places.windows(2).all(|pair| pair[0] != pair[1]));
            let stored = program.outputs().get(1).map_or(0, |slot| slot.len);
            assert_eq!(stored, places.len());
        }
    }
}
