//! From equations of latent accelerations in `.tex` and Markdown files to sections in the grammar of candidate terms,
//! each piece with its place. Displays without a left side `\ddot z_k =` are skipped. Text is also skipped, unless the
//! only equations are in its lines. In a display that is read, anything without a meaning here is an error.
//!
//! Read `token`, `markdown` (text to tokens), `expander`, `commands`, `definitions` (printed text), `sections`, then
//! for a right-hand side `derivatives`, `reader`, `expression`, `variables`, `numbers`. `words.txt` has LaTeX's words
//! by class.

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
pub(super) mod variables;

pub(super) use sections::read;

use std::ops::Range;
use std::rc::Rc;

use expander::{Expander, Meaning, Refusal};
use expression::LeftSide;
use reader::{BARE, Digits, Last, Reader};
use sections::is_one_of;
use token::{Kind, Lexer, Token, group_length, has, is_in, spelled};
use variables::function;

use super::*;
use crate::import::equations::{Equation, Piece, Position, Section, complete, text_of};
