//! The reduced-order model: encoder, decoder, library, coefficients, phases.
//!
//! In: matrices, candidate terms as text, phases. Out: a [`ReducedModel`] whose every shape, rank, name and number has
//! been checked, so that later stages need no checks. Read `rom.rs` first: it states the equations and the units.
//!
//! ```
//! use nalgebra::{DMatrix, DVector};
//! use romc::model::{FeetRule, Library, Phase, ReducedModel};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A mass on a spring, pushed by u1: ddz1 = -4 z1 - 0.1 dz1 + 2 u1.
//! let library = Library::from_terms(1, &["z1".into(), "dz1".into(), "u1".into()])?;
//! let model = ReducedModel::builder("spring", library)
//!     .phase(Phase {
//!         name: "contact".into(),
//!         feet: FeetRule::Any,
//!         xi: DMatrix::from_column_slice(3, 1, &[-4.0, -0.1, 2.0]),
//!     })
//!     .build()?;
//! let [z, dz, u_lat] = [0.5, 1.0, 0.25].map(|value| DVector::from_element(1, value));
//! assert_eq!(model.ddz(0, &z, &dz, &u_lat)?[0], -4.0 * 0.5 - 0.1 * 1.0 + 2.0 * 0.25);
//!
//! // A latent-only model returns an error for maps of robot states.
//! assert!(model.encode(&DVector::zeros(18)).is_err());
//! # Ok(())
//! # }
//! ```

mod builder;
mod coordinates;
mod error;
mod identifier;
mod jump_prior;
mod latent_words;
mod library;
mod listed;
mod maps;
mod order;
mod rom;
mod standard_library;
mod state_map;
mod statistics;
mod stride_prior;

pub use crate::robot::FeetRule;
pub(crate) use builder::ModelBuilder;
pub use coordinates::{CoordinateNames, ScaleFactors, Scaling};
pub use error::ModelError;
pub use identifier::{Identifier, IdentifierError, check_name};
pub use jump_prior::{FEATURE_DIM, GOAL_DIM, GoalRange, JumpPart, JumpPrior, Landmark, Landmarks};
pub use latent_words::{LatentWords, MassCentre};
pub use library::{
    CandidateTerm, LatentVariable, Library, LibraryChoice, MAX_LATENT_DIM, MAX_TERM_LEN, Step, Tape,
};
pub use maps::{Activation, DENSITY_AT_ZERO, GELU_CUBIC, GELU_RATE, TAIL, Tangent, complement};
pub use order::CoordinateOrder;
pub use rom::{Phase, ReducedModel};
pub use standard_library::{LibraryOrder, StandardLibrary};
pub use state_map::{AffineMap, Layer, MAX_LAYERS, StateMap};
pub use statistics::{InputGivenState, InputStatistics};
pub use stride_prior::{GAIT_DIM, STRIDE_WIDTH, StridePrior};

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::ops::RangeInclusive;

use error::{Result, check, check_count, check_finite, check_shape, check_tensor};
use nalgebra::{DMatrix, DVector, DefaultAllocator, Dim, Dyn, Matrix, OMatrix, RawStorage};
use rom::selected;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};
use thiserror::Error;

use crate::robot::{
    Actuators, BODY_DIM, BODY_NAMES, BODY_X, ContactFlags, FOOT_DIM, InputRule, JOINT_DIM,
    JOINT_NAMES, LEG_JOINT_DIM, Leg, LegMoments, Robot, RobotError, STATE_DIM, WrenchFrame,
};
use crate::symbolic::{
    ExprId, ExprPool, Function, Node, Number, ParseError, SymbolId, integer_power,
};
