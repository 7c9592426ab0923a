//! The structured solver in C is generated from its Rust: it is up to date, has the Rust's bits on random programs, and
//! changes if the Rust changes.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use romc::solver::{Cost, Links, Outcome, Program, Real, RowMatrices, Settings, Shape, Stage};
use romc_translate::{Fault, Source, Unit, controller, translate};

use crate::emitted::STRICT;
use crate::programs::{root, succeed};
use crate::random::Random;
use crate::steps::made_of_changed;

const HORIZON: usize = 10;

/// A random program as the numbers that `solve_programs.c` reads.
fn random_program(
    random: &mut Random,
    nx: usize,
    nu: usize,
    number: usize,
    links: usize,
) -> Vec<f64> {
    let tightness = [0.02, 1.0, 2.0, 4.0][number % 4];
    let (input, pairs, soft) = (6 + nu, 2, [3, 0][number / 4 % 2]);
    let counts = [input, soft, links, pairs];
    let mut values: Vec<f64> = counts.map(|count| count as f64).into();
    // Sometimes a cost is not convex, or a number is not finite.
    let curvature = if number % 13 == 12 { -0.3 } else { 0.1 };
    let positive = |random: &mut Random| random.signed().abs();
    values.extend((0..nx).map(|_| 0.5 + positive(random)));
    values.extend((0..nx).map(|_| 1.5 + positive(random)));
    values.extend((0..nu).map(|_| curvature + positive(random)));
    values.extend([30.0, 1e-8]);
    values.extend((0..nx).map(|_| 2.0 * random.signed()));
    if number % 29 == 28 {
        *values.last_mut().expect("numbers") = f64::NAN;
    }
    for _ in 0..HORIZON {
        for i in 0..nx * nx {
            let on_diagonal = if i % (nx + 1) == 0 { 0.95 } else { 0.0 };
            values.push(on_diagonal + 0.12 * random.signed());
        }
        values.extend((0..nx * nu).map(|_| random.signed()));
        values.extend((0..nx).map(|_| 0.1 * random.signed()));
        for (count, pairs) in [(input, pairs), (links, 0)] {
            for row in 0..count {
                let is_opposite = row % 2 == 1 && row < 2 * pairs;
                let from = values.len() - nu;
                values.extend_from_within(from..);
                for value in &mut values[from + nu..] {
                    *value = if is_opposite {
                        -*value
                    } else {
                        random.signed()
                    };
                }
            }
        }
        let slack_row = if soft > 0 { input + soft } else { usize::MAX };
        let rows = input + soft + usize::from(soft > 0) + links;
        values.extend((0..rows).map(|row| match row == slack_row {
            true => 0.0,
            false => (0.3 + positive(random)) / tightness,
        }));
    }
    values.extend((0..soft * nu).map(|_| random.signed()));
    values
}

/// The numbers of a program one after the other.
struct Reader<'a>(&'a [f64]);

impl Reader<'_> {
    fn count(&mut self) -> usize {
        self.numbers::<f64>(1)[0] as usize
    }

    fn numbers<T: Real>(&mut self, count: usize) -> Vec<T> {
        let (taken, rest) = self.0.split_at(count);
        self.0 = rest;
        taken.iter().map(|value| T::of(*value)).collect()
    }

    fn array<T: Real, const N: usize>(&mut self) -> [T; N] {
        let numbers = self.numbers(N);
        std::array::from_fn(|i| numbers[i])
    }

    fn rows<T: Real, const N: usize>(&mut self, count: usize) -> Vec<[T; N]> {
        (0..count).map(|_| self.array()).collect()
    }
}

/// Output of `solve_programs.c` for a program, by the library.
fn solved<T: Real, const NX: usize, const NU: usize, const LINKED: bool>(
    values: &[f64],
) -> Vec<f64> {
    let mut reader = Reader(values);
    let mut counts = [0; 4];
    counts.fill_with(|| reader.count());
    let [input, soft, link, pairs] = counts;
    let shape = Shape {
        input,
        soft,
        link,
        pairs,
    };
    let cost = Cost {
        state: reader.array(),
        terminal: reader.array(),
        input: reader.array(),
        slack: reader.array::<T, 1>()[0],
    };
    let softness = reader.array::<T, 1>()[0];
    let x0: [T; NX] = reader.array();
    let mut stages = [Stage::<T, NX, NU>::zeros(); HORIZON];
    let mut memory = vec![T::ZERO; HORIZON * shape.memory()];
    let (mut inputs, mut links) = (Vec::new(), Vec::new());
    for (place, stage) in stages.iter_mut().enumerate() {
        stage.input_rows = place * input;
        stage.a = std::array::from_fn(|_| reader.array());
        stage.b = std::array::from_fn(|_| reader.array());
        stage.c = reader.array();
        inputs.extend(reader.rows(input));
        links.extend(reader.rows(link));
        let bounds = reader.numbers(shape.rows());
        memory[place * shape.memory()..][..shape.rows()].copy_from_slice(&bounds);
    }
    let softs = reader.rows(soft);
    let mut gains = [[[T::ZERO; NU]; NU]; HORIZON];
    let mut program = Program {
        stages: &mut stages,
        rows: &mut memory,
        first: 3,
        shape,
        matrices: RowMatrices {
            input: &inputs,
            soft: &softs,
        },
        links: Links::<'_, T, NU, LINKED> {
            rows: &links,
            gains: &mut gains,
            softness,
        },
        cost,
    };
    let settings = Settings {
        max_iterations: 40,
        tolerance: T::of(1e-9),
        gap: T::of(1e-8),
        accepted_residual: T::of(1e-6),
    };
    let mut out = Vec::new();
    for (turn, share) in [1.0, 0.7, 0.4].into_iter().enumerate() {
        out.push(f64::from(program.prepare()));
        let report = program.solve(&x0.map(|x| T::of(share) * x), turn > 0, &settings);
        out.push(f64::from(report.outcome as u8));
        out.push(f64::from(report.iterations));
        let residuals = report.residuals;
        out.extend([residuals.primal, residuals.dual, residuals.gap].map(Real::wide));
        for k in 0..HORIZON {
            let stage = program.stages[program.at(k)];
            out.extend(stage.v.map(Real::wide));
            out.extend(stage.x.map(Real::wide));
            out.push(stage.t.wide());
            out.extend(program.multipliers(k).iter().map(|y| y.wide()));
        }
        program.shift();
    }
    out
}

/// Results of the C of these files for programs, compiled for these sizes and this precision.
fn solved_in_c(
    folder: &Path,
    files: &[(&str, String)],
    (nx, nu, real, linked): (usize, usize, &str, bool),
    programs: &[Vec<f64>],
) -> Vec<f64> {
    for (path, text) in files {
        let name = Path::new(path).file_name().expect("a file");
        fs::write(folder.join(name), text).expect("written");
    }
    let program = folder.join("program");
    succeed(
        Command::new("cc")
            .args(STRICT)
            .args(["-O2", "-ffp-contract=off"])
            .args([
                format!("-DNX={nx}"),
                format!("-DNU={nu}"),
                format!("-DREAL={real}"),
            ])
            .arg(format!("-DLINKED={}", u8::from(linked)))
            .arg("-I.")
            .arg(root().join("tests/controller_c/solve_programs.c"))
            .arg("-o")
            .arg(&program)
            .current_dir(folder),
    );
    let bytes: Vec<u8> = (programs.iter().flatten())
        .flat_map(|value| value.to_ne_bytes())
        .collect();
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it was compiled");
    let mut stdin = child.stdin.take().expect("piped");
    let writer = std::thread::spawn(move || stdin.write_all(&bytes));
    let output = child.wait_with_output().expect("it ends");
    writer.join().expect("no panic").expect("it reads all");
    assert!(output.status.success());
    let numbers = output.stdout.chunks_exact(8);
    let number = |bytes: &[u8]| f64::from_ne_bytes(bytes.try_into().expect("8 bytes"));
    numbers.map(number).collect()
}

/// Compares C and Rust on random programs; returns how many were solved with iterations.
fn compare<T: Real, const NX: usize, const NU: usize, const LINKED: bool>(real: &str) -> usize {
    let mut random = Random::new(NX as u64);
    let links = if LINKED { 3 } else { 0 };
    let programs: Vec<Vec<f64>> = (0..400)
        .map(|number| random_program(&mut random, NX, NU, number, links))
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let files = controller(root()).expect("the solver is in the subset");
    let found = solved_in_c(folder.path(), &files, (NX, NU, real, LINKED), &programs);
    let mut rest = found.as_slice();
    let mut iterated = 0;
    for (number, program) in programs.iter().enumerate() {
        let expected = solved::<T, NX, NU, LINKED>(program);
        let (own, others) = rest.split_at(expected.len());
        let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
        let differs = own.iter().zip(&expected).position(|pair| !is_same(pair));
        assert_eq!(differs, None, "program {number} of {NX}, {NU}, {real}");
        iterated += usize::from(own[1] == f64::from(Outcome::Solved as u8) && own[2] > 0.0);
        rest = others;
    }
    assert!(rest.is_empty());
    iterated
}

#[test]
fn solver_in_c_is_what_its_rust_says() {
    for (path, text) in controller(root()).expect("the controller is in the subset") {
        let committed = fs::read_to_string(root().join(path)).expect("committed");
        assert!(
            committed == text,
            "{path}: run `cargo run -p romc-translate`"
        );
    }
}

#[test]
fn solver_in_c_has_the_bits_of_its_rust_on_random_programs_of_two_sizes_in_both_precisions() {
    let iterated = [
        compare::<f64, 8, 4, false>("double"),
        compare::<f64, 8, 4, true>("double"),
        compare::<f64, 6, 3, true>("double"),
        compare::<f64, 12, 6, false>("double"),
        compare::<f32, 8, 4, false>("float"),
    ];
    assert!(iterated.iter().all(|count| *count > 20), "{iterated:?}");
}

#[test]
fn constant_of_the_rust_changes_the_c() {
    let mut random = Random::new(1);
    let programs: Vec<Vec<f64>> = (0..40)
        .map(|number| random_program(&mut random, 8, 4, 4 * number + 1, 0))
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let mut results = Vec::new();
    for margin in ["1e-3", "4e-3"] {
        let to = format!("LEAST_MARGIN: f64 = {margin}");
        let file = "src/control/solver/point.rs";
        let files = made_of_changed(file, "LEAST_MARGIN: f64 = 1e-3", &to);
        let sizes = (8, 4, "double", false);
        results.push(solved_in_c(folder.path(), &files, sizes, &programs));
    }
    assert_eq!(results[0].len(), results[1].len());
    let pairs = results[0].iter().zip(&results[1]);
    let differing = pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert!(differing > 100, "{differing}");
}

#[test]
fn constructs_outside_the_subset_are_named_with_their_place() {
    for (body, line, word) in [
        (
            "    let double = |x: usize| 2 * x;\n    double(n)",
            2,
            "expression",
        ),
        (
            "    let mut sum = 0;\n    for i in [1, 2] {\n        sum += i;\n    }\n    sum",
            3,
            "loop",
        ),
        (
            "    match n {\n        0 => 1,\n        _ => n,\n    }",
            2,
            "expression",
        ),
        ("    elsewhere(n)", 2, "function from elsewhere"),
        ("    let n = 1;\n    n", 2, "second variable"),
        (
            "    if n > 0 {\n        return count(n - 1);\n    }\n    n",
            1,
            "calls itself",
        ),
    ] {
        let text = format!("fn count(n: usize) -> usize {{\n{body}\n}}\n");
        let fault = fault_of(&text, "test_count(1);");
        assert_eq!(
            (fault.path.as_str(), fault.line),
            ("count.rs", line),
            "{fault}"
        );
        assert!(fault.message.contains(word), "{fault}");
    }
}

/// The error in a piece of Rust whose functions are called by C.
fn fault_of(text: &str, user: &str) -> Fault {
    let source = |path: &str, text: &str| Source {
        path: path.to_owned(),
        text: text.to_owned(),
    };
    let unit = Unit {
        prefix: "test",
        users: &[source("user.askama", user)],
        ..Unit::default()
    };
    translate(&[source("count.rs", text)], &unit).expect_err(text)
}

#[test]
fn functions_and_types_that_are_left_out_are_named_where_the_c_needs_them() {
    let plain = "fn count(n: usize) -> usize {\n    n\n}\n";
    for (text, user, place) in [
        (
            plain,
            "/* A template. */\nint a = test_cuont(1);",
            "user.askama:2: no such function: `test_cuont`",
        ),
        (
            "fn count<const N: usize>(x: &[f64; N]) -> usize {\n    N\n}\n",
            "test_count(x);",
            "user.askama:1: no such function: `test_count`",
        ),
        (
            "fn count(\n    n: Count,\n) -> usize {\n    1\n}\n",
            "test_count(n);",
            "count.rs:2: an unknown type `Count`",
        ),
        (
            "fn count(x: [f64; 2]) -> usize {\n    1\n}\n",
            "test_count(x);",
            "count.rs:1: an array by value: pass a reference",
        ),
        (
            "struct Count {}\nimpl Count {\n    fn of(n: (usize, usize)) -> usize {\n        1\n    }\n}\n",
            "test_count_of(n);",
            "count.rs:3: a type outside the subset",
        ),
        (
            "struct Count {\n    n: usize,\n    of: (f64, f64),\n}\nfn count(c: &Count) -> usize {\n    1\n}\n",
            "test_count(&c);",
            "count.rs:3: a type outside the subset",
        ),
        (
            "enum Count {\n    None,\n    Some(usize),\n}\nfn count(c: Count) -> usize {\n    1\n}\n",
            "test_count(c);",
            "count.rs:1: an enum with data",
        ),
        (
            "settings! {\n    step => count: Count,\n}\nfn count(n: usize) -> usize {\n    n\n}\n",
            "test_count(1);",
            "count.rs:1: an unknown type `Count`",
        ),
    ] {
        assert_eq!(fault_of(text, user).to_string(), place, "{text}");
    }
}
