//! The spellings of a language as a table of patterns; arrays and functions before they are spelled; lists and comments
//! broken into lines. `$name` and similar words in a pattern are placeholders. `$model`, `$upper`, `$real` and `$f`
//! (identifier of the model, the same in upper case, type of numbers, suffix of literals) are defined everywhere.

use super::*;

/// The patterns of a language. Those with two entries are for double and single precision.
pub(crate) struct Spelling {
    /// Words that no variable may be called, with blanks between them.
    pub reserved: &'static str,
    pub reals: [&'static str; 2],
    pub suffixes: [&'static str; 2],
    /// NaN and both infinities in self-tests.
    pub not_finite: [&'static str; 3],
    /// Definition of `$name` by `$value`; of an array by its `$n` elements.
    pub scalar: &'static str,
    pub array: &'static str,
    /// An array of `$n` elements that are assigned later.
    pub declaration: &'static str,
    pub assignment: &'static str,
    pub addition: Option<&'static str>, // `+=`, where the language has it
    /// Head of a loop of `$name` from 0 to below `$n`, or to `$last`; and the end of its body.
    pub loop_head: &'static str,
    pub loop_end: Option<&'static str>,
    /// Whether a `Lanes` statement is a loop. Rust's compiler unrolls it before it looks for vectors.
    pub loops_over_lanes: bool,
    /// Marker at the end of a line that continues in the next.
    pub continuation: &'static str,
    /// Sum, difference, product and quotient, with the spaces around them.
    pub operators: [&'static str; 4],
    /// `f(a, b, c) = a*b + c` for loops, in a language whose compilers never fuse the two by themselves.
    pub multiply_add: Option<&'static str>,
    /// A function `$name` of `$a`, and the functions that are spelled otherwise.
    pub function: &'static str,
    pub functions: &'static [(Unary, &'static str)],
    pub power: &'static str,
    /// `$zero` where `$test` is zero, else `$other`.
    pub select: &'static str,
    /// Element `$i` of an array, entry `$i`, `$j` of a table; the first index.
    pub element: &'static str,
    pub entry: &'static str,
    pub first_index: usize,
    /// Arrays of a call: whole parameter, whole local array, elements from `$first` (`$next` from one) to below `$end`.
    pub read: [&'static str; 3],
    pub written: [&'static str; 3],
    /// Calls of the sine-and-cosine kernel for `$n` angles and of a generated function.
    pub sin_cos: &'static str,
    pub call: &'static str,
    /// The kernel's core on the argument `$a` of a lane: defines `$sine` and `$cosine`, and notes an argument beyond
    /// its limit. Blocks of lanes are for compilers: scripts run many points as columns.
    pub sin_cos_lane: &'static [&'static str],
    /// Placeholder for a result of the core that is not used, if it may be left out.
    pub unused_lane: Option<&'static str>,
    pub prefix: &'static str,
    /// Beginning of the names of tables; a table; the text that opens its rows, follows each eighth entry and closes
    /// them.
    pub table_base: &'static str,
    pub table: &'static str,
    pub rows: [&'static str; 3],
    /// Head of a function; its parameters: arrays read, arrays written, scalars; mention of one that nothing reads.
    pub head: &'static str,
    pub parameters: [&'static str; 3],
    pub mention: &'static str,
}

#[derive(Clone)]
pub(crate) struct Dialect {
    pub spelling: &'static Spelling,
    pub model: String, // identifier, the beginning of all external names in C
    pub precision: Precision,
}

impl Dialect {
    pub(crate) fn new(spelling: &'static Spelling, model: &str, precision: Precision) -> Self {
        Self {
            spelling,
            model: model.to_owned(),
            precision,
        }
    }

    pub(crate) fn upper(&self) -> String {
        self.model.to_ascii_uppercase()
    }

    pub(crate) fn real(&self) -> &'static str {
        self.spelling.reals[usize::from(self.precision.is_single())]
    }

    pub(crate) fn suffix(&self) -> &'static str {
        self.spelling.suffixes[usize::from(self.precision.is_single())]
    }

    pub(crate) fn fill(&self, pattern: &str, words: &[(&str, &str)]) -> String {
        let mut parts = pattern.split('$');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let end = part.find(|c: char| !c.is_ascii_lowercase());
            let (word, rest) = part.split_at(end.unwrap_or(part.len()));
            match (word, words.iter().find(|(known, _)| *known == word)) {
                (_, Some((_, value))) => text += value,
                ("model", None) => text += &self.model,
                ("upper", None) => text += &self.upper(),
                ("real", None) => text += self.real(),
                ("f", None) => text += self.suffix(),
                (unknown, None) => unreachable!("`${unknown}` in the pattern `{pattern}`"),
            }
            text += rest;
        }
        text
    }

    pub(crate) fn literal(&self, value: f64) -> String {
        self.precision.digits(value) + self.suffix()
    }

    /// A number of a self-test, which may be infinite or none.
    pub(crate) fn number(&self, value: f64) -> String {
        let [nan, infinite, negative] = self.spelling.not_finite;
        match value {
            _ if value.is_nan() => nan.to_owned(),
            f64::INFINITY => infinite.to_owned(),
            f64::NEG_INFINITY => negative.to_owned(),
            _ => self.literal(value),
        }
    }

    pub(crate) fn call(&self, callee: Option<&Ident>, read: &[Span], written: &[Span]) -> String {
        let passed = |spans: &[Span], patterns: &[&str; 3]| {
            let text = |span: &Span| {
                let pattern = match (span.is_whole(), span.is_parameter) {
                    (true, true) => patterns[0],
                    (true, false) => patterns[1],
                    (false, _) => patterns[2],
                };
                let bounds = [span.offset, span.offset + 1, span.offset + span.len];
                let [first, next, end] = &bounds.map(|bound| bound.to_string());
                let name = span.array.as_str();
                let words = [
                    ("name", name),
                    ("first", first),
                    ("next", next),
                    ("end", end),
                ];
                self.fill(pattern, &words)
            };
            spans.iter().map(text).collect::<Vec<_>>()
        };
        let n = read.first().map_or(0, |span| span.len).to_string();
        let inputs = passed(read, &self.spelling.read).join(", ");
        let outputs = passed(written, &self.spelling.written);
        let all = outputs.join(", ");
        let mut words = vec![("n", n.as_str()), ("read", &inputs), ("written", &all)];
        match callee {
            Some(callee) => {
                words.push(("name", callee.as_str()));
                self.fill(self.spelling.call, &words)
            }
            None => {
                words.extend([("sines", outputs[0].as_str()), ("cosines", &outputs[1])]);
                self.fill(self.spelling.sin_cos, &words)
            }
        }
    }

    pub(crate) fn table(&self, name: &Ident, table: &Table) -> String {
        let [open, between, close] = self.spelling.rows;
        let row = |row: &[f64]| {
            let entries: Vec<String> = row.iter().map(|&entry| self.literal(entry)).collect();
            let lines: Vec<String> = entries.chunks(8).map(|line| line.join(", ")).collect();
            format!("{open}{}{close}\n", lines.join(between))
        };
        let entries: String = (0..table.rows).map(|r| row(table.row(r))).collect();
        let [rows, cols] = [table.rows, table.cols].map(|count| count.to_string());
        let words = [
            ("name", name.as_str()),
            ("rows", &rows),
            ("cols", &cols),
            ("value", &entries),
        ];
        self.fill(self.spelling.table, &words)
    }

    pub(crate) fn head(&self, function: &Function) -> String {
        let text = |parameter: &Parameter| {
            let pattern = match parameter.role {
                Role::Input => self.spelling.parameters[0],
                Role::Output | Role::InOut => self.spelling.parameters[1],
                Role::Scalar => self.spelling.parameters[2],
            };
            let len = parameter.len.to_string();
            self.fill(pattern, &[("name", parameter.name.as_str()), ("n", &len)])
        };
        let parameters: Vec<String> = function.parameters.iter().map(text).collect();
        let words = [
            ("name", function.name.as_str()),
            ("value", &parameters.join(", ")),
        ];
        self.fill(self.spelling.head, &words)
    }

    /// The function without documentation and last newline; with a mention of each parameter that nothing reads.
    pub(crate) fn definition(&self, function: &Function) -> String {
        let mention = |name: &Ident| self.fill(self.spelling.mention, &[("name", name.as_str())]);
        let unused = function.unused.iter();
        let unused: String = unused
            .map(|name| format!("    {}\n", mention(name)))
            .collect();
        format!("{} {{\n{unused}{}}}", self.head(function), function.body)
    }
}

/// A subscript `offset + sum_i stride_i * name_i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Index {
    pub terms: Vec<(usize, Ident)>,
    pub offset: usize,
}

impl Index {
    pub(crate) fn fixed(offset: usize) -> Self {
        Self {
            terms: Vec::new(),
            offset,
        }
    }

    pub(crate) fn variable(name: &Ident) -> Self {
        Self::fixed(0).plus(1, name)
    }

    pub(crate) fn plus(mut self, stride: usize, name: &Ident) -> Self {
        self.terms.push((stride, name.clone()));
        self
    }

    pub(crate) fn shifted(mut self, by: usize) -> Self {
        self.offset += by;
        self
    }
}

/// `len` elements of an array from `offset` on, handed to a function.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    pub array: Ident,
    pub offset: usize,
    pub len: usize,
    pub of: usize,
    pub is_parameter: bool,
}

impl Span {
    pub(crate) fn whole(array: &Ident, len: usize, is_parameter: bool) -> Self {
        Self {
            array: array.clone(),
            offset: 0,
            len,
            of: len,
            is_parameter,
        }
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.offset == 0 && self.len == self.of
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Input,
    Output,
    InOut,
    Scalar,
}

/// A parameter of a generated function, in a language or, with a text for a name, in any.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parameter<N = Ident> {
    pub name: N,
    pub len: usize, // an output may have none
    pub role: Role,
}

pub(crate) struct Function {
    pub name: Ident,
    pub docs: Vec<String>,
    pub parameters: Vec<Parameter>,
    pub unused: Vec<Ident>,
    pub body: String,
}

/// Where parameters become results, as in scripts: one that is read and written is an argument and returned.
impl Function {
    fn of(&self, roles: &[Role]) -> Vec<&Parameter> {
        let parameters = self.parameters.iter();
        parameters.filter(|p| roles.contains(&p.role)).collect()
    }

    pub(crate) fn inputs(&self) -> Vec<&Parameter> {
        self.of(&[Role::Input, Role::InOut, Role::Scalar])
    }

    pub(crate) fn outputs(&self) -> Vec<&Parameter> {
        self.of(&[Role::Output, Role::InOut])
    }

    pub(crate) fn arrays(&self) -> Vec<&Parameter> {
        self.of(&[Role::Input, Role::InOut])
    }

    pub(crate) fn copied(&self) -> Vec<&Parameter> {
        self.of(&[Role::InOut])
    }

    /// Parameters that are returned and are no arguments, so that the body has to begin with them.
    pub(crate) fn created(&self) -> Vec<&Parameter> {
        self.of(&[Role::Output])
    }

    pub(crate) fn mentions(&self, name: &str) -> bool {
        self.body.contains(&format!("{name}[")) || self.body.contains(&format!("{name}("))
    }
}

/// `{a, b, c}` with `indent` after every eight elements; one without a newline leaves breaking to the printer.
pub(crate) fn braced(elements: &[String], indent: &str) -> String {
    let lines: Vec<String> = elements.chunks(8).map(|line| line.join(", ")).collect();
    format!("{{{}}}", lines.join(&format!(",{indent}")))
}

/// Each paragraph as [`wrapped`]; continued lines are indented by two spaces.
pub(crate) fn comment_lines(paragraphs: &[String], width: usize) -> Vec<String> {
    let paragraphs = paragraphs.iter();
    paragraphs
        .flat_map(|text| wrapped(text, width, " "))
        .collect()
}

/// A paragraph broken at spaces into lines of at most `width` bytes where possible; continued lines begin with
/// `indent`, which a space follows if it is not empty.
pub fn wrapped(paragraph: &str, width: usize, indent: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in paragraph.split_whitespace() {
        if !line.is_empty() && line.len() + 1 + word.len() > width {
            lines.push(std::mem::replace(&mut line, indent.to_owned()));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push(line);
    lines
}

/// The text without trailing spaces or several blank lines in a row, ending with one newline.
pub fn tidy(text: &str) -> String {
    // Line by line into one buffer: a file has up to ten megabytes.
    let mut tidied = String::with_capacity(text.len() + 1);
    for line in text.lines().map(str::trim_end) {
        if !line.is_empty() || !(tidied.is_empty() || tidied.ends_with("\n\n")) {
            tidied.push_str(line);
            tidied.push('\n');
        }
    }
    tidied.truncate(tidied.trim_end_matches('\n').len() + 1);
    tidied
}
