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
//! If the optimum without constraints satisfies them it is the optimum; only otherwise is the
//! conic program solved.

use nalgebra::{Cholesky, Matrix3, SMatrix, SVector};

use super::control_model::{ControlModel, ControlPhase};
use super::error::ControlError;
use super::problem::upright;
use super::qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver};
use super::settings::MpcSettings;
use super::sparse::SparseColumns;
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, Leg};

type Torque = SVector<f64, JOINT_DIM>;
type TorqueSquare = SMatrix<f64, JOINT_DIM, JOINT_DIM>;

/// Gravity, m/s², for the weight that scales rows of forces.
const GRAVITY: f64 = 9.81;
/// Rows of the two sides of the torque limits.
const BOUND_ROWS: usize = 2 * JOINT_DIM;

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

/// Why no torques were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiftFailure {
    /// A leg in contact is stretched: its torques do not determine its force.
    SingularLeg,
    /// The conic program was not solved.
    Solver(Outcome),
}

/// The consistent lift of one model on its robot, with its own persistent solver.
#[derive(Debug)]
pub struct ConsistentLift {
    solver: QpSolver,
    /// `pinv(W_eᵀ) s_u`, split into its columns for torques and for force and moment.
    by_torque: Vec<[f64; JOINT_DIM]>,
    by_wrench: Vec<[f64; 6]>,
    limit_nm: Torque,
    weight_n: f64,
    friction: f64,
    prior_weight: f64,
    iterations: u32,
}

impl ConsistentLift {
    /// Prepares the lift.
    ///
    /// # Errors
    /// [`ControlError::Solver`] if the conic solver refuses the program.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Result<Self, ControlError> {
        let projection = plant.projection_matrix();
        let row = |latent: usize| projection.row(latent);
        Ok(Self {
            solver: QpSolver::new(
                empty_program(),
                QpSettings {
                    max_iterations: 60,
                    tolerance: 1e-8,
                    ..settings.qp
                },
            )?,
            by_torque: (0..plant.latent_dim())
                .map(|i| std::array::from_fn(|j| row(i)[j]))
                .collect(),
            by_wrench: (0..plant.latent_dim())
                .map(|i| std::array::from_fn(|j| row(i)[JOINT_DIM + j]))
                .collect(),
            limit_nm: Torque::from(*plant.robot().torque_limit_nm()),
            weight_n: plant.robot().mass_kg() * GRAVITY,
            friction: settings.foot_friction,
            prior_weight: settings.lift_prior_weight,
            iterations: 0,
        })
    }

    /// Takes the projection of another plant: that at the measured state, where it depends on it.
    pub fn take_projection(&mut self, plant: &ControlModel) {
        let projection = plant.projection_matrix();
        for (latent, row) in projection.row_iter().enumerate() {
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
        let (hessian, gradient) = self.cost(&plant.phases()[stance.phase], &wrench, u_lat);
        if let Some(factor) = Cholesky::new(hessian) {
            let torque = factor.solve(&-gradient);
            if self.is_allowed(&torque, &forces, &stance.losses_nm) {
                return Ok(torque.into());
            }
        }
        self.solve(&hessian, &gradient, &forces, &stance.losses_nm)
    }

    /// Interior-point iterations of the last lift; zero if no constraint was active.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Hessian and gradient at zero of half the cost, by torques in N m.
    fn cost(
        &self,
        phase: &ControlPhase,
        wrench: &SMatrix<f64, 6, JOINT_DIM>,
        u_lat: &[f64],
    ) -> (TorqueSquare, Torque) {
        let mut hessian = phase.torque_precision * self.prior_weight;
        let mut gradient = -(hessian * phase.torque_mean);
        for (latent, &target) in u_lat.iter().enumerate() {
            let direct = Torque::from(self.by_torque[latent]);
            let row = direct + wrench.transpose() * SVector::<f64, 6>::from(self.by_wrench[latent]);
            hessian += row * row.transpose();
            gradient -= row * target;
        }
        (hessian, gradient)
    }

    fn is_allowed(
        &self,
        torque: &Torque,
        forces: &[Option<Matrix3<f64>>; FOOT_DIM],
        losses: &[f64; JOINT_DIM],
    ) -> bool {
        let within = (torque.iter().zip(losses))
            .zip(self.limit_nm.iter())
            .all(|((torque, loss), limit)| (torque + loss).abs() <= *limit);
        within
            && forces.iter().enumerate().all(|(leg, force)| match force {
                None => true,
                Some(map) => {
                    let force = map * torque.fixed_rows::<3>(3 * leg);
                    force.x.hypot(force.y) <= self.friction * force.z
                }
            })
    }

    fn solve(
        &mut self,
        hessian: &TorqueSquare,
        gradient: &Torque,
        forces: &[Option<Matrix3<f64>>; FOOT_DIM],
        losses: &[f64; JOINT_DIM],
    ) -> Result<[f64; JOINT_DIM], LiftFailure> {
        let (friction, weight, limit) = (self.friction, self.weight_n, self.limit_nm);
        let program = self.solver.program_mut();
        // Torques as shares of their limits, the cost with a largest curvature of one.
        let scaled = |row: usize, col: usize| hessian[(row, col)] * limit[row] * limit[col];
        let cost_scale = 1.0
            / (0..JOINT_DIM)
                .map(|i| scaled(i, i))
                .fold(f64::MIN_POSITIVE, f64::max);
        for col in 0..JOINT_DIM {
            for row in 0..=col {
                program.p.set(row, col, cost_scale * scaled(row, col));
            }
            program.q[col] = cost_scale * gradient[col] * limit[col];
            program.b[col] = 1.0 - losses[col] / limit[col];
            program.b[JOINT_DIM + col] = 1.0 + losses[col] / limit[col];
        }
        for (leg, force) in forces.iter().enumerate() {
            let first_row = BOUND_ROWS + 3 * leg;
            for (number, (axis, factor)) in
                [(2, friction), (0, 1.0), (1, 1.0)].into_iter().enumerate()
            {
                for joint in 0..3 {
                    let entry = force.map_or(0.0, |map| factor * map[(axis, joint)] / weight);
                    program.a.set(
                        first_row + number,
                        3 * leg + joint,
                        -entry * limit[3 * leg + joint],
                    );
                }
            }
            // A foot in the air has the cone's axis as its slack: strictly inside.
            program.b[first_row] = if force.is_some() { 0.0 } else { 1.0 };
        }
        let outcome = self.solver.solve();
        self.iterations = self.solver.iterations();
        match outcome {
            Outcome::Solved => {
                let solution = self.solver.solution();
                Ok(std::array::from_fn(|joint| {
                    let (loss, limit) = (losses[joint], limit[joint]);
                    (solution[joint] * limit).clamp(-limit - loss, limit - loss)
                }))
            }
            Outcome::Inaccurate
            | Outcome::Infeasible
            | Outcome::Unbounded
            | Outcome::IterationCap
            | Outcome::NumericalFailure => Err(LiftFailure::Solver(outcome)),
        }
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
    for leg in Leg::ALL {
        if stance.feet[leg.index()] {
            let joints = leg.of_joints(&stance.joints_rad);
            forces[leg.index()] = Some(rotation * plant.robot().foot_force_map(leg, &joints).ok()?);
        }
    }
    Some(forces)
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
