//! Equations of latent accelerations as LaTeX prints them, in `.tex` and Markdown files.
//!
//! A document enters; sections of equations in the grammar of candidate terms leave, each piece
//! with its place in the document, so that every later fault is reported there. Displays without
//! a left side `\ddot z_k =` are skipped, as is the text around them, unless the only equations are
//! in its lines; inside a display that is
//! read, whatever has no meaning here is an error with line and column, never a guess.
//!
//! Read `token.rs` (characters to tokens; `markdown.rs`), `expander.rs` with `definitions.rs`, `conditionals.rs` and
//! `scopes.rs` (what of them is printed), `document.rs` (displays), `derivatives.rs` (dots for other ways to write a
//! derivative), `sections.rs` (displays to equations and phases), `reader.rs`, `digits.rs`, `expression.rs` and
//! `numbers.rs` (one right side) in this order.

mod conditionals;
mod definitions;
mod derivatives;
mod digits;
mod document;
mod expander;
mod expression;
mod markdown;
mod names;
mod numbers;
mod reader;
mod scopes;
mod sections;
mod token;
mod variables;

pub use names::{NameError, SymbolNames};
pub(super) use sections::read;
