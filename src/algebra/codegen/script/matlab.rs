//! MATLAB and Octave: `NAME.m`, a function that returns a struct of function handles.

use askama::Template;

use super::functions::{FunctionText, ModelText, Script, list};
use crate::codegen::code::{
    Argument, ConstTable, Function, Index, Infix, MathFunction, Parameter, Span,
};
use crate::codegen::dialect::Dialect;
use crate::codegen::error::CodegenError;
use crate::codegen::functions::ModelFunctions;
use crate::codegen::ident::Namer;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::tidy;
use crate::codegen::literal::Literal;
use crate::codegen::printer::{Printer, subscript};
use crate::files::EmittedFile;

/// MATLAB without toolboxes; Octave runs the same.
#[derive(Clone, Copy, Debug)]
struct MatlabDialect;

/// Keywords of MATLAB and Octave, and the names that generated files use themselves.
const RESERVED: [&str; 55] = [
    "arguments",
    "break",
    "case",
    "catch",
    "classdef",
    "continue",
    "else",
    "elseif",
    "end",
    "for",
    "function",
    "global",
    "if",
    "otherwise",
    "parfor",
    "persistent",
    "return",
    "spmd",
    "switch",
    "try",
    "while",
    "do",
    "until",
    "unwind_protect",
    "end_try_catch",
    "endif",
    "endfor",
    "endwhile",
    "endfunction",
    "endswitch",
    "methods",
    "properties",
    "events",
    "enumeration",
    "columns",
    "rows_of",
    "model",
    "n",
    "zeros",
    "size",
    "numel",
    "repmat",
    "cell",
    "max",
    "error",
    "nargin",
    "sin",
    "cos",
    "tan",
    "tanh",
    "exp",
    "log",
    "sqrt",
    "abs",
    "sign",
];

impl Dialect for MatlabDialect {
    fn reserved(&self) -> &'static [&'static str] {
        &RESERVED
    }

    fn literal(&self, literal: Literal) -> String {
        literal.to_string()
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

    fn operator(&self, op: Infix) -> &'static str {
        match op {
            Infix::Add => " + ",
            Infix::Sub => " - ",
            Infix::Mul => ".*",
            Infix::Div => "./",
        }
    }

    fn element(&self, array: &str, index: &Index) -> String {
        format!("{array}({}, :)", from_one(index))
    }

    fn entry(&self, table: &str, row: &Index, col: &Index) -> String {
        format!("{table}({}, {})", from_one(row), from_one(col))
    }

    fn apply(&self, function: MathFunction, argument: &str) -> String {
        let name = match function {
            MathFunction::Sqrt => "sqrt",
            MathFunction::Abs => "abs",
            MathFunction::Sign => "sign",
            MathFunction::Tan => "tan",
            MathFunction::Tanh => "tanh",
            MathFunction::Exp => "exp",
            MathFunction::Log => "log",
        };
        format!("{name}({argument})")
    }

    fn let_scalar(&self, name: &str, value: &str) -> String {
        format!("{name} = {value};")
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

    fn discard(&self, _parameter: &str) -> String {
        String::new()
    }

    fn multiply_add(&self) -> Option<&'static str> {
        None
    }

    fn call(&self, callee: Option<&str>, arguments: &[Argument]) -> String {
        let (mut read, mut written) = (Vec::new(), Vec::new());
        for argument in arguments {
            match argument {
                Argument::Read(span) => read.push(span_text(span)),
                Argument::Write(span) => written.push(span_text(span)),
            }
        }
        let read = read.join(", ");
        match callee {
            Some(callee) => format!("[{}] = {callee}({read});", written.join(", ")),
            None => {
                let [sines, cosines] = written.as_slice() else {
                    unreachable!("the kernel writes sines and cosines");
                };
                format!("{sines} = sin({read}); {cosines} = cos({read});")
            }
        }
    }

    fn sin_cos_lane(&self, _: &str, _: &[String; 2], _: [bool; 2]) -> Vec<String> {
        // Blocks of lanes are for compilers: scripts run many points as columns.
        Vec::new()
    }

    fn table(&self, table: &ConstTable) -> String {
        let rows = table.entries.chunks(table.cols).map(|row| {
            let row: Vec<String> = row.iter().map(Literal::to_string).collect();
            let lines: Vec<String> = row.chunks(8).map(|line| line.join(", ")).collect();
            format!("        {}\n", lines.join(", ...\n        "))
        });
        format!(
            "function t = {}_entries()\n    t = [\n{}    ];\nend",
            table.name,
            rows.collect::<String>()
        )
    }

    fn parameter(&self, parameter: &Parameter) -> String {
        parameter.name.to_string()
    }

    fn signature(&self, function: &Function) -> String {
        format!("function {}", function.name)
    }

    fn docs(&self, _lines: &[String]) -> String {
        // The template places documentation.
        String::new()
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
    /// Functions are names and definitions.
    m: ModelText<(String, String)>,
}

#[derive(Template)]
#[template(
    path = "script/matlab_function.askama",
    config = "../../templates/askama.toml"
)]
struct MatlabFunction<'a> {
    name: &'a str,
    parameters: String,
    results: String,
    docs: &'a [String],
    arrays: Vec<(&'a str, usize)>,
    tables: &'a [String],
    created: Vec<(&'a str, usize)>,
    body: &'a str,
}

/// The file of a model; `provenance` is the text of the first line.
///
/// # Errors
/// [`CodegenError::Template`] if a template fails.
pub fn emit(entries: &ModelInterface, provenance: &str) -> Result<Vec<EmittedFile>, CodegenError> {
    let dialect = MatlabDialect;
    let functions = ModelFunctions::new(entries, &dialect, "");
    let script = Script {
        printer: Printer::new(&dialect),
        print: &|function, _| matlab_function(function),
        numbers: column,
    };
    let stem = Namer::new(&RESERVED).mint(&entries.identifier).to_string();
    let file = MatlabFile {
        banner: format!("% {provenance}"),
        file: &stem,
        m: script.model(entries, &functions)?,
    };
    Ok(vec![EmittedFile::new(
        format!("{stem}.m"),
        tidy(&file.render()?),
    )])
}

fn matlab_function(function: &FunctionText) -> Result<(String, String), CodegenError> {
    let template = MatlabFunction {
        name: &function.name,
        parameters: function.parameters(),
        results: list(&function.outputs, |output| output.name.clone()),
        docs: &function.docs,
        arrays: function.arrays(),
        tables: &function.tables,
        created: function.created(),
        body: &function.body,
    };
    Ok((function.name.clone(), template.render()?))
}

/// Numbers of a column, counted from one.
fn column(numbers: &[usize]) -> String {
    if numbers.is_empty() {
        return "zeros(0, 1)".to_owned();
    }
    format!("[{}]'", list(numbers, |number| (number + 1).to_string()))
}
