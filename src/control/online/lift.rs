//! Torques that can carry a latent input: the lift that obeys the ground.
//!
//! `u = W_eᵀ u_lat` returns torques *and* a body force, and nothing ties the two together. The
//! consistent lift looks for the torques alone and lets the legs make the force:
//!
//! ```text
//! minimise   ‖ M τ − u_lat ‖² + w (τ − m)ᵀ S⁻¹ (τ − m),   M = pinv(W_eᵀ) s_u [ I ; G(q, c) ]
//! subject to |τ + ℓ| ≤ τ_max,   ‖(R F_k)_{x,y}‖ ≤ μ (R F_k)_z,   F_k = −J_k⁻ᵀ τ_k for each foot k in contact
//! ```
//!
//! `τ` are the torques at the links and `τ + ℓ` the command, with the losses `ℓ` of the joints in the
//! planned motion. `G(q, c)` maps torques to force and moment of the feet in contact, in the frame of
//! the model's inputs; `m` and `S` are mean and covariance of the training torques in the phase,
//! `R` turns the body frame upright. The prior
//! decides what the latent input leaves open, twelve torques against a few latent coordinates.
//! `τ = 0` satisfies every constraint, as `ℓ` is never beyond the limits.
//!
//! Torques are written by the standard deviations of the training's, `τ = m + C y` with `C Cᵀ = S`,
//! and with `A = M C / √w` and `r = (u_lat − M m) / √w` the program becomes
//!
//! ```text
//! minimise ½ ‖A y − r‖² + ½ ‖y‖²   subject to the rows,
//! y₀ = Aᵀ (I + A Aᵀ)⁻¹ r,   I + Aᵀ A = L Lᵀ,   y = y₀ + L⁻ᵀ v:   minimise ½ ‖v‖²
//! ```
//!
//! `y₀` takes a system of as many unknowns as latent coordinates and is the solution if it keeps all
//! rows; otherwise `½ ‖v‖²` under the rows is a program of one stage, for clarabel with the cones or for the
//! structured solver with the pyramids inside them. Torques are the solution of one convex
//! program for every latent input, and change continuously with it.

use nalgebra::{Cholesky, Matrix3};

use super::conic::Conic;
use super::control_model::{ControlModel, ControlPhase};
use super::dense::{factorise, solve_lower, solve_upper};
use super::engine::{StageSolver, Start};
use super::error::ControlError;
use super::problem::upright;
use super::qp::{Outcome, QpSettings};
use super::settings::{MpcSettings, Solver};
use super::stage::{CONE_ROWS, FrictionShape, PYRAMID_ROWS, StageCost, StageQp, StageShape};
use super::structured::{Structured, TOLERANCE};
use crate::robot::{ContactFlags, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM, Leg};
use crate::solver::Settings;

/// Cap on the interior-point iterations of a lift.
pub const LIFT_ITERATIONS: u32 = 60;
/// Curvature of the cost as the solvers have it: `CURVATURE / 2 ‖v‖²`. Inputs a few deviations beyond the
/// limits then have multipliers near those at which iterations begin.
pub const CURVATURE: f64 = 0.01;

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
    solver: Box<dyn StageSolver>,
    friction: FrictionShape,
    qp: StageQp,
    /// `pinv(W_eᵀ) s_u`, split into its columns for torques and for force and moment.
    by_torque: Vec<Torque>,
    by_wrench: Vec<[f64; 6]>,
    /// `M`, `A`, the factor of `I + A Aᵀ` row by row, and `r`.
    map: Vec<Torque>,
    scaled_map: Vec<Torque>,
    square: Vec<f64>,
    residual: Vec<f64>,
    /// `C` of each phase.
    deviation: Vec<Option<[Torque; JOINT_DIM]>>,
    limit_nm: Torque,
    weight_n: f64,
    foot_friction: f64,
    prior_weight: f64,
    iterations: u32,
}

impl ConsistentLift {
    /// Prepares the lift, for the solver that the settings name.
    ///
    /// # Errors
    /// [`ControlError::Solver`] if clarabel refuses the program.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Result<Self, ControlError> {
        let d = plant.latent_dim();
        let friction = settings.solver.friction();
        let (pyramids, cones) = match friction {
            FrictionShape::Cone => (0, FOOT_DIM),
            FrictionShape::Pyramid => (FOOT_DIM, 0),
        };
        let shape = StageShape {
            inputs: JOINT_DIM,
            input_rows: 2 * JOINT_DIM + PYRAMID_ROWS * pyramids,
            cones,
            ..StageShape::default()
        };
        let mut lift = Self {
            solver: solver(shape, settings)?,
            friction,
            qp: StageQp::zeros(&shape),
            by_torque: vec![[0.0; JOINT_DIM]; d],
            by_wrench: vec![[0.0; 6]; d],
            map: vec![[0.0; JOINT_DIM]; d],
            scaled_map: vec![[0.0; JOINT_DIM]; d],
            square: vec![0.0; d * d],
            residual: vec![0.0; d],
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

    /// Takes the projection of another plant: that at the measured state, where it depends on it.
    pub(super) fn take_projection(&mut self, plant: &ControlModel) {
        for (latent, row) in plant.parts().projection.row_iter().enumerate() {
            self.by_torque[latent] = std::array::from_fn(|joint| row[joint]);
            self.by_wrench[latent] = std::array::from_fn(|axis| row[JOINT_DIM + axis]);
        }
    }

    /// Torques at the links, N m, for a latent input on a stance; with the stance's losses added they
    /// are within the motors' limits.
    ///
    /// # Errors
    /// [`LiftFailure`] if a leg in contact is singular or the program is not solved.
    pub fn lift(
        &mut self,
        plant: &ControlModel,
        u_lat: &[f64],
        stance: &StanceState,
    ) -> Result<[f64; JOINT_DIM], LiftFailure> {
        self.iterations = 0;
        let forces = foot_forces(plant, stance).ok_or(LiftFailure::SingularLeg)?;
        self.write_map(plant, stance)?;
        let deviation = self.deviation[stance.phase].ok_or(BROKEN)?;
        let mean: Torque = plant.phases()[stance.phase].torque_mean.into();
        let mut y = self.free_optimum(&deviation, &mean, u_lat).ok_or(BROKEN)?;
        let torque = torque_of(&deviation, &mean, &y);
        self.write_limits(&torque, &stance.losses_nm);
        match self.friction {
            FrictionShape::Cone => self.write_cones(&torque, &forces),
            FrictionShape::Pyramid => self.write_pyramids(&torque, &forces),
        }
        if !self.is_kept() {
            self.constrain(&deviation, &mut y)?;
        }
        let torque = torque_of(&deviation, &mean, &y);
        Ok(std::array::from_fn(|joint| {
            let (loss, limit) = (stance.losses_nm[joint], self.limit_nm[joint]);
            torque[joint].clamp(-limit - loss, limit - loss)
        }))
    }

    /// Interior-point iterations of the last lift; zero if no constraint was active.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Writes `M`.
    fn write_map(&mut self, plant: &ControlModel, stance: &StanceState) -> Result<(), LiftFailure> {
        let wrench = plant
            .input_rule()
            .wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet)
            .map_err(|_| LiftFailure::SingularLeg)?;
        for latent in 0..self.map.len() {
            for joint in 0..JOINT_DIM {
                let mut by_wrench = 0.0;
                for axis in 0..6 {
                    by_wrench += wrench[(axis, joint)] * self.by_wrench[latent][axis];
                }
                self.map[latent][joint] = self.by_torque[latent][joint] + by_wrench;
            }
        }
        Ok(())
    }

    /// Writes `A` and returns `y₀`; none if a number is not finite.
    fn free_optimum(
        &mut self,
        deviation: &[Torque; JOINT_DIM],
        mean: &Torque,
        u_lat: &[f64],
    ) -> Option<Torque> {
        let d = self.map.len();
        let scale = 1.0 / self.prior_weight.sqrt();
        for i in 0..d {
            let row = &self.map[i];
            let mut left = u_lat[i];
            for j in 0..JOINT_DIM {
                left -= row[j] * mean[j];
                let mut sum = 0.0;
                for k in 0..=j {
                    sum += row[k] * deviation[k][j];
                }
                self.scaled_map[i][j] = scale * sum;
            }
            self.residual[i] = scale * left;
        }
        for i in 0..d {
            for j in 0..=i {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                for k in 0..JOINT_DIM {
                    sum += self.scaled_map[i][k] * self.scaled_map[j][k];
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
                y[j] += self.scaled_map[i][j] * self.residual[i];
            }
        }
        Some(y)
    }

    /// Both sides of the torque limits as rows on the torques, and the room that `torque` leaves.
    fn write_limits(&mut self, torque: &Torque, losses_nm: &Torque) {
        let rows = &mut self.qp.input;
        rows.clear();
        for sign in [1.0, -1.0] {
            for joint in 0..JOINT_DIM {
                let limit = self.limit_nm[joint];
                let mut row = [0.0; JOINT_DIM];
                row[joint] = sign / limit;
                let room = 1.0 - sign * ((torque[joint] + losses_nm[joint]) / limit);
                rows.push(&row, room);
            }
        }
    }

    /// The pyramid `|F_x|, |F_y| <= μ F_z / √2` of each foot in contact.
    fn write_pyramids(&mut self, torque: &Torque, forces: &FootForces) {
        for leg in 0..FOOT_DIM {
            let Some(force) = &forces[leg] else {
                continue;
            };
            for side in 0..PYRAMID_ROWS {
                let sign = if side % 2 == 0 { 1.0 } else { -1.0 };
                let mut row = [0.0; JOINT_DIM];
                let mut room = 0.0;
                for k in 0..3 {
                    let within =
                        self.foot_friction * force[(2, k)] * std::f64::consts::FRAC_1_SQRT_2;
                    let entry = (sign * force[(side / 2, k)] - within) / self.weight_n;
                    row[3 * leg + k] = entry;
                    room -= entry * torque[3 * leg + k];
                }
                self.qp.input.push(&row, room);
            }
        }
    }

    /// The cone of each foot; one in the air has the axis as its slack, strictly inside.
    fn write_cones(&mut self, torque: &Torque, forces: &FootForces) {
        self.qp.cones.clear();
        for leg in 0..FOOT_DIM {
            for (axis, factor) in [(2, self.foot_friction), (0, 1.0), (1, 1.0)] {
                let mut row = [0.0; JOINT_DIM];
                let mut room = if axis == 2 { 1.0 } else { 0.0 };
                if let Some(force) = &forces[leg] {
                    room = 0.0;
                    for k in 0..3 {
                        let entry = factor * force[(axis, k)] / self.weight_n;
                        row[3 * leg + k] = -entry;
                        room += entry * torque[3 * leg + k];
                    }
                }
                self.qp.cones.push(&row, room);
            }
        }
    }

    /// Whether the rows are kept as they are; written so that room that is not a number counts as violated.
    fn is_kept(&self) -> bool {
        let (cones, _) = self.qp.cones.bounds.as_chunks::<CONE_ROWS>();
        self.qp.input.bounds.iter().all(|room| *room >= 0.0)
            && cones.iter().all(|[axis, x, y]| x.hypot(*y) <= *axis)
    }

    /// Moves `y` from the optimum without rows to the one under them.
    fn constrain(
        &mut self,
        deviation: &[Torque; JOINT_DIM],
        y: &mut Torque,
    ) -> Result<(), LiftFailure> {
        let mut hessian = [0.0; JOINT_DIM * JOINT_DIM];
        for i in 0..JOINT_DIM {
            for j in 0..=i {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                for row in &self.scaled_map {
                    sum += row[i] * row[j];
                }
                hessian[i * JOINT_DIM + j] = sum;
            }
        }
        if !factorise(&mut hessian, JOINT_DIM) {
            return Err(BROKEN);
        }
        for rows in [&mut self.qp.input, &mut self.qp.cones] {
            for row in rows.entries.as_chunks_mut::<JOINT_DIM>().0 {
                let mut by_deviation = [0.0; JOINT_DIM];
                for j in 0..JOINT_DIM {
                    for k in 0..=j {
                        by_deviation[j] += row[k] * deviation[k][j];
                    }
                }
                solve_lower(&hessian, JOINT_DIM, &mut by_deviation);
                *row = by_deviation;
            }
        }
        let stages = std::slice::from_ref(&self.qp);
        self.solver.forget();
        self.solver.prepare(stages, 0, &[true]);
        let (outcome, iterations) = self.solver.solve(stages, &Start::default());
        self.iterations = iterations;
        if outcome != Outcome::Solved {
            return Err(LiftFailure::Solver(outcome));
        }
        let mut v = [0.0; JOINT_DIM];
        v.copy_from_slice(self.solver.stage(0).0);
        solve_upper(&hessian, JOINT_DIM, &mut v);
        for j in 0..JOINT_DIM {
            y[j] += v[j];
        }
        Ok(())
    }
}

fn solver(shape: StageShape, settings: &MpcSettings) -> Result<Box<dyn StageSolver>, ControlError> {
    let cost = StageCost {
        state: Vec::new(),
        terminal: 1.0,
        input: CURVATURE,
        slack: 0.0,
    };
    Ok(match settings.solver {
        Solver::Clarabel => {
            let settings = QpSettings {
                max_iterations: LIFT_ITERATIONS,
                tolerance: 1e-12,
                ..settings.qp
            };
            Box::new(Conic::new(1, shape, &cost, settings)?)
        }
        Solver::Riccati => {
            let settings = Settings {
                max_iterations: LIFT_ITERATIONS,
                tolerance: TOLERANCE,
                // Torques are at stake: the largest product alone decides.
                gap: 0.0,
                accepted_residual: settings.qp.accepted_residual,
            };
            Box::new(Structured::<1, JOINT_DIM, false>::new(
                1, shape, &cost, settings,
            ))
        }
    })
}

/// `C` with `C Cᵀ = S`, upper triangular, of the torques of a phase; none if their precision is not
/// positive definite.
pub fn torque_deviation(phase: &ControlPhase) -> Option<[[f64; JOINT_DIM]; JOINT_DIM]> {
    // S⁻¹ = K Kᵀ, C = K⁻ᵀ.
    let inverse = Cholesky::new(phase.torque_precision)?.l().try_inverse()?;
    let entry = |row: usize, col: usize| if row <= col { inverse[(col, row)] } else { 0.0 };
    Some(std::array::from_fn(|row| {
        std::array::from_fn(|col| entry(row, col))
    }))
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

/// The upright force of each foot in contact by its leg's torques, or none if a leg is singular.
pub fn foot_forces(
    plant: &ControlModel,
    stance: &StanceState,
) -> Option<[Option<Matrix3<f64>>; FOOT_DIM]> {
    let [roll, pitch, _] = stance.attitude_rad;
    let turned = upright([roll, pitch]);
    let rotation = Matrix3::from_fn(|row, col| turned[row][col]);
    let mut forces = [None; FOOT_DIM];
    for leg in Leg::down(stance.feet) {
        let joints = leg.of_joints(&stance.joints_rad);
        forces[leg.index()] = Some(rotation * plant.robot().foot_force_map(leg, &joints).ok()?);
    }
    Some(forces)
}
