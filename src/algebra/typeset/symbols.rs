//! How the model's variables are written: `z1` as z with subscript 1, or renamed.

use std::collections::BTreeMap;

use super::error::RenameError;
use super::tree::{GREEK, Glyph, Symbol};

/// What a variable of the latent model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Latent coordinate `z`.
    Position,
    /// Its velocity `dz`.
    Velocity,
    /// Latent input `u`.
    Input,
    /// Acceleration `ddz`, the left side of an equation.
    Acceleration,
}

/// A variable of the latent model: what it is, and its number counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Variable {
    /// What it is.
    pub quantity: Quantity,
    /// Its number, from one.
    pub index: usize,
}

impl Variable {
    /// Reads `z3`, `dz3`, `ddz3` or `u3`; anything else is none of the model's variables.
    pub fn parse(name: &str) -> Option<Self> {
        let digits = name.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let quantity = match &name[..name.len() - digits.len()] {
            "z" => Quantity::Position,
            "dz" => Quantity::Velocity,
            "ddz" => Quantity::Acceleration,
            "u" => Quantity::Input,
            _ => return None,
        };
        if digits.starts_with('0') || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        let index = digits.parse().ok()?;
        Some(Self { quantity, index })
    }
}

/// New names for latent coordinates and inputs, such as `z1=x`, `u2=F_z`.
///
/// ```
/// use romc::typeset::SymbolTable;
/// assert!(SymbolTable::parse(&["z1=x", "z2=z", "u1=u_x"], 2).is_ok());
/// assert!(SymbolTable::parse(&[r"z1=\input{x}"], 2).is_err());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SymbolTable {
    names: BTreeMap<(Quantity, usize), Symbol>,
}

impl SymbolTable {
    /// Reads entries `VARIABLE=NAME` for a model of `latent_dim` coordinates.
    ///
    /// # Errors
    /// [`RenameError`] for an entry that is malformed, names no variable of the
    /// model, or makes two variables look alike.
    pub fn parse<S: AsRef<str>>(entries: &[S], latent_dim: usize) -> Result<Self, RenameError> {
        let mut table = Self::default();
        for entry in entries {
            let entry = entry.as_ref();
            let (left, right) = entry.split_once('=').ok_or_else(|| RenameError::Form {
                entry: entry.to_owned(),
            })?;
            let (left, right) = (left.trim(), right.trim());
            let variable = Variable::parse(left)
                .filter(|variable| {
                    matches!(variable.quantity, Quantity::Position | Quantity::Input)
                        && (1..=latent_dim).contains(&variable.index)
                })
                .ok_or_else(|| RenameError::Variable {
                    found: left.to_owned(),
                })?;
            let symbol = parse_symbol(right).ok_or_else(|| RenameError::Name {
                variable: left.to_owned(),
                found: right.to_owned(),
            })?;
            let key = (variable.quantity, variable.index);
            if table.names.insert(key, symbol).is_some() {
                return Err(RenameError::Twice {
                    variable: left.to_owned(),
                });
            }
        }
        table.check_distinct(latent_dim)?;
        Ok(table)
    }

    /// How a variable is written, its index counted from one.
    pub fn symbol(&self, quantity: Quantity, index: usize) -> Symbol {
        let (base, letter, dots) = match quantity {
            Quantity::Position => (Quantity::Position, 'z', 0),
            Quantity::Velocity => (Quantity::Position, 'z', 1),
            Quantity::Acceleration => (Quantity::Position, 'z', 2),
            Quantity::Input => (Quantity::Input, 'u', 0),
        };
        match self.names.get(&(base, index)) {
            Some(symbol) => Symbol {
                dots,
                ..symbol.clone()
            },
            None => Symbol {
                glyph: Glyph::Letter(letter),
                dots,
                subscript: vec![Glyph::Digits(index.to_string())],
            },
        }
    }

    fn check_distinct(&self, latent_dim: usize) -> Result<(), RenameError> {
        let mut seen: BTreeMap<Symbol, String> = BTreeMap::new();
        for (quantity, letter) in [(Quantity::Position, 'z'), (Quantity::Input, 'u')] {
            for index in 1..=latent_dim {
                let name = format!("{letter}{index}");
                let symbol = self.symbol(quantity, index);
                if let Some(first) = seen.insert(symbol.clone(), name.clone()) {
                    return Err(RenameError::Collision {
                        first,
                        second: name,
                        name: symbol.to_string(),
                    });
                }
            }
        }
        Ok(())
    }
}

impl std::fmt::Display for Symbol {
    /// Plain text for messages: `z_1`, `theta`, `F_lin,1`, with `d` for each dot.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for _ in 0..self.dots {
            f.write_str("d")?;
        }
        write!(f, "{}", self.glyph)?;
        for (place, part) in self.subscript.iter().enumerate() {
            write!(f, "{}{part}", if place == 0 { "_" } else { "," })?;
        }
        Ok(())
    }
}

impl std::fmt::Display for Glyph {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Glyph::Letter(letter) => write!(f, "{letter}"),
            Glyph::Greek(place) => f.write_str(GREEK[*place].0),
            Glyph::Digits(text) | Glyph::Word(text) => f.write_str(text),
        }
    }
}

/// Longest word in a name; more is surely a mistake.
const LONGEST_WORD: usize = 24;

fn parse_symbol(text: &str) -> Option<Symbol> {
    let (base, subscript) = match text.split_once('_') {
        Some((base, subscript)) => (base, Some(subscript)),
        None => (text, None),
    };
    if base.trim_start().starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let letter = glyph(base)?;
    let subscript = match subscript {
        None => Vec::new(),
        Some(parts) => {
            let inner = parts
                .strip_prefix('{')
                .map_or(Some(parts), |rest| rest.strip_suffix('}'))?;
            inner.split(',').map(glyph).collect::<Option<_>>()?
        }
    };
    Some(Symbol {
        glyph: letter,
        dots: 0,
        subscript,
    })
}

/// Reads a letter, a word, digits or a Greek letter's name; anything else is refused.
pub(super) fn glyph(text: &str) -> Option<Glyph> {
    let text = text.trim();
    let named = text.strip_prefix('\\');
    let name = named.unwrap_or(text);
    if let Some(place) = GREEK.iter().position(|(greek, _)| *greek == name) {
        return Some(Glyph::Greek(place));
    }
    if named.is_some() || name.len() > LONGEST_WORD {
        return None;
    }
    if name.is_empty() || !name.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
        return None;
    }
    let mut letters = name.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) if letter.is_ascii_alphabetic() => Some(Glyph::Letter(letter)),
        _ if name.bytes().all(|byte| byte.is_ascii_digit()) => Some(Glyph::Digits(name.to_owned())),
        _ => Some(Glyph::Word(name.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variable_parse_accepts_only_model_variables() {
        let Variable { quantity, index } = Variable::parse("dz12").unwrap();
        assert_eq!((quantity, index), (Quantity::Velocity, 12));
        for name in ["z", "z0", "z01", "x1", "z1a", "dddz1", "", "1", "z-1"] {
            assert_eq!(Variable::parse(name), None, "{name}");
        }
    }

    #[test]
    fn table_renames_the_coordinate_and_all_its_derivatives() {
        let table = SymbolTable::parse(&["z1 = x", "u2=F_lin,z", "z2=theta"], 2).unwrap();
        let show = |name: &str| {
            let Variable { quantity, index } = Variable::parse(name).unwrap();
            table.symbol(quantity, index).to_string()
        };
        assert_eq!(show("z1"), "x");
        assert_eq!(show("ddz1"), "ddx");
        assert_eq!(show("dz2"), "dtheta");
        assert_eq!(show("u2"), "F_lin,z");
        assert_eq!(show("u1"), "u_1");
    }

    #[test]
    fn table_refuses_names_that_carry_tex_variables_that_the_model_lacks_and_one_look_of_two() {
        let refused = |entry: &str| SymbolTable::parse(&[entry], 2).expect_err(entry);
        let names = [
            r"\input{x}",
            "x%",
            "a b",
            "$",
            "^^5c",
            r"\def",
            "",
            "1",
            "x_",
            "x_{a",
        ];
        for name in names {
            let error = refused(&format!("z1={name}"));
            assert!(matches!(error, RenameError::Name { .. }), "{name}");
        }
        for entry in ["z3=x", "dz1=v", "u0=a", "q=a"] {
            let error = refused(entry);
            assert!(matches!(error, RenameError::Variable { .. }), "{entry}");
        }
        let clash = refused("z1=z_2");
        assert!(matches!(clash, RenameError::Collision { .. }));
        assert!(SymbolTable::parse(&["z1=z_2", "z2=z_1"], 2).is_ok());
    }
}
