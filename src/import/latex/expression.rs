//! One right side: from LaTeX to the grammar of candidate terms, each piece with its place. Ambiguous print is refused:
//! `\sin z_1 u_1`, a product that goes on without a sign behind a slash (`2/3z_1`, `z_1/2u_1`), a number after a
//! variable. Nesting is limited, so the machine's stack is safe.

use super::variables::Symbol;
use super::*;

const FACTOR: &str = "a number, a variable, a function or a group";
const BARS: &[&str] = &["|", "\\rvert", "\\vert", "\\|"];
/// Opening delimiters of a sum, and their closing ones.
const DELIMITERS: [(&str, &[&str]); 8] = [
    ("(", &[")"]),
    ("[", &["]"]),
    ("\\{", &["\\}"]),
    ("\\lbrace", &["\\rbrace"]),
    ("|", BARS),
    ("\\lvert", BARS),
    ("\\vert", BARS),
    ("\\|", BARS),
];

/// `\ddot z_1 =`: its tokens and the latent coordinate, if it is one.
pub(super) struct LeftSide {
    pub(super) at: usize,
    pub(super) after: usize,
    pub(super) symbol: Symbol,
    pub(super) output: Option<usize>,
}

impl Reader<'_> {
    pub(super) fn left_sides(&mut self) -> Vec<LeftSide> {
        let is_dotted = |at: &usize| self.tokens[*at].is_command("ddot");
        let places: Vec<usize> = (0..self.tokens.len()).filter(is_dotted).collect();
        let left_sides = places.into_iter().filter_map(|at| self.left_side(at));
        left_sides.collect()
    }

    fn left_side(&mut self, at: usize) -> Option<LeftSide> {
        let (end, depth) = (self.end, self.depth);
        self.at = at;
        let symbol = self.symbol();
        (self.end, self.depth) = (end, depth);
        let symbol = symbol.ok().flatten().filter(|symbol| symbol.dots == 2)?;
        self.skip_time();
        // Where something is defined or was rounded, other signs stand for `=`.
        self.character(':');
        let mut signs = "coloneqq coloneq triangleq equiv approx simeq".split(' ');
        (self.character('=') || signs.any(|name| self.command(name))).then_some(())?;
        let output = match self.names.variable(&symbol.name, self.alone) {
            Some(LatentVariable::Z(index)) => Some(index),
            _ => None,
        };
        Some(LeftSide {
            at,
            after: self.at,
            symbol,
            output,
        })
    }

    /// The first token before a place that prints anything.
    pub(super) fn printed_before(&mut self, to: usize) -> Option<Token> {
        let end = std::mem::replace(&mut self.end, to);
        self.at = 0;
        let token = self.peek().cloned();
        self.end = end;
        token
    }

    pub(super) fn equation(
        &mut self,
        output: usize,
        line: usize,
        from: usize,
        to: usize,
    ) -> Read<Equation> {
        let total = self.end;
        (self.at, self.end, self.depth) = (from, to, 0);
        self.bars.clear();
        self.sum(true)?;
        self.rest_of_line()?;
        self.end = total;
        Ok(Equation {
            output,
            line,
            pieces: std::mem::take(&mut self.pieces),
        })
    }

    pub(super) fn rest_of_line(&mut self) -> Read<()> {
        loop {
            match self.next_kind() {
                None => return Ok(()),
                Some(Kind::Character(',' | '.' | ';')) => self.at += 1,
                Some(Kind::Command(name)) if is_in("text", &name) => {
                    let (at, after) = (self.at, self.after_argument(self.at + 1));
                    let end = std::mem::replace(&mut self.end, after);
                    self.at = at + 1 + usize::from(self.kind(at + 1) == Some(&Kind::Open));
                    self.takes(&Kind::Dollar);
                    let is_formula = |c: char| "+-*/=".contains(c) || c.is_ascii_digit();
                    if matches!(self.next_kind(), Some(Kind::Character(c)) if is_formula(c)) {
                        let expected =
                            "words behind the equation, or mathematics outside of the text";
                        return self.unexpected(expected);
                    }
                    (self.at, self.end) = (after, end);
                }
                Some(_) => return self.unexpected("an operator or the end of the equation"),
            }
        }
    }

    /// Reads terms with their signs; where it `leads`, integers that begin a term are coefficients.
    pub(super) fn sum(&mut self, leads: bool) -> Read<()> {
        let mut is_first = true;
        loop {
            let place = self.here();
            let mut sign = None;
            while let Some(next) = ['+', '-'].into_iter().find(|sign| self.character(*sign)) {
                if sign.is_some() && self.breaks_before(self.at - 1) {
                    self.at -= 1;
                    return self.unexpected("one operator where a line breaks");
                }
                let is_minus = (sign == Some('-')) != (next == '-');
                sign = Some(if is_minus { '-' } else { '+' });
            }
            match sign {
                Some(sign) => self.push(place, sign),
                None if is_first => {}
                None => return Ok(()),
            }
            is_first = false;
            self.term(leads)?;
        }
    }

    fn term(&mut self, leads: bool) -> Read<()> {
        self.peek();
        let is_literal = self.number_at(self.at).is_some();
        let mut last = self.factor(leads)?;
        let literal_end = is_literal.then_some(self.at);
        let mut after_slash = false;
        loop {
            let from = self.at;
            let place = self.here();
            let Some(kind) = self.next_kind() else {
                return Ok(());
            };
            let is_bare = matches!(last, Last::Bare | Last::BareNumber);
            let is_dot = matches!(&kind, Kind::Command(name) if has("cdot times ast cdotp", name));
            match kind {
                _ if is_dot && last == Last::BareNumber => return self.unexpected(BARE),
                Kind::Character('/') if is_bare => return self.unexpected(BARE),
                Kind::Character('/') => {
                    self.at += 1;
                    self.push(place, "/");
                    self.peek();
                    let number = self.at;
                    self.factor(false)?;
                    if self.number_takes_power_of_ten(number) {
                        return self.unexpected(
                            "`\\frac`, or parentheses around the number that the slash divides by",
                        );
                    }
                    after_slash = true;
                    last = Last::Other;
                    continue;
                }
                _ if is_dot || kind == Kind::Character('*') => {
                    self.at += 1;
                    self.push(place, "*");
                    if is_dot {
                        self.signs();
                    }
                    after_slash = false;
                }
                kind if self.starts_factor(&kind) => {
                    let refusal = match after_slash {
                        true => Some("`\\frac`, or parentheses around the divisor"),
                        false => self.refusal(&kind, last, literal_end == Some(from)),
                    };
                    if let Some(expected) = refusal {
                        return self.unexpected(expected);
                    }
                    self.push(place, "*");
                }
                _ => return Ok(()),
            }
            last = self.factor(false)?;
        }
    }

    /// The expected text before a factor that follows without a sign, where that is ambiguous.
    fn refusal(&self, kind: &Kind, last: Last, is_behind_literal: bool) -> Option<&'static str> {
        let command = match kind {
            Kind::Command(name) => name,
            _ => "",
        };
        if self.breaks_before(self.at) {
            return Some("an operator where a row or column goes on");
        }
        if is_behind_literal && self.is_fraction_of_integers() {
            return Some(
                "`\\cdot` or `+` between a number and a fraction, which print as a mixed number",
            );
        }
        match last {
            Last::Bare if function(command).is_some() => return None,
            Last::Bare | Last::BareNumber => return Some(BARE),
            Last::Number | Last::Other => {}
        }
        if command == "num" {
            return Some("an operator before the number");
        }
        if self.is_number_next() {
            return Some(
                "an operator before the number, no space inside it, or braces around a subscript",
            );
        }
        self.is_lone_integer()
            .then_some("`\\tag{...}` for the number of an equation, or `\\cdot` before a factor")
    }

    pub(super) fn signs(&mut self) {
        let place = self.here();
        if self.character('-') {
            self.push(place, "-");
        }
    }

    /// Whether a token behind a factor is another one; other tokens end the term.
    pub(super) fn starts_factor(&self, kind: &Kind) -> bool {
        match kind {
            _ if self.number_at(self.at).is_some() => true,
            Kind::Character('|') => self.bars.last() != Some(&true),
            Kind::Character(c) => !"+-=,.;)]<>:!*/".contains(*c),
            Kind::Command(name) => {
                let ends =
                    "right rvert rVert } rbrace rangle leq geq le ge lt gt approx equiv sim in";
                !has(ends, name) && !is_in("text", name)
            }
            kind => !kind.ends_term(),
        }
    }

    /// Reads a function, or a number, a variable or a group with its power.
    pub(super) fn factor(&mut self, leads: bool) -> Read<Last> {
        let place = self.here();
        let Some(token) = self.peek().cloned() else {
            return self.unexpected(FACTOR);
        };
        if let Some((name, after)) = self.function_name() {
            self.at = after;
            return self.call(place, &name);
        }
        if let Some(number) = self.number_at(self.at) {
            let place = self.tokens[number.first].place;
            self.at = number.behind;
            let literal = self.literal(&number.text, leads);
            self.push(place, literal);
            self.powers(place)?;
            return Ok(Last::Number);
        }
        let last = match &token.kind {
            Kind::Command(name) if name == "num" => self.macro_number(place)?,
            Kind::Command(name) if has("frac dfrac tfrac cfrac nicefrac sfrac", name) => {
                self.at += 1;
                self.push(place, "((");
                let top = self.inside(|reader| reader.group_sum(leads))?;
                self.push(place, ")/(");
                let bottom = self.inside(|reader| reader.group_sum(false))?;
                self.push(place, "))");
                match (top, bottom) {
                    (Last::Number, Last::Number) => Last::Number,
                    _ => Last::Other,
                }
            }
            Kind::Command(name) if name == "sqrt" => self.root(place)?,
            Kind::Command(name) if name == "abs" => {
                self.at += 1;
                self.enclosed_sum(place, "abs(")?
            }
            Kind::Character('(' | '[' | '|') => self.delimited(place)?,
            Kind::Command(name) if has("left { lvert vert", name) => self.delimited(place)?,
            kind => self.variable_or_braces(place, kind)?,
        };
        self.powers(place)?;
        Ok(last)
    }

    /// A variable, or a group in braces, which stands for its contents; sums need parentheses that are printed.
    fn variable_or_braces(&mut self, place: Position, kind: &Kind) -> Read<Last> {
        let start = self.at;
        if let Some(symbol) = self.symbol()? {
            return self.variable(place, &symbol);
        }
        self.at = start;
        match kind {
            Kind::Open if self.kind(start + 1) == Some(&Kind::Character(',')) => {
                self.at += 1;
                self.unexpected("a decimal point, or no comma between thousands")
            }
            Kind::Open => {
                let last = self.enclosed(place, "(", |reader| {
                    let last = reader.factor(false)?;
                    match reader.peek() {
                        None => Ok(last),
                        Some(_) => reader.unexpected("one factor in braces, or parentheses"),
                    }
                })?;
                match last == Last::Bare && self.is_next(&Kind::Superscript) {
                    true => self.unexpected("parentheses around the function or its argument"),
                    false => Ok(last),
                }
            }
            Kind::Command(_) => self.unexpected(
                "a number, a variable, a group, \\frac, \\sqrt, \\sin, \\cos, \\tan, \\tanh, \\exp, \\ln or \\operatorname{sgn}",
            ),
            _ => self.unexpected(FACTOR),
        }
    }

    /// The result of `read` on the next argument, between an opening text and a parenthesis.
    fn enclosed<T>(
        &mut self,
        place: Position,
        open: &str,
        read: impl FnOnce(&mut Self) -> Read<T>,
    ) -> Read<T> {
        self.push(place, open);
        let value = self.inside(read)?;
        self.push(place, ")");
        Ok(value)
    }

    /// A sum in a group; whether it is a number alone. `leads` as in [`Self::sum`].
    fn group_sum(&mut self, leads: bool) -> Read<Last> {
        let first = self.at;
        self.sum(leads)?;
        let is_number = (self.number_at(first)).is_some_and(|number| number.behind == self.at);
        Ok(if is_number { Last::Number } else { Last::Other })
    }

    pub(super) fn delimited(&mut self, place: Position) -> Read<Last> {
        let has_left = self.command("left");
        let mut openers = DELIMITERS.iter();
        let Some((_, closers)) = openers.find(|(opener, _)| self.delimiter(opener)) else {
            return self.unexpected("`(`, `[`, `\\{` or `|`");
        };
        let are_bars = *closers == BARS;
        self.push(place, if are_bars { "abs(" } else { "(" });
        self.deepen()?;
        self.bars.push(are_bars);
        self.sum(false)?;
        self.bars.pop();
        self.depth -= 1;
        let has_right = self.command("right");
        if has_left != has_right || !closers.iter().any(|closer| self.delimiter(closer)) {
            let right = if has_left { "`\\right` and " } else { "" };
            let expected = match are_bars {
                true => "an operator or the closing bar".to_owned(),
                false => format!("an operator or {right}`{}`", closers[0]),
            };
            return self.unexpected(&expected);
        }
        self.push(place, ")");
        Ok(Last::Other)
    }

    fn delimiter(&mut self, wanted: &str) -> bool {
        match wanted.strip_prefix('\\') {
            Some(command) => self.command(command),
            None => wanted.chars().all(|character| self.character(character)),
        }
    }

    /// The sum in the argument that comes next, between an opening text and a parenthesis.
    pub(super) fn enclosed_sum(&mut self, place: Position, open: &str) -> Read<Last> {
        let read = |reader: &mut Self| reader.sum(false);
        self.enclosed(place, open, read).map(|()| Last::Other)
    }

    pub(super) fn powers(&mut self, place: Position) -> Read<()> {
        if !self.takes(&Kind::Superscript) {
            return Ok(());
        }
        if self.kind(self.at) == Some(&Kind::Open) {
            self.at += 1;
            if self.is_lone_integer() {
                return self
                    .unexpected("a power without parentheses; derivatives are written with dots");
            }
            self.at -= 1;
        }
        self.enclosed_sum(place, "^(")?;
        match self.is_next(&Kind::Superscript) {
            true => self.unexpected("one power, or parentheses around the first"),
            false => Ok(()),
        }
    }
}
