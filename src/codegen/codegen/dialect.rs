//! What targets spell differently.

use super::code::{Index, Span};
use super::options::Precision;
use super::printer::subscript;
use crate::ir::{Table, Unary};

/// What a language spells the same everywhere.
pub(crate) struct Spelling {
    /// Words that no variable may be called, with blanks between them.
    pub reserved: &'static str,
    /// What ends a statement.
    pub terminator: &'static str,
    /// What follows the head of a loop, and what closes its body.
    pub loop_ends: (&'static str, Option<&'static str>),
    /// What ends a line that goes on in the next.
    pub continuation: &'static str,
    /// Whether there is `+=`.
    pub adds_in_place: bool,
    /// Sum, difference, product and quotient, with the spaces around them.
    pub operators: [&'static str; 4],
    /// Function `f(a, b, c) = a*b + c` for loops, in a language whose compilers never fuse the two
    /// operations by themselves.
    pub multiply_add: Option<&'static str>,
}

impl Spelling {
    /// As in C.
    pub(crate) const fn with_braces(reserved: &'static str) -> Self {
        Self {
            reserved,
            terminator: ";",
            loop_ends: (" {", Some("}")),
            continuation: "",
            adds_in_place: true,
            operators: [" + ", " - ", "*", "/"],
            multiply_add: None,
        }
    }
}

/// A target language. The printer owns precedence and parentheses, the dialect everything that differs between
/// languages.
pub(crate) trait Dialect {
    fn spelling(&self) -> &'static Spelling;

    /// A power of printed operands.
    fn power(&self, base: &str, exponent: &str) -> String;

    /// The second printed operand where the first is zero, else the third.
    fn select(&self, operands: [String; 3]) -> String;

    fn element(&self, array: &str, index: &Index) -> String {
        format!("{array}[{}]", subscript(index))
    }

    fn entry(&self, table: &str, row: &Index, col: &Index) -> String {
        format!("{table}[{}][{}]", subscript(row), subscript(col))
    }

    fn literal(&self, value: f64) -> String {
        Precision::Double.digits(value)
    }

    /// A function applied to a printed argument; never [`Unary::Neg`], which is an operator.
    fn apply(&self, function: Unary, argument: &str) -> String;

    fn let_scalar(&self, name: &str, value: &str) -> String {
        format!("{name} = {value}{}", self.spelling().terminator)
    }

    /// Definition of an array by its printed elements.
    fn let_array(&self, name: &str, elements: &[String]) -> String;

    /// Declaration of an array that is assigned later.
    fn declare(&self, name: &str, len: usize) -> String;

    fn for_loop(&self, variable: &str, count: usize) -> String;

    /// Beginning of the names of constant tables.
    fn table_base(&self, _prefix: &str) -> String {
        "TABLE".to_owned()
    }

    /// A call of the sine-and-cosine kernel, or of a generated function (`callee`).
    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String;

    /// The kernel's core on one printed argument of a lane: defines sine and cosine, and
    /// notes an argument beyond its limit. Blocks of lanes are for compilers: scripts run many
    /// points as columns.
    fn sin_cos_lane(&self, _: &str, _: &[String; 2], _is_used: [bool; 2]) -> Vec<String> {
        unreachable!("a language without blocks of lanes prints none")
    }

    /// The rows of a constant table: entries between `open` and `close`, with `between` after every
    /// eight of them.
    fn rows(&self, table: &Table, [open, between, close]: [&str; 3]) -> String {
        let row = |row: &[f64]| {
            let entries: Vec<String> = row.iter().map(|&entry| self.literal(entry)).collect();
            let lines: Vec<String> = entries.chunks(8).map(|line| line.join(", ")).collect();
            format!("{open}{}{close}\n", lines.join(between))
        };
        (0..table.rows()).map(|r| row(table.row(r))).collect()
    }

    fn table(&self, name: &str, table: &Table) -> String;
}
