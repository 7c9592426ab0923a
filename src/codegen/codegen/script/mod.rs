//! Languages that run scripts: `NAME.py` on NumPy, `NAME_casadi.py` with functions of CasADi, `NAME.m` for MATLAB and
//! Octave, a function that returns a struct of function handles.
//!
//! Arrays are matrices with a column per point, or a vector for one point, and every operation is
//! element by element, so that the statements of a program serve one state and many alike. What a
//! generated function writes into its parameters elsewhere is returned here.

mod functions;

use askama::Template;

use super::code::{Index, Role, Span};
use super::dialect::{Dialect, Spelling};
use super::ident::Namer;
use super::interface::ModelInterface;
use super::line_wrapping::tidy;
use super::model_text::ModelText;
use super::options::CodegenError;
use super::printer::subscript;
use crate::files::EmittedFile;
use crate::ir::{Statement, Table, Unary};
use functions::{FunctionText, list, names};

/// A language of scripts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Script {
    /// Python on arrays of NumPy.
    NumPy,
    /// Python with symbolic scalars of CasADi.
    Casadi,
    /// MATLAB without toolboxes; Octave runs the same.
    Matlab,
}

/// Keywords of Python and the names that generated modules use themselves.
static PYTHON: Spelling = Spelling {
    terminator: "",
    loop_ends: (":", None),
    continuation: " \\",
    ..Spelling::with_braces(
        "
    False None True and as assert async await break class continue def del elif else except finally
    for from global if import in is lambda nonlocal not or pass raise return try while with yield
    match case type np casadi range list shape zip len float print _rows _sin_cos
",
    )
};

/// Keywords of MATLAB and Octave, and the names that generated files use themselves.
static MATLAB: Spelling = Spelling {
    loop_ends: ("", Some("end")),
    continuation: " ...",
    adds_in_place: false,
    operators: [" + ", " - ", ".*", "./"],
    ..Spelling::with_braces(
        "
    arguments break case catch classdef continue else elseif end for function global if otherwise
    parfor persistent return spmd switch try while do until unwind_protect end_try_catch endif
    endfor endwhile endfunction endswitch methods properties events enumeration columns rows_of
    model n zeros size numel repmat cell max error nargin sin cos tan tanh exp log sqrt abs sign
    power select
",
    )
};

/// Modules that a file of the same name would hide from NumPy, CasADi and the file itself.
const MODULES: &str = "
    numpy abc argparse array ast atexit base64 bisect builtins bz2 calendar cmath code codecs
    collections concurrent contextlib contextvars copy copyreg csv ctypes dataclasses datetime
    decimal dis email encodings enum errno fnmatch fractions functools gc genericpath getpass glob
    gzip hashlib heapq hmac html http importlib inspect io itertools json keyword linecache locale
    logging lzma marshal math mmap multiprocessing numbers opcode operator os pathlib pickle pkgutil
    platform posixpath pprint queue random re secrets select selectors shutil signal site socket
    stat statistics string struct subprocess sys sysconfig tempfile textwrap threading time token
    tokenize traceback types typing unittest urllib
";

impl Script {
    /// What stands before the names of elementary functions.
    fn module(self) -> &'static str {
        match self {
            Self::NumPy => "np.",
            Self::Casadi => "casadi.",
            Self::Matlab => "",
        }
    }

    /// The file of a model; `provenance` is the text of the first line.
    ///
    /// # Errors
    /// [`CodegenError::Template`] if a template fails.
    pub fn emit(
        self,
        entries: &ModelInterface,
        provenance: &str,
    ) -> Result<Vec<EmittedFile>, CodegenError> {
        let (reserved, numbers): (_, fn(&[usize]) -> String) = match self {
            Self::NumPy | Self::Casadi => (format!("{} {MODULES}", PYTHON.reserved), tuple),
            Self::Matlab => (MATLAB.reserved.to_owned(), column),
        };
        let stem = Namer::new(&reserved).mint(&entries.identifier);
        let m = ModelText::new(entries, &self, "", FunctionText::new, numbers);
        let (path, text) = match self {
            Self::NumPy => {
                let banner = format!("# {provenance}");
                (format!("{stem}.py"), NumPyModule { banner, m }.render()?)
            }
            Self::Casadi => {
                let (banner, module) = (format!("# {provenance}"), format!("{stem}_casadi"));
                let path = format!("{module}.py");
                (path, CasadiModule { banner, module, m }.render()?)
            }
            Self::Matlab => {
                let file = MatlabFile {
                    banner: format!("% {provenance}"),
                    file: stem.to_string(),
                    selects: entries.has(|s| matches!(s, Statement::Select(_))),
                    m,
                };
                (format!("{stem}.m"), file.render()?)
            }
        };
        Ok(vec![EmittedFile::new(path, tidy(&text))])
    }
}

impl Dialect for Script {
    fn spelling(&self) -> &'static Spelling {
        match self {
            Self::NumPy | Self::Casadi => &PYTHON,
            Self::Matlab => &MATLAB,
        }
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        let name = match (function, self) {
            (Unary::Abs, Self::Casadi) => "fabs",
            (named, _) => named.name(),
        };
        format!("{}{name}({argument})", self.module())
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{}power({base}, {exponent})", self.module())
    }

    fn select(&self, [test, zero, other]: [String; 3]) -> String {
        match self {
            Self::NumPy => format!("np.where(np.equal({test}, 0.0), {zero}, {other})"),
            Self::Casadi => format!("casadi.if_else(casadi.eq({test}, 0.0), {zero}, {other})"),
            Self::Matlab => format!("select({test}, {zero}, {other})"),
        }
    }

    fn element(&self, array: &str, index: &Index) -> String {
        match self {
            Self::NumPy | Self::Casadi => format!("{array}[{}]", subscript(index)),
            Self::Matlab => format!("{array}({}, :)", from_one(index)),
        }
    }

    fn entry(&self, table: &str, row: &Index, col: &Index) -> String {
        match self {
            Self::NumPy | Self::Casadi => {
                format!("{table}[{}][{}]", subscript(row), subscript(col))
            }
            Self::Matlab => format!("{table}({}, {})", from_one(row), from_one(col)),
        }
    }

    fn let_array(&self, name: &str, elements: &[String]) -> String {
        let elements = elements.join(", ");
        match self {
            Self::NumPy | Self::Casadi => format!("{name} = [{elements}]"),
            Self::Matlab => format!("{name} = rows_of(n, {elements});"),
        }
    }

    fn declare(&self, name: &str, len: usize) -> String {
        match self {
            Self::NumPy | Self::Casadi => format!("{name} = [0.0] * {len}"),
            Self::Matlab => format!("{name} = zeros({len}, n);"),
        }
    }

    fn for_loop(&self, variable: &str, count: usize) -> String {
        match self {
            Self::NumPy | Self::Casadi => format!("for {variable} in range({count})"),
            Self::Matlab => format!("for {variable} = 0:{}", count - 1),
        }
    }

    fn table_base(&self, _prefix: &str) -> String {
        match self {
            Self::NumPy | Self::Casadi => "TABLE".to_owned(),
            Self::Matlab => "table".to_owned(),
        }
    }

    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String {
        let read = list(read, |span| match span.is_whole() {
            true => span.array.to_string(),
            false => self.slice(span),
        });
        match (self, callee) {
            (Self::Matlab, None) => {
                let [sines, cosines] = [0, 1].map(|which| &written[which].array);
                format!("{sines} = sin({read}); {cosines} = cos({read});")
            }
            (Self::Matlab, Some(callee)) => {
                let written = list(written, |span| span.array.to_string());
                format!("[{written}] = {callee}({read});")
            }
            (Self::NumPy | Self::Casadi, _) => {
                let callee = match (self, callee) {
                    (_, None) => "_sin_cos".to_owned(),
                    (Self::Casadi, Some(callee)) => private(callee),
                    (_, Some(callee)) => callee.to_owned(),
                };
                let written = list(written, |span| self.slice(span));
                format!("{written} = {callee}({read})")
            }
        }
    }

    fn table(&self, name: &str, table: &Table) -> String {
        match self {
            Self::NumPy | Self::Casadi => {
                let rows = self.rows(table, ["    [", ",\n     ", "],"]);
                format!("{name} = [\n{rows}]")
            }
            Self::Matlab => {
                let rows = self.rows(table, ["        ", ", ...\n        ", ""]);
                format!("function t = {name}_entries()\n    t = [\n{rows}    ];\nend")
            }
        }
    }
}

impl Script {
    fn slice(self, span: &Span) -> String {
        let (array, first, end) = (&span.array, span.offset, span.offset + span.len);
        match self {
            Self::NumPy | Self::Casadi => format!("{array}[{first}:{end}]"),
            Self::Matlab => format!("{array}({}:{end}, :)", first + 1),
        }
    }
}

fn from_one(index: &Index) -> String {
    subscript(&index.clone().shifted(1))
}

#[derive(Template)]
#[template(path = "script/numpy.askama", config = "templates/askama.toml")]
struct NumPyModule<'a> {
    banner: String,
    m: ModelText<'a, FunctionText>,
}

#[derive(Template)]
#[template(path = "script/casadi.askama", config = "templates/askama.toml")]
struct CasadiModule<'a> {
    banner: String,
    module: String,
    m: ModelText<'a, FunctionText>,
}

#[derive(Template)]
#[template(path = "script/matlab.askama", config = "templates/askama.toml")]
struct MatlabFile<'a> {
    banner: String,
    file: String,
    selects: bool,
    m: ModelText<'a, FunctionText>,
}

impl CasadiModule<'_> {
    /// The function made of expressions; these are private functions, so that it has the plain name.
    fn definition(&self, f: &FunctionText) -> String {
        let (model, name) = (&self.m.entries.identifier, &f.name);
        let inputs = list(&f.inputs(), |input| {
            format!("(\"{}\", {})", input.name, input.len)
        });
        let outputs = list(&f.outputs(), |output| match output.role {
            Role::InOut => format!("\"{}_next\"", output.name),
            Role::Output | Role::Input | Role::Scalar => format!("\"{}\"", output.name),
        });
        let mut phases = self.m.phases.iter();
        let pattern = match phases.find(|phase| phase.functions[1].name == *name) {
            Some(phase) => format!(",\n    ({0}_JACOBIAN_ROWS, {0}_JACOBIAN_COLS)", phase.upper),
            None => String::new(),
        };
        let expressions = private(name);
        format!(
            "{name} = _function(\n    \"{model}_{name}\", {expressions}, [{inputs}], [{outputs}]{pattern})"
        )
    }
}

/// Name of the expressions of a function.
fn private(name: &str) -> String {
    format!("_{name}")
}

/// A line inside a documentation string.
fn escaped(line: &str) -> String {
    line.replace('\\', "\\\\").replace('"', "\\\"")
}

/// Numbers of a tuple, which needs a comma even after its only element.
fn tuple(numbers: &[usize]) -> String {
    let text = list(numbers, usize::to_string);
    match numbers.len() {
        1 => format!("({text},)"),
        _ => format!("({text})"),
    }
}

/// Numbers of a column, counted from one.
fn column(numbers: &[usize]) -> String {
    if numbers.is_empty() {
        return "zeros(0, 1)".to_owned();
    }
    format!("[{}]'", list(numbers, |number| (number + 1).to_string()))
}
