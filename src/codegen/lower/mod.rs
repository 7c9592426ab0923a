//! From a model to programs.
//!
//! A [`ReducedModel`](crate::model::ReducedModel) and a phase enter, a
//! [`Program`](crate::ir::Program) leaves: the accelerations, their Jacobian, a Runge-Kutta step,
//! one of the maps between robot and latent coordinates, or the generalised inputs. Every decision that changes
//! a rounding is made here: which subexpressions are shared, in which order sums are
//! added, that a power is a chain of products. Read `dynamics` first, then `expression`.

mod combination;
mod compiled;
mod cost;
mod dense;
mod dynamics;
mod error;
mod expression;
mod maps;
mod nested;
mod network;
mod number;
mod solve;
mod step;
mod sums;
mod wrench;

pub use compiled::CompiledModel;
pub use cost::Form;
pub use dynamics::{JacobianPattern, dynamics, dynamics_jacobian};
pub use error::LowerError;
pub use maps::Map;
pub use step::rk4_step;
pub use wrench::{actuator_torque, generalised_input};
