//! The latent dynamics as equations: nothing else reads Xi to print or emit. Read `system.rs` first.
//!
//! For each phase the accelerations are sums of coefficients times expressions over named variables, in library order,
//! in one pool, in their shortest form unless asked otherwise.
//!
//! ```
//! use nalgebra::DMatrix;
//! use romc::equations::Equations;
//! use romc::model::{FeetRule, Library, Phase, ReducedModel};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let terms = ["1", "dz1", "sin(z1)"].map(str::to_owned);
//! let model = ReducedModel::builder("pendulum", Library::from_terms(1, &terms)?)
//!     .phase(Phase {
//!         name: "contact".into(),
//!         feet: FeetRule::Any,
//!         xi: DMatrix::from_column_slice(3, 1, &[0.0, -0.3, -9.81]),
//!     })
//!     .build()?;
//! let equations = Equations::of(&model);
//! let ddz1: Vec<_> = equations.phases[0]
//!     .summands(&equations, 0)
//!     .map(|(coefficient, term)| (coefficient, term.text.as_str()))
//!     .collect();
//! assert_eq!(ddz1, [(-0.3, "dz1"), (-9.81, "sin(z1)")]);
//! # Ok(())
//! # }
//! ```

mod physical;
mod system;

pub use physical::{LatentUnits, PhysicalError, Unit};
pub(crate) use system::summand_words;
pub use system::{Equations, ExactStep, PhaseEquations};

use std::borrow::Cow;
use std::fmt;

use nalgebra::{DMatrix, DVector};
use system::Summand;

use crate::model::{
    AffineMap, CandidateTerm, CoordinateNames, FeetRule, LatentVariable, LatentWords, Library,
    MAX_TERM_LEN, ModelError, Phase, ReducedModel, ScaleFactors, Scaling,
};
use crate::symbolic::{ExprId, ExprPool, Node, Shortened, Shortener, SymbolId};
