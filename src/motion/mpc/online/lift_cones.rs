//! The consistent lift with friction cones, by clarabel.

use nalgebra::{Cholesky, SMatrix, SVector};

use super::control_model::ControlPhase;
use super::error::ControlError;
use super::lift::{LiftFailure, LiftProblem, LiftRules};
use super::qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver};
use super::sparse::SparseColumns;
use crate::robot::{FOOT_DIM, JOINT_DIM};

type Torque = SVector<f64, JOINT_DIM>;
type TorqueSquare = SMatrix<f64, JOINT_DIM, JOINT_DIM>;

/// Rows of the two sides of the torque limits.
const BOUND_ROWS: usize = 2 * JOINT_DIM;

/// The solver of [`lift_in_cones`].
pub(super) fn cone_solver(settings: QpSettings) -> Result<QpSolver, ControlError> {
    QpSolver::new(empty_program(), settings)
}

/// Torques at the links, N m, and interior-point iterations: zero if the optimum without
/// constraints keeps them; `solver` is a [`cone_solver`].
pub(super) fn lift_in_cones(
    solver: &mut QpSolver,
    phase: &ControlPhase,
    problem: &LiftProblem<'_>,
    rules: &LiftRules,
) -> (Result<[f64; JOINT_DIM], LiftFailure>, u32) {
    let (hessian, gradient) = cost(phase, problem, rules.prior_weight);
    if let Some(factor) = Cholesky::new(hessian) {
        let torque = factor.solve(&-gradient);
        if is_allowed(&torque, problem, rules) {
            return (Ok(torque.into()), 0);
        }
    }
    let torque = solve(solver, &hessian, &gradient, problem, rules);
    (torque, solver.iterations())
}

fn solve(
    solver: &mut QpSolver,
    hessian: &TorqueSquare,
    gradient: &Torque,
    problem: &LiftProblem<'_>,
    rules: &LiftRules,
) -> Result<[f64; JOINT_DIM], LiftFailure> {
    let (limit, losses) = (&rules.limit_nm, problem.losses_nm);
    let program = solver.program_mut();
    // Torques as shares of their limits, the cost with a largest curvature of one.
    let scaled = |row: usize, col: usize| hessian[(row, col)] * limit[row] * limit[col];
    let curvatures = (0..JOINT_DIM).map(|i| scaled(i, i));
    let cost_scale = 1.0 / curvatures.fold(f64::MIN_POSITIVE, f64::max);
    for col in 0..JOINT_DIM {
        for row in 0..=col {
            program.p.set(row, col, cost_scale * scaled(row, col));
        }
        program.q[col] = cost_scale * gradient[col] * limit[col];
        program.b[col] = 1.0 - losses[col] / limit[col];
        program.b[JOINT_DIM + col] = 1.0 + losses[col] / limit[col];
    }
    for (leg, force) in problem.forces.iter().enumerate() {
        let first_row = BOUND_ROWS + 3 * leg;
        let axes = [(2, rules.friction), (0, 1.0), (1, 1.0)].into_iter();
        for (row, (axis, factor)) in (first_row..).zip(axes) {
            for k in 0..3 {
                let joint = 3 * leg + k;
                let entry = force.map_or(0.0, |map| factor * map[(axis, k)] / rules.weight_n);
                program.a.set(row, joint, -entry * limit[joint]);
            }
        }
        // A foot in the air has the cone's axis as its slack: strictly inside.
        program.b[first_row] = if force.is_some() { 0.0 } else { 1.0 };
    }
    match solver.solve() {
        Outcome::Solved => {
            let solution = solver.solution();
            Ok(std::array::from_fn(|joint| {
                rules.within_limit(solution[joint] * limit[joint], joint, losses)
            }))
        }
        outcome @ (Outcome::Inaccurate
        | Outcome::Infeasible
        | Outcome::Unbounded
        | Outcome::IterationCap
        | Outcome::NumericalFailure) => Err(LiftFailure::Solver(outcome)),
    }
}

/// Hessian and gradient at zero of half the cost, by torques in N m.
fn cost(
    phase: &ControlPhase,
    problem: &LiftProblem<'_>,
    prior_weight: f64,
) -> (TorqueSquare, Torque) {
    let mut hessian = phase.torque_precision * prior_weight;
    let mut gradient = -(hessian * phase.torque_mean);
    for (row, &target) in problem.map.iter().zip(problem.u_lat) {
        let row = Torque::from(*row);
        hessian += row * row.transpose();
        gradient -= row * target;
    }
    (hessian, gradient)
}

fn is_allowed(torque: &Torque, problem: &LiftProblem<'_>, rules: &LiftRules) -> bool {
    let within = (torque.iter().zip(problem.losses_nm))
        .zip(&rules.limit_nm)
        .all(|((torque, loss), limit)| (torque + loss).abs() <= *limit);
    within
        && (problem.forces.iter().enumerate()).all(|(leg, force)| match force {
            None => true,
            Some(map) => {
                let force = map * torque.fixed_rows::<3>(3 * leg);
                force.x.hypot(force.y) <= rules.friction * force.z
            }
        })
}

/// Torque bounds, and a friction cone for each foot; costs and cones are filled at each lift.
fn empty_program() -> ConeProgram {
    let upper: Vec<(usize, usize)> = (0..JOINT_DIM)
        .flat_map(|col| (0..=col).map(move |row| (row, col)))
        .collect();
    let mut entries: Vec<(usize, usize)> =
        (0..BOUND_ROWS).map(|row| (row, row % JOINT_DIM)).collect();
    for leg in 0..FOOT_DIM {
        entries.extend((0..9).map(|k| (BOUND_ROWS + 3 * leg + k / 3, 3 * leg + k % 3)));
    }
    let n_rows = BOUND_ROWS + 3 * FOOT_DIM;
    let mut a = SparseColumns::from_pattern(n_rows, JOINT_DIM, &entries);
    let mut b = vec![0.0; n_rows];
    for joint in 0..JOINT_DIM {
        a.set(joint, joint, 1.0);
        a.set(JOINT_DIM + joint, joint, -1.0);
    }
    b[..BOUND_ROWS].fill(1.0);
    let mut cones = vec![Cone::Nonnegative(BOUND_ROWS)];
    cones.extend([Cone::SecondOrder(3); FOOT_DIM]);
    ConeProgram {
        p: SparseColumns::from_pattern(JOINT_DIM, JOINT_DIM, &upper),
        q: vec![0.0; JOINT_DIM],
        a,
        b,
        cones,
    }
}
