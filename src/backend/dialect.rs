//! What targets spell differently.

use super::code::{Argument, ConstTable, Function, MathFunction, Parameter};
use super::literal::Literal;

/// Spelling of a target language. The printer owns precedence and parentheses, the
/// dialect everything that differs between languages.
pub trait Dialect {
    /// Words that no variable may be called.
    fn reserved(&self) -> &'static [&'static str];

    /// A number in the target's precision.
    fn literal(&self, literal: Literal) -> String;

    /// A function applied to a printed argument.
    fn apply(&self, function: MathFunction, argument: &str) -> String;

    /// Definition of a scalar.
    fn let_scalar(&self, name: &str, value: &str) -> String;

    /// Definition of an array by its printed elements.
    fn let_array(&self, name: &str, elements: &[String]) -> String;

    /// Declaration of an array that is assigned later.
    fn declare(&self, name: &str, len: usize) -> String;

    /// Head of a loop whose body follows in braces.
    fn for_loop(&self, variable: &str, count: usize) -> String;

    /// Beginning of the names of constant tables.
    fn table_base(&self, prefix: &str) -> String;

    /// A mention of a parameter that nothing reads.
    fn discard(&self, parameter: &str) -> String;

    /// Function `f(a, b, c) = a*b + c` for loops, in a language whose compilers never fuse the two
    /// operations by themselves.
    fn multiply_add(&self) -> Option<&'static str>;

    /// A call of the sine-and-cosine kernel, or of a generated function (`callee`).
    fn call(&self, callee: Option<&str>, arguments: &[Argument]) -> String;

    /// The kernel's core on one printed argument of a lane: defines sine and cosine, and
    /// notes an argument beyond its limit.
    fn sin_cos_lane(&self, argument: &str, names: &[String; 2], is_used: [bool; 2]) -> Vec<String>;

    /// Definition of a constant table.
    fn table(&self, table: &ConstTable) -> String;

    /// A parameter.
    fn parameter(&self, parameter: &Parameter) -> String;

    /// The function's name and parameters, without body.
    fn signature(&self, function: &Function) -> String;

    /// Documentation from its lines.
    fn docs(&self, lines: &[String]) -> String;
}
