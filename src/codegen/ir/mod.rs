//! Programs: computations and their order.
//!
//! A [`Program`] enters from `lower` (through `ProgramBuilder`); C, Rust and the interpreter run its statements in
//! the same order with the same association, so that results agree bit for bit. Read `program` first, then `interpret`.
//!
//! ```
//! use romc::equations::Equations;
//! use romc::ir::Interpreter;
//! use romc::lower::{Form, dynamics};
//! use romc::model::{FeetRule, Library, Phase, ReducedModel};
//!
//! let library = Library::from_terms(1, &["z1".to_owned()])?;
//! let (name, xi) = ("contact".to_owned(), nalgebra::DMatrix::from_element(1, 1, -40.0));
//! let contact = Phase { name, feet: FeetRule::Any, xi };
//! let spring = ReducedModel::builder("spring", library).phase(contact).build()?;
//! let program = dynamics(&Equations::of(&spring), 0, Form::StraightLine)?;
//!
//! let mut ddz = [0.0];
//! Interpreter::new(&program).run(&[&[0.5], &[0.0], &[0.0]], &mut [&mut ddz]);
//! assert_eq!(ddz, [-20.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod build;
pub(crate) mod interpret;
mod operation;
mod program;
#[cfg(test)]
#[path = "../../../tests/differential/sines.rs"]
mod sines;

pub(crate) use build::IrError;
pub(crate) use build::ProgramBuilder;
pub use interpret::{
    Interpreter,
    double::{LIMIT, reduced_sin_cos, sin_cos},
};
pub use operation::{Binary, Unary};
pub(crate) use operation::{FUNCTIONS, alternating};
pub(crate) use program::{LANES, Table, Vector};
pub use program::{Program, Slot, Statement, ValueId};
