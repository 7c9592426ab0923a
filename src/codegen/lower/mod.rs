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

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use combination::{Combination, Term, linear_combination, scaled};
use expression::ExpressionLowering;
use nalgebra::{DMatrix, DVector};
use nested::{Demand, Nested};
use number::{Sheet, ids, numbers};

use crate::equations::{Equations, PhaseEquations};
use crate::ir::{
    Binary, Interpreter, IrError, LANES, Program, ProgramBuilder, Table, Unary, ValueId, Vector,
};
use crate::model::{
    Activation, DENSITY_AT_ZERO, GELU_CUBIC, GELU_RATE, LatentVariable, ModelError, ReducedModel,
    StateMap, TAIL,
};
use crate::symbolic::{ExprId, ExprPool, Function, Node, SymbolId, sum_of_floats};

type Result<T, E = LowerError> = std::result::Result<T, E>;
