//! Symbols of the model's variables, and the options of printed equations.

use std::collections::BTreeMap;

use super::tree::greek;
use super::*;

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RenameError(String);

/// New names for latent coordinates and inputs, such as `z1=x`, `u2=F_z`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SymbolTable {
    names: BTreeMap<LatentVariable, Symbol>,
}

impl SymbolTable {
    /// Reads entries `VARIABLE=NAME` for a model of `latent_dim` coordinates.
    ///
    /// # Errors
    /// [`RenameError`] for an entry that is malformed, names no variable, or makes two variables look alike.
    pub fn parse<S: AsRef<str>>(entries: &[S], latent_dim: usize) -> Result<Self, RenameError> {
        let mut table = Self::default();
        let mut entries = entries.iter();
        let renamed = entries.try_for_each(|entry| table.rename(entry.as_ref(), latent_dim));
        let checked = renamed.and_then(|()| table.check_distinct(latent_dim));
        checked.map(|()| table).map_err(RenameError)
    }

    fn rename(&mut self, entry: &str, latent_dim: usize) -> Result<(), String> {
        let (left, right) = entry
            .split_once('=')
            .ok_or_else(|| format!("`{entry}`: expected `VARIABLE=NAME`, for example `z1=x`"))?;
        let (left, right) = (left.trim(), right.trim());
        let variable = LatentVariable::from_name(left, latent_dim)
            .filter(|variable| !matches!(variable, LatentVariable::Dz(_)));
        let variable = variable.ok_or_else(|| {
            let expected = "expected z1, z2, ... or u1, u2, ... (dots follow z)";
            format!("`{left}` cannot be renamed: {expected}")
        })?;
        let symbol = parse_symbol(right);
        let symbol = symbol.ok_or_else(|| format!("`{left}={right}`: expected {NAME}"))?;
        match self.names.insert(variable, symbol) {
            Some(_) => Err(format!("`{left}` is renamed twice")),
            None => Ok(()),
        }
    }

    pub(crate) fn symbol(&self, variable: LatentVariable) -> Symbol {
        let (letter, index) = match variable {
            LatentVariable::Z(index) => ('z', index),
            LatentVariable::U(index) => ('u', index),
            LatentVariable::Dz(index) => return self.derivative(index, 1),
        };
        let new = self.names.get(&variable).cloned();
        new.unwrap_or_else(|| Symbol {
            glyph: Glyph::Letter(letter),
            dots: 0,
            subscript: vec![Glyph::Digits((index + 1).to_string())],
        })
    }

    pub(crate) fn acceleration(&self, output: usize) -> Symbol {
        self.derivative(output, 2)
    }

    fn derivative(&self, index: usize, dots: u8) -> Symbol {
        let position = self.symbol(LatentVariable::Z(index));
        Symbol { dots, ..position }
    }

    fn check_distinct(&self, latent_dim: usize) -> Result<(), String> {
        let mut seen: BTreeMap<Symbol, String> = BTreeMap::new();
        for variable in LatentVariable::all(latent_dim) {
            let (symbol, second) = (self.symbol(variable), variable.to_string());
            if let Some(first) = seen.insert(symbol.clone(), second.clone()) {
                return Err(format!(
                    "`{first}` and `{second}` would both be printed as `{symbol}`"
                ));
            }
        }
        Ok(())
    }
}

impl std::fmt::Display for Symbol {
    /// Plain text for messages: `z_1`, `theta`, `F_lin,1`, with `d` for each dot.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", "d".repeat(self.dots.into()), self.glyph)?;
        let mut marks = std::iter::once("_").chain(std::iter::repeat(","));
        let mut parts = self.subscript.iter().zip(&mut marks);
        parts.try_for_each(|(part, mark)| write!(f, "{mark}{part}"))
    }
}

impl std::fmt::Display for Glyph {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Glyph::Letter(letter) => write!(f, "{letter}"),
            Glyph::Greek(place) => f.write_str(greek_letter(*place).0),
            Glyph::Digits(text) | Glyph::Word(text) => f.write_str(text),
        }
    }
}

/// Allowed new names.
const NAME: &str = "a letter, a word or a Greek letter's name, with an optional subscript of letters and digits after \
                    `_` (x, theta, p_x, F_lin,1)";

const LONGEST_WORD: usize = 24; // longer words are surely mistakes

fn parse_symbol(text: &str) -> Option<Symbol> {
    let (base, subscript) = match text.split_once('_') {
        Some((base, parts)) => {
            let braced = parts.strip_prefix('{');
            let inner = braced.map_or(Some(parts), |rest| rest.strip_suffix('}'))?;
            (base, inner.split(',').map(glyph).collect::<Option<_>>()?)
        }
        None => (text, Vec::new()),
    };
    if base.trim_start().starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    Some(Symbol {
        glyph: glyph(base)?,
        dots: 0,
        subscript,
    })
}

/// Reads a letter, a word, digits or a Greek letter's name; anything else is refused.
pub(super) fn glyph(text: &str) -> Option<Glyph> {
    let text = text.trim();
    let named = text.strip_prefix('\\');
    let name = named.unwrap_or(text);
    if let Some(place) = greek().position(|(greek, _)| greek == name) {
        return Some(Glyph::Greek(place));
    }
    let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric());
    if named.is_some() || !is_plain || !(1..=LONGEST_WORD).contains(&name.len()) {
        return None;
    }
    let mut letters = name.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) if letter.is_ascii_alphabetic() => Some(Glyph::Letter(letter)),
        _ if name.bytes().all(|byte| byte.is_ascii_digit()) => Some(Glyph::Digits(name.to_owned())),
        _ => Some(Glyph::Word(name.to_owned())),
    }
}

/// How the equations of a phase stand on a page of LaTeX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Form {
    /// [`Form::Cases`] for a phase that fits on a page, [`Form::Align`] for a longer one.
    #[default]
    #[value(skip)]
    Automatic,
    /// A number for each equation; breaks across pages.
    Align,
    /// One number, a brace around the phase's equations.
    Cases,
}

/// How numbers are written in LaTeX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NumberStyle {
    /// Digits as they are: `0.36`, `1.2 \times 10^{-9}`.
    #[default]
    Plain,
    /// The macro of siunitx: `\num{0.36}`.
    Siunitx,
}

/// How equations are printed; the default reproduces the form of the paper's equations (25) and (26).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrintOptions {
    pub rounding: Rounding,
    /// Longest line in em of the text around (1 em is 10 pt in a 10 pt document): 32 suits one column, 22 a column of a
    /// two-column paper. `None` is 32 for LaTeX and 44 for other pages.
    pub width_em: Option<f64>,
    pub symbols: SymbolTable,
    /// Digest of the model file; the first line of every emitted file names it.
    pub digest: Option<String>,
    pub numbers: NumberStyle,
    pub form: Form,
}

pub(crate) type Emitted = Result<Vec<EmittedFile>, TypesetError>;

#[derive(Debug, thiserror::Error)]
pub enum TypesetError {
    /// A coefficient in robot coordinates is too large once folded with weights and scale factors.
    #[error("robot coordinates, {output}: the coefficient of {term:?} is {value} in SI units")]
    NotFinite {
        output: String,
        term: String,
        value: f64,
    },
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
