//! romc, the reduced-order model compiler.

pub mod artifact;
pub mod check;
pub mod cli;
pub mod codegen;
pub mod deploy;
pub mod equations;
mod error;
pub mod evaluate;
pub mod files;
pub mod import;
pub mod ir;
pub mod lower;
pub mod model;
pub mod mpc;
pub mod recording;
pub mod report;
pub mod robot;
pub mod sim;
pub mod simplify;
pub mod study;
pub mod symbolic;
pub mod train;
pub mod typeset;

pub use error::Error;
