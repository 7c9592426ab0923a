//! Languages that run scripts: `NAME.py` on NumPy, `NAME_casadi.py` with functions of CasADi, `NAME.m` for MATLAB and
//! Octave, a function that returns a struct of function handles.
//!
//! Arrays are matrices with a column per point, or a vector for one point, and every operation is
//! element by element, so that the statements of a program serve one state and many alike. What a
//! generated function writes into its parameters elsewhere is returned here.

use askama::Template;

use super::code::{Function, Parameter, Role};
use super::dialect::Dialect;
use super::ident::Namer;
use super::interface::ModelInterface;
use super::languages::{CASADI, MATLAB, NUMPY};
use super::line_wrapping::{comment_lines, tidy};
use super::model_text::ModelText;
use super::options::{CodegenError, Precision};
use crate::files::EmittedFile;
use crate::ir::Statement;

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

#[derive(Template)]
#[template(config = "templates/askama.toml")]
enum File<'a> {
    #[template(path = "script/numpy.askama")]
    NumPy { banner: String, m: ModelText<'a> },
    #[template(path = "script/casadi.askama")]
    Casadi {
        banner: String,
        module: &'a str,
        m: ModelText<'a>,
    },
    #[template(path = "script/matlab.askama")]
    Matlab {
        banner: String,
        file: &'a str,
        selects: bool,
        m: ModelText<'a>,
    },
}

impl Script {
    /// The file of a model; `provenance` is the text of the first line.
    ///
    /// # Errors
    /// [`CodegenError::Template`] if a template fails.
    pub fn emit(
        self,
        entries: &ModelInterface,
        provenance: &str,
    ) -> Result<Vec<EmittedFile>, CodegenError> {
        let (spelling, modules, comment, ending) = match self {
            Self::NumPy => (&NUMPY, MODULES, "#", ".py"),
            Self::Casadi => (&CASADI, MODULES, "#", "_casadi.py"),
            Self::Matlab => (&MATLAB, "", "%", ".m"),
        };
        let mut stems = Namer::new(&format!("{} {modules}", spelling.reserved));
        let path = format!("{}{ending}", stems.mint(&entries.identifier));
        let dialect = &Dialect::new(spelling, &entries.identifier, Precision::Double);
        let m = ModelText::new(entries, dialect, None);
        let banner = format!("{comment} {provenance}");
        let (name, _) = path.split_once('.').expect("an ending");
        let file = match self {
            Self::NumPy => File::NumPy { banner, m },
            Self::Casadi => File::Casadi {
                banner,
                module: name,
                m,
            },
            Self::Matlab => File::Matlab {
                banner,
                file: name,
                selects: entries.has(|s| matches!(s, Statement::Select(_))),
                m,
            },
        };
        let text = tidy(&file.render()?);
        Ok(vec![EmittedFile::new(path, text)])
    }
}

fn list<T>(elements: &[T], print: impl Fn(&T) -> String) -> String {
    elements.iter().map(print).collect::<Vec<_>>().join(", ")
}

fn names(parameters: Vec<&Parameter>) -> String {
    list(&parameters, |parameter| parameter.name.to_string())
}

/// The function of CasADi made of expressions; these are private functions, so that it has the plain name.
fn definition(m: &ModelText<'_>, f: &Function) -> String {
    let (model, name) = (&m.entries.identifier, &f.name);
    let inputs = list(&f.inputs(), |input| {
        format!("(\"{}\", {})", input.name, input.len)
    });
    let outputs = list(&f.outputs(), |output| match output.role {
        Role::InOut => format!("\"{}_next\"", output.name),
        Role::Output | Role::Input | Role::Scalar => format!("\"{}\"", output.name),
    });
    let mut phases = m.phases.iter();
    let pattern = match phases.find(|phase| phase.functions[1].name == *name) {
        Some(phase) => format!(",\n    ({0}_JACOBIAN_ROWS, {0}_JACOBIAN_COLS)", phase.upper),
        None => String::new(),
    };
    format!(
        "{name} = _function(\n    \"{model}_{name}\", _{name}, [{inputs}], [{outputs}]{pattern})"
    )
}

fn comments(f: &Function) -> Vec<String> {
    comment_lines(&f.docs, 90)
}

/// The same inside a documentation string.
fn escaped(f: &Function) -> Vec<String> {
    let escape = |line: String| line.replace('\\', "\\\\").replace('"', "\\\"");
    comments(f).into_iter().map(escape).collect()
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
