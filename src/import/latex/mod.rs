//! Equations of latent accelerations as LaTeX prints them, in `.tex` and Markdown files.
//!
//! A document enters; sections of equations in the grammar of candidate terms leave, each piece with its place. Displays
//! without a left side `\ddot z_k =` are skipped, as is the text, unless the only equations are in its lines; in a
//! display that is read, whatever has no meaning here is an error.
//!
//! Read `token.rs` and `markdown.rs` (text to tokens), `expander.rs` with `commands.rs` and `definitions.rs` (what of
//! them is printed), `sections.rs` (displays, equations and phases), `derivatives.rs`, `reader.rs`, `expression.rs`,
//! `variables.rs` and `numbers.rs` (one right side) in this order. `words.txt` has the words of LaTeX by their classes.

mod commands;
mod definitions;
mod derivatives;
mod expander;
mod expression;
mod markdown;
mod numbers;
mod reader;
mod sections;
mod token;
mod variables;

pub(super) use sections::read;
pub use variables::{NameError, SymbolNames};
