//! Torques that can carry a latent input: the lift that obeys the ground.
//!
//! `u = W_eᵀ u_lat` returns torques *and* a body force, and nothing ties the two together. The
//! consistent lift looks for the torques alone and lets the legs make the force:
//!
//! ```text
//! minimise   ‖ M τ − u_lat ‖² + w (τ − m_p)ᵀ S_p⁻¹ (τ − m_p),   M = pinv(W_eᵀ) s_u [ I ; G(q, c) ]
//! subject to |τ + ℓ| ≤ τ_max,   ‖(R F_k)_{x,y}‖ ≤ μ (R F_k)_z,   F_k = −J_k⁻ᵀ τ_k for each foot k in contact
//! ```
//!
//! `τ` are the torques at the links and `τ + ℓ` the command, with what the joints take, `ℓ`, in the
//! planned motion. `G(q, c)` maps torques to force and moment of the feet in contact, in the frame of
//! the model's inputs; `m_p` and `S_p` are mean and covariance of the training torques in the phase,
//! `R` turns the body frame upright. The prior
//! decides what the latent input leaves open, twelve torques against a few latent coordinates.
//! `τ = 0` satisfies every constraint, as `ℓ` is never beyond the limits.
//!
//! If the optimum without constraints satisfies them it is the optimum; only otherwise is a program
//! solved: by clarabel with these cones (`lift_cones`), or by the structured solver with the pyramid
//! `|F_x|, |F_y| <= μ F_z / √2` inside each of them (`lift_pyramids`). Whichever it is, the optimum
//! without constraints is checked against the constraints that the program has: torques are then the
//! solution of one convex program for every latent input, and change continuously with it.

use nalgebra::Matrix3;

use super::control_model::ControlModel;
use super::error::ControlError;
use super::lift_cones::{cone_solver, lift_in_cones};
use super::lift_pyramids::PyramidLift;
use super::problem::upright;
use super::qp::{Outcome, QpSettings, QpSolver};
use super::settings::{MpcSettings, Solver};
use crate::robot::{ContactFlags, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM, Leg};

/// Cap on the interior-point iterations of a lift.
pub const LIFT_ITERATIONS: u32 = 60;

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
    /// What the joints take of the motors' torques, N m, at most the torque limits; zero in a model
    /// without actuators.
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

/// The constants of the constraints and of the prior.
#[derive(Debug, Clone, Copy)]
pub(super) struct LiftRules {
    /// Torque limits, N m.
    pub limit_nm: [f64; JOINT_DIM],
    /// The robot's weight, N, in units of which forces are.
    pub weight_n: f64,
    /// Friction coefficient of each foot.
    pub friction: f64,
    /// Weight of the prior.
    pub prior_weight: f64,
}

impl LiftRules {
    /// The torque at the links nearest to one that keeps a joint's command within its limit.
    pub(super) fn within_limit(
        &self,
        torque_nm: f64,
        joint: usize,
        losses_nm: &[f64; JOINT_DIM],
    ) -> f64 {
        let (loss, limit) = (losses_nm[joint], self.limit_nm[joint]);
        torque_nm.clamp(-limit - loss, limit - loss)
    }
}

/// One latent input to be lifted.
#[derive(Debug, Clone, Copy)]
pub(super) struct LiftProblem<'a> {
    /// `M`, a row per latent coordinate.
    pub map: &'a [[f64; JOINT_DIM]],
    /// The latent input.
    pub u_lat: &'a [f64],
    /// The upright force of each foot in contact by its leg's torques.
    pub forces: &'a [Option<Matrix3<f64>>; FOOT_DIM],
    /// What the joints take, N m.
    pub losses_nm: &'a [f64; JOINT_DIM],
}

#[derive(Debug)]
enum Method {
    Cones(Box<QpSolver>),
    Pyramids(Box<PyramidLift>),
}

/// The consistent lift of one model on its robot, with its own persistent solver.
#[derive(Debug)]
pub struct ConsistentLift {
    method: Method,
    /// `pinv(W_eᵀ) s_u`, split into its columns for torques and for force and moment.
    by_torque: Vec<[f64; JOINT_DIM]>,
    by_wrench: Vec<[f64; 6]>,
    /// `M` of the last lift.
    map: Vec<[f64; JOINT_DIM]>,
    rules: LiftRules,
    iterations: u32,
}

impl ConsistentLift {
    /// Prepares the lift, for the solver that the settings name.
    ///
    /// # Errors
    /// [`ControlError::Solver`] if clarabel refuses the program.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Result<Self, ControlError> {
        let d = plant.latent_dim();
        let method = match settings.solver {
            Solver::Clarabel => {
                let settings = QpSettings {
                    max_iterations: LIFT_ITERATIONS,
                    tolerance: 1e-8,
                    ..settings.qp
                };
                Method::Cones(Box::new(cone_solver(settings)?))
            }
            Solver::Riccati => Method::Pyramids(Box::new(PyramidLift::new(
                d,
                plant.phases(),
                LIFT_ITERATIONS,
                settings.qp.accepted_residual,
            ))),
        };
        let mut lift = Self {
            method,
            by_torque: vec![[0.0; JOINT_DIM]; d],
            by_wrench: vec![[0.0; 6]; d],
            map: vec![[0.0; JOINT_DIM]; d],
            rules: LiftRules {
                limit_nm: *plant.robot().torque_limit_nm(),
                weight_n: plant.robot().mass_kg() * GRAVITY_M_S2,
                friction: settings.foot_friction,
                prior_weight: settings.lift_prior_weight,
            },
            iterations: 0,
        };
        lift.take_projection(plant);
        Ok(lift)
    }

    /// Takes the projection of another plant: that at the measured state, where it depends on it.
    pub fn take_projection(&mut self, plant: &ControlModel) {
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
        let wrench = plant
            .input_rule()
            .wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet)
            .map_err(|_| LiftFailure::SingularLeg)?;
        let forces = foot_forces(plant, stance).ok_or(LiftFailure::SingularLeg)?;
        for (latent, row) in self.map.iter_mut().enumerate() {
            for (joint, entry) in row.iter_mut().enumerate() {
                let mut by_wrench = 0.0;
                for (axis, factor) in self.by_wrench[latent].iter().enumerate() {
                    by_wrench += wrench[(axis, joint)] * factor;
                }
                *entry = self.by_torque[latent][joint] + by_wrench;
            }
        }
        let problem = LiftProblem {
            map: &self.map,
            u_lat,
            forces: &forces,
            losses_nm: &stance.losses_nm,
        };
        let phase = &plant.phases()[stance.phase];
        let (torque, iterations) = match &mut self.method {
            Method::Cones(solver) => lift_in_cones(solver, phase, &problem, &self.rules),
            Method::Pyramids(pyramids) => {
                pyramids.lift((stance.phase, phase), &problem, &self.rules)
            }
        };
        self.iterations = iterations;
        torque
    }

    /// Interior-point iterations of the last lift; zero if no constraint was active.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }
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
