//! MATLAB and Octave: `NAME.m`, a function that returns a struct of function handles.

use askama::Template;

use super::functions::{FunctionText, list, names};
use crate::codegen::code::{Index, Span};
use crate::codegen::dialect::Dialect;
use crate::codegen::ident::Namer;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::tidy;
use crate::codegen::model_text::ModelText;
use crate::codegen::options::CodegenError;
use crate::codegen::printer::subscript;
use crate::files::EmittedFile;
use crate::ir::{Binary, Statement, Table, Unary};

/// MATLAB without toolboxes; Octave runs the same.
#[derive(Clone, Copy, Debug)]
struct MatlabDialect;

/// Keywords of MATLAB and Octave, and the names that generated files use themselves.
const RESERVED: &str = "
    arguments break case catch classdef continue else elseif end for function global if otherwise
    parfor persistent return spmd switch try while do until unwind_protect end_try_catch endif
    endfor endwhile endfunction endswitch methods properties events enumeration columns rows_of
    model n zeros size numel repmat cell max error nargin sin cos tan tanh exp log sqrt abs sign
    power select
";

impl Dialect for MatlabDialect {
    fn reserved(&self) -> &'static str {
        RESERVED
    }

    fn loop_ends(&self) -> (&'static str, Option<&'static str>) {
        ("", Some("end"))
    }

    fn continuation(&self) -> &'static str {
        " ..."
    }

    fn adds_in_place(&self) -> bool {
        false
    }

    fn operator(&self, op: Binary) -> &'static str {
        match op {
            Binary::Add => " + ",
            Binary::Sub => " - ",
            Binary::Mul => ".*",
            Binary::Div => "./",
            Binary::Pow => unreachable!("powers are functions"),
        }
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("power({base}, {exponent})")
    }

    fn select(&self, [test, zero, other]: [String; 3]) -> String {
        format!("select({test}, {zero}, {other})")
    }

    fn element(&self, array: &str, index: &Index) -> String {
        format!("{array}({}, :)", from_one(index))
    }

    fn entry(&self, table: &str, row: &Index, col: &Index) -> String {
        format!("{table}({}, {})", from_one(row), from_one(col))
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        format!("{}({argument})", function.name())
    }

    fn let_array(&self, name: &str, elements: &[String]) -> String {
        format!("{name} = rows_of(n, {});", elements.join(", "))
    }

    fn declare(&self, name: &str, len: usize) -> String {
        format!("{name} = zeros({len}, n);")
    }

    fn for_loop(&self, variable: &str, count: usize) -> String {
        format!("for {variable} = 0:{}", count - 1)
    }

    fn table_base(&self, _prefix: &str) -> String {
        "table".to_owned()
    }

    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String {
        let read = list(read, span_text);
        match callee {
            Some(callee) => format!("[{}] = {callee}({read});", list(written, span_text)),
            None => {
                let [sines, cosines] = [0, 1].map(|which| span_text(&written[which]));
                format!("{sines} = sin({read}); {cosines} = cos({read});")
            }
        }
    }

    fn table(&self, name: &str, table: &Table) -> String {
        let rows = self.rows(table, ["        ", ", ...\n        ", ""]);
        format!("function t = {name}_entries()\n    t = [\n{rows}    ];\nend")
    }
}

fn from_one(index: &Index) -> String {
    subscript(&index.clone().shifted(1))
}

fn span_text(span: &Span) -> String {
    if span.is_whole() {
        span.array.to_string()
    } else {
        format!(
            "{}({}:{}, :)",
            span.array,
            span.offset + 1,
            span.offset + span.len
        )
    }
}

#[derive(Template)]
#[template(path = "script/matlab.askama", config = "../../templates/askama.toml")]
struct MatlabFile<'a> {
    banner: String,
    file: &'a str,
    selects: bool,
    m: ModelText<'a, FunctionText>,
}

/// The file of a model; `provenance` is the text of the first line.
///
/// # Errors
/// [`CodegenError::Template`] if a template fails.
pub fn emit(entries: &ModelInterface, provenance: &str) -> Result<Vec<EmittedFile>, CodegenError> {
    let stem = Namer::new(RESERVED).mint(&entries.identifier).to_string();
    let file = MatlabFile {
        banner: format!("% {provenance}"),
        file: &stem,
        selects: entries.has(|s| matches!(s, Statement::Select(_))),
        m: ModelText::new(entries, &MatlabDialect, "", FunctionText::new, column),
    };
    Ok(vec![EmittedFile::new(
        format!("{stem}.m"),
        tidy(&file.render()?),
    )])
}

/// Numbers of a column, counted from one.
fn column(numbers: &[usize]) -> String {
    if numbers.is_empty() {
        return "zeros(0, 1)".to_owned();
    }
    format!("[{}]'", list(numbers, |number| (number + 1).to_string()))
}
