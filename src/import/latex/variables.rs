//! Functions with their arguments, variables with dots and subscripts, and how a document names them.

use std::collections::BTreeMap;

use super::*;
use crate::model::MAX_LATENT_DIM;

pub(super) struct Symbol {
    pub(super) name: String,
    pub(super) dots: usize,
    pub(super) place: Position,
}

impl Symbol {
    pub(super) fn quoted(&self) -> String {
        let dots = ["", "\\dot ", "\\ddot ", "\\dddot "][self.dots.min(3)];
        format!("`{dots}{}`", self.name)
    }
}

impl Reader<'_> {
    /// A function's name at the reader's place, and the place behind it.
    pub(super) fn function_name(&self) -> Option<(String, usize)> {
        let Kind::Command(command) = self.kind(self.at)? else {
            return self.plain_function_name();
        };
        if let Some(name) = function(command) {
            return Some((name.to_owned(), self.at + 1));
        }
        if !is_in("fonts", command) || self.kind(self.at + 1) != Some(&Kind::Open) {
            return None;
        }
        let close = self.closing[self.at + 1];
        let word = self.characters(self.at + 2..close);
        let name = match word.as_str() {
            "e" if self.kind(close + 1) == Some(&Kind::Superscript) => {
                return Some(("e".to_owned(), close + 2));
            }
            word @ ("abs" | "sqrt") => word,
            word => function(word)?,
        };
        Some((name.to_owned(), close + 1))
    }

    /// `sin(`, typed without a backslash, where its first letter is no variable.
    fn plain_function_name(&self) -> Option<(String, usize)> {
        let first = &self.tokens[self.at];
        let is_power = self.kind(self.at + 1) == Some(&Kind::Superscript);
        if first.kind == Kind::Character('e') && is_power && !self.is_variable("e") {
            return Some(("e".to_owned(), self.at + 2));
        }
        let letters = self.tokens[self.at..self.end].iter().enumerate();
        let word: String = letters
            .map_while(|(place, token)| match token.kind {
                Kind::Character(letter) if letter.is_ascii_alphabetic() => {
                    let is_next = token.place == (first.place.0, first.place.1 + place);
                    is_next.then_some(letter)
                }
                _ => None,
            })
            .collect();
        let after = self.at + word.len();
        let has_argument = match self.kind(after)? {
            Kind::Character('(' | '[') | Kind::Superscript => true,
            kind => *kind == Kind::Command("left".to_owned()),
        };
        let name = function(&word).filter(|_| has_argument && !self.is_variable(&word[..1]))?;
        Some((name.to_owned(), after))
    }

    fn is_variable(&self, name: &str) -> bool {
        self.names.variable(name, self.alone).is_some()
    }

    pub(super) fn call(&mut self, place: Position, name: &str) -> Read<Last> {
        if name == "e" {
            return self.enclosed_sum(place, "exp(");
        }
        let mut power = None;
        if self.takes(&Kind::Superscript) {
            let expected = "a positive power; an inverse function has no reading here";
            power = Some(self.inside(|reader| reader.number(expected))?);
        }
        let before = self.pieces.len();
        let last = self.function_argument()?;
        let argument = self.pieces.split_off(before);
        let parts: &[&str] = match name {
            "sec" => &["(1/cos(", "))"],
            "csc" => &["(1/sin(", "))"],
            "cot" => &["(1/tan(", "))"],
            "sinh" => &["((exp(", ")-exp(-(", ")))/2)"],
            "cosh" => &["((exp(", ")+exp(-(", ")))/2)"],
            _ => {
                self.push(place, name);
                &["(", ")"]
            }
        };
        for (number, part) in parts.iter().enumerate() {
            if number > 0 {
                self.pieces.extend(argument.iter().cloned());
            }
            self.push(place, *part);
        }
        match power {
            Some(power) => self.push(place, format!("^({power})")),
            None if last == Last::Other => self.powers(place)?,
            None => {}
        }
        Ok(last)
    }

    fn function_argument(&mut self) -> Read<Last> {
        let place = self.here();
        match self.next_kind() {
            Some(Kind::Character('(' | '[')) => self.delimited(place),
            Some(Kind::Command(opener)) if opener == "left" && !self.is_bar_behind() => {
                self.delimited(place)
            }
            // Braces do not print: without them a sum or a power in them would have another meaning.
            Some(Kind::Open) => {
                let last = self.inside(|reader| match reader.next_kind() {
                    Some(Kind::Character('(' | '[')) => reader.factor(false),
                    _ => {
                        reader.signs();
                        reader.bare_argument()
                    }
                })?;
                match last {
                    Last::Other => Ok(last),
                    _ if self.is_next(&Kind::Superscript) => self.unexpected(BARE),
                    Last::BareNumber => Ok(last),
                    _ => Ok(Last::Other),
                }
            }
            _ => self.bare_argument(),
        }
    }

    fn is_bar_behind(&self) -> bool {
        match self.kind(self.at + 1) {
            Some(Kind::Character(bar)) => *bar == '|',
            Some(Kind::Command(name)) => has("lvert vert |", name),
            _ => false,
        }
    }

    /// `\sin 2\dot z_1`: numbers and one more factor.
    pub(super) fn bare_argument(&mut self) -> Read<Last> {
        self.deepen()?;
        let first = self.factor(false)?;
        let place = self.here();
        let next = self.next_kind();
        let goes_on = match &next {
            Some(Kind::Command(name)) if function(name).is_some() => false,
            Some(kind) => self.starts_factor(kind) && self.number_at(self.at).is_none(),
            None => false,
        };
        let is_dot = matches!(&next, Some(Kind::Command(name)) if has("cdot times", name));
        let is_number = first == Last::Number && (is_dot || !goes_on);
        if first == Last::Number && !is_number {
            self.push(place, "*");
            self.factor(false)?;
        }
        self.depth -= 1;
        Ok(if is_number {
            Last::BareNumber
        } else {
            Last::Bare
        })
    }

    pub(super) fn variable(&mut self, place: Position, symbol: &Symbol) -> Read<Last> {
        let variable = self.names.variable(&symbol.name, self.alone);
        let name = match (variable, symbol.dots) {
            (Some(variable @ (LatentVariable::Z(_) | LatentVariable::U(_))), 0) => {
                variable.to_string()
            }
            (Some(LatentVariable::Z(index)), 1) => LatentVariable::Dz(index).to_string(),
            (None, 0) if symbol.name == "pi" => format!("{:?}", std::f64::consts::PI),
            _ => {
                let (found, expected) = (symbol.quoted(), self.names.expected());
                return Err(ImportError::at(self.file, symbol.place, found, expected));
            }
        };
        self.push(place, name);
        self.skip_time();
        Ok(Last::Other)
    }

    /// Passes `(t)` behind a variable.
    pub(super) fn skip_time(&mut self) {
        let start = self.at;
        let is_time = self.character('(') && self.character('t') && self.character(')');
        if !is_time {
            self.at = start;
        }
    }

    /// Reads a variable with dots and subscript; nothing if there is none.
    pub(super) fn symbol(&mut self) -> Read<Option<Symbol>> {
        let place = self.here();
        let Some((mut name, dots)) = self.glyph(0)? else {
            return Ok(None);
        };
        self.subscript(&mut name)?;
        // A power may stand before the subscript: both follow the same letter.
        let power = self.at;
        if !name.contains('_') && self.is_next(&Kind::Superscript) {
            let behind = self.after_argument(self.at + 1);
            if self.kind(behind) == Some(&Kind::Subscript) {
                self.at = behind;
                self.subscript(&mut name)?;
                let end = self.at;
                self.tokens[power..end].rotate_left(behind - power);
                self.is_around[power..end].rotate_left(behind - power);
                self.link(power..end);
                self.at = power + (end - behind);
            }
        }
        Ok(Some(Symbol { name, dots, place }))
    }

    /// A letter, a Greek letter or a word, with dots above it.
    pub(super) fn glyph(&mut self, depth: usize) -> Read<Option<(String, usize)>> {
        let Some(kind) = self.next_kind() else {
            return Ok(None);
        };
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
            Kind::Command(command) if depth < 8 && has("dot ddot dddot", command) => {
                self.at += 1;
                let inner = self.inside(|reader| {
                    let Some((mut name, dots)) = reader.glyph(depth + 1)? else {
                        return Ok(None);
                    };
                    reader.subscript(&mut name)?;
                    let dots = dots + command.len() - 2;
                    Ok(reader.peek().is_none().then_some((name, dots)))
                });
                if let Ok(Some(inner)) = inner {
                    return Ok(Some(inner));
                }
                self.at = at + 1;
                self.unexpected("a variable under the dots")
            }
            Kind::Command(name) if is_in("fonts", name) => {
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
    pub(super) fn subscript(&mut self, name: &mut String) -> Read<()> {
        if !self.takes(&Kind::Subscript) {
            return Ok(());
        }
        let parts = self.inside(|reader| match reader.word(reader.at, reader.end) {
            Some(word) => {
                reader.at = reader.end;
                Ok(word)
            }
            None => reader.unexpected("a subscript of letters, digits and commas"),
        })?;
        if name.contains('_') {
            return self.unexpected("one subscript");
        }
        *name += &format!("_{parts}");
        Ok(())
    }

    /// Letters, digits and commas between two places, fonts aside.
    pub(super) fn word(&self, from: usize, to: usize) -> Option<String> {
        let mut word = String::new();
        for token in &self.tokens[from..to.min(self.end)] {
            match &token.kind {
                Kind::Character(c) if c.is_ascii_alphanumeric() || *c == ',' => word.push(*c),
                Kind::Command(name) if is_greek(name) => word.push_str(name),
                Kind::Command(name) if is_in("fonts", name) || is_in("invisible", name) => {}
                Kind::Open | Kind::Close => {}
                _ => return None,
            }
        }
        (!word.is_empty()).then_some(word)
    }
}

pub(super) fn function(command: &str) -> Option<&str> {
    let is_called = |known: &Function| !matches!(known, Function::Abs | Function::Sqrt);
    let known = Function::by_name(command).filter(is_called);
    let derived = || has("sec csc cot sinh cosh", command).then_some(command);
    known.map(Function::name).or_else(derived)
}

pub(super) fn is_greek(command: &str) -> bool {
    is_in("greek", command)
}

/// Why a name for a variable was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}`: expected `VARIABLE=NAME`, such as `z1=x`, `z2=theta` or `u1=F_lin,x`, each variable and name once"
)]
pub struct NameError(String);

/// Names that a document gives to latent coordinates and inputs, as in `romc compile --rename` (`x`, `theta`,
/// `F_lin,x`); `z_1` and `u_1` unless renamed. Velocities follow their coordinate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SymbolNames {
    names: BTreeMap<String, LatentVariable>,
}

impl SymbolNames {
    /// Reads entries `VARIABLE=NAME`.
    ///
    /// # Errors
    /// [`NameError`] for an entry of another form or variable, or one that was given before.
    pub(crate) fn parse<S: AsRef<str>>(entries: &[S]) -> Result<Self, NameError> {
        let mut names = BTreeMap::new();
        for entry in entries.iter().map(AsRef::as_ref) {
            let refused = || NameError(entry.to_owned());
            let (left, right) = entry.split_once('=').ok_or_else(refused)?;
            let variable = LatentVariable::from_name(left.trim(), MAX_LATENT_DIM)
                .filter(|variable| !matches!(variable, LatentVariable::Dz(_)))
                .ok_or_else(refused)?;
            let name: String = (right.chars())
                .filter(|c| !c.is_whitespace() && !"{}\\".contains(*c))
                .collect();
            let is_part = |c: char| c.is_ascii_alphanumeric() || "_,".contains(c);
            let is_name =
                name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_part);
            let is_again = names.values().any(|other| *other == variable);
            if !is_name || is_again || names.insert(name, variable).is_some() {
                return Err(refused());
            }
        }
        Ok(Self { names })
    }

    /// The variable of a name such as `z_1` or `F_lin,x`; `alone` allows `z` and `u` for the first of each.
    pub(super) fn variable(&self, name: &str, alone: bool) -> Option<LatentVariable> {
        if let Some(variable) = self.names.get(name) {
            return Some(*variable);
        }
        let plain = match name.split_once('_') {
            None if alone && matches!(name, "z" | "u") => format!("{name}1"),
            None => return None,
            Some(("u", subscript)) => format!("u{}", subscript.trim_start_matches("lat,")),
            Some(("z", subscript)) => format!("z{subscript}"),
            Some(_) => return None,
        };
        LatentVariable::from_name(&plain, MAX_LATENT_DIM)
            .filter(|variable| self.names.values().all(|renamed| renamed != variable))
    }

    /// The first entry whose variable equations of so many latent coordinates do not have.
    pub(in super::super) fn beyond(&self, latent_dim: usize) -> Option<String> {
        let is_beyond = |variable: &LatentVariable| match variable {
            LatentVariable::Z(k) | LatentVariable::Dz(k) | LatentVariable::U(k) => *k >= latent_dim,
        };
        let mut entries = self.names.iter();
        let (name, variable) = entries.find(|(_, variable)| is_beyond(variable))?;
        Some(format!("{variable}={name}"))
    }

    pub(super) fn expected(&self) -> String {
        let renamed: Vec<&str> = self.names.keys().map(String::as_str).collect();
        match renamed.is_empty() {
            true => {
                "z_1, \\dot z_1, u_1 and so on (--symbols VARIABLE=NAME for other names)".to_owned()
            }
            false => format!("{}, z_k or u_k, with dots or without", renamed.join(", ")),
        }
    }
}
