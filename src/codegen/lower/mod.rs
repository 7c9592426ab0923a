//! From a [model](crate::model::ReducedModel) to [programs](crate::ir::Program): a phase's accelerations, their
//! Jacobian, a Runge-Kutta step, the maps between robot and latent coordinates, the generalised inputs.
//!
//! Every decision that changes a rounding is made here: which subexpressions are shared, in which order sums are added,
//! that a power is a chain of products. Read `dynamics` first, then `expression`.

mod combination;
mod compiled;
mod dense;
mod dynamics;
mod expression;
#[cfg(test)]
#[path = "../../../tests/differential/lowered.rs"]
mod lowered;
mod maps;
mod nested;
mod number;
mod polynomial;
mod wrench;

pub use compiled::CompiledModel;
pub use dense::Form;
pub use dynamics::{JacobianPattern, LowerError, dynamics, dynamics_jacobian, rk4_step};
pub use maps::Map;
pub use wrench::{actuator_torque, generalised_input, leg_torque};
