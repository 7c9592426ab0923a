//! One of two files that are compared, with its numbers as they are written.

use super::*;
use crate::artifact;
use crate::equations::Equations;

/// Digits that a rounded float has at least; decimals with more digits are nearer to one float than to any other.
const FLOAT_DIGITS: usize = 16;
/// Below this floats hold every multiple of 1/2.
const LARGEST_HALF: f64 = 4e15;

#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    #[error(transparent)]
    File(#[from] ImportError),
    #[error("{file}:{line}: not a usable equation")]
    Expression {
        file: String,
        line: usize,
        source: ParseError,
    },
}

#[derive(Clone, Debug)]
pub struct Side {
    pub file: String,
    pub latent_dim: usize,
    /// Whether its decimals stand for numbers that were rounded in the last digit.
    pub is_rounded: bool,
    /// Whether decimals with more digits than floats hold count as they are written.
    keeps_digits: bool,
    pub(super) phases: Vec<SidePhase>,
}

#[derive(Clone, Debug)]
pub(super) struct SidePhase {
    pub(super) name: Option<String>,
    pub(super) ddz: Vec<RightSide>,
}

#[derive(Clone, Debug)]
pub(super) enum RightSide {
    Summands(Vec<(f64, String)>),
    Text(usize, String),
}

/// Reads two files. Labels of LaTeX end in the names of the other file's phases.
pub(crate) fn read_sides(
    paths: [&Path; 2],
    options: &CheckOptions,
) -> Result<[Side; 2], CheckError> {
    let is_latex = |path: &Path| matches!(Format::of_path(path), Ok(Format::Latex));
    let read = |path: &Path, known: &[String]| {
        let format = match path.extension().is_some_and(|ending| ending == "json") {
            true => size::Format::Model,
            false => size::Format::Equations,
        };
        let file = path.display().to_string();
        let refused = |source| ImportError::io(&file, "read the file", source);
        let bytes = size::read_capped(path, format).map_err(refused)?;
        Side::from_bytes(&file, &bytes, options, known)
    };
    if is_latex(paths[0]) && !is_latex(paths[1]) {
        let second = read(paths[1], &[])?;
        return Ok([read(paths[0], &second.phase_names())?, second]);
    }
    let first = read(paths[0], &[])?;
    let known = first.phase_names();
    Ok([first, read(paths[1], &known)?])
}

impl Side {
    /// `known` are names of phases that labels of LaTeX may end in, in addition to `contact` and `flight`.
    pub fn from_bytes(
        file: &str,
        bytes: &[u8],
        options: &CheckOptions,
        known: &[String],
    ) -> Result<Self, CheckError> {
        let ending = Path::new(file).extension();
        let ending = ending.map(|ending| ending.to_string_lossy().to_lowercase());
        if ending.as_deref() == Some("json") {
            let model = artifact::read_from_bytes(file, bytes)?;
            return Ok(Self::of_model(file, &model));
        }
        let Ok(format @ (Format::Equations | Format::Latex)) = Format::of_path(Path::new(file))
        else {
            let found = ending.map(|ending| format!("the ending `.{ending}`"));
            let found = found.unwrap_or("no ending".to_owned());
            let expected = "a model (.json), equations as text (.txt), or LaTeX (.tex, .md)";
            return Err(ImportError::at(file, Place::Whole, found, expected).into());
        };
        let usual = ["contact", "flight"].map(str::to_owned);
        let known: Vec<String> = known.iter().cloned().chain(usual).collect();
        let read = read_equations(file, format, bytes, &options.symbols, &known)?;
        let side = Self {
            file: file.to_owned(),
            latent_dim: read.latent_dim,
            is_rounded: format == Format::Latex && !options.exact,
            keeps_digits: options.exact,
            phases: (read.sections.into_iter())
                .map(|section| SidePhase {
                    name: section.phase,
                    ddz: (section.equations.iter())
                        .map(|equation| RightSide::Text(equation.line, equation.text()))
                        .collect(),
                })
                .collect(),
        };
        side.check()?;
        Ok(side)
    }

    pub(crate) fn of_model(file: &str, model: &ReducedModel) -> Self {
        let equations = Equations::as_learned(model);
        let phases = equations.phases.iter().map(|phase| {
            let ddz = (0..model.latent_dim()).map(|output| {
                let summands = phase.summands(&equations, output);
                let texts = summands.map(|(c, term)| (c, term.text.clone()));
                RightSide::Summands(texts.collect())
            });
            SidePhase {
                name: Some(phase.name.clone()),
                ddz: ddz.collect(),
            }
        });
        Self {
            file: file.to_owned(),
            latent_dim: model.latent_dim(),
            is_rounded: false,
            keeps_digits: false,
            phases: phases.collect(),
        }
    }

    pub(crate) fn phase_names(&self) -> Vec<String> {
        let names = self.phases.iter().map(|phase| phase.name.clone());
        names.flatten().collect()
    }

    fn check(&self) -> Result<(), CheckError> {
        let mut pool = ExprPool::exact();
        for right_side in self.phases.iter().flat_map(|phase| &phase.ddz) {
            if let RightSide::Text(line, text) = right_side {
                let parsed = self.parse(text, &mut pool);
                parsed.map_err(|source| CheckError::Expression {
                    file: self.file.clone(),
                    line: *line,
                    source,
                })?;
            }
        }
        Ok(())
    }

    fn parse(&self, text: &str, pool: &mut ExprPool) -> Result<Reading, ParseError> {
        let known = |name: &str| LatentVariable::from_name(name, self.latent_dim).is_some();
        let literal = |pool: &mut ExprPool, number: &str| self.decimal(pool, number);
        pool.parse_defined(text, &known, &literal)
    }

    /// Integers, and halves of exact files, are numbers of the pool; from 17 digits the shortest of the float counts.
    fn decimal(&self, pool: &mut ExprPool, number: &str) -> Option<ExprId> {
        if number.bytes().all(|byte| byte.is_ascii_digit()) && number.parse::<i64>().is_ok() {
            return None;
        }
        let float = (number.parse::<f64>().ok())
            .filter(|_| number.contains(['.', 'e', 'E']) && !self.keeps_digits)
            .filter(|float| n_digits(number) > FLOAT_DIGITS && float.is_normal());
        let (is_rounded, text) = match float {
            Some(float) => (false, format!("{float:?}")),
            None => (self.is_rounded, number.to_owned()),
        };
        let literal = Coefficient::parse(&text, is_rounded)?;
        let is_half = (&literal + &literal).is_integer();
        if !is_rounded && is_half && literal.to_f64() < LARGEST_HALF && float.is_none() {
            return None;
        }
        pool.decimal(&text, is_rounded)
    }

    /// With symbols for decimals; where a model's `floats` are rounded, long ones stand for all numbers near.
    pub(super) fn build(
        &self,
        right_side: &RightSide,
        floats: Floats,
        pool: &mut ExprPool,
    ) -> Reading {
        match right_side {
            RightSide::Text(_, text) => self
                .parse(text, pool)
                .expect("the text was parsed when the file was read"),
            RightSide::Summands(summands) => {
                let (mut products, mut guards) = (Vec::new(), Vec::new());
                for (coefficient, term) in summands {
                    let term = self.parse(term, pool).expect("terms of a model parse");
                    guards.extend(term.guards);
                    let size = coefficient.abs();
                    let whole = Number::from_f64(size).filter(|number| number.is_exact());
                    let text = format!("{size:?}");
                    let is_rounded = floats == Floats::Rounded && n_digits(&text) >= FLOAT_DIGITS;
                    let factor = match (whole, is_rounded) {
                        (Some(number), _) => Some(pool.constant(number)),
                        (None, true) => pool.decimal(&format!("{size:.14e}"), true),
                        (None, false) => pool.decimal(&text, false),
                    };
                    let product = pool.mul(factor.expect("a float reads as a decimal"), term.expr);
                    products.push(match *coefficient < 0.0 {
                        true => pool.neg(product),
                        false => product,
                    });
                }
                let expr = pool.sum(&products);
                Reading { expr, guards }
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Floats {
    Exact,
    /// Numbers such as 1/3 and sums that were rounded to floats: of those with 16 digits or more, 15 count.
    Rounded,
}

fn n_digits(decimal: &str) -> usize {
    let mantissa = decimal.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.trim_start_matches(['0', '.']);
    digits.bytes().filter(u8::is_ascii_digit).count()
}
