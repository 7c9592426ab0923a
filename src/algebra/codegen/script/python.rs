//! Python: `NAME.py` on NumPy, `NAME_casadi.py` with functions of CasADi.

use askama::Template;

use super::functions::{FunctionText, list, names};
use crate::codegen::code::{Role, Span};
use crate::codegen::dialect::Dialect;
use crate::codegen::ident::Namer;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::tidy;
use crate::codegen::model_text::ModelText;
use crate::codegen::options::CodegenError;
use crate::files::EmittedFile;
use crate::ir::{Table, Unary};

/// Python with the elementary functions of the library on whose numbers the functions work.
#[derive(Clone, Copy, Debug)]
enum Library {
    NumPy,
    Casadi,
}

/// Keywords of Python and the names that generated modules use themselves.
const RESERVED: &str = "
    False None True and as assert async await break class continue def del elif else except finally
    for from global if import in is lambda nonlocal not or pass raise return try while with yield
    match case type np casadi range list shape zip len float print _rows _sin_cos
";

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

impl Library {
    fn module(self) -> &'static str {
        match self {
            Library::NumPy => "np",
            Library::Casadi => "casadi",
        }
    }
}

impl Dialect for Library {
    fn reserved(&self) -> &'static str {
        RESERVED
    }

    fn terminator(&self) -> &'static str {
        ""
    }

    fn loop_ends(&self) -> (&'static str, Option<&'static str>) {
        (":", None)
    }

    fn continuation(&self) -> &'static str {
        " \\"
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        let name = match (function, self) {
            (Unary::Abs, Library::Casadi) => "fabs",
            (named, _) => named.name(),
        };
        format!("{}.{name}({argument})", self.module())
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{}.power({base}, {exponent})", self.module())
    }

    fn select(&self, [test, zero, other]: [String; 3]) -> String {
        match self {
            Library::NumPy => format!("np.where(np.equal({test}, 0.0), {zero}, {other})"),
            Library::Casadi => format!("casadi.if_else(casadi.eq({test}, 0.0), {zero}, {other})"),
        }
    }

    fn let_array(&self, name: &str, elements: &[String]) -> String {
        format!("{name} = [{}]", elements.join(", "))
    }

    fn declare(&self, name: &str, len: usize) -> String {
        format!("{name} = [0.0] * {len}")
    }

    fn for_loop(&self, variable: &str, count: usize) -> String {
        format!("for {variable} in range({count})")
    }

    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String {
        let callee = match (callee, self) {
            (None, _) => "_sin_cos".to_owned(),
            (Some(callee), Library::NumPy) => callee.to_owned(),
            (Some(callee), Library::Casadi) => private(callee),
        };
        let read = list(read, |span| match span.is_whole() {
            true => span.array.to_string(),
            false => slice(span),
        });
        format!("{} = {callee}({read})", list(written, slice))
    }

    fn table(&self, name: &str, table: &Table) -> String {
        let rows = self.rows(table, ["    [", ",\n     ", "],"]);
        format!("{name} = [\n{rows}]")
    }
}

fn slice(span: &Span) -> String {
    format!("{}[{}:{}]", span.array, span.offset, span.offset + span.len)
}

#[derive(Template)]
#[template(path = "script/numpy.askama", config = "../../templates/askama.toml")]
struct NumPyModule<'a> {
    banner: String,
    m: ModelText<'a, FunctionText>,
}

#[derive(Template)]
#[template(path = "script/casadi.askama", config = "../../templates/askama.toml")]
struct CasadiModule<'a> {
    banner: String,
    module: &'a str,
    m: ModelText<'a, FunctionText>,
}

/// The module of a model on NumPy; `provenance` is the text of the first line.
///
/// # Errors
/// [`CodegenError::Template`] if a template fails.
pub fn emit(entries: &ModelInterface, provenance: &str) -> Result<Vec<EmittedFile>, CodegenError> {
    let module = NumPyModule {
        banner: format!("# {provenance}"),
        m: ModelText::new(entries, &Library::NumPy, "", FunctionText::new, tuple),
    };
    let path = format!("{}.py", stem(entries));
    Ok(vec![EmittedFile::new(path, tidy(&module.render()?))])
}

/// The module of a model on CasADi; `provenance` is the text of the first line.
///
/// # Errors
/// [`CodegenError::Template`] if a template fails.
pub fn emit_casadi(
    entries: &ModelInterface,
    provenance: &str,
) -> Result<Vec<EmittedFile>, CodegenError> {
    let module_name = format!("{}_casadi", stem(entries));
    let module = CasadiModule {
        banner: format!("# {provenance}"),
        module: &module_name,
        m: ModelText::new(entries, &Library::Casadi, "", FunctionText::new, tuple),
    };
    let path = format!("{module_name}.py");
    Ok(vec![EmittedFile::new(path, tidy(&module.render()?))])
}

fn stem(entries: &ModelInterface) -> String {
    let mut namer = Namer::new(&format!("{RESERVED} {MODULES}"));
    namer.mint(&entries.identifier).to_string()
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
