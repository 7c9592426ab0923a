//! LaTeX is read as TeX prints it: digits in braces, definitions that end with their group, and text that is not
//! printed. Random documents are checked against a model of TeX's groups in this file and, with all tools, TeX itself.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::Command;

use romc::import::{Format, SymbolNames, read_equations};

use super::tools;

/// Names of the macros. The body of one may contain only those after it, so every expansion ends.
const MACROS: [&str; 4] = ["ka", "kb", "kc", "kd"];
const GROUPS: [(&str, &str); 6] = [
    ("{", "}"),
    ("\\begingroup ", "\\endgroup "),
    ("\\bgroup ", "\\egroup "),
    ("\\begin{center}", "\\end{center}"),
    ("\\begin{quote}\n", "\\end{quote}\n"),
    ("\\begin{own}{7}", "\\end{own}"),
];
const PREAMBLE: &str =
    "\\newif\\ifdraft\n\\newenvironment{own}[1]{\\begin{center}\\def\\ka{#1}}{\\end{center}}\n";

/// Body of a macro: digits, or the number of another macro.
type Body = Vec<Result<char, usize>>;

/// The definitions in force at a place.
#[derive(Clone)]
struct Meanings {
    macros: BTreeMap<usize, Body>,
    is_draft: bool,
}

struct Writer {
    random: u64,
    text: String,
    /// The innermost group is last.
    groups: Vec<Meanings>,
    /// Whether the next text is printed.
    is_printed: bool,
    /// Numbers of the equations that are printed.
    numbers: Vec<String>,
}

impl Writer {
    fn document(seed: u64) -> Self {
        let macros = (0..MACROS.len()).map(|name| (name, vec![Ok('1')]));
        let macros = macros.collect();
        let mut writer = Self {
            random: seed,
            text: "\\draftfalse".to_owned(),
            groups: vec![Meanings {
                macros,
                is_draft: false,
            }],
            is_printed: true,
            numbers: Vec::new(),
        };
        for name in MACROS {
            let _ = write!(writer.text, "\\def\\{name}{{1}}");
        }
        writer.statements(3);
        writer.equation();
        writer
    }

    /// A number below `count`.
    fn below(&mut self, count: usize) -> usize {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.random;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) % count as u64) as usize
    }

    fn push(&mut self, text: &str) {
        self.text.push_str(text);
    }

    fn meanings(&mut self) -> &mut Meanings {
        self.groups.last_mut().expect("the document")
    }

    fn statements(&mut self, depth: usize) {
        for _ in 0..1 + self.below(4) {
            match self.below(if depth > 0 { 8 } else { 5 }) {
                0 | 1 => self.definition(),
                2 => self.equation(),
                3 => self.rows(),
                4 => self.unprinted(),
                5 | 6 => self.group(depth - 1),
                _ => self.condition(depth - 1),
            }
        }
    }

    fn group(&mut self, depth: usize) {
        let (open, close) = GROUPS[self.below(GROUPS.len())];
        self.push(open);
        let inside = self.meanings().clone();
        self.groups.push(inside);
        if open.ends_with("{7}") {
            self.meanings().macros.insert(0, vec![Ok('7')]);
        }
        self.statements(depth);
        self.groups.pop();
        self.push(close);
    }

    /// A definition for the group, or for the rest of the document.
    fn definition(&mut self) {
        let name = self.below(MACROS.len());
        let body: Body = (0..1 + self.below(3))
            .map(|_| match self.below(3) {
                0 if name + 1 < MACROS.len() => Err(name + 1 + self.below(MACROS.len() - name - 1)),
                _ => Ok(char::from(b'0' + self.below(10) as u8)),
            })
            .collect();
        let written: String = (body.iter())
            .map(|part| match part {
                Ok(digit) => digit.to_string(),
                Err(name) => format!("\\{} ", MACROS[*name]),
            })
            .collect();
        let own = MACROS[name];
        let kind = self.below(8);
        let is_global = (4..7).contains(&kind);
        let mut meaning = Some(body);
        match kind {
            0 => self.push(&format!("\\renewcommand{{\\{own}}}{{{written}}}")),
            1 => self.push(&format!("\\def\\{own} {{{written}}}")),
            2 => self
                .push(&format!("\\renewcommand*\\{own}[1][{written}]{{##1}}").replace("##", "#")),
            3 => {
                self.push(&format!("\\providecommand{{\\{own}}}{{{written}}}"));
                meaning = None;
            }
            4 => self.push(&format!("\\gdef\\{own}{{{written}}}")),
            5 => self.push(&format!("\\global\\long\\def\\{own}{{{written}}}")),
            6 | 7 if name + 1 < MACROS.len() => {
                let other = name + 1;
                meaning = self.meanings().macros.get(&other).cloned();
                let global = if is_global { "\\global" } else { "" };
                self.push(&format!("{global}\\let\\{own}=\\{} ", MACROS[other]));
            }
            _ => {
                let value = self.below(2) == 0;
                let global = if is_global { "\\global" } else { "" };
                self.push(&format!("{global}\\draft{value} "));
                let first = if is_global { 0 } else { self.groups.len() - 1 };
                for group in &mut self.groups[first..] {
                    group.is_draft = value;
                }
                return;
            }
        }
        let first = if is_global { 0 } else { self.groups.len() - 1 };
        for group in &mut self.groups[first..] {
            if let Some(meaning) = &meaning {
                group.macros.insert(name, meaning.clone());
            }
        }
    }

    /// Writes a branch that is not printed.
    fn dead(&mut self, depth: usize) {
        let (groups, is_printed) = (self.groups.clone(), self.is_printed);
        self.is_printed = false;
        self.statements(depth);
        (self.groups, self.is_printed) = (groups, is_printed);
    }

    fn condition(&mut self, depth: usize) {
        let is_draft = self.meanings().is_draft;
        let (name, value) =
            [("iftrue", true), ("iffalse", false), ("ifdraft", is_draft)][self.below(3)];
        let value = match self.below(4) {
            0 => {
                self.push("\\unless");
                !value
            }
            _ => value,
        };
        self.push(&format!("\\{name} "));
        for is_read in [value, !value] {
            match is_read {
                true => self.statements(depth),
                false => {
                    self.dead(depth);
                    let stray = ["", "% \\fi\n", "{", "\\]", "\\ifx a", "\\verb|"][self.below(6)];
                    self.push(stray);
                    self.push(if stray == "\\ifx a" {
                        "\\else\\fi "
                    } else {
                        ""
                    });
                }
            }
            self.push(if is_read == value { "\\else " } else { "\\fi " });
        }
    }

    fn unprinted(&mut self) {
        let text = [
            "% \\[\\ddot z_1 = 9 z_1\\]\n",
            "5\\% {\\typeout{$z_1$}}",
            "\\phantom{$\\ddot z_1 = 9 z_1$}",
            "\n\\begin{comment}\n\\[\\ddot z_1 = 9 z_1\\] \\fi } \n\\end{comment}\n",
            "\\verb|\\iffalse $|",
            "\n\\begin{verbatim}\n\\[\\ddot z_1 = 9 z_1\\] % { \\end\n\\end{verbatim}\n",
        ];
        // In a skipped branch TeX does not recognise environments.
        let text = text[self.below(if self.is_printed { text.len() } else { 3 })];
        self.push(text);
    }

    /// A display of one equation, sometimes with a definition inside.
    fn equation(&mut self) {
        let (open, close) = [
            ("\\[", "\\]"),
            ("$$", "$$"),
            ("\\begin{equation*}", "\\end{equation*}"),
        ][self.below(3)];
        self.push(open);
        let inside = self.meanings().clone();
        self.groups.push(inside);
        self.left_side();
        if self.below(3) == 0 {
            self.definition();
        }
        self.number();
        self.groups.pop();
        self.push(close);
    }

    /// Rows whose cells are groups.
    fn rows(&mut self) {
        self.push("\\begin{align*}");
        for row in 0..2 {
            self.push(if row > 0 { "\\\\" } else { "" });
            let outside = self.groups.clone();
            self.left_side();
            self.push("\\def\\ka{3}&");
            let inside = self.meanings().clone();
            self.groups.push(inside);
            self.push("\\renewcommand{\\kb}{8}");
            self.meanings().macros.insert(1, vec![Ok('8')]);
            self.number();
            self.groups = outside;
        }
        self.push("\\end{align*}");
    }

    fn left_side(&mut self) {
        let live = self.numbers.len() + 1;
        let index = if self.is_printed { live } else { 1 };
        self.push(&format!("\\ddot z_{{{index}}} = "));
    }

    /// A number in digits and macros, mixed with braces, fonts and comments, and its factor.
    fn number(&mut self) {
        let mut value = String::new();
        let point = ["0.", "1{,}", "{0}.", "2{.}", "{}3."][self.below(5)];
        self.push(point);
        value.push_str(&point.replace(',', ".").replace(['{', '}'], ""));
        for _ in 0..4 + self.below(4) {
            let (written, digits) = match self.below(3) {
                0 => {
                    let name = self.below(MACROS.len());
                    (format!("\\{} ", MACROS[name]), self.resolved(&[Err(name)]))
                }
                _ => {
                    let digits = self.below(100).to_string();
                    (digits.clone(), digits)
                }
            };
            let (open, close) = [
                ("", ""),
                ("", "% 5\n"),
                ("{", "}"),
                ("{{", "}{}}"),
                ("\\mathrm{", "}"),
                ("{}", " "),
                ("\\text{", "}"),
                ("\\bgroup ", "\\egroup "),
                ("\\begingroup ", "\\endgroup "),
            ][self.below(9)];
            self.push(&format!("{open}{written}{close}"));
            value.push_str(&digits);
        }
        self.push("z_1");
        if self.is_printed {
            self.numbers.push(value);
        }
    }

    fn resolved(&mut self, body: &[Result<char, usize>]) -> String {
        let macros = self.meanings().macros.clone();
        let mut open: Vec<_> = body.iter().rev().copied().collect();
        let mut digits = String::new();
        while let Some(part) = open.pop() {
            match part {
                Ok(digit) => digits.push(digit),
                Err(name) => open.extend(macros[&name].iter().rev()),
            }
        }
        digits
    }
}

/// Reads a document and compares its numbers.
fn assert_read(document: &Writer, seed: u64) {
    let text = format!("{PREAMBLE}{}", document.text);
    let read = read_equations(
        "made.tex",
        Format::Latex,
        text.as_bytes(),
        &SymbolNames::default(),
        &[],
    );
    let read = read.unwrap_or_else(|error| panic!("seed {seed}: {error}\n{text}"));
    let equations = read.sections.iter().flat_map(|section| &section.equations);
    let found: Vec<String> = equations
        .map(|equation| equation.text().replace('\n', ""))
        .collect();
    let expected: Vec<String> = (document.numbers.iter())
        .map(|number| format!("{number}*z1"))
        .collect();
    assert_eq!(found, expected, "seed {seed}\n{text}");
}

#[test]
fn documents_are_read_as_a_model_of_groups_foretells() {
    for seed in 0..if tools::is_thorough() { 500 } else { 50 } {
        assert_read(&Writer::document(seed), seed);
    }
}

#[test]
fn tex_prints_the_numbers_that_are_read() {
    let found = ["pdflatex", "pdftotext"].map(|tool| {
        let version = if tool == "pdftotext" {
            "-v"
        } else {
            "--version"
        };
        tools::is_thorough() && tools::answers(Command::new(tool).arg(version))
    });
    if found.contains(&false) {
        return;
    }
    let documents: Vec<Writer> = (0..500).map(Writer::document).collect();
    let mut text = format!(
        "\\documentclass{{article}}\\usepackage{{amsmath,verbatim}}\\pagestyle{{empty}}\n{PREAMBLE}\
         \\renewcommand{{\\ddot}}[1]{{D#1}}\\begin{{document}}\n"
    );
    for document in &documents {
        let _ = writeln!(text, "\\begingroup {}\\endgroup\\newpage", document.text);
    }
    text.push_str("\\end{document}\n");
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("made.tex"), text).expect("a file");
    let run = |tool: &str, arguments: &[&str]| {
        let output = Command::new(tool)
            .args(arguments)
            .current_dir(folder.path())
            .output();
        let output = output.expect("it was found");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{tool}: {text}");
        text
    };
    run(
        "pdflatex",
        &["-interaction=nonstopmode", "-halt-on-error", "made.tex"],
    );
    let printed = run("pdftotext", &["-raw", "made.pdf", "-"]);
    let pages: Vec<&str> = printed.split('\u{c}').collect();
    assert!(pages.len() >= documents.len(), "{} pages", pages.len());
    for (seed, (document, page)) in documents.iter().zip(pages).enumerate() {
        let page: String = page.chars().filter(|c| !c.is_whitespace()).collect();
        let numbers = page
            .split('D')
            .skip(1)
            .filter_map(|part| part.split_once('='));
        let numbers: Vec<String> = numbers
            .filter_map(|(_, right)| Some(right.split_once('z')?.0.replace(',', ".")))
            .collect();
        assert_eq!(numbers, document.numbers, "seed {seed}\n{}", document.text);
    }
}
