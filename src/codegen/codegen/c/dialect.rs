//! How C99 spells statements.

use crate::codegen::code::{Function, Parameter, Role, Span};
use crate::codegen::dialect::{Dialect, Spelling};
use crate::codegen::line_wrapping::{braced, comment_lines};
use crate::codegen::options::Precision;
use crate::ir::{Table, Unary};

#[derive(Clone, Debug)]
pub(crate) struct CDialect {
    /// Identifier of the model, the beginning of all external and helper names.
    pub name: String,
    pub precision: Precision,
}

/// Keywords of C and C++, and the library names that generated files use.
static SPELLING: Spelling = Spelling::with_braces(
    "
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false catch class delete explicit export friend mutable
    namespace new noexcept nullptr operator private protected public template this throw try typeid
    typename using virtual and or not xor main sin cos tan tanh exp log pow sqrt fabs memcpy size_t
    uint64_t y0 y1 yn j0 j1 jn gamma signgam abs asm typeof constexpr concept requires import module
    alignas alignof static_assert thread_local decltype div index time erf I NULL errno stdin stdout
    stderr
",
);

impl Dialect for CDialect {
    fn spelling(&self) -> &'static Spelling {
        &SPELLING
    }

    fn literal(&self, value: f64) -> String {
        format!("{}{}", self.precision.digits(value), self.suffix())
    }

    fn apply(&self, function: Unary, argument: &str) -> String {
        let name = match function {
            Unary::Abs => "fabs",
            Unary::Sign => return format!("{}_sign({argument})", self.name),
            named => named.name(),
        };
        format!("{name}{}({argument})", self.suffix())
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{}_pow({base}, {exponent})", self.name)
    }

    fn select(&self, [test, zero, other]: [String; 3]) -> String {
        format!("{}_select({test}, {zero}, {other})", self.name)
    }

    fn let_scalar(&self, name: &str, value: &str) -> String {
        format!("const {} {name} = {value};", self.real())
    }

    fn let_array(&self, name: &str, elements: &[String]) -> String {
        format!(
            "const {} {name}[{}] = {};",
            self.real(),
            elements.len(),
            braced(elements, " ")
        )
    }

    fn declare(&self, name: &str, len: usize) -> String {
        format!("{} {name}[{len}];", self.real())
    }

    fn for_loop(&self, variable: &str, count: usize) -> String {
        format!("for (size_t {variable} = 0; {variable} < {count}; ++{variable})")
    }

    fn call(&self, callee: Option<&str>, read: &[Span], written: &[Span]) -> String {
        let passed: Vec<String> = read.iter().chain(written).map(pointer).collect();
        let passed = passed.join(", ");
        match callee {
            Some(callee) => format!("{callee}({passed});"),
            None => format!("{}_sin_cos({}, {passed});", self.name, read[0].len),
        }
    }

    fn sin_cos_lane(
        &self,
        argument: &str,
        [sine, cosine]: &[String; 2],
        _is_used: [bool; 2],
    ) -> Vec<String> {
        let (name, upper) = (&self.name, self.upper());
        let suffix = self.suffix();
        vec![
            format!("{} {sine}, {cosine};", self.real()),
            format!("{name}_sin_cos_reduced({argument}, &{sine}, &{cosine});"),
            // A choice between numbers: compilers vectorise it where they do not vectorise a
            // comparison that becomes an integer.
            format!(
                "beyond[lane] = fabs{suffix}({argument}) <= {upper}_ANGLE_LIMIT ? beyond[lane] : 1.0{suffix};"
            ),
        ]
    }

    fn table_base(&self, prefix: &str) -> String {
        format!("{prefix}table")
    }

    fn table(&self, name: &str, table: &Table) -> String {
        let (rows, cols, real) = (table.rows(), table.cols(), self.real());
        let entries = self.rows(table, ["    {", ",\n     ", "},"]);
        format!("static const {real} {name}[{rows}][{cols}] = {{\n{entries}}};")
    }
}

impl CDialect {
    pub(crate) fn upper(&self) -> String {
        self.name.to_ascii_uppercase()
    }

    /// The definition of a function; the header has its documentation.
    pub(crate) fn definition(&self, function: &Function) -> String {
        let head = self.head(function, "restrict ");
        function.definition(&head, |unused| format!("(void){unused};"))
    }

    /// The function's name and parameters, arrays with a qualifier.
    fn head(&self, function: &Function, qualifier: &str) -> String {
        let parameters = function.parameters.iter();
        let parameters: Vec<String> = parameters
            .map(|parameter| self.declared(parameter, qualifier))
            .collect();
        format!("void {}({})", function.name, parameters.join(", "))
    }

    fn declared(&self, parameter: &Parameter, qualifier: &str) -> String {
        let (name, real) = (&parameter.name, self.real());
        match parameter.role {
            Role::Input => format!("const {real} *{qualifier}{name}"),
            Role::Output | Role::InOut => format!("{real} *{qualifier}{name}"),
            Role::Scalar => format!("{real} {name}"),
        }
    }

    pub(crate) fn real(&self) -> &'static str {
        match self.precision {
            Precision::Double => "double",
            Precision::Single => "float",
        }
    }

    /// What literals and library functions of that type end with.
    pub(crate) fn suffix(&self) -> &'static str {
        match self.precision {
            Precision::Double => "",
            Precision::Single => "f",
        }
    }

    /// The documented prototype for the header; `restrict` is left to the definition, so
    /// that C++ can include it.
    pub(crate) fn prototype(&self, function: &Function) -> String {
        let signature = self.head(function, "");
        format!("{}{signature};", documentation(&function.docs))
    }
}

/// A documentation comment, one paragraph a line.
pub(crate) fn documentation(lines: &[String]) -> String {
    let body: Vec<String> = comment_lines(lines, 94)
        .iter()
        .map(|line| format!(" * {}", line.replace("*/", "* /")))
        .collect();
    format!("/**\n{}\n */\n", body.join("\n"))
}

fn pointer(span: &Span) -> String {
    if span.offset == 0 {
        span.array.to_string()
    } else {
        format!("&{}[{}]", span.array, span.offset)
    }
}
