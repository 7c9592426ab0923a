//! The structured solver against clarabel.

use crate::synthetic::unwatched;
use romc::evaluate::{ReferenceInput, along_recording};
use romc::mpc::{
    Cone, ConeProgram, Lift, MpcSettings, Outcome, QpSettings, QpSolver, Solver, sparse,
};
use romc::solver::{self, Cost, Links, Program, Real, RowMatrices, Settings, Shape, Stage};

use crate::random::Random;

const HORIZON: usize = 12;
const NX: usize = 6;
const NU: usize = 3;
const SHAPE: Shape = Shape {
    input: 5,
    soft: 3,
    link: 0,
    pairs: 2,
};
/// Rows of a stage, and those that link its input to the one before.
const ROWS: usize = 9;
const LINKS: usize = 4;
const WIDTH: usize = NX + NU + 1;

/// A random program, in double precision.
struct RandomProgram {
    a: Vec<[[f64; NX]; NX]>,
    b: Vec<[[f64; NU]; NX]>,
    c: Vec<[f64; NX]>,
    input: Vec<[f64; NU]>,
    soft: Vec<[f64; NU]>,
    link: Vec<[f64; NU]>,
    bounds: Vec<f64>,
    link_bounds: Vec<f64>,
    x0: [f64; NX],
    state: [f64; NX],
    weight: [f64; NU],
}

const PRICE: f64 = 8.0;

/// The rows of all stages, `count` each, with so many pairs of opposite rows first.
fn with_opposites(mut rows: Vec<[f64; NU]>, count: usize, pairs: usize) -> Vec<[f64; NU]> {
    for stage in rows.chunks_exact_mut(count) {
        for [row, opposite] in stage[..2 * pairs].as_chunks_mut::<2>().0 {
            *opposite = row.map(|entry| -entry);
        }
    }
    rows
}

impl RandomProgram {
    fn new(random: &mut Random, tightness: f64) -> Self {
        let row = |random: &mut Random| std::array::from_fn::<f64, NU, _>(|_| random.signed());
        let rows = |count: usize, random: &mut Random| (0..count).map(|_| row(random)).collect();
        let stages = 0..HORIZON;
        let near_one = |i: usize, j: usize, random: &mut Random| {
            0.12 * random.signed() + if i == j { 0.95 } else { 0.0 }
        };
        let mut bounds = Vec::new();
        for _ in 0..HORIZON {
            for kind in 0..ROWS {
                // The slack's own row is kept at zero.
                let scale = if kind == 8 { 0.0 } else { 1.0 / tightness };
                bounds.push(scale * (0.3 + random.signed().abs()));
            }
        }
        let input: Vec<_> = rows(SHAPE.input * HORIZON, random);
        Self {
            a: (stages.clone())
                .map(|_| std::array::from_fn(|i| std::array::from_fn(|j| near_one(i, j, random))))
                .collect(),
            b: (stages.clone())
                .map(|_| std::array::from_fn(|_| row(random)))
                .collect(),
            c: stages
                .map(|_| std::array::from_fn(|_| 0.1 * random.signed()))
                .collect(),
            input: with_opposites(input, SHAPE.input, SHAPE.pairs),
            soft: rows(SHAPE.soft, random),
            bounds,
            link: Vec::new(),
            link_bounds: Vec::new(),
            x0: std::array::from_fn(|_| 2.0 * random.signed()),
            state: std::array::from_fn(|_| 0.5 + random.signed().abs()),
            weight: std::array::from_fn(|_| 0.1 + random.signed().abs()),
        }
    }

    /// The same with rows that link the inputs of consecutive stages.
    fn linked(random: &mut Random, tightness: f64) -> Self {
        let mut program = Self::new(random, tightness);
        for _ in 0..LINKS * HORIZON {
            let row = std::array::from_fn(|_| random.signed());
            program.link.push(row);
            let bound = (0.3 + random.signed().abs()) / tightness;
            program.link_bounds.push(bound);
        }
        program
    }

    /// Links of a stage.
    fn links(&self) -> usize {
        self.link.len() / HORIZON
    }

    /// Solves with the structured solver, `LINKED` if it has links; inputs of all stages and the report.
    fn structured<T: Real, const LINKED: bool>(
        &self,
        tolerance: f64,
        accepted: f64,
        softness: f64,
    ) -> (Vec<f64>, solver::Report<T>) {
        const FIRST: usize = 5;
        let shape = Shape {
            link: self.links(),
            ..SHAPE
        };
        let to = |value: f64| T::of(value);
        let all = |rows: &[[f64; NU]]| rows.iter().map(|row| row.map(to)).collect::<Vec<_>>();
        let (input, soft) = (all(&self.input), all(&self.soft));
        let mut stages = vec![Stage::<T, NX, NU>::zeros(); HORIZON];
        let mut memory = vec![T::ZERO; HORIZON * shape.memory()];
        // Links stand by places of the ring, of which the first stage has another than the first.
        let mut link = all(&self.link);
        link.rotate_right(FIRST * self.links());
        let mut gains = vec![[[T::ZERO; NU]; NU]; HORIZON];
        let state = self.state.map(to);
        let mut program = Program {
            stages: &mut stages,
            rows: &mut memory,
            first: FIRST,
            shape,
            matrices: RowMatrices {
                input: &input,
                soft: &soft,
            },
            links: Links::<'_, T, NU, LINKED> {
                rows: &link,
                gains: &mut gains,
                softness: to(softness),
            },
            cost: Cost {
                state,
                terminal: self.state.map(|weight| to(3.0 * weight)),
                input: self.weight.map(to),
                slack: to(PRICE),
            },
        };
        for k in 0..HORIZON {
            let place = program.at(k);
            let stage = &mut program.stages[place];
            stage.a = self.a[k].map(|row| row.map(to));
            stage.b = self.b[k].map(|row| row.map(to));
            stage.c = self.c[k].map(to);
            stage.input_rows = k * SHAPE.input;
            let links = &self.link_bounds[k * self.links()..][..self.links()];
            let bounds = self.bounds[k * ROWS..][..ROWS].iter().chain(links);
            let bounds = bounds.copied().map(to);
            program
                .bounds_mut(k)
                .iter_mut()
                .zip(bounds)
                .for_each(|(out, bound)| *out = bound);
        }
        assert!(program.prepare());
        let settings = Settings {
            max_iterations: 60,
            tolerance: to(tolerance),
            gap: T::ZERO,
            accepted_residual: to(accepted),
        };
        let report = program.solve(&self.x0.map(to), false, &settings);
        let inputs = (0..HORIZON)
            .flat_map(|k| program.stages[program.at(k)].v.map(Real::wide))
            .collect();
        (inputs, report)
    }

    /// Solves with clarabel: unknowns `v_0, x_1, t_1, v_1, ...`; none if no inputs keep the rows.
    fn conic(&self) -> Option<Vec<f64>> {
        let equalities = NX * HORIZON;
        let unlinked = (NX + ROWS) * HORIZON;
        let (n, m) = (WIDTH * HORIZON, unlinked + self.link.len());
        let mut entries = Vec::new();
        let mut add = |row: usize, col: usize, value: f64| entries.push((row, col, value));
        let mut b = vec![0.0; m];
        for k in 0..HORIZON {
            for i in 0..NX {
                let row = k * NX + i;
                (0..NU).for_each(|j| add(row, k * WIDTH + j, self.b[k][i][j]));
                add(row, k * WIDTH + NU + i, -1.0);
                b[row] = -self.c[k][i];
                for j in 0..NX {
                    if k == 0 {
                        b[row] -= self.a[0][i][j] * self.x0[j];
                    } else {
                        add(row, (k - 1) * WIDTH + NU + j, self.a[k][i][j]);
                    }
                }
            }
            for number in 0..ROWS {
                let row = equalities + k * ROWS + number;
                b[row] = self.bounds[k * ROWS + number];
                let (first, values) = match number {
                    0..5 => (0, self.input[k * SHAPE.input + number]),
                    5..8 => (NU, self.soft[number - 5]),
                    _ => (NU, [0.0; NU]),
                };
                (0..NU).for_each(|j| add(row, k * WIDTH + first + j, values[j]));
                if number >= 5 {
                    add(row, k * WIDTH + NU + NX, -1.0);
                }
            }
        }
        for (number, bound) in self.link_bounds.iter().enumerate() {
            let (k, row) = (number / LINKS, unlinked + number);
            b[row] = *bound;
            (0..NU).for_each(|j| add(row, k * WIDTH + j, self.link[number][j]));
            if k > 0 {
                (0..NU).for_each(|j| add(row, (k - 1) * WIDTH + j, -self.link[number - LINKS][j]));
            }
        }
        let a = sparse(m, n, &entries);
        let diagonal: Vec<_> = (0..n).map(|i| (i, i, 0.0)).collect();
        let mut p = sparse(n, n, &diagonal);
        let mut q = vec![0.0; n];
        for k in 0..HORIZON {
            let factor = if k + 1 == HORIZON { 3.0 } else { 1.0 };
            (0..NU).for_each(|j| p.set_entry((k * WIDTH + j, k * WIDTH + j), self.weight[j]));
            for i in 0..NX {
                let at = k * WIDTH + NU + i;
                p.set_entry((at, at), factor * self.state[i]);
            }
            q[k * WIDTH + NU + NX] = PRICE;
        }
        let program = ConeProgram {
            p,
            q,
            a,
            b,
            cones: vec![Cone::Zero(equalities), Cone::Nonnegative(m - equalities)],
        };
        let settings = QpSettings {
            tolerance: 1e-10,
            max_iterations: 200,
            accepted_residual: 1e-7,
            ..QpSettings::default()
        };
        let mut solver = QpSolver::new(program, settings).expect("a sound program");
        match solver.solve() {
            Outcome::Infeasible => return None,
            outcome => assert_eq!(outcome, Outcome::Solved),
        }
        let inputs = (0..HORIZON).flat_map(|k| solver.solution()[k * WIDTH..][..NU].to_vec());
        Some(inputs.collect())
    }
}

/// Largest difference of two solutions, relative to the larger of 1 and the largest expected number.
fn off(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(1.0_f64, |size, v| size.max(v.abs()));
    let pairs = found.iter().zip(expected);
    pairs.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs())) / size
}

#[test]
fn riccati_finds_clarabels_optimum_of_random_programs_in_both_precisions() {
    let mut random = Random::new(11);
    let (mut worst, mut worst_single, mut without, mut most) = (0.0_f64, 0.0_f64, 0, 0);
    let mut infeasible = 0;
    for number in 0..60 {
        let tightness = [0.02, 1.0, 2.0, 4.0][number % 4];
        let program = RandomProgram::new(&mut random, tightness);
        let Some(expected) = program.conic() else {
            infeasible += 1;
            continue;
        };
        let off = |found: &[f64]| off(found, &expected);
        let (found, report) = program.structured::<f64, false>(1e-11, 1e-7, 0.0);
        assert_eq!(
            report.outcome,
            solver::Outcome::Solved,
            "{number}: {report:?}"
        );
        without += usize::from(report.iterations == 0);
        most = most.max(report.iterations);
        worst = worst.max(off(&found));
        let (found, report) = program.structured::<f32, false>(1e-5, 6e-3, 0.0);
        assert_eq!(
            report.outcome,
            solver::Outcome::Solved,
            "{number}: {report:?}"
        );
        worst_single = worst_single.max(off(&found));
    }
    assert!(infeasible < 15, "{infeasible} of 60 have no solution");
    println!(
        "f64 {worst:.1e}, f32 {worst_single:.1e}, {without} of 60 without iterations, at most {most}"
    );
    assert!(
        worst < 2e-5 && worst_single < 2e-2,
        "{worst:e} {worst_single:e}"
    );
    assert!((5..55).contains(&without) && most <= 30, "{without} {most}");
}

#[test]
fn riccati_finds_clarabels_optimum_of_programs_whose_inputs_are_linked_in_both_precisions() {
    let mut random = Random::new(29);
    let (mut worst, mut worst_single, mut most, mut infeasible) = (0.0_f64, 0.0_f64, 0, 0);
    for number in 0..60 {
        let tightness = [1.0, 2.0, 4.0][number % 3];
        let program = RandomProgram::linked(&mut random, tightness);
        let Some(expected) = program.conic() else {
            infeasible += 1;
            continue;
        };
        let off = |found: &[f64]| off(found, &expected);
        let (found, report) = program.structured::<f64, true>(1e-12, 1e-7, 1e-8);
        assert_eq!(
            report.outcome,
            solver::Outcome::Solved,
            "{number}: {report:?}"
        );
        most = most.max(report.iterations);
        worst = worst.max(off(&found));
        let (found, report) = program.structured::<f32, true>(1e-4, 3e-3, 1e-5);
        assert_eq!(
            report.outcome,
            solver::Outcome::Solved,
            "{number}: {report:?}"
        );
        worst_single = worst_single.max(off(&found));
    }
    println!(
        "f64 {worst:.1e}, f32 {worst_single:.1e}, {infeasible} of 60 infeasible, at most {most}"
    );
    assert!(infeasible < 30, "{infeasible} of 60 have no solution");
    assert!(
        worst < 2e-5 && worst_single < 3e-2 && most <= 30,
        "{worst:e} {worst_single:e} {most}"
    );
}

#[test]
fn riccati_commands_clarabels_torques_along_recordings_and_prepares_ahead() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, lift) in [
        ("go1-d4", Lift::Transpose),
        ("go1-d6", Lift::Transpose),
        ("go1-d4", Lift::Consistent),
    ] {
        let model =
            romc::artifact::read(&root.join(format!("models/{name}.json"))).expect("shipped");
        let path = root.join("examples/recordings/go1/test_02.csv.gz");
        let recording = romc::recording::read(&path).expect("shipped");
        let runs = [Solver::Clarabel, Solver::Riccati].map(|solver| {
            let mut settings = MpcSettings {
                solver,
                lift,
                ..unwatched()
            };
            settings.qp.tolerance = 1e-9;
            let mut controller = romc::mpc::controller(&model, settings).expect("complete");
            let input = ReferenceInput::Recorded;
            along_recording(&mut controller, &recording, input, |_, _| {}).expect("sound")
        });
        let [conic, structured] = &runs;
        assert_eq!(conic.rows.len(), structured.rows.len());
        let mut equal = 0;
        for (a, b) in conic.rows.iter().zip(&structured.rows) {
            let (a, b, time_s) = (&a.command, &b.command, a.time_s);
            assert_eq!((a.status, b.iterations), (b.status, 0));
            let off = a.torque_nm.iter().zip(b.torque_nm);
            let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            equal += usize::from(off < 1e-6);
            // In the few steps in which a foot would leave its pyramid torques are others, but not far.
            assert!(off < 4.0, "{name} at {}: {off} N m", time_s);
        }
        match lift {
            Lift::Transpose => assert_eq!(equal, conic.rows.len(), "{name}"),
            Lift::Consistent => assert!(3 * equal > 2 * conic.rows.len(), "{name}: {equal}"),
        }
    }
}

#[test]
fn riccati_commands_clarabels_torques_under_limits_on_their_rates() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, rates) in [
        ("go1-d2", [3.0, 2.0]),
        ("go1-d4", [500.0, 100.0]),
        ("go1-d6", [500.0, 100.0]),
    ] {
        let model =
            romc::artifact::read(&root.join(format!("models/{name}.json"))).expect("shipped");
        for (number, rate) in rates.into_iter().enumerate() {
            let path = root.join(format!(
                "examples/recordings/go1/test_0{}.csv.gz",
                1 + number
            ));
            let recording = romc::recording::read(&path).expect("shipped");
            let [conic, structured] = [Solver::Clarabel, Solver::Riccati].map(|solver| {
                let mut settings = MpcSettings {
                    solver,
                    torque_rate_nm_s: Some(rate),
                    ..unwatched()
                };
                settings.qp.tolerance = 1e-12;
                let mut controller = romc::mpc::controller(&model, settings).expect("complete");
                let input = ReferenceInput::Recorded;
                along_recording(&mut controller, &recording, input, |_, _| {}).expect("sound")
            });
            let (mut active, mut worst) = (0, 0.0_f64);
            for (a, b) in conic.rows.iter().zip(&structured.rows) {
                let (a, b, time_s) = (&a.command, &b.command, a.time_s);
                assert_eq!(a.status, b.status, "{name} at {time_s}");
                active += usize::from(b.iterations > 0);
                let off = a.torque_nm.iter().zip(b.torque_nm);
                worst = off.fold(worst, |worst, (a, b)| worst.max((a - b).abs()));
            }
            println!(
                "{name}, {rate} N m/s: {active} of {} active, {worst:.1e} N m",
                conic.rows.len()
            );
            assert!(worst < 1e-6, "{name}, {rate} N m/s: {worst:e} N m");
            assert!(active > 10, "{name}, {rate} N m/s: {active}");
        }
    }
}
