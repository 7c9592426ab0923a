//! romc, the reduced-order model compiler: from recordings of a legged robot to a small symbolic model of its jump, and
//! from the model to equations, code and joint torques.
//!
//! A model has an encoder and a decoder between the robot's state `x` and a few latent coordinates `z`, and per phase
//! (contact, flight) sparse accelerations `ddz = Xi^T Theta(z, dz, u_lat)` over a library of candidate terms. The
//! stages, each a module that can be used alone:
//!
//! | stage | in | out |
//! |---|---|---|
//! | [`recording`] | CSV files | [`Recording`](recording::Recording): segments of samples in SI units |
//! | [`identify`] | recordings | gravity, mass and the joints' losses, with standard errors |
//! | [`train`] | recordings | a [`ReducedModel`](model::ReducedModel) |
//! | [`artifact`], [`import`] | a model file; tensors or equations of other tools | the same |
//! | [`equations`] | a model | [`Equations`](equations::Equations): its accelerations as expressions of [`symbolic`] |
//! | [`simplify`] | a model, a domain, a tolerance | a shorter model with a certificate |
//! | [`typeset`] | equations | LaTeX, Markdown, MathML |
//! | [`lower`], [`ir`], [`codegen`] | equations | programs; C, Rust, Python, CasADi, MATLAB |
//! | [`sim`], [`evaluate`], [`report`] | a model, recordings | rollouts, figures, a page |
//! | [`mpc`], [`deploy`] | a model, a measured state, a reference | joint torques; a controller's crate |
//!
//! A shipped model against a jump that its training did not see, then as LaTeX and C:
//!
//! ```
//! use std::path::Path;
//! use romc::deploy::{EmitOptions, Target, emit};
//! use romc::equations::Equations;
//! use romc::evaluate::Assessment;
//!
//! let root = Path::new(env!("CARGO_MANIFEST_DIR"));
//! let model = romc::artifact::read(&root.join("models/go1-d4.json"))?;
//! let jump = romc::recording::read(&root.join("examples/recordings/go1/test_01.csv.gz"))?;
//!
//! // rollouts over the whole jump, and started again from the recorded state every 0.1 s
//! let jumps = [jump];
//! let assessment = Assessment::over(&model, &jumps, 0.1)?;
//! assert_eq!(assessment.runs[0].full.diverged_at_s(), None);
//!
//! let files = emit(&Equations::of(&model), &[Target::Latex, Target::C], &EmitOptions::default())?;
//! let source = files.iter().find(|file| file.path == "go1_d4.c").expect("the C source");
//! assert!(source.contents.contains("void go1_d4_contact_dynamics("));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/train_model.rs` trains one, `examples/latent_mpc.rs` runs the controller. `ARCHITECTURE.md` has the rooms
//! and who may import whom, `docs/explanation/model.md` the equations.

#[cfg(test)]
extern crate self as romc; // for test files that were written from outside

pub mod check;
pub mod cli;
pub mod deploy;
mod error;
pub mod import;
pub mod report;
pub mod simplify;
pub(crate) mod study;

#[doc(inline)]
pub use romc_cas as symbolic;
#[doc(inline)]
pub use romc_codegen::{codegen, equations, ir, lower, typeset};
#[doc(inline)]
pub use romc_control::solver;
#[doc(inline)]
pub use romc_data::{identify, recording};
#[doc(inline)]
pub use romc_learn::{evaluate, mpc, plan, sim, train};
#[doc(inline)]
pub use romc_model::{artifact, files, limits, model, robot_file};
#[doc(inline)]
pub use romc_robot as robot;

pub use error::Error;
