//! Names and units of the coordinates of state and input, and scale factors between SI units and those of the training.

use super::*;

const MAX_TEXT_LEN: usize = 64;

/// In order; of characters that mean nothing in C, Rust and CSV, for comments and tables of generated files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoordinateNames {
    pub names: Vec<String>,
    pub units: Vec<String>,
}

impl CoordinateNames {
    pub fn of_robot() -> [Self; 2] {
        [
            (Robot::state_names(), Robot::state_units()),
            (Robot::input_names(), Robot::input_units()),
        ]
        .map(|(names, units)| Self {
            names: names.to_vec(),
            units: units.to_vec(),
        })
    }

    pub(crate) fn dim(&self) -> usize {
        self.names.len()
    }

    /// Refuses other than `dim` different names, those of a robot if there is one, and units of harmless characters.
    pub(super) fn check(
        &self,
        signals: &str,
        dim: Option<usize>,
        robot: Option<(&[String], &Robot)>,
    ) -> Result<()> {
        let (names, units) = (format!("{signals}.names"), format!("{signals}.units"));
        let dim = dim.unwrap_or(self.names.len());
        check_shape(&names, (self.names.len(), 1), (dim, 1))?;
        check_shape(&units, (self.units.len(), 1), (dim, 1))?;
        let allowed = "ASCII letters, digits, `.`, `_`, `-`";
        check_texts(&names, &self.names, allowed, "._-")?;
        let allowed = "ASCII letters, digits, space, `/`, `^`, `.`, `-`";
        check_texts(&units, &self.units, allowed, " /^.-")?;
        for (index, name) in self.names.iter().enumerate() {
            let place = format!("`{names}`[{index}]");
            if let Some(first) = self.names[..index].iter().position(|first| first == name) {
                let found = format!("{name:?} as in [{first}] already");
                return Err(ModelError::invalid(place, found, "different names"));
            }
            if let Some((expected, robot)) = robot {
                let expected = &expected[index];
                let of_robot = format!("{expected:?} as on robot {}", robot.name);
                check(name == expected, &place, || format!("{name:?}"), of_robot)?;
            }
        }
        Ok(())
    }
}

fn check_texts(list: &str, texts: &[String], allowed: &str, punctuation: &str) -> Result<()> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || punctuation.contains(c);
    let expected = format!("1 to {MAX_TEXT_LEN} characters out of {allowed}");
    for (index, text) in texts.iter().enumerate() {
        let is_short = (1..=MAX_TEXT_LEN).contains(&text.len());
        let fits = is_short && !text.contains("//") && text.chars().all(is_allowed);
        let start: String = text.chars().take(2 * MAX_TEXT_LEN).collect();
        let found = || format!("{start:?}");
        check(fits, &format!("`{list}`[{index}]"), found, &expected)?;
    }
    Ok(())
}

/// Factors of one kind of quantity: `scaled value = factor * SI value`.
#[derive(Clone, Debug, PartialEq)]
pub enum ScaleFactors {
    Uniform(f64),
    PerCoordinate(DVector<f64>),
}

impl ScaleFactors {
    pub fn expand(&self, dim: usize) -> DVector<f64> {
        match self {
            ScaleFactors::Uniform(factor) => DVector::from_element(dim, *factor),
            ScaleFactors::PerCoordinate(factors) => factors.clone(),
        }
    }

    pub(super) fn check(&self, tensor: &'static str, dim: Option<usize>) -> Result<()> {
        if let ScaleFactors::PerCoordinate(factors) = self {
            let expected = dim.unwrap_or(factors.len());
            check_shape(&format!("scaling.{tensor}"), factors.shape(), (expected, 1))?;
        }
        let factors = self.expand(1);
        let usable = |f: f64| f.is_finite() && f > 0.0 && (1.0 / f).is_finite();
        for (index, &factor) in factors.iter().enumerate() {
            let place = format!("`scaling.{tensor}`[{index}]");
            let expected = "a positive number with a finite reciprocal";
            check(usable(factor), &place, || factor, expected)?;
        }
        Ok(())
    }
}

/// The paper trains on all quantities times 0.1 (its "normalisation 1/10").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scaling {
    pub state: ScaleFactors,
    pub input: ScaleFactors,
}

impl Scaling {
    pub fn uniform(factor: f64) -> Self {
        Self {
            state: ScaleFactors::Uniform(factor),
            input: ScaleFactors::Uniform(factor),
        }
    }
}
