//! Settings of [`MpcSettings`](super::MpcSettings) that choose between methods.

/// How a latent input becomes joint torques, each way with its number for interfaces without enumerations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Lift {
    /// The paper's `u = W_eᵀ u_lat`: its leading entries are the torques, which need not produce its body force.
    Transpose = 0,
    /// The torques whose own ground reaction forces come closest to the latent input, within torque limits and the
    /// friction cones of the feet in contact; see [`ConsistentLift`](super::ConsistentLift).
    Consistent = 1,
}

/// Trajectory about which the dynamics are linearised, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Linearisation {
    /// The reference: each stage is linearised once and reused while the horizon passes over it.
    Reference = 0,
    /// The last plan, shifted by one stage (real-time iteration).
    LastPlan = 1,
}

/// Source of the dynamics along the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Drift {
    /// The reference's own finite differences if it has an input, its own or an estimate, otherwise the model.
    Automatic,
    /// The reference's own finite differences: the model is trusted for deviations only.
    Reference,
    /// The model.
    Model,
}

/// Input of a reference that comes without one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MissingInput {
    /// Estimated from the reference's accelerations and the model, see `estimate`.
    Estimate,
    /// The mean training input of each phase: the optimisation has to find the rest.
    Mean,
}

/// Which constraint rows a stage carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowSelection {
    /// Those that can become active, see [`StageRows::new`](super::problem::StageRows::new).
    Needed,
    /// All of them.
    All,
}

/// Solver of the quadratic program of a step, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Solver {
    /// clarabel, for all rows and cones.
    Clarabel = 0,
    /// The structured [`solver`](crate::solver). It supports at most
    /// [`MAX_STRUCTURED_DIM`](super::structured::MAX_STRUCTURED_DIM) latent coordinates and replaces friction cones by
    /// the pyramids inside them.
    Riccati = 1,
}

/// Where the legs of a command come from, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Legs {
    /// Decoded from the latent state: for models that represent the legs.
    Decoded = 0,
    /// Those of the reference: joint targets, the joint losses along them, and the torques that the consistent lift
    /// prefers.
    Reference = 1,
}

/// Behaviour after the end of the reference, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AfterEnd {
    /// The last sample is held.
    Hold = 0,
    /// Torques fade into joint damping.
    Damp = 1,
    /// Torques and gains fade to zero.
    Stop = 2,
}
