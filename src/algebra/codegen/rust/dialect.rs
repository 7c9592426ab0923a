//! How Rust spells statements.

use crate::codegen::code::{ConstTable, Function, Parameter, Role, Span};
use crate::codegen::dialect::{Dialect, Lines, name};
use crate::codegen::fours::{FourBlock, Fours};
use crate::codegen::line_wrapping::wrapped;
use crate::codegen::precision::Precision;
use crate::codegen::printer::Printer;
use crate::ir::{QUAD, Quad, Unary};

/// Most terms of a sum in one function: LLVM loses sight of vectors in longer chains.
const LONGEST_CHAIN: usize = 10;

/// Rust without `std` or allocation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RustDialect {
    /// Floating-point numbers of the code.
    pub precision: Precision,
}

impl RustDialect {
    /// The type of numbers.
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

    /// A function with its documentation.
    pub(crate) fn definition(&self, function: &Function) -> String {
        let parameters = function.parameters.iter().map(|p| self.parameter(p));
        let parameters = parameters.collect::<Vec<_>>().join(", ");
        let docs = documentation(&function.docs);
        let head = format!("{docs}pub fn {}({parameters})", function.name);
        Printer::new(self).function(&head, |unused| format!("let _ = {unused};"), function)
    }
}

/// Keywords of Rust and the names that generated crates use themselves.
const RESERVED: &str = "
    abstract as async await become box break const continue crate do dyn else enum extern false
    final fn for gen if impl in let loop macro match mod move mut override priv pub ref return self
    static struct super trait true try type typeof unsafe unsized use virtual where while yield f64
    f32 usize std core libm math four start_four add_four part sin_cos sin_cos_reduced sign union
";

impl Dialect for RustDialect {
    fn reserved(&self) -> &'static str {
        RESERVED
    }

    fn literal(&self, value: f64) -> String {
        self.precision.digits(value)
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        format!("math::{}({argument})", name(function))
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

    fn multiply_add(&self) -> Option<&'static str> {
        Some("math::mul_add")
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

    fn four_block(&self, fours: &Fours, block: &FourBlock) -> Option<Lines> {
        let (real, y, n_sums) = (self.real(), &fours.array, QUAD * fours.sums.len());
        let (weights, n_weights) = (&fours.weights.array, fours.weights.of);
        let vector = |vector: Quad| match vector {
            Quad::Row(row) => format!("{}[{row}]", fours.table.1),
            Quad::Sum(sum) => format!("four({y}, {})", QUAD * sum),
        };
        let starts = block.sums.clone().map(|sum| {
            let start = vector(fours.sums[sum].start);
            (2, format!("start_four({y}, {}, {start});", QUAD * sum))
        });
        let mut parts: Vec<Lines> = vec![starts.collect()];
        let mut lengths = vec![0; block.sums.len()];
        for four in &block.terms {
            let length = &mut lengths[four.sum - block.sums.start];
            if *length == LONGEST_CHAIN {
                lengths.fill(0);
                parts.push(Vec::new());
            }
            lengths[four.sum - block.sums.start] += 1;
            let (at, vector) = (QUAD * four.sum, vector(four.vector));
            let weight = format!("{weights}[{}]", fours.weights.offset + four.weight);
            let lanes = fours.lanes(four.vector).map(u8::from);
            let lanes = lanes.iter().rev().map(u8::to_string).collect::<String>();
            let line = format!("add_four::<0b{lanes}, _>({y}, {at}, {vector}, {weight});");
            parts.last_mut().expect("one part at least").push((2, line));
        }
        let by = if fours.weights.is_parameter { "" } else { "&" };
        let mut lines = Vec::new();
        for part in parts {
            let head = format!(
                "fn part({y}: &mut [{real}; {n_sums}], {weights}: &[{real}; {n_weights}]) {{"
            );
            lines.push((0, "{".to_owned()));
            // Without wide registers the compiler adds number by number, best all in one function.
            let avx = "target_feature = \"avx\"";
            lines.push((1, format!("#[cfg_attr({avx}, inline(never))]")));
            lines.push((1, format!("#[cfg_attr(not({avx}), inline(always))]")));
            lines.push((1, head));
            if !part.iter().any(|(_, line)| line.contains("add_four")) {
                lines.push((2, format!("let _ = {weights};")));
            }
            lines.extend(part);
            lines.push((1, "}".to_owned()));
            lines.push((1, format!("part(&mut {y}, {by}{weights});")));
            lines.push((0, "}".to_owned()));
        }
        Some(lines)
    }

    fn table(&self, table: &ConstTable) -> Option<String> {
        let rows = self.rows(table, ["    [", ",\n     ", "],"]);
        let (name, real) = (&table.name, self.real());
        let (n, cols) = (table.values.rows(), table.values.cols());
        Some(match table.is_in_lanes {
            true => {
                format!("static {name}: &[[{real}; {cols}]; {n}] = &Aligned([\n{rows}]).0;")
            }
            false => format!("static {name}: [[{real}; {cols}]; {n}] = [\n{rows}];"),
        })
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
