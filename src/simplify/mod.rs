//! Simplification with a certificate: fewer terms and digits, and how far `ddz` can be off for it.
//!
//! A model, a [`Domain`] (a box of latent states and inputs per phase, from recordings or given) and a [`Tolerance`]
//! enter; a simpler model leaves with a [`Certificate`] that lists every change with the interval in which its error
//! lies over the whole box, and with its error at the recorded samples. `docs/simplification.md` has the mathematics.
//! Read `run.rs` first, then `equation.rs` (what may take a term's place, and which changes are made) and `ranges.rs`
//! (the intervals).
//!
//! ```
//! use nalgebra::DMatrix;
//! use romc::model::{FeetRule, Library, Phase, ReducedModel};
//! use romc::equations::Equations;
//! use romc::simplify::{Domain, Tolerance, simplify};
//! use romc::symbolic::Interval;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A pendulum that hardly moves: ddz1 = -9.81 sin(z1) - 0.00003 dz1 + 2.0004 u1.
//! let terms = ["z1", "dz1", "sin(z1)", "u1"].map(str::to_owned);
//! let model = ReducedModel::builder("pendulum", Library::from_terms(1, &terms)?)
//!     .phase(Phase {
//!         name: "contact".into(),
//!         feet: FeetRule::Any,
//!         xi: DMatrix::from_column_slice(4, 1, &[0.0, -0.00003, -9.81, 2.0004]),
//!     })
//!     .build()?;
//! let small = Interval::new(-0.1, 0.1);
//! let domain = Domain::new(&model, vec![Some(vec![small, small, small])])?;
//! let simplified = simplify(&Equations::of(&model), &domain, None, Tolerance::Absolute(1e-3))?;
//! let left = simplified.model.active_terms(0, 0)?;
//! let left: Vec<_> = left.iter().map(|(xi, term)| (*xi, term.text())).collect();
//! assert_eq!(left, [(-9.794, "z1"), (2.0, "u1")]);
//! let equation = &simplified.certificate.phases[0].equations[0];
//! assert!(equation.bound.magnitude() <= 1e-3);
//! # Ok(())
//! # }
//! ```

mod certificate;
mod domain;
mod equation;
mod measure;
mod ranges;
mod run;
mod tables;
mod workspace;

pub use certificate::{Certificate, Tolerance, ToleranceError, certificate_json};
pub use domain::{Domain, MARGIN, Samples, SimplifyError};
pub use measure::{PrintedEquation, RolloutEffect};
pub(crate) use measure::{RolloutBasis, printed, rollouts_json};
pub use run::{Simplified, simplify};
pub use tables::markdown;
pub(crate) use tables::{bound_words, change_table, equation_table, lost_words, rollout_table};
