//! The consistent lift: torques whose ground reaction forces produce a latent input. `u = W_eᵀ u_lat` returns torques
//! *and* a body force without a relation between the two. The consistent lift computes torques alone; the legs produce
//! the force:
//!
//! ```text
//! minimise   ‖ M τ − u_lat ‖² + w (τ − m)ᵀ S⁻¹ (τ − m),   M = pinv(W_eᵀ) s_u [ I ; G(q, c) ]
//! subject to |τ + ℓ| ≤ τ_max,   ‖(R F_k)_{x,y}‖ ≤ μ (R F_k)_z,   F_k = −J_k⁻ᵀ τ_k for each foot k in contact
//! ```
//!
//! `τ` are the torques at the links and `τ + ℓ` the command, with the losses `ℓ`, never beyond the limits. `G(q, c)`
//! maps torques to force and moment of the feet in contact, in the frame of the model's inputs. `m` and `S` are mean
//! and covariance of the training torques in the phase, or `m` the torques of the reference. `R` turns the body frame
//! upright.
//!
//! Torques are scaled by the standard deviations of the training torques, `τ = m + C y` with `C Cᵀ = S`. With
//! `A = M C / √w` and `r = (u_lat − M m) / √w` the program becomes
//!
//! ```text
//! minimise ½ ‖A y − r‖² + ½ ‖y‖²   subject to the rows,
//! y₀ = Aᵀ (I + A Aᵀ)⁻¹ r,   I + Aᵀ A = L Lᵀ,   y = y₀ + L⁻ᵀ v:   minimise ½ ‖v‖²
//! ```
//!
//! `y₀` requires a linear system with as many unknowns as latent coordinates. It is the solution if it satisfies all
//! rows. Otherwise `½ ‖v‖²` under the rows is a program of one stage, solved by clarabel with the cones or by the
//! structured solver with the pyramids inside them.

use nalgebra::{Cholesky, Matrix3};

use super::conic::{StageSolver, Start};
use super::control_model::{ControlModel, ControlPhase};
use super::dense::{Real, solve_upper};
use super::error::ControlError;
use super::lift_program::{
    change_rows, free_optimum, keep_limits, keep_swing, write_foot, write_hessian, write_limits,
    write_torque,
};
use super::problem::to_upright;
use super::qp::QpSettings;
use super::settings::{MpcSettings, Solver};
use super::stage::{CONE_ROWS, PYRAMID_ROWS, StageCost, StageQp, StageShape};
use crate::robot::{ContactFlags, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM, Leg, STATE_DIM, WrenchFrame};
use crate::solver::{Outcome, Shape};

const LIFT_ITERATIONS: u32 = 60;
/// Curvature of the cost as the solvers have it: `CURVATURE / 2 ‖v‖²`. Inputs a few deviations beyond the limits then
/// have multipliers near those at which iterations begin.
const CURVATURE: Real = 0.01;

type Torque = [f64; JOINT_DIM];
/// The upright force of each foot in contact by its leg's torques.
type FootForces = [Option<Matrix3<f64>>; FOOT_DIM];

/// Posture, contact and motion that a lift is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StanceState {
    /// Joint positions, rad.
    pub joints_rad: [f64; JOINT_DIM],
    /// Roll, pitch and yaw, rad.
    pub attitude_rad: [f64; 3],
    /// Feet in contact.
    pub feet: ContactFlags,
    /// Phase of the model.
    pub phase: usize,
    /// Losses of the joints, N m, at most the torque limits; zero in a model without actuators.
    pub losses_nm: [f64; JOINT_DIM],
    /// Torques at the links that the consistent lift stays near, N m; none for the mean of the training's in the phase.
    pub near_nm: Option<[f64; JOINT_DIM]>,
    /// Whether legs in the air keep those torques, or none where they are not known: they do not push the body.
    pub keeps_swing: bool,
}

impl StanceState {
    /// At a state (18, SI units), without losses.
    pub fn at(x: &[f64], feet: ContactFlags, phase: usize) -> Self {
        Self {
            joints_rad: std::array::from_fn(|joint| x[joint]),
            attitude_rad: std::array::from_fn(|angle| x[15 + angle]),
            feet,
            phase,
            losses_nm: [0.0; JOINT_DIM],
            near_nm: None,
            keeps_swing: false,
        }
    }
}

/// Why no torques were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiftFailure {
    /// A leg in contact is stretched: its torques do not determine its force.
    SingularLeg,
    /// Its program was not solved.
    Solver(Outcome),
}

const BROKEN: LiftFailure = LiftFailure::Solver(Outcome::NumericalFailure);

/// The consistent lift of one model on its robot, with its own persistent solver.
#[derive(Debug)]
pub struct ConsistentLift {
    engine: Box<dyn StageSolver>,
    solver: Solver,
    qp: StageQp,
    /// `pinv(W_eᵀ) s_u` and `A`, row by row.
    projection: Vec<f64>,
    scaled_map: Vec<f64>,
    /// `C` of each phase.
    deviation: Vec<Option<[Torque; JOINT_DIM]>>,
    limit_nm: Torque,
    weight_n: f64,
    foot_friction: f64,
    prior_weight: f64,
    iterations: u32,
}

impl ConsistentLift {
    /// Prepares the lift for the solver of the settings.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Result<Self, ControlError> {
        let d = plant.latent_dim();
        let shape = StageShape {
            inputs: JOINT_DIM,
            rows: Shape {
                input: 2 * JOINT_DIM,
                ..Shape::default()
            },
            ..StageShape::default()
        };
        let shape = shape.with_cones(FOOT_DIM, settings.solver);
        let cost = StageCost {
            state: Vec::new(),
            terminal: 1.0,
            input: CURVATURE,
            slack: 0.0,
        };
        let qp = QpSettings {
            max_iterations: LIFT_ITERATIONS,
            tolerance: 1e-12,
            ..settings.qp
        };
        let mut lift = Self {
            engine: settings.solver.of_horizon(1, shape, &cost, qp)?,
            solver: settings.solver,
            qp: StageQp::zeros(&shape),
            projection: vec![0.0; d * STATE_DIM],
            scaled_map: vec![0.0; d * JOINT_DIM],
            deviation: plant.phases().iter().map(torque_deviation).collect(),
            limit_nm: *plant.robot().torque_limit_nm(),
            weight_n: plant.robot().mass_kg() * GRAVITY_M_S2,
            foot_friction: settings.foot_friction,
            prior_weight: settings.lift_prior_weight,
            iterations: 0,
        };
        lift.take_projection(plant);
        Ok(lift)
    }

    /// Uses the projection of another plant: the one at the measured state, if maps depend on the state.
    pub(super) fn take_projection(&mut self, plant: &ControlModel) {
        let rows = plant.projection.row_iter();
        for (own, row) in self.projection.chunks_exact_mut(STATE_DIM).zip(rows) {
            own.copy_from_slice(row.transpose().as_slice());
        }
    }

    /// Torques at the links, N m, for a latent input on a stance; with the losses they are within the motors' limits.
    pub fn lift(
        &mut self,
        plant: &ControlModel,
        u_lat: &[f64],
        stance: &StanceState,
    ) -> Result<[f64; JOINT_DIM], LiftFailure> {
        self.iterations = 0;
        let forces = foot_forces(plant, stance).ok_or(LiftFailure::SingularLeg)?;
        let rule = plant.input_rule();
        let wrench = rule.wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet);
        let wrench = wrench.map_err(|_| LiftFailure::SingularLeg)?.transpose();
        let deviation = self.deviation[stance.phase].ok_or(BROKEN)?;
        let (mut deviation, mut mean) = (deviation, [0.0; JOINT_DIM]);
        let deviation = deviation.as_flattened_mut();
        let near = stance.near_nm.as_ref().map(<[f64; JOINT_DIM]>::as_slice);
        mean.copy_from_slice(near.unwrap_or(plant.phases()[stance.phase].torque_mean.as_slice()));
        if stance.keeps_swing {
            let (limit_nm, losses_nm) = (&self.limit_nm, &stance.losses_nm);
            keep_swing(
                &stance.feet,
                near.is_some(),
                limit_nm,
                losses_nm,
                &mut mean,
                deviation,
            );
        }
        let (deviation, mean) = (&*deviation, &mean[..]);
        let (d, weight) = (u_lat.len(), self.prior_weight);
        let (projection, scaled_map) = (&self.projection, &mut self.scaled_map);
        let (wrench, mut y) = (wrench.as_slice(), [0.0; JOINT_DIM]);
        if !free_optimum(
            projection, wrench, mean, deviation, u_lat, weight, d, scaled_map, &mut y,
        ) {
            return Err(BROKEN);
        }
        let mut torque = [0.0; JOINT_DIM];
        write_torque(mean, deviation, &y, &mut torque);
        self.write_rows(&torque, &stance.losses_nm, &forces);
        if !self.is_kept() {
            self.constrain(deviation, &mut y)?;
            write_torque(mean, deviation, &y, &mut torque);
        }
        keep_limits(&self.limit_nm, &stance.losses_nm, &mut torque);
        Ok(torque)
    }

    /// Interior-point iterations of the last lift; zero if no constraint was active.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// The rows on the torques, and the room that `torque` leaves: limits, and of each foot in contact the pyramid. A
    /// foot in the air has a cone of which the axis is the slack, strictly inside.
    fn write_rows(&mut self, torque: &Torque, losses_nm: &Torque, forces: &FootForces) {
        let (friction, weight_n) = (self.foot_friction, self.weight_n);
        let down = forces.iter().flatten().count();
        let pyramids = match self.solver {
            Solver::Clarabel => 0,
            Solver::Riccati => down,
        };
        let rows = &mut self.qp.input;
        rows.resize(2 * JOINT_DIM + PYRAMID_ROWS * pyramids, JOINT_DIM);
        let (limit_nm, bounds) = (&self.limit_nm, &mut rows.bounds);
        write_limits(limit_nm, losses_nm, torque, &mut rows.entries, bounds);
        let mut first = 2 * JOINT_DIM;
        for leg in 0..FOOT_DIM {
            let force = forces[leg].map(|force| force.transpose());
            match (self.solver, &force) {
                (Solver::Clarabel, _) => self.write_cone(leg, torque, force.as_ref()),
                (Solver::Riccati, None) => {}
                (Solver::Riccati, Some(force)) => {
                    let rows = &mut self.qp.input;
                    let entries = &mut rows.entries[first * JOINT_DIM..];
                    let (force, bounds) = (force.as_slice(), &mut rows.bounds[first..]);
                    write_foot(force, friction, weight_n, torque, leg, entries, bounds);
                    first += PYRAMID_ROWS;
                }
            }
        }
    }

    /// The cone of a foot with the transpose of its force by the torques.
    fn write_cone(&mut self, leg: usize, torque: &Torque, force: Option<&Matrix3<f64>>) {
        let axes = [(2, self.foot_friction), (0, 1.0), (1, 1.0)];
        for (number, (axis, factor)) in axes.into_iter().enumerate() {
            let place = CONE_ROWS * leg + number;
            let row = &mut self.qp.cones.entries[place * JOINT_DIM..][..JOINT_DIM];
            row.fill(0.0);
            let mut room = f64::from(force.is_none() && axis == 2);
            for k in 0..3 {
                let entry = force.map_or(0.0, |force| factor * force[(k, axis)] / self.weight_n);
                row[3 * leg + k] = -entry;
                room += entry * torque[3 * leg + k];
            }
            self.qp.cones.bounds[place] = room;
        }
    }

    /// Whether the rows are kept as they are; written so that room that is not a number counts as violated.
    fn is_kept(&self) -> bool {
        let (cones, _) = self.qp.cones.bounds.as_chunks::<CONE_ROWS>();
        self.qp.input.bounds.iter().all(|room| *room >= 0.0)
            && cones.iter().all(|[axis, x, y]| x.hypot(*y) <= *axis)
    }

    /// Moves `y` from the optimum without rows to the one under them.
    fn constrain(&mut self, deviation: &[f64], y: &mut Torque) -> Result<(), LiftFailure> {
        let mut hessian = [0.0; JOINT_DIM * JOINT_DIM];
        let d = self.scaled_map.len() / JOINT_DIM;
        if !write_hessian(&self.scaled_map, d, &mut hessian) {
            return Err(BROKEN);
        }
        for rows in [&mut self.qp.input, &mut self.qp.cones] {
            let count = rows.bounds.len();
            change_rows(&hessian, deviation, count, &mut rows.entries);
        }
        let stages = std::slice::from_ref(&self.qp);
        self.engine.forget();
        self.engine.prepare(stages, 0, &[true]);
        let (outcome, iterations) = self.engine.solve(stages, &Start::default());
        self.iterations = iterations;
        if outcome != Outcome::Solved {
            return Err(LiftFailure::Solver(outcome));
        }
        let mut v = [0.0; JOINT_DIM];
        v.copy_from_slice(self.engine.stage(0).0);
        solve_upper(&hessian, JOINT_DIM, &mut v);
        for j in 0..JOINT_DIM {
            y[j] += v[j];
        }
        Ok(())
    }
}

/// `C` with `C Cᵀ = S`, upper triangular, of the torques of a phase; none if their precision is not positive definite.
pub fn torque_deviation(phase: &ControlPhase) -> Option<[[f64; JOINT_DIM]; JOINT_DIM]> {
    // S⁻¹ = K Kᵀ, C = K⁻ᵀ.
    let inverse = Cholesky::new(phase.torque_precision)?.l().try_inverse()?;
    // Column by column the lower triangle is its transpose row by row.
    Some(inverse.lower_triangle().into())
}

/// The upright force of each foot in contact by its leg's torques, or none if a leg is singular.
pub fn foot_forces(
    plant: &ControlModel,
    stance: &StanceState,
) -> Option<[Option<Matrix3<f64>>; FOOT_DIM]> {
    let [roll, pitch, _] = stance.attitude_rad;
    let turned = to_upright(WrenchFrame::Body, [roll, pitch]);
    let rotation = Matrix3::from_fn(|row, col| turned[row][col]);
    let mut forces = [None; FOOT_DIM];
    for leg in Leg::down(stance.feet) {
        let joints = leg.of_joints(&stance.joints_rad);
        forces[leg.index()] = Some(rotation * plant.robot().foot_force_map(leg, &joints).ok()?);
    }
    Some(forces)
}
