//! Models of legged robots as equations, programs and text: the lower half of romc.
//!
//! A model file becomes a [`ReducedModel`](model::ReducedModel), its accelerations
//! [`Equations`](equations::Equations) over the expressions of [`symbolic`], these a
//! [`Program`](ir::Program); [`typeset`] and [`codegen`] print both. Nothing here knows recordings.
//!
//! `romc` re-exports every module; depend on that.

pub mod artifact;
pub mod codegen;
pub mod equations;
pub mod files;
pub mod ir;
pub mod limits;
pub mod lower;
pub mod model;
pub mod robot;
pub mod robot_file;
pub mod symbolic;
pub mod typeset;
