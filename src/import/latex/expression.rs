//! One right side: from LaTeX to the grammar of candidate terms, each piece with its place.
//!
//! What is ambiguous in print is refused: `\sin z_1 u_1`, `1/2z_1u_1` with more than numbers around
//! the slash, a number after a variable. Nesting is limited, so the machine's stack is safe.

use super::super::equations::{Equation, refused};
use super::super::error::ImportError;
use super::names::{SymbolNames, is_greek};
use super::token::{Kind, Token};
use crate::model::LatentVariable;

/// Most nested groups.
const MAX_DEPTH: usize = 60;
/// Commands that change only how the page looks; those of the second list take an argument.
const INVISIBLE: &str = ", ; : ! > quad qquad enspace thinspace medspace thickspace negthinspace \
    displaystyle textstyle scriptstyle limits nolimits nonumber notag allowbreak nobreak \
    allowdisplaybreaks hfill hfil mathstrut strut relax big Big bigg Bigg centering noindent par \
    smallskip medskip bigskip";
const INVISIBLE_WITH_ARGUMENT: &str =
    "tag hspace vspace mspace hskip phantom hphantom vphantom color cline";
/// Commands that only choose a font.
const FONTS: &str = "mathrm mathit mathbf mathsf mathtt bm boldsymbol pmb text textrm textit textup \
    mathnormal operatorname mathop mathord mathbin mathopen mathclose mathinner mbox";
const SIZES: &str = "bigl Bigl biggl Biggl bigr Bigr biggr Biggr bigm";

/// How integers of a document's coefficients were rounded, where it says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digits {
    /// Places after the point.
    Decimals(usize),
    /// Significant digits.
    Significant(usize),
}

/// A variable with its dots: `\ddot z_1` is `z_1` and 2.
pub(super) struct Symbol {
    name: String,
    dots: usize,
    place: (usize, usize),
}

impl Symbol {
    /// The variable in quotes, for messages.
    pub(super) fn quoted(&self) -> String {
        let dots = ["", "\\dot ", "\\ddot ", "\\dddot "][self.dots.min(3)];
        format!("`{dots}{}`", self.name)
    }
}

/// What was read last, where it decides whether a product may go on without a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Last {
    Number,
    Other,
    /// A function whose argument had no parentheses.
    Bare,
    /// The same with a number as its argument.
    BareNumber,
}

pub(super) struct Reader<'a> {
    pub(super) file: &'a str,
    pub(super) names: &'a SymbolNames,
    /// Whether `z` and `u` need no subscript.
    pub(super) alone: bool,
    pub(super) digits: Option<Digits>,
    tokens: Vec<Token>,
    /// For each opening brace, where it closes.
    closing: Vec<usize>,
    at: usize,
    end: usize,
    depth: usize,
    /// Whether each open delimiter is a bar.
    bars: Vec<bool>,
    pieces: Vec<(usize, usize, String)>,
}

const BARE: &str = "parentheses around the argument of the function before";

type Read<T> = Result<T, ImportError>;

fn has(list: &str, word: &str) -> bool {
    list.split_whitespace().any(|known| known == word)
}

impl<'a> Reader<'a> {
    /// A reader of one display's tokens.
    ///
    /// # Errors
    /// [`ImportError::Text`] for braces without partner.
    pub(super) fn new(file: &'a str, names: &'a SymbolNames, tokens: &[Token]) -> Read<Self> {
        let tokens = with_split_digits(tokens);
        let mut closing = vec![0; tokens.len()];
        let mut open = Vec::new();
        for (place, token) in tokens.iter().enumerate() {
            match token.kind {
                Kind::Open => open.push(place),
                Kind::Close => match open.pop() {
                    Some(start) => closing[start] = place,
                    None => open.extend([place, place]),
                },
                _ => {}
            }
        }
        if let Some(token) = open.first().map(|place| &tokens[*place]) {
            let found = format!("{} without its partner", token.quoted());
            return Err(refused(file, token.line, token.column, found, "braces in pairs"));
        }
        let end = tokens.len();
        Ok(Self {
            file,
            names,
            alone: false,
            digits: None,
            tokens,
            closing,
            at: 0,
            end,
            depth: 0,
            bars: Vec::new(),
            pieces: Vec::new(),
        })
    }

    /// Passes what prints nothing; what follows, or nothing at the end.
    fn peek(&mut self) -> Option<&Token> {
        while self.at < self.end {
            let after = match &self.tokens[self.at].kind {
                Kind::Align | Kind::Break | Kind::Label(_) | Kind::Comment(_) | Kind::Paragraph => {
                    self.at + 1
                }
                Kind::Character('~') => self.at + 1,
                Kind::Open if self.closing[self.at] == self.at + 1 => self.at + 2,
                Kind::Command(name) if name == " " || has(INVISIBLE, name) || has(SIZES, name) => {
                    self.at + 1
                }
                Kind::Command(name) if has(INVISIBLE_WITH_ARGUMENT, name) => {
                    let star = usize::from(self.kind(self.at + 1) == Some(&Kind::Character('*')));
                    self.after_argument(self.at + 1 + star)
                }
                _ => break,
            };
            self.at = after;
        }
        (self.at < self.end).then(|| &self.tokens[self.at])
    }

    fn kind(&self, at: usize) -> Option<&Kind> {
        self.tokens[..self.end].get(at).map(|token| &token.kind)
    }

    /// The place behind the group or token at `at`.
    fn after_argument(&self, at: usize) -> usize {
        match self.kind(at) {
            Some(Kind::Open) => self.closing[at] + 1,
            Some(_) => at + 1,
            None => at,
        }
    }

    fn character(&mut self, wanted: char) -> bool {
        let found = self.peek().is_some_and(|token| token.kind == Kind::Character(wanted));
        self.at += usize::from(found);
        found
    }

    fn command(&mut self, wanted: &str) -> bool {
        let found = self.peek().is_some_and(|token| token.is_command(wanted));
        self.at += usize::from(found);
        found
    }

    /// Refuses what comes next.
    fn unexpected<T>(&mut self, expected: &str) -> Read<T> {
        let (line, column, found) = match self.peek() {
            Some(token) => (token.line, token.column, token.quoted()),
            None => {
                let last = self.tokens[..self.end].last();
                let found = match self.tokens.get(self.end) {
                    Some(next) => next.quoted(),
                    None => "the end of the equation".to_owned(),
                };
                last.map_or((1, 1, found.clone()), |t| (t.line, t.column, found))
            }
        };
        Err(refused(self.file, line, column, found, expected))
    }

    fn here(&mut self) -> (usize, usize) {
        self.peek().map_or((1, 1), |token| (token.line, token.column))
    }

    fn push(&mut self, (line, column): (usize, usize), text: impl Into<String>) {
        self.pieces.push((line, column, text.into()));
    }

    /// Runs `read` on the group or token that comes next, which must be used up.
    fn inside<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        if self.peek().is_none() {
            return self.unexpected("an argument");
        }
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return self.unexpected(&format!("at most {MAX_DEPTH} nested groups"));
        }
        let mut range = (self.at, self.at + 1);
        let mut after = self.at + 1;
        match &self.tokens[self.at].kind {
            Kind::Open => {
                after = self.closing[self.at] + 1;
                range = (self.at + 1, after - 1);
            }
            Kind::Number(text) if text.len() > 1 => {
                return self.unexpected("braces around an argument of several digits");
            }
            _ => {}
        }
        let outer_end = std::mem::replace(&mut self.end, range.1);
        self.at = range.0;
        let bars = std::mem::take(&mut self.bars);
        let value = read(self)?;
        if self.peek().is_some() {
            return self.unexpected("an operator or the end of the group");
        }
        (self.bars, self.depth) = (bars, self.depth - 1);
        (self.at, self.end) = (after, outer_end);
        Ok(value)
    }

    // ---- left sides -------------------------------------------------------------------------

    /// Reads `\ddot z_1 =` at `at`; the left side and the place behind it.
    pub(super) fn left_side(&mut self, at: usize) -> Option<(Symbol, usize)> {
        let (end, depth) = (self.end, self.depth);
        self.at = at;
        let symbol = self.symbol();
        (self.end, self.depth) = (end, depth);
        let symbol = symbol.ok().flatten().filter(|symbol| symbol.dots == 2)?;
        self.skip_time();
        self.character('=').then_some((symbol, self.at))
    }

    /// Latent coordinate of a left side, from 0.
    pub(super) fn output(&self, symbol: &Symbol) -> Option<usize> {
        match self.names.variable(&symbol.name, self.alone)? {
            LatentVariable::Z(index) => Some(index),
            LatentVariable::Dz(_) | LatentVariable::U(_) => None,
        }
    }

    pub(super) fn tokens(&self) -> &[Token] {
        &self.tokens
    }

    /// Whether anything is printed between two places; the first such token.
    pub(super) fn printed(&mut self, from: usize, to: usize) -> Option<Token> {
        let end = std::mem::replace(&mut self.end, to);
        self.at = from;
        let token = self.peek().cloned();
        self.end = end;
        token
    }

    /// Reads the right side between two places.
    pub(super) fn equation(&mut self, output: usize, line: usize, from: usize, to: usize) -> Read<Equation> {
        let total = self.end;
        (self.at, self.end, self.depth) = (from, to, 0);
        self.bars.clear();
        self.sum(true)?;
        self.rest_of_line()?;
        self.end = total;
        Ok(Equation::new(output, line, std::mem::take(&mut self.pieces)))
    }

    /// Passes punctuation and words behind an equation.
    fn rest_of_line(&mut self) -> Read<()> {
        loop {
            let (is_mark, is_text) = match self.peek().map(|token| &token.kind) {
                None => return Ok(()),
                Some(Kind::Character(',' | '.' | ';')) => (true, false),
                Some(Kind::Command(name)) => (false, has("text textrm textit mbox intertext shortintertext", name)),
                Some(_) => (false, false),
            };
            match (is_mark, is_text) {
                (true, _) => self.at += 1,
                (_, true) => self.at = self.after_argument(self.at + 1),
                _ => return self.unexpected("an operator or the end of the equation"),
            }
        }
    }

    // ---- sums and products ------------------------------------------------------------------

    /// Reads terms with their signs up to something that ends a sum.
    fn sum(&mut self, is_outermost: bool) -> Read<()> {
        let mut is_first = true;
        loop {
            let place = self.here();
            let mut sign = None;
            while let Some(next) = ['+', '-'].into_iter().find(|sign| self.character(*sign)) {
                let is_minus = (sign == Some('-')) != (next == '-');
                sign = Some(if is_minus { '-' } else { '+' });
            }
            match sign {
                Some(sign) => self.push(place, sign),
                None if is_first => {}
                None => return Ok(()),
            }
            is_first = false;
            self.term(is_outermost)?;
        }
    }

    fn term(&mut self, is_outermost: bool) -> Read<()> {
        let mut last = self.factor(is_outermost)?;
        let mut after_slash = false;
        loop {
            let place = self.here();
            let next = self.peek().map(|token| token.kind.clone());
            match next {
                Some(Kind::Command(name)) if matches!(name.as_str(), "cdot" | "times" | "ast" | "cdotp") => {
                    if last == Last::BareNumber {
                        return self.unexpected(BARE);
                    }
                    self.at += 1;
                    self.push(place, "*");
                    self.signs();
                    last = self.factor(false)?;
                    after_slash = false;
                }
                Some(Kind::Character('*')) => {
                    self.at += 1;
                    self.push(place, "*");
                    last = self.factor(false)?;
                    after_slash = false;
                }
                Some(Kind::Character('/')) => {
                    self.at += 1;
                    self.push(place, "/");
                    let divisor = self.factor(false)?;
                    after_slash = (last, divisor) != (Last::Number, Last::Number);
                    last = Last::Other;
                }
                Some(kind) if self.starts_factor(&kind) => {
                    if after_slash {
                        return self.unexpected("`\\frac`, or parentheses around what the slash divides by");
                    }
                    match (last, &kind) {
                        (Last::Bare, Kind::Command(name)) if function(name).is_some() => {}
                        (Last::Bare | Last::BareNumber, _) => return self.unexpected(BARE),
                        (_, Kind::Number(_)) => {
                            return self.unexpected("an operator before the number, or braces around a subscript");
                        }
                        _ => {}
                    }
                    self.push(place, "*");
                    last = self.factor(false)?;
                }
                _ => return Ok(()),
            }
        }
    }

    fn signs(&mut self) {
        let place = self.here();
        if self.character('-') {
            self.push(place, "-");
        }
    }

    /// Whether a token behind a factor is another one; other tokens end the term.
    fn starts_factor(&self, kind: &Kind) -> bool {
        match kind {
            Kind::Character('|') => self.bars.last() != Some(&true),
            Kind::Character(c) => !"+-=,.;)]<>:!*/".contains(*c),
            Kind::Command(name) => {
                !has("right rvert rVert } rbrace rangle text textrm textit mbox intertext shortintertext \
                     leq geq le ge lt gt approx equiv sim in", name)
            }
            Kind::Number(_) | Kind::Open | Kind::Begin(_) | Kind::End(_) | Kind::Superscript
            | Kind::Subscript | Kind::Parameter(_) | Kind::Display | Kind::Dollar => true,
            Kind::Close | Kind::Align | Kind::Break | Kind::Label(_) | Kind::Comment(_) | Kind::Paragraph => false,
        }
    }

    // ---- factors ----------------------------------------------------------------------------

    fn factor(&mut self, leads: bool) -> Read<Last> {
        const EXPECTED: &str = "a number, a variable, a function or a group";
        let place = self.here();
        let Some(token) = self.peek().cloned() else {
            return self.unexpected(EXPECTED);
        };
        match &token.kind {
            Kind::Number(text) => {
                self.at += 1;
                let literal = self.literal(text, leads);
                self.push(place, literal);
                self.powers(place)?;
                Ok(Last::Number)
            }
            Kind::Command(name) if name == "num" => self.macro_number(place),
            Kind::Command(name) if matches!(name.as_str(), "frac" | "dfrac" | "tfrac" | "cfrac" | "nicefrac" | "sfrac") => {
                self.at += 1;
                self.push(place, "((");
                let top = self.inside(|reader| reader.group_sum())?;
                self.push(place, ")/(");
                let bottom = self.inside(|reader| reader.group_sum())?;
                self.push(place, "))");
                self.powers(place)?;
                Ok(if (top, bottom) == (Last::Number, Last::Number) { Last::Number } else { Last::Other })
            }
            Kind::Command(name) if name == "sqrt" => self.root(place),
            Kind::Command(name) if matches!(name.as_str(), "abs" | "lvert" | "vert") => self.absolute(place, name),
            Kind::Character('|') => self.absolute(place, "|"),
            Kind::Command(name) if name == "left" && self.opens_bar() => self.absolute(place, "left"),
            Kind::Character('(' | '[') => self.parentheses(place),
            Kind::Command(name) if name == "left" || name == "{" => self.parentheses(place),
            Kind::Character('e') if self.kind(self.at + 1) == Some(&Kind::Superscript) => {
                self.at += 2;
                self.exponential(place)
            }
            _ => self.named(place, &token),
        }
    }

    /// A function, a variable, or a group in braces.
    fn named(&mut self, place: (usize, usize), token: &Token) -> Read<Last> {
        if let Some((name, after)) = self.function_name() {
            self.at = after;
            return self.call(place, &name);
        }
        let start = self.at;
        if let Some(symbol) = self.symbol()? {
            return self.variable(place, &symbol);
        }
        self.at = start;
        if token.kind == Kind::Open {
            return self.braces(place);
        }
        let expected = match &token.kind {
            Kind::Command(_) => {
                "a number, a variable, a group, \\frac, \\sqrt, \\sin, \\cos, \\tan, \\tanh, \\exp, \\ln or \\operatorname{sgn}"
            }
            _ => "a number, a variable, a function or a group",
        };
        self.unexpected(expected)
    }

    /// A group in braces stands for what is in it; sums need parentheses that are printed.
    fn braces(&mut self, place: (usize, usize)) -> Read<Last> {
        self.push(place, "(");
        let last = self.inside(|reader| {
            let last = reader.factor(false)?;
            match reader.peek() {
                None => Ok(last),
                Some(_) => reader.unexpected("one factor in braces, or parentheses"),
            }
        })?;
        self.push(place, ")");
        self.powers(place)?;
        Ok(last)
    }

    /// A sum in a group; whether it is a number alone.
    fn group_sum(&mut self) -> Read<Last> {
        let first = self.at;
        self.sum(false)?;
        let is_number = self.at == first + 1 && matches!(self.tokens[first].kind, Kind::Number(_));
        Ok(if is_number { Last::Number } else { Last::Other })
    }

    /// The literal of a number: a power of ten behind it goes into it, and an integer that the
    /// document has rounded gets a point or an exponent, so that it counts as rounded.
    fn literal(&mut self, text: &str, leads: bool) -> String {
        if let Some(exponent) = self.power_of_ten()
            && !text.contains(['e', 'E'])
        {
            return format!("{text}e{exponent}");
        }
        let is_integer = text.bytes().all(|byte| byte.is_ascii_digit());
        match self.digits {
            Some(digits) if leads && is_integer && text != "0" => match digits {
                Digits::Decimals(0) => format!("{text}."),
                Digits::Significant(count) if text.len() == count => format!("{text}."),
                Digits::Significant(count) if text.len() > count => {
                    let (kept, zeros) = text.split_at(count.max(1));
                    match zeros.bytes().all(|byte| byte == b'0') {
                        true => format!("{kept}e{}", zeros.len()),
                        false => text.to_owned(),
                    }
                }
                Digits::Decimals(_) | Digits::Significant(_) => text.to_owned(),
            },
            _ => text.to_owned(),
        }
    }

    /// Passes `\times 10^{-3}`, and gives its exponent.
    fn power_of_ten(&mut self) -> Option<i32> {
        let start = self.at;
        let found = (|| {
            if !self.command("times") && !self.command("cdot") {
                return None;
            }
            if self.peek()?.kind != Kind::Number("10".to_owned()) {
                return None;
            }
            self.at += 1;
            if self.peek()?.kind != Kind::Superscript {
                return None;
            }
            self.at += 1;
            let behind = self.after_argument(self.at);
            let text: String = (self.tokens[self.at..behind].iter())
                .map(|token| match &token.kind {
                    Kind::Open | Kind::Close => String::new(),
                    Kind::Character(sign @ ('+' | '-')) => sign.to_string(),
                    Kind::Number(text) => text.clone(),
                    _ => "?".to_owned(),
                })
                .collect();
            let is_one_token = behind == self.at + 1;
            let exponent: i32 = text.parse().ok().filter(|e: &i32| !is_one_token || *e < 10)?;
            self.at = behind;
            Some(exponent)
        })();
        if found.is_none() {
            self.at = start;
        }
        found
    }

    /// `\num{-1.2e-3}`.
    fn macro_number(&mut self, place: (usize, usize)) -> Read<Last> {
        self.at += 1;
        if self.character('[') {
            while !self.character(']') {
                if self.peek().is_none() {
                    return self.unexpected("`]`");
                }
                self.at += 1;
            }
        }
        let text = self.inside(|reader| {
            let is_negative = reader.character('-');
            if !is_negative {
                reader.character('+');
            }
            match reader.peek().map(|token| token.kind.clone()) {
                Some(Kind::Number(text)) => {
                    reader.at += 1;
                    Ok(if is_negative { format!("(-{text})") } else { text })
                }
                _ => reader.unexpected("a number such as 1.2e-3"),
            }
        })?;
        self.push(place, text);
        self.powers(place)?;
        Ok(Last::Number)
    }

    fn root(&mut self, place: (usize, usize)) -> Read<Last> {
        self.at += 1;
        let mut index = None;
        if self.character('[') {
            match self.peek().map(|token| token.kind.clone()) {
                Some(Kind::Number(text)) if matches!(text.parse(), Ok(2..=99_u32)) => index = Some(text),
                _ => return self.unexpected("the index of the root, 2 to 99"),
            }
            self.at += 1;
            if !self.character(']') {
                return self.unexpected("`]`");
            }
        }
        self.push(place, if index.is_some() { "((" } else { "sqrt(" });
        self.inside(|reader| reader.sum(false))?;
        self.push(place, index.map_or(")".to_owned(), |index| format!(")^(1/{index}))")));
        self.powers(place)?;
        Ok(Last::Other)
    }

    fn opens_bar(&self) -> bool {
        match self.kind(self.at + 1) {
            Some(Kind::Character('|')) => true,
            Some(Kind::Command(name)) => matches!(name.as_str(), "lvert" | "vert" | "|"),
            _ => false,
        }
    }

    fn absolute(&mut self, place: (usize, usize), opener: &str) -> Read<Last> {
        self.at += 1 + usize::from(opener == "left");
        self.push(place, "abs(");
        if opener == "abs" {
            self.inside(|reader| reader.sum(false))?;
        } else {
            self.deepen()?;
            self.bars.push(true);
            self.sum(false)?;
            self.bars.pop();
            self.depth -= 1;
            let has_right = self.command("right");
            let closed = self.character('|') || ["rvert", "vert", "|"].iter().any(|name| self.command(name));
            if !closed || has_right != (opener == "left") {
                return self.unexpected("an operator or the closing bar");
            }
        }
        self.push(place, ")");
        self.powers(place)?;
        Ok(Last::Other)
    }

    fn deepen(&mut self) -> Read<()> {
        self.depth += 1;
        match self.depth > MAX_DEPTH {
            true => self.unexpected(&format!("at most {MAX_DEPTH} nested groups")),
            false => Ok(()),
        }
    }

    /// Parentheses of any kind and size, with their powers.
    fn parentheses(&mut self, place: (usize, usize)) -> Read<Last> {
        self.delimited(place)?;
        self.powers(place)?;
        Ok(Last::Other)
    }

    fn delimited(&mut self, place: (usize, usize)) -> Read<()> {
        let has_left = self.command("left");
        let closer = match self.peek().map(|token| token.kind.clone()) {
            Some(Kind::Character('(')) => Kind::Character(')'),
            Some(Kind::Character('[')) => Kind::Character(']'),
            Some(Kind::Command(name)) if name == "{" => Kind::Command("}".to_owned()),
            Some(Kind::Command(name)) if name == "lbrace" => Kind::Command("rbrace".to_owned()),
            _ => return self.unexpected("`(`, `[`, `\\{` or `|`"),
        };
        self.at += 1;
        self.push(place, "(");
        self.deepen()?;
        self.bars.push(false);
        self.sum(false)?;
        self.bars.pop();
        self.depth -= 1;
        let has_right = self.command("right");
        let closes = self.peek().is_some_and(|token| token.kind == closer);
        if !closes || has_left != has_right {
            let quoted = Token { kind: closer, line: 1, column: 1 }.quoted();
            let right = if has_left { "`\\right` and " } else { "" };
            return self.unexpected(&format!("an operator or {right}{quoted}"));
        }
        self.at += 1;
        self.push(place, ")");
        Ok(())
    }

    fn exponential(&mut self, place: (usize, usize)) -> Read<Last> {
        self.push(place, "exp(");
        self.inside(|reader| reader.sum(false))?;
        self.push(place, ")");
        Ok(Last::Other)
    }

    /// The power behind a factor.
    fn powers(&mut self, place: (usize, usize)) -> Read<()> {
        if self.peek().is_none_or(|token| token.kind != Kind::Superscript) {
            return Ok(());
        }
        self.at += 1;
        self.push(place, "^(");
        self.inside(|reader| reader.sum(false))?;
        self.push(place, ")");
        match self.peek().map(|token| &token.kind) {
            Some(Kind::Superscript) => self.unexpected("one power, or parentheses around the first"),
            _ => Ok(()),
        }
    }

    // ---- functions --------------------------------------------------------------------------

    /// A function's name at the reader's place, and the place behind it.
    fn function_name(&self) -> Option<(String, usize)> {
        let Some(Kind::Command(command)) = self.kind(self.at) else { return None };
        if let Some(name) = function(command) {
            return Some((name.to_owned(), self.at + 1));
        }
        if !has(FONTS, command) || self.kind(self.at + 1) != Some(&Kind::Open) {
            return None;
        }
        let close = self.closing[self.at + 1];
        let word: String = (self.tokens[self.at + 2..close].iter())
            .filter_map(|token| match &token.kind {
                Kind::Character(letter) => Some(*letter),
                Kind::Command(inner) if has(FONTS, inner) => None,
                Kind::Open | Kind::Close => None,
                _ => Some('?'),
            })
            .collect();
        let name = match word.as_str() {
            "e" if self.kind(close + 1) == Some(&Kind::Superscript) => return Some(("e".to_owned(), close + 2)),
            "sgn" | "sign" => "sign",
            "abs" => "abs",
            "sqrt" => "sqrt",
            word => function(word)?,
        };
        Some((name.to_owned(), close + 1))
    }

    fn call(&mut self, place: (usize, usize), name: &str) -> Read<Last> {
        if name == "e" {
            return self.exponential(place);
        }
        let mut power = None;
        if self.peek().is_some_and(|token| token.kind == Kind::Superscript) {
            self.at += 1;
            power = Some(self.inside(|reader| match reader.peek().map(|token| token.kind.clone()) {
                Some(Kind::Number(text)) => {
                    reader.at += 1;
                    Ok(text)
                }
                _ => reader.unexpected("a positive power; an inverse function has no reading here"),
            })?);
        }
        self.push(place, format!("{name}("));
        let argument = self.here();
        let last = match self.peek().map(|token| token.kind.clone()) {
            Some(Kind::Character('(' | '[')) => self.delimited(argument).map(|()| Last::Other)?,
            Some(Kind::Command(opener)) if opener == "left" && !self.opens_bar() => {
                self.delimited(argument).map(|()| Last::Other)?
            }
            Some(Kind::Open) => self.inside(|reader| reader.sum(false)).map(|()| Last::Other)?,
            _ => self.bare_argument()?,
        };
        self.push(place, ")");
        match power {
            Some(power) => self.push(place, format!("^({power})")),
            None if last == Last::Other => self.powers(place)?,
            None => {}
        }
        Ok(last)
    }

    /// `\sin 2\dot z_1`: numbers and one more factor.
    fn bare_argument(&mut self) -> Read<Last> {
        self.deepen()?;
        let first = self.factor(false)?;
        let place = self.here();
        let next = self.peek().map(|token| token.kind.clone());
        let goes_on = match &next {
            Some(Kind::Command(name)) if function(name).is_some() => false,
            Some(kind) => self.starts_factor(kind) && !matches!(kind, Kind::Number(_)),
            None => false,
        };
        let is_dot = matches!(&next, Some(Kind::Command(name)) if matches!(name.as_str(), "cdot" | "times"));
        let is_number = first == Last::Number && !(goes_on && !is_dot);
        if first == Last::Number && !is_number {
            self.push(place, "*");
            self.factor(false)?;
        }
        self.depth -= 1;
        Ok(if is_number { Last::BareNumber } else { Last::Bare })
    }

    // ---- variables --------------------------------------------------------------------------

    fn variable(&mut self, place: (usize, usize), symbol: &Symbol) -> Read<Last> {
        let variable = self.names.variable(&symbol.name, self.alone);
        let name = match (variable, symbol.dots) {
            (Some(variable @ (LatentVariable::Z(_) | LatentVariable::U(_))), 0) => variable.to_string(),
            (Some(LatentVariable::Z(index)), 1) => LatentVariable::Dz(index).to_string(),
            _ => {
                let (line, column) = symbol.place;
                return Err(refused(self.file, line, column, symbol.quoted(), self.names.expected()));
            }
        };
        self.push(place, name);
        self.skip_time();
        self.powers(place)?;
        Ok(Last::Other)
    }

    /// Passes `(t)` behind a variable.
    fn skip_time(&mut self) {
        let start = self.at;
        let is_time = self.character('(') && self.character('t') && self.character(')');
        if !is_time {
            self.at = start;
        }
    }

    /// Reads a variable with dots and subscript; nothing if there is none.
    fn symbol(&mut self) -> Read<Option<Symbol>> {
        let place = self.here();
        let Some((name, dots)) = self.glyph(0)? else { return Ok(None) };
        let mut symbol = Symbol { name, dots, place };
        self.subscript(&mut symbol)?;
        // A power may stand before the subscript: both follow the same letter.
        let power = self.at;
        if !symbol.name.contains('_') && self.peek().is_some_and(|t| t.kind == Kind::Superscript) {
            let behind = self.after_argument(self.at + 1);
            if self.kind(behind) == Some(&Kind::Subscript) {
                self.at = behind;
                self.subscript(&mut symbol)?;
                let end = self.at;
                self.tokens[power..end].rotate_left(behind - power);
                self.relink(power, end);
                self.at = power + (end - behind);
            }
        }
        Ok(Some(symbol))
    }

    /// Finds the partners of braces again between two places.
    fn relink(&mut self, from: usize, to: usize) {
        let mut open = Vec::new();
        for place in from..to {
            match self.tokens[place].kind {
                Kind::Open => open.push(place),
                Kind::Close => {
                    if let Some(start) = open.pop() {
                        self.closing[start] = place;
                    }
                }
                _ => {}
            }
        }
    }

    /// A letter, a Greek letter or a word, with dots above it.
    fn glyph(&mut self, depth: usize) -> Read<Option<(String, usize)>> {
        let Some(kind) = self.peek().map(|token| token.kind.clone()) else { return Ok(None) };
        let at = self.at;
        match &kind {
            Kind::Character(letter) if letter.is_ascii_alphabetic() => {
                self.at += 1;
                Ok(Some((letter.to_string(), 0)))
            }
            Kind::Command(name) if is_greek(name) => {
                self.at += 1;
                Ok(Some((name.clone(), 0)))
            }
            Kind::Command(name) if depth < 8 && matches!(name.as_str(), "dot" | "ddot" | "dddot") => {
                self.at += 1;
                let more = name.len() - 2;
                let inner = self.inside(|reader| {
                    let Some((name, dots)) = reader.glyph(depth + 1)? else { return Ok(None) };
                    let mut symbol = Symbol { name, dots, place: (0, 0) };
                    reader.subscript(&mut symbol)?;
                    Ok(reader.peek().is_none().then_some(symbol))
                });
                match inner.ok().flatten() {
                    Some(symbol) => Ok(Some((symbol.name, symbol.dots + more))),
                    None => {
                        self.at = at + 1;
                        self.unexpected("a variable under the dots")
                    }
                }
            }
            Kind::Command(name) if has(FONTS, name) => {
                self.at += 1;
                let close = self.after_argument(self.at);
                let word = self.word(self.at, close);
                self.at = close;
                Ok(word.map(|word| (word, 0)))
            }
            Kind::Open if depth < 8 => {
                let close = self.closing[at];
                let end = std::mem::replace(&mut self.end, close);
                self.at += 1;
                let inner = self.glyph(depth + 1)?;
                let is_whole = self.peek().is_none();
                self.end = end;
                self.at = if is_whole { close + 1 } else { at };
                Ok(inner.filter(|_| is_whole))
            }
            _ => Ok(None),
        }
    }

    /// Reads `_1`, `_{10}`, `_{\mathrm{lat},1}` behind a variable.
    fn subscript(&mut self, symbol: &mut Symbol) -> Read<()> {
        if self.peek().is_none_or(|token| token.kind != Kind::Subscript) {
            return Ok(());
        }
        self.at += 1;
        let parts = self.inside(|reader| {
            let word = reader.word(reader.at, reader.end);
            match word {
                Some(word) => {
                    reader.at = reader.end;
                    Ok(word)
                }
                None => reader.unexpected("a subscript of letters, digits and commas"),
            }
        })?;
        if symbol.name.contains('_') {
            return self.unexpected("one subscript");
        }
        symbol.name = format!("{}_{parts}", symbol.name);
        Ok(())
    }

    /// Letters, digits and commas between two places, fonts aside.
    fn word(&self, from: usize, to: usize) -> Option<String> {
        let mut word = String::new();
        for token in &self.tokens[from..to.min(self.end)] {
            match &token.kind {
                Kind::Character(c) if c.is_ascii_alphabetic() || *c == ',' => word.push(*c),
                Kind::Number(text) if !text.contains(['.', '+', '-']) => word.push_str(text),
                Kind::Command(name) if is_greek(name) => word.push_str(name),
                Kind::Command(name) if has(FONTS, name) || has(INVISIBLE, name) => {}
                Kind::Open | Kind::Close => {}
                _ => return None,
            }
        }
        (!word.is_empty()).then_some(word)
    }
}

/// The tokens with digits apart where LaTeX takes one digit as an argument: `x^12`, `\frac12`.
fn with_split_digits(tokens: &[Token]) -> Vec<Token> {
    let mut split: Vec<Token> = Vec::with_capacity(tokens.len());
    for token in tokens {
        let arguments = match split.last().map(|before| &before.kind) {
            Some(Kind::Superscript | Kind::Subscript) => 1,
            Some(Kind::Command(name)) if name == "sqrt" => 1,
            Some(Kind::Command(name)) if name.ends_with("frac") => 2,
            _ => 0,
        };
        let Kind::Number(text) = &token.kind else {
            split.push(token.clone());
            continue;
        };
        let digits = text.bytes().take_while(u8::is_ascii_digit).count().min(arguments);
        let parts = (0..digits).map(|place| (place, &text[place..=place]));
        for (place, part) in parts.chain(Some((digits, &text[digits..])).filter(|rest| !rest.1.is_empty())) {
            let kind = Kind::Number(part.to_owned());
            split.push(Token { kind, line: token.line, column: token.column + place });
        }
    }
    split
}

/// The grammar's name of a function that LaTeX has a command for.
fn function(command: &str) -> Option<&'static str> {
    Some(match command {
        "sin" => "sin",
        "cos" => "cos",
        "tan" => "tan",
        "tanh" => "tanh",
        "exp" => "exp",
        "ln" | "log" => "log",
        "sgn" | "sign" => "sign",
        _ => return None,
    })
}
