//! What a user chooses of generated code: its numbers, sines and units; and why there is none.

use super::interface::ModelInterface;
use crate::ir::{Program, Statement};
use crate::lower::LowerError;
use crate::model::{ReducedModel, Scaling};

/// Floating-point numbers of generated code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Precision {
    /// 64 bits: `double` and `f64`.
    #[default]
    #[value(name = "f64")]
    Double,
    /// 32 bits: `float` and `f32`.
    #[value(name = "f32")]
    Single,
}

impl Precision {
    pub(crate) fn bits(self) -> usize {
        match self {
            Self::Double => 64,
            Self::Single => 32,
        }
    }

    /// A finite number with the fewest digits that read back to the nearest number of this precision, always with
    /// a point or an exponent, so that it is no integer in any target.
    pub(crate) fn digits(self, value: f64) -> String {
        assert!(value.is_finite(), "numbers of programs are finite");
        match self {
            Self::Double => format!("{value:?}"),
            Self::Single => format!("{:?}", value as f32),
        }
    }

    /// Points of a block of a batch: what the widest common registers hold.
    pub(crate) fn lanes(self) -> usize {
        match self {
            Self::Double => 8,
            Self::Single => 16,
        }
    }

    pub(crate) fn is_single(self) -> bool {
        self == Self::Single
    }

    /// A number as a program in this precision holds it.
    pub(crate) fn nearest(self, value: f64) -> f64 {
        match self {
            Self::Double => value,
            Self::Single => f64::from(value as f32),
        }
    }

    /// Whether a number is finite, and well within the range of this precision.
    pub(crate) fn holds(self, value: f64) -> bool {
        let largest = match self {
            Self::Double => f64::MAX,
            Self::Single => f64::from(f32::MAX) / 16.0,
        };
        value.abs() <= largest
    }

    /// Whether every constant of the functions is finite in this precision.
    ///
    /// # Errors
    /// [`CodegenError::BeyondSingle`] for the first that is not.
    pub fn check(self, entries: &ModelInterface) -> Result<(), CodegenError> {
        if self == Self::Double {
            return Ok(());
        }
        for entry in entries.all() {
            if let Some(value) = beyond_single(&entry.program) {
                return Err(CodegenError::BeyondSingle {
                    function: entry.name.clone(),
                    value,
                });
            }
        }
        Ok(())
    }
}

fn beyond_single(program: &Program) -> Option<f64> {
    let constants = program.statements().iter().filter_map(|s| match s {
        Statement::Constant(value) => Some(*value),
        _ => None,
    });
    let entries = program.tables().iter().flat_map(|table| table.entries());
    let inner = program.callees().iter().find_map(beyond_single);
    constants
        .chain(entries.copied())
        .find(|value| (*value as f32).is_infinite())
        .or(inner)
}

/// Two significant digits, never less than the number.
pub(crate) fn rounded_up(bound: f64) -> String {
    format!("{:.1e}", crate::typeset::rounded_up(bound, 2))
}

/// Where sines and cosines come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum SineCosine {
    // Within about one unit of the last place, without branches, so that loops over it vectorise.
    /// A function inside the file that compilers vectorise, the same bits everywhere.
    #[default]
    Inline,
    /// The platform's mathematics library.
    Library,
}

/// Units of `x`, `dx` and `u` at the interface of generated code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// SI units; the model's scaling factors are folded into the maps.
    #[default]
    Si,
    /// Scaled values as the model was learned with: `s_x x`, `s_x dx`, `s_u u`; the maps are the
    /// encoder's and the decoder's very weights.
    Scaled,
}

impl Units {
    pub(super) fn of_robot(self) -> &'static str {
        match self {
            Self::Si => "SI units",
            Self::Scaled => "scaled units (s_x and s_u times SI units)",
        }
    }

    /// The model whose maps take these units.
    pub(super) fn convert(self, model: &ReducedModel) -> Result<ReducedModel, LowerError> {
        match (self, model.scaling()) {
            (Self::Scaled, Ok(_)) => {
                let builder = model.clone().into_builder();
                Ok(builder.scaling(Scaling::uniform(1.0)).build()?)
            }
            // A model without robot coordinates has no maps either.
            (Self::Si, _) | (Self::Scaled, Err(_)) => Ok(model.clone()),
        }
    }
}

/// Why no code could be generated from a model.
#[derive(Debug, thiserror::Error)]
pub enum CodegenError {
    /// The model cannot be lowered.
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// A constant is beyond the largest single-precision number.
    #[error(
        "`{function}` has the constant {value:e}, beyond what single precision holds (3.4e38); use `--precision f64`"
    )]
    BeyondSingle {
        /// The function, without the model's name.
        function: String,
        /// The constant.
        value: f64,
    },
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_read_back_to_the_same_bits_and_in_single_precision_to_the_nearest_number() {
        for value in [
            0.36,
            -0.0,
            1e-300,
            5e-324,
            1e16,
            123_456_789.0,
            0.1 + 0.2,
            1e-44,
            16_777_217.0,
        ] {
            let texts = [Precision::Double, Precision::Single].map(|of| of.digits(value));
            let (double, single): (f64, f32) = (
                texts[0].parse().expect("a number"),
                texts[1].parse().expect("a number"),
            );
            assert_eq!(double.to_bits(), value.to_bits(), "{texts:?}");
            assert_eq!(single.to_bits(), (value as f32).to_bits(), "{texts:?}");
            let has_point = |text: &String| text.contains(['.', 'e']);
            assert!(
                texts.iter().all(has_point),
                "{texts:?} would be integers in C"
            );
        }
    }

    #[test]
    #[should_panic(expected = "finite")]
    fn number_that_is_not_finite_is_never_spelled() {
        Precision::Single.digits(f64::NAN);
    }
}
