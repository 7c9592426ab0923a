//! Integration of the hybrid model.
//!
//! `compiled.rs`: a model's programs, run by the interpreter.

mod compiled;

pub use compiled::CompiledModel;
