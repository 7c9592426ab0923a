//! How Rust spells statements.

use crate::codegen::code::{Function, Parameter, Role, Span};
use crate::codegen::dialect::{Dialect, Spelling};
use crate::codegen::line_wrapping::wrapped;
use crate::codegen::options::Precision;
use crate::ir::{Table, Unary};

/// Rust without `std` or allocation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RustDialect {
    pub precision: Precision,
}

impl RustDialect {
    pub(crate) fn real(&self) -> &'static str {
        match self.precision {
            Precision::Double => "f64",
            Precision::Single => "f32",
        }
    }

    /// The type of integers as wide.
    pub(crate) fn bits(&self) -> String {
        format!("u{}", self.precision.bits())
    }

    fn parameter(&self, parameter: &Parameter) -> String {
        let (name, len, real) = (&parameter.name, parameter.len, self.real());
        match parameter.role {
            Role::Input => format!("{name}: &[{real}; {len}]"),
            Role::Output | Role::InOut => format!("{name}: &mut [{real}; {len}]"),
            Role::Scalar => format!("{name}: {real}"),
        }
    }

    pub(crate) fn definition(&self, function: &Function) -> String {
        let parameters = function.parameters.iter().map(|p| self.parameter(p));
        let parameters = parameters.collect::<Vec<_>>().join(", ");
        let docs = documentation(&function.docs);
        let head = format!("{docs}pub fn {}({parameters})", function.name);
        function.definition(&head, |unused| format!("let _ = {unused};"))
    }
}

/// Keywords of Rust and the names that generated crates use themselves.
static SPELLING: Spelling = Spelling {
    multiply_add: Some("math::mul_add"),
    ..Spelling::with_braces(
        "
    abstract as async await become box break const continue crate do dyn else enum extern false
    final fn for gen if impl in let loop macro match mod move mut override priv pub ref return self
    static struct super trait true try type typeof unsafe unsized use virtual where while yield f64
    f32 usize std core libm math sin_cos sin_cos_reduced sign union
",
    )
};

impl Dialect for RustDialect {
    fn spelling(&self) -> &'static Spelling {
        &SPELLING
    }

    fn literal(&self, value: f64) -> String {
        self.precision.digits(value)
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        format!("math::{}({argument})", function.name())
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("math::pow({base}, {exponent})")
    }

    fn select(&self, [test, zero, other]: [String; 3]) -> String {
        format!("math::select({test}, {zero}, {other})")
    }

    fn let_scalar(&self, name: &str, value: &str) -> String {
        format!("let {name} = {value};")
    }

    fn let_array(&self, name: &str, elements: &[String]) -> String {
        format!(
            "let {name}: [{}; {}] = [{}];",
            self.real(),
            elements.len(),
            elements.join(", ")
        )
    }

    fn declare(&self, name: &str, len: usize) -> String {
        format!("let mut {name} = [0.0_{}; {len}];", self.real())
    }

    fn for_loop(&self, variable: &str, count: usize) -> String {
        format!("for {variable} in 0..{count}")
    }

    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String {
        let read = read.iter().map(|span| reference(span, "&"));
        let written = written.iter().map(|span| reference(span, "&mut "));
        let passed: Vec<String> = read.chain(written).collect();
        format!("{}({});", callee.unwrap_or("sin_cos"), passed.join(", "))
    }

    fn sin_cos_lane(&self, argument: &str, names: &[String; 2], is_used: [bool; 2]) -> Vec<String> {
        let name = |which: usize| {
            if is_used[which] {
                names[which].as_str()
            } else {
                "_"
            }
        };
        let (sine, cosine) = (name(0), name(1));
        vec![
            format!("let ({sine}, {cosine}) = sin_cos_reduced({argument});"),
            format!(
                "beyond[lane] = if math::abs({argument}) <= ANGLE_LIMIT {{ beyond[lane] }} else {{ 1.0 }};"
            ),
        ]
    }

    fn table(&self, name: &str, table: &Table) -> String {
        let (rows, cols, real) = (table.rows(), table.cols(), self.real());
        let entries = self.rows(table, ["    [", ",\n     ", "],"]);
        format!("static {name}: [[{real}; {cols}]; {rows}] = [\n{entries}];")
    }
}

/// A documentation comment; equations are in a text block, so that no markup applies.
fn documentation(lines: &[String]) -> String {
    let mut text = String::new();
    let (equations, prose): (Vec<&String>, Vec<&String>) =
        lines.iter().partition(|line| line.starts_with("ddz"));
    for (position, paragraph) in prose.iter().enumerate() {
        if position > 0 {
            text.push_str("///\n");
        }
        for line in wrapped(paragraph, 94, " ") {
            text.push_str(&format!("/// {}\n", plain(line.trim_start())));
        }
    }
    if !equations.is_empty() {
        text.push_str("///\n/// ```text\n");
        for equation in equations {
            for line in wrapped(equation, 94, " ") {
                text.push_str(&format!("/// {line}\n"));
            }
        }
        text.push_str("/// ```\n");
    }
    text
}

/// Brackets would be read as links.
fn plain(line: &str) -> String {
    line.replace('[', "\\[").replace(']', "\\]")
}

fn reference(span: &Span, by: &str) -> String {
    match (span.is_whole(), span.is_parameter) {
        (true, true) => span.array.to_string(),
        (true, false) => format!("{by}{}", span.array),
        (false, _) => format!(
            "{by}{}[{}..{}]",
            span.array,
            span.offset,
            span.offset + span.len
        ),
    }
}
