//! The consistent lift with friction pyramids, by the structured [`solver`](crate::solver).
//!
//! Torques are written by the standard deviations of the training's, `τ = m + C y` with `C Cᵀ = S`,
//! and with `A = M C / √w` and `r = (u_lat − M m) / √w` the program becomes
//!
//! ```text
//! minimise ½ ‖A y − r‖² + ½ ‖y‖²   subject to  rows · τ <= bounds,
//! y₀ = Aᵀ (I + A Aᵀ)⁻¹ r,   I + Aᵀ A = L Lᵀ,   y = y₀ + L⁻ᵀ v:   minimise ½ ‖v‖²
//! ```
//!
//! `y₀` takes a system of as many unknowns as latent coordinates and is the solution if it keeps all
//! rows; otherwise `½ ‖v‖²` under the rows is one stage of the solver's. Rows are both sides of the
//! torque limits and, for each foot in contact, the pyramid `|F_x|, |F_y| <= μ F_z / √2` inside its
//! cone. Every sum has one order: the controller in C has the same bits.
// Loops over indices have the order of operations of the C that repeats them.
#![allow(clippy::needless_range_loop)]

use nalgebra::Cholesky;

use super::control_model::ControlPhase;
use super::dense::{factorise, solve_lower, solve_upper};
use super::lift::{LiftFailure, LiftProblem, LiftRules};
use super::qp::Outcome;
use super::structured::{PYRAMID_ROWS, TOLERANCE, outcome_of, prepare, solve};
use crate::robot::{FOOT_DIM, JOINT_DIM};
use crate::solver::{Cost, Links, Program, RowMatrices, Settings, Shape, Stage};

type Torque = [f64; JOINT_DIM];
type Lifted = (Result<Torque, LiftFailure>, u32);

/// No lift at all.
const BROKEN: Lifted = (Err(LiftFailure::Solver(Outcome::NumericalFailure)), 0);

/// Curvature of the cost as the solver has it: `CURVATURE / 2 ‖v‖²`. Inputs a few deviations beyond the
/// limits then have multipliers near those at which its iterations begin.
pub const CURVATURE: f64 = 0.01;

/// Most rows of the program.
const MAX_ROWS: usize = 2 * JOINT_DIM + PYRAMID_ROWS * FOOT_DIM;

/// `C` with `C Cᵀ = S`, upper triangular, of the torques of a phase; none if their precision is not
/// positive definite.
pub fn torque_deviation(phase: &ControlPhase) -> Option<[Torque; JOINT_DIM]> {
    // S⁻¹ = K Kᵀ, C = K⁻ᵀ.
    let inverse = Cholesky::new(phase.torque_precision)?.l().try_inverse()?;
    let entry = |row: usize, col: usize| if row <= col { inverse[(col, row)] } else { 0.0 };
    Some(std::array::from_fn(|row| {
        std::array::from_fn(|col| entry(row, col))
    }))
}

/// The program with its memory.
#[derive(Debug)]
pub(super) struct PyramidLift {
    /// `C` of each phase.
    deviation: Vec<Option<[Torque; JOINT_DIM]>>,
    /// `A`, the factor of `I + A Aᵀ` row by row, and `r`.
    map: Vec<Torque>,
    square: Vec<f64>,
    residual: Vec<f64>,
    /// Rows by `τ`, then by `v`, and what `y₀` leaves of their bounds.
    rows: Vec<Torque>,
    room: Vec<f64>,
    memory: Vec<f64>,
    settings: Settings<f64>,
}

impl PyramidLift {
    /// Memory for a latent dimension and the torques of the phases.
    pub(super) fn new(
        latent_dim: usize,
        phases: &[ControlPhase],
        max_iterations: u32,
        accepted_residual: f64,
    ) -> Self {
        let shape = Shape {
            input: MAX_ROWS,
            ..Shape::default()
        };
        Self {
            deviation: phases.iter().map(torque_deviation).collect(),
            map: vec![[0.0; JOINT_DIM]; latent_dim],
            square: vec![0.0; latent_dim * latent_dim],
            residual: vec![0.0; latent_dim],
            rows: vec![[0.0; JOINT_DIM]; MAX_ROWS],
            room: vec![0.0; MAX_ROWS],
            memory: vec![0.0; shape.memory()],
            settings: Settings {
                max_iterations,
                tolerance: TOLERANCE,
                // Torques are at stake: the largest product alone decides.
                gap: 0.0,
                accepted_residual,
            },
        }
    }

    /// Torques at the links, N m, and interior-point iterations: zero if the optimum without
    /// constraints keeps them.
    pub(super) fn lift(
        &mut self,
        phase: (usize, &ControlPhase),
        problem: &LiftProblem<'_>,
        rules: &LiftRules,
    ) -> Lifted {
        let Some(deviation) = self.deviation[phase.0] else {
            return BROKEN;
        };
        let mean: Torque = phase.1.torque_mean.into();
        let Some(y) = self.free_optimum(&deviation, &mean, problem, rules) else {
            return BROKEN;
        };
        let torque = torque_of(&deviation, &mean, &y);
        let count = self.write_rows(&torque, problem, rules);
        // Written so that room that is not a number counts as violated.
        let is_kept = self.room[..count].iter().all(|room| *room >= 0.0);
        let (y, iterations) = match is_kept {
            true => (Ok(y), 0),
            false => self.solve(&deviation, y, count),
        };
        let torque = y.map(|y| {
            let torque = torque_of(&deviation, &mean, &y);
            std::array::from_fn(|joint| rules.within_limit(torque[joint], joint, problem.losses_nm))
        });
        (torque, iterations)
    }

    /// Writes `A` and returns `y₀`; none if a number is not finite.
    fn free_optimum(
        &mut self,
        deviation: &[Torque; JOINT_DIM],
        mean: &Torque,
        problem: &LiftProblem<'_>,
        rules: &LiftRules,
    ) -> Option<Torque> {
        let d = problem.map.len();
        let scale = 1.0 / rules.prior_weight.sqrt();
        for i in 0..d {
            let row = &problem.map[i];
            let mut left = problem.u_lat[i];
            for j in 0..JOINT_DIM {
                left -= row[j] * mean[j];
                let mut sum = 0.0;
                for k in 0..=j {
                    sum += row[k] * deviation[k][j];
                }
                self.map[i][j] = scale * sum;
            }
            self.residual[i] = scale * left;
        }
        for i in 0..d {
            for j in 0..=i {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                for k in 0..JOINT_DIM {
                    sum += self.map[i][k] * self.map[j][k];
                }
                self.square[i * d + j] = sum;
            }
        }
        if !factorise(&mut self.square, d) {
            return None;
        }
        solve_lower(&self.square, d, &mut self.residual);
        solve_upper(&self.square, d, &mut self.residual);
        let mut y = [0.0; JOINT_DIM];
        for i in 0..d {
            for j in 0..JOINT_DIM {
                y[j] += self.map[i][j] * self.residual[i];
            }
        }
        Some(y)
    }

    /// Rows on the torques and their room at the optimum without them; how many there are.
    fn write_rows(
        &mut self,
        torque: &Torque,
        problem: &LiftProblem<'_>,
        rules: &LiftRules,
    ) -> usize {
        for joint in 0..JOINT_DIM {
            let (limit, loss) = (rules.limit_nm[joint], problem.losses_nm[joint]);
            for (row, sign) in [(joint, 1.0), (JOINT_DIM + joint, -1.0)] {
                self.rows[row] = [0.0; JOINT_DIM];
                self.rows[row][joint] = sign / limit;
                self.room[row] = 1.0 - sign * ((torque[joint] + loss) / limit);
            }
        }
        let mut count = 2 * JOINT_DIM;
        for leg in 0..FOOT_DIM {
            let Some(force) = &problem.forces[leg] else {
                continue;
            };
            for side in 0..PYRAMID_ROWS {
                let sign = if side % 2 == 0 { 1.0 } else { -1.0 };
                let mut room = 0.0;
                self.rows[count] = [0.0; JOINT_DIM];
                for k in 0..3 {
                    let within = rules.friction * force[(2, k)] * std::f64::consts::FRAC_1_SQRT_2;
                    let entry = (sign * force[(side / 2, k)] - within) / rules.weight_n;
                    self.rows[count][3 * leg + k] = entry;
                    room -= entry * torque[3 * leg + k];
                }
                self.room[count] = room;
                count += 1;
            }
        }
        count
    }

    /// The solution under the first `count` rows, from the optimum without them.
    fn solve(&mut self, deviation: &[Torque; JOINT_DIM], mut y: Torque, count: usize) -> Lifted {
        let mut hessian = [0.0; JOINT_DIM * JOINT_DIM];
        for i in 0..JOINT_DIM {
            for j in 0..=i {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                for row in &self.map {
                    sum += row[i] * row[j];
                }
                hessian[i * JOINT_DIM + j] = sum;
            }
        }
        if !factorise(&mut hessian, JOINT_DIM) {
            return BROKEN;
        }
        for row in &mut self.rows[..count] {
            let mut by_deviation = [0.0; JOINT_DIM];
            for j in 0..JOINT_DIM {
                for k in 0..=j {
                    by_deviation[j] += row[k] * deviation[k][j];
                }
            }
            solve_lower(&hessian, JOINT_DIM, &mut by_deviation);
            *row = by_deviation;
        }
        let shape = Shape {
            input: count,
            ..Shape::default()
        };
        let mut stages = [Stage::<f64, 1, JOINT_DIM>::zeros()];
        let mut program = Program {
            stages: &mut stages,
            rows: &mut self.memory[..shape.memory()],
            first: 0,
            shape,
            matrices: RowMatrices {
                input: &self.rows[..count],
                soft: &[],
                hard: &[],
            },
            links: Links::none(),
            cost: Cost {
                state: [0.0],
                terminal: [0.0],
                input: [CURVATURE; JOINT_DIM],
                slack: 0.0,
            },
        };
        program.bounds_mut(0).copy_from_slice(&self.room[..count]);
        if !prepare(&mut program) {
            return BROKEN;
        }
        let report = solve(&mut program, &[0.0], false, &self.settings);
        let outcome = outcome_of(report.outcome);
        if outcome != Outcome::Solved {
            return (Err(LiftFailure::Solver(outcome)), report.iterations);
        }
        let mut v = stages[0].v;
        solve_upper(&hessian, JOINT_DIM, &mut v);
        for j in 0..JOINT_DIM {
            y[j] += v[j];
        }
        (Ok(y), report.iterations)
    }
}

/// `m + C y`.
fn torque_of(deviation: &[Torque; JOINT_DIM], mean: &Torque, y: &Torque) -> Torque {
    let mut torque = *mean;
    for i in 0..JOINT_DIM {
        for j in i..JOINT_DIM {
            torque[i] += deviation[i][j] * y[j];
        }
    }
    torque
}
