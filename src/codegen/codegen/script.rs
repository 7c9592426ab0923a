//! Scripts: `NAME.py` on NumPy, `NAME_casadi.py` with functions of CasADi, `NAME.m` for MATLAB and Octave, a function
//! that returns a struct of function handles; and the spellings of all languages.
//!
//! Arrays of scripts are matrices with a column per point (a vector for one point), and operations are element by
//! element: a program's statements serve one state and many. Values that other languages write into parameters are
//! returned here.

use super::dialect::Spelling;
use super::*;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Script {
    NumPy,
    Casadi,
    /// MATLAB without toolboxes; Octave runs the same.
    Matlab,
}

/// Modules that a file of the same name would hide from NumPy, CasADi and the file itself.
const MODULES: &str = "numpy abc argparse array ast atexit base64 bisect builtins bz2 calendar cmath code codecs \
    collections concurrent contextlib contextvars copy copyreg csv ctypes dataclasses datetime \
    decimal dis email encodings enum errno fnmatch fractions functools gc genericpath getpass glob \
    gzip hashlib heapq hmac html http importlib inspect io itertools json keyword linecache locale \
    logging lzma marshal math mmap multiprocessing numbers opcode operator os pathlib pickle pkgutil \
    platform posixpath pprint queue random re secrets select selectors shutil signal site socket \
    stat statistics string struct subprocess sys sysconfig tempfile textwrap threading time token \
    tokenize traceback types typing unittest urllib";

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
    pub fn emit(self, entries: &ModelInterface, provenance: &str) -> Result<Vec<EmittedFile>> {
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

fn column(numbers: &[usize]) -> String {
    if numbers.is_empty() {
        return "zeros(0, 1)".to_owned();
    }
    format!("[{}]'", list(numbers, |number| (number + 1).to_string()))
}

/// C99. Reserved are the keywords of C and C++, and the library names that generated files use.
pub(crate) const C: Spelling = Spelling {
    reserved: "auto break case char const continue default do double else enum extern float for goto if inline \
        int long register restrict return short signed sizeof static struct switch typedef union \
        unsigned void volatile while bool true false catch class delete explicit export friend mutable \
        namespace new noexcept nullptr operator private protected public template this throw try typeid \
        typename using virtual and or not xor main sin cos pow fabs memcpy size_t \
        uint64_t y0 y1 yn j0 j1 jn gamma signgam asm typeof constexpr concept requires import module \
        alignas alignof static_assert thread_local decltype div index time erf I NULL errno stdin stdout \
        stderr",
    reals: ["double", "float"],
    suffixes: ["", "f"],
    not_finite: ["NAN", "INFINITY", "-INFINITY"],
    scalar: "const $real $name = $value;",
    array: "const $real $name[$n] = {$value};",
    declaration: "$real $name[$n];",
    assignment: "$name = $value;",
    addition: Some("$name += $value;"),
    loop_head: "for (size_t $name = 0; $name < $n; ++$name) {",
    loop_end: Some("}"),
    loops_over_lanes: true,
    continuation: "",
    operators: [" + ", " - ", "*", "/"],
    multiply_add: None,
    function: "$name$f($a)",
    functions: &[(Unary::Abs, "fabs$f($a)"), (Unary::Sign, "$model_sign($a)")],
    power: "$model_pow($a, $b)",
    select: "$model_select($test, $zero, $other)",
    element: "$name[$i]",
    entry: "$name[$i][$j]",
    first_index: 0,
    read: ["$name", "$name", "&$name[$first]"],
    written: ["$name", "$name", "&$name[$first]"],
    sin_cos: "$model_sin_cos($n, $read, $written);",
    call: "$name($read, $written);",
    // A choice between numbers: compilers vectorise it, but not a comparison that becomes an integer.
    sin_cos_lane: &[
        "$real $sine, $cosine;",
        "$model_sin_cos_reduced($a, &$sine, &$cosine);",
        "beyond[lane] = fabs$f($a) <= $upper_ANGLE_LIMIT ? beyond[lane] : 1.0$f;",
    ],
    unused_lane: None,
    prefix: "$model_",
    table_base: "$model_table",
    table: "static const $real $name[$rows][$cols] = {\n$value};",
    rows: ["    {", ",\n     ", "},"],
    head: "void $name($value)",
    parameters: [
        "const $real *restrict $name",
        "$real *restrict $name",
        "$real $name",
    ],
    mention: "(void)$name;",
};

/// Rust without `std` or allocation. Reserved are its keywords and the names that generated crates use themselves.
pub(crate) const RUST: Spelling = Spelling {
    reserved: "abstract as async await become box break const continue crate do dyn else enum extern false \
        final fn for gen if impl in let loop macro match mod move mut override priv pub ref return self \
        static struct super trait true try type typeof unsafe unsized use virtual where while yield f64 \
        f32 usize std core libm math sin_cos sin_cos_reduced sign union",
    reals: ["f64", "f32"],
    suffixes: ["", ""],
    not_finite: ["f64::NAN", "f64::INFINITY", "f64::NEG_INFINITY"],
    scalar: "let $name = $value;",
    array: "let $name: [$real; $n] = [$value];",
    declaration: "let mut $name = [0.0_$real; $n];",
    loop_head: "for $name in 0..$n {",
    loops_over_lanes: false,
    multiply_add: Some("math::mul_add"),
    function: "math::$name($a)",
    functions: &[],
    power: "math::pow($a, $b)",
    select: "math::select($test, $zero, $other)",
    read: ["$name", "&$name", "&$name[$first..$end]"],
    written: ["$name", "&mut $name", "&mut $name[$first..$end]"],
    sin_cos: "sin_cos($read, $written);",
    sin_cos_lane: &[
        "let ($sine, $cosine) = sin_cos_reduced($a);",
        "beyond[lane] = if math::abs($a) <= ANGLE_LIMIT { beyond[lane] } else { 1.0 };",
    ],
    unused_lane: Some("_"),
    prefix: "",
    table_base: "TABLE",
    table: "static $name: [[$real; $cols]; $rows] = [\n$value];",
    rows: ["    [", ",\n     ", "],"],
    head: "pub fn $name($value)",
    parameters: [
        "$name: &[$real; $n]",
        "$name: &mut [$real; $n]",
        "$name: $real",
    ],
    mention: "let _ = $name;",
    ..C
};

/// Python on arrays of NumPy. Reserved are its keywords and the names that generated modules use themselves.
pub(crate) const NUMPY: Spelling = Spelling {
    reserved: "False None True and as assert async await break class continue def del elif else except finally \
        for from global if import in is lambda nonlocal not or pass raise return try while with yield \
        match case type np casadi range list shape zip len float print _rows _sin_cos",
    scalar: "$name = $value",
    array: "$name = [$value]",
    declaration: "$name = [0.0] * $n",
    assignment: "$name = $value",
    addition: Some("$name += $value"),
    loop_head: "for $name in range($n):",
    loop_end: None,
    loops_over_lanes: false,
    continuation: " \\",
    function: "np.$name($a)",
    functions: &[],
    power: "np.power($a, $b)",
    select: "np.where(np.equal($test, 0.0), $zero, $other)",
    read: ["$name", "$name", "$name[$first:$end]"],
    written: ["$name[$first:$end]"; 3],
    sin_cos: "$written = _sin_cos($read)",
    call: "$written = $name($read)",
    prefix: "",
    table_base: "TABLE",
    table: "$name = [\n$value]",
    rows: ["    [", ",\n     ", "],"],
    ..C
};

/// Python with symbolic scalars of CasADi; the expressions of a function are a private one.
pub(crate) const CASADI: Spelling = Spelling {
    function: "casadi.$name($a)",
    functions: &[(Unary::Abs, "casadi.fabs($a)")],
    power: "casadi.power($a, $b)",
    select: "casadi.if_else(casadi.eq($test, 0.0), $zero, $other)",
    call: "$written = _$name($read)",
    ..NUMPY
};

/// MATLAB and Octave. Reserved are their keywords, and the names that generated files use themselves.
pub(crate) const MATLAB: Spelling = Spelling {
    reserved: "arguments break case catch classdef continue else elseif end for function global if otherwise \
        parfor persistent return spmd switch try while do until unwind_protect end_try_catch endif \
        endfor endwhile endfunction endswitch methods properties events enumeration columns rows_of \
        model n zeros size numel repmat cell max error nargin sin cos power select",
    scalar: "$name = $value;",
    array: "$name = rows_of(n, $value);",
    declaration: "$name = zeros($n, n);",
    addition: None,
    loop_head: "for $name = 0:$last",
    loop_end: Some("end"),
    loops_over_lanes: false,
    continuation: " ...",
    operators: [" + ", " - ", ".*", "./"],
    function: "$name($a)",
    functions: &[],
    power: "power($a, $b)",
    select: "select($test, $zero, $other)",
    element: "$name($i, :)",
    entry: "$name($i, $j)",
    first_index: 1,
    read: ["$name", "$name", "$name($next:$end, :)"],
    written: ["$name"; 3],
    sin_cos: "$sines = sin($read); $cosines = cos($read);",
    call: "[$written] = $name($read);",
    prefix: "",
    table_base: "table",
    table: "function t = $name_entries()\n    t = [\n$value    ];\nend",
    rows: ["        ", ", ...\n        ", ""],
    ..C
};
