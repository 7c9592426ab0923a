//! Programs: what is computed, in which order.
//!
//! A [`Program`] enters from `lower` (through [`ProgramBuilder`]); C, Rust and the interpreter run its statements in
//! the same order with the same association, so that results agree bit for bit. Read `program` first, then `interpret`.
//!
//! ```
//! use romc::ir::{Binary, Interpreter, ProgramBuilder};
//!
//! let mut builder = ProgramBuilder::new("area");
//! let sides = builder.input("sides", 2);
//! let area = builder.binary(Binary::Mul, sides[0], sides[1]);
//! builder.output("area", &[area]);
//! let program = builder.finish().expect("finite");
//!
//! let mut area = [0.0];
//! Interpreter::new(&program).run(&[&[3.0, 4.0]], &mut [&mut area]);
//! assert_eq!(area, [12.0]);
//! ```

mod build;
pub mod interpret;
mod operation;
mod program;

pub use build::{IrError, ProgramBuilder};
pub use interpret::Interpreter;
pub use operation::{Binary, Unary};
pub(crate) use operation::{FUNCTIONS, alternating};
pub(crate) use program::{LANES, Table};
pub use program::{Program, Slot, Statement, ValueId, Vector};
