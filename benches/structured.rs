//! The structured solver on problems from a file, compared with clarabel at 1e-9.
//!
//! ```text
//! cargo bench --bench structured -- FILE.bin... [--times FILE.txt]
//! ```
//!
//! A file holds one closed loop of an MPC in latent coordinates, little-endian: int32 `d, N, T, 0`, then float64
//! numbers. These are the lift of torques and forces (`d x 18`), the decoder of joints (`12 x d`) and its bias (12),
//! lower and upper joint limits (12 each), torque limits (12), friction. Weights of positions, velocities and inputs
//! (`d` each) follow, and the factor on the last state's. Then come for each of `T` steps `x0 (2d)`, reference
//! `((N+1) x 2d)`, `A (N x 2d x 2d)`, `B (N x 2d x d)`, `c (N x 2d)`. Each step ends with a guess of states and inputs
//! (`(N+1) x 2d`, `N x d`), the solution's (the same) and its cost. `benches/mpc_solvers/stages.py` makes such files,
//! and runs PIQP on them next to this program.
//!
//! Rows that the others imply are removed first, by linear programs. Each step starts from the last
//! step's solution, and its time includes everything that depends on the step: writing, gains, solve. A
//! loop is run [`REPEATS`] times; a step's time is the smallest, to exclude other load on the machine.

use std::io::Write as _;

use romc::mpc::problem::{Row, RowKind, needed_rows};
use romc::mpc::structured::{prepare, solve};
use romc::mpc::{Cone, ConeProgram, QpSettings, QpSolver, sparse};
use romc::solver::{Cost, Links, Outcome, Program, RowMatrices, Settings, Shape, Stage};

#[path = "shared/clock.rs"]
mod clock;

/// Weight of the robot, N, by which rows of forces are divided.
const WEIGHT_N: f64 = 118.0;

/// How often a loop is run.
const REPEATS: usize = 3;

/// Price of leaving a joint limit, above the multipliers of the problems: the limits are then kept.
const PRICE: f64 = 1e4;

/// Reads numbers of a file one after the other.
struct Reader {
    values: Vec<f64>,
    at: usize,
}

impl Reader {
    fn take(&mut self, count: usize) -> Vec<f64> {
        self.at += count;
        self.values[self.at - count..self.at].to_vec()
    }
}

/// Data common to all steps of a file.
struct Loop<const NU: usize> {
    horizon: usize,
    input_rows: Vec<([f64; NU], f64)>,
    joint_rows: Vec<([f64; NU], f64)>,
    state_weight: Vec<f64>,
    input_weight: Vec<f64>,
    terminal: f64,
}

/// One step's numbers.
struct Step {
    x0: Vec<f64>,
    reference: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut times = None;
    let mut files = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--times" => times = rest.next().cloned(),
            "--bench" => {}
            file => files.push(file.to_owned()),
        }
    }
    if files.is_empty() {
        println!("usage: cargo bench --bench structured -- FILE.bin... [--times FILE.txt]");
    }
    let mut lines = String::new();
    for file in files {
        let bytes = std::fs::read(&file).unwrap_or_else(|error| panic!("{file}: {error}"));
        let head = |k: usize| i32::from_le_bytes(bytes[4 * k..][..4].try_into().expect("4 bytes"));
        let (horizon, ticks) = (head(1) as usize, head(2) as usize);
        let values = bytes[16..]
            .chunks_exact(8)
            .map(|chunk| f64::from_le_bytes(chunk.try_into().expect("8 bytes")))
            .collect();
        let reader = Reader { values, at: 0 };
        let all = match head(0) {
            2 => run::<4, 2>(reader, horizon, ticks),
            4 => run::<8, 4>(reader, horizon, ticks),
            6 => run::<12, 6>(reader, horizon, ticks),
            d => panic!("{file}: {d} latent coordinates, expected 2, 4 or 6"),
        };
        println!("{file}: {}", all.1);
        for time in all.0 {
            lines += &format!("{time}\n");
        }
    }
    if let Some(path) = times {
        let mut file = std::fs::File::create(path).expect("the file can be made");
        file.write_all(lines.as_bytes()).expect("the disk has room");
    }
}

fn read_loop<const NU: usize>(reader: &mut Reader, horizon: usize) -> Loop<NU> {
    let (lift, decoder, bias) = (reader.take(NU * 18), reader.take(12 * NU), reader.take(12));
    let (low, high, torque) = (reader.take(12), reader.take(12), reader.take(12));
    let friction = reader.take(1)[0];
    let mut state_weight = reader.take(NU);
    state_weight.extend(reader.take(NU));
    let (input_weight, terminal) = (reader.take(NU), reader.take(1)[0]);
    let (mut input_rows, mut joint_rows) = (Vec::new(), Vec::new());
    for joint in 0..12 {
        let half = 0.5 * (high[joint] - low[joint]);
        for (sign, limit) in [(1.0, high[joint]), (-1.0, low[joint])] {
            let row = std::array::from_fn(|j| sign * lift[18 * j + joint] / torque[joint]);
            input_rows.push((row, 1.0));
            let row = std::array::from_fn(|j| sign * decoder[NU * joint + j] / half);
            joint_rows.push((row, sign * (limit - bias[joint]) / half));
        }
    }
    for axis in [12, 13] {
        for sign in [1.0, -1.0] {
            let entry = |j: usize| sign * lift[18 * j + axis] - friction * lift[18 * j + 14];
            input_rows.push((std::array::from_fn(|j| entry(j) / WEIGHT_N), 0.0));
        }
    }
    Loop {
        horizon,
        input_rows: needed(input_rows),
        joint_rows: needed(joint_rows),
        state_weight,
        input_weight,
        terminal,
    }
}

/// The rows without those that the others imply; opposite rows come first, in pairs.
fn needed<const NU: usize>(rows: Vec<([f64; NU], f64)>) -> Vec<([f64; NU], f64)> {
    let numbered = rows.iter().enumerate().map(|(joint, (row, bound))| Row {
        kind: RowKind::JointLimit,
        joint,
        row: row.to_vec(),
        bound: *bound,
        per_loss: 0.0,
    });
    let kept: Vec<_> = (needed_rows(numbered.collect(), 0.0).iter())
        .map(|row| rows[row.joint])
        .collect();
    let is_paired = |(row, _): &&([f64; NU], f64)| {
        let opposite = row.map(|entry| -entry);
        kept.iter().any(|(other, _)| *other == opposite)
    };
    let (paired, single): (Vec<_>, Vec<_>) = kept.iter().partition(is_paired);
    paired.into_iter().chain(single).copied().collect()
}

/// How many pairs of opposite rows come first.
fn pairs<const NU: usize>(rows: &[[f64; NU]]) -> usize {
    let (twos, _) = rows.as_chunks::<2>();
    (twos.iter())
        .take_while(|[row, other]| row.map(|entry| -entry) == *other)
        .count()
}

fn read_step<const NX: usize, const NU: usize>(reader: &mut Reader, horizon: usize) -> Step {
    let step = Step {
        x0: reader.take(NX),
        reference: reader.take((horizon + 1) * NX),
        a: reader.take(horizon * NX * NX),
        b: reader.take(horizon * NX * NU),
        c: reader.take(horizon * NX),
    };
    // A guess, a solution, its cost: of another solver.
    reader.take(2 * ((horizon + 1) * NX + horizon * NU) + 1);
    step
}

/// Solves all steps; times in us, and a line about them.
fn run<const NX: usize, const NU: usize>(
    mut reader: Reader,
    horizon: usize,
    ticks: usize,
) -> (Vec<f64>, String) {
    let shared: Loop<NU> = read_loop(&mut reader, horizon);
    let rows = |rows: &[([f64; NU], f64)]| rows.iter().map(|(row, _)| *row).collect::<Vec<_>>();
    let (input, soft) = (rows(&shared.input_rows), rows(&shared.joint_rows));
    let shape = Shape {
        input: input.len(),
        soft: soft.len(),
        pairs: pairs(&input),
        ..Shape::default()
    };
    let state: [f64; NX] = std::array::from_fn(|i| 2.0 * shared.state_weight[i]);
    let cost = Cost {
        state,
        terminal: state.map(|weight| shared.terminal * weight),
        input: std::array::from_fn(|j| 2.0 * shared.input_weight[j]),
        slack: PRICE,
    };
    let settings = Settings {
        max_iterations: 60,
        tolerance: 1e-8,
        gap: 2e-7,
        accepted_residual: 2e-5,
    };
    let mut reference = Conic::new::<NX, NU>(&shared);
    let steps: Vec<Step> = (0..ticks)
        .map(|_| read_step::<NX, NU>(&mut reader, horizon))
        .collect();
    let (mut times, mut iterations) = (vec![f64::INFINITY; ticks], Vec::new());
    let (mut off, mut cost_off, mut unsolved) = (0.0_f64, 0.0_f64, 0);
    for repeat in 0..REPEATS {
        let mut stages = vec![Stage::<f64, NX, NU>::zeros(); horizon];
        let mut memory = vec![0.0; horizon * shape.memory()];
        let (mut first, mut is_warm) = (0, false);
        for (tick, step) in steps.iter().enumerate() {
            let mut program = Program {
                stages: &mut stages,
                rows: &mut memory,
                first,
                shape,
                matrices: RowMatrices {
                    input: &input,
                    soft: &soft,
                },
                links: Links::none(),
                cost,
            };
            let mut report = None;
            #[cfg(target_arch = "x86_64")]
            let is_wide = is_x86_feature_detected!("avx2");
            #[cfg(not(target_arch = "x86_64"))]
            let is_wide = false;
            let time = clock::timed(|| {
                if tick > 0 {
                    program.shift();
                }
                write(&mut program, &shared, step);
                let x0 = std::array::from_fn(|i| step.x0[i] - step.reference[i]);
                report = Some(match is_wide {
                    true => {
                        prepare::<true, NX, NU, false>(&mut program);
                        solve::<true, NX, NU, false>(&mut program, &x0, is_warm, &settings)
                    }
                    false => {
                        prepare::<false, NX, NU, false>(&mut program);
                        solve::<false, NX, NU, false>(&mut program, &x0, is_warm, &settings)
                    }
                });
            });
            times[tick] = time.min(times[tick]);
            first = program.first;
            let report = report.expect("solved or not");
            is_warm = report.outcome == Outcome::Solved;
            if repeat > 0 {
                continue;
            }
            iterations.push(f64::from(report.iterations));
            unsolved += usize::from(report.outcome != Outcome::Solved);
            let solution = reference.solve::<NX, NU>(&shared, step);
            for k in 0..horizon {
                let stage = &program.stages[program.at(k)];
                for (found, expected) in stage.v.iter().zip(&solution[k * (NX + NU)..]) {
                    off = off.max((found - expected).abs());
                }
            }
            let value = |part: &dyn Fn(usize, usize) -> f64| -> f64 {
                let weight = |k: usize, i: usize| match (i < NU, k + 1 == horizon) {
                    (true, _) => cost.input[i],
                    (false, true) => cost.terminal[i - NU],
                    (false, false) => cost.state[i - NU],
                };
                (0..horizon)
                    .flat_map(|k| (0..NU + NX).map(move |i| (k, i)))
                    .map(|(k, i)| 0.5 * weight(k, i) * part(k, i).powi(2))
                    .sum()
            };
            let ours = value(&|k, i| {
                let stage = &program.stages[program.at(k)];
                if i < NU { stage.v[i] } else { stage.x[i - NU] }
            });
            let theirs = value(&|k, i| solution[k * (NX + NU) + i]);
            cost_off = cost_off.max((ours - theirs).abs() / theirs.abs().max(1.0));
        }
    }
    let line = format!(
        "d {NU}, N {horizon}, {} + {} rows a stage: median {:.1} us, 99 % {:.1} us; iterations {} / {} / {}; \
         inputs within {off:.1e}, cost within {cost_off:.1e} of clarabel's at 1e-9; {unsolved} of {ticks} unsolved",
        shape.input,
        shape.soft,
        clock::percentile(&times, 0.5),
        clock::percentile(&times, 0.99),
        clock::percentile(&iterations, 0.5),
        clock::percentile(&iterations, 0.99),
        clock::percentile(&iterations, 1.0),
    );
    (times, line)
}

fn write<const NX: usize, const NU: usize>(
    program: &mut Program<'_, f64, NX, NU, false>,
    shared: &Loop<NU>,
    step: &Step,
) {
    for k in 0..shared.horizon {
        let place = program.at(k);
        let stage = &mut program.stages[place];
        for i in 0..NX {
            stage.a[i].copy_from_slice(&step.a[(k * NX + i) * NX..][..NX]);
            stage.b[i].copy_from_slice(&step.b[(k * NX + i) * NU..][..NU]);
            stage.c[i] = defect::<NX>(step, k, i);
        }
        let bounds = program.bounds_mut(k);
        let (inputs, joints) = bounds.split_at_mut(shared.input_rows.len());
        for (bound, (_, limit)) in inputs.iter_mut().zip(&shared.input_rows) {
            *bound = *limit;
        }
        for (bound, (row, limit)) in joints.iter_mut().zip(&shared.joint_rows) {
            *bound = limit - at_reference::<NX, NU>(step, k, row);
        }
    }
}

/// Residual of the dynamics at the reference.
fn defect<const NX: usize>(step: &Step, k: usize, i: usize) -> f64 {
    let row = &step.a[(k * NX + i) * NX..][..NX];
    let moved: f64 = (0..NX).map(|j| row[j] * step.reference[k * NX + j]).sum();
    moved + step.c[k * NX + i] - step.reference[(k + 1) * NX + i]
}

fn at_reference<const NX: usize, const NU: usize>(step: &Step, k: usize, row: &[f64; NU]) -> f64 {
    (0..NU)
        .map(|j| row[j] * step.reference[(k + 1) * NX + j])
        .sum()
}

/// The same program for clarabel: unknowns `v_0, x_1, v_1, x_2, ...`.
struct Conic {
    solver: QpSolver,
}

impl Conic {
    fn new<const NX: usize, const NU: usize>(shared: &Loop<NU>) -> Self {
        let (width, horizon) = (NX + NU, shared.horizon);
        let (n, equalities) = (width * horizon, NX * horizon);
        let rows = shared.input_rows.len() + shared.joint_rows.len();
        let mut entries = Vec::new();
        for k in 0..horizon {
            for i in 0..NX {
                let row = k * NX + i;
                entries.extend((0..NU).map(|j| (row, k * width + j, 0.0)));
                entries.push((row, k * width + NU + i, 0.0));
                if k > 0 {
                    entries.extend((0..NX).map(|j| (row, (k - 1) * width + NU + j, 0.0)));
                }
            }
            for number in 0..rows {
                let offset = if number < shared.input_rows.len() {
                    0
                } else {
                    NU
                };
                let row = equalities + k * rows + number;
                entries.extend((0..NU).map(|j| (row, k * width + offset + j, 0.0)));
            }
        }
        let m = equalities + rows * horizon;
        let mut a = sparse(m, n, &entries);
        let diagonal: Vec<_> = (0..n).map(|i| (i, i, 0.0)).collect();
        let mut p = sparse(n, n, &diagonal);
        for k in 0..horizon {
            let factor = if k + 1 == horizon {
                shared.terminal
            } else {
                1.0
            };
            for j in 0..NU {
                let at = k * width + j;
                p.set_entry((at, at), 2.0 * shared.input_weight[j]);
            }
            for i in 0..NX {
                let at = k * width + NU + i;
                p.set_entry((at, at), 2.0 * factor * shared.state_weight[i]);
                a.set_entry((k * NX + i, at), -1.0);
            }
            let all = shared.input_rows.iter().chain(&shared.joint_rows);
            for (number, (row, _)) in all.enumerate() {
                let offset = if number < shared.input_rows.len() {
                    0
                } else {
                    NU
                };
                for (j, entry) in row.iter().enumerate() {
                    let at = equalities + k * rows + number;
                    a.set_entry((at, k * width + offset + j), *entry);
                }
            }
        }
        let program = ConeProgram {
            p,
            q: vec![0.0; n],
            a,
            b: vec![0.0; m],
            cones: vec![Cone::Zero(equalities), Cone::Nonnegative(rows * horizon)],
        };
        let settings = QpSettings {
            tolerance: 1e-9,
            max_iterations: 200,
            ..QpSettings::default()
        };
        let solver = QpSolver::new(program, settings).expect("a sound program");
        Self { solver }
    }

    fn solve<const NX: usize, const NU: usize>(
        &mut self,
        shared: &Loop<NU>,
        step: &Step,
    ) -> Vec<f64> {
        let width = NX + NU;
        let rows = shared.input_rows.len() + shared.joint_rows.len();
        let program = self.solver.program_mut();
        for k in 0..shared.horizon {
            for i in 0..NX {
                let row = k * NX + i;
                let mut right = -defect::<NX>(step, k, i);
                for j in 0..NU {
                    program
                        .a
                        .set_entry((row, k * width + j), step.b[row * NU + j]);
                }
                for j in 0..NX {
                    let entry = step.a[row * NX + j];
                    if k == 0 {
                        right -= entry * (step.x0[j] - step.reference[j]);
                    } else {
                        program.a.set_entry((row, (k - 1) * width + NU + j), entry);
                    }
                }
                program.b[row] = right;
            }
            let first = NX * shared.horizon + k * rows;
            for (number, (_, limit)) in shared.input_rows.iter().enumerate() {
                program.b[first + number] = *limit;
            }
            for (number, (row, limit)) in shared.joint_rows.iter().enumerate() {
                program.b[first + shared.input_rows.len() + number] =
                    limit - at_reference::<NX, NU>(step, k, row);
            }
        }
        self.solver.solve();
        self.solver.solution().to_vec()
    }
}
