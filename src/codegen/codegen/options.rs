//! User options of generated code: its numbers, sines and units; and reasons why it cannot be generated.

use super::*;

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

    /// A finite number with the fewest digits that read back to the nearest number of this precision. It always has a
    /// point or an exponent, so that it is no integer in any target.
    pub fn digits(self, value: f64) -> String {
        assert!(value.is_finite(), "numbers of programs are finite");
        match self {
            Self::Double => format!("{value:?}"),
            Self::Single => format!("{:?}", value as f32),
        }
    }

    pub(crate) fn lanes(self) -> usize {
        512 / self.bits()
    }

    pub(crate) fn is_single(self) -> bool {
        self == Self::Single
    }

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
    pub fn check(self, entries: &ModelInterface) -> Result<()> {
        let beyond =
            |entry: &FunctionSpec| Some((entry.name.clone(), beyond_single(&entry.program)?));
        match entries.all().find_map(beyond).filter(|_| self.is_single()) {
            Some((function, value)) => Err(CodegenError::BeyondSingle { function, value }),
            None => Ok(()),
        }
    }
}

fn beyond_single(program: &Program) -> Option<f64> {
    let constants = program.statements.iter().filter_map(|s| match s {
        Statement::Constant(value) => Some(*value),
        _ => None,
    });
    let entries = program.tables.iter().flat_map(|table| &table.entries);
    let inner = program.callees.iter().find_map(beyond_single);
    constants
        .chain(entries.copied())
        .find(|value| (*value as f32).is_infinite())
        .or(inner)
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum SineCosine {
    // Within about one unit of the last place, without branches, so that loops over it vectorise.
    /// A function in the file; equal bits on every platform
    #[default]
    Inline,
    /// The mathematics library of the platform
    Library,
}

/// Units of `x`, `dx` and `u` at the interface of generated code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// SI units; the model's scaling factors are folded into the maps.
    #[default]
    Si,
    /// Scaled values as the model was learned with, `s_x x`, `s_x dx`, `s_u u`: the maps are bare encoder and decoder.
    Scaled,
}

impl Units {
    pub(super) fn of_robot(self) -> &'static str {
        match self {
            Self::Si => "SI units",
            Self::Scaled => "scaled units (s_x and s_u times SI units)",
        }
    }

    /// The model with its maps in these units.
    pub(super) fn convert(self, model: &ReducedModel) -> Result<ReducedModel, LowerError> {
        // A model without robot coordinates has no maps either.
        if self == Self::Si || model.scaling().is_err() {
            return Ok(model.clone());
        }
        let builder = model.clone().into_builder();
        Ok(builder.scaling(Scaling::uniform(1.0)).build()?)
    }
}

/// Why no code could be generated from a model.
#[derive(Debug, thiserror::Error)]
pub enum CodegenError {
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// A constant is beyond the largest single-precision number.
    #[error(
        "`{function}` has the constant {value:e}, beyond the largest single-precision number (3.4e38); use `--precision f64`"
    )]
    BeyondSingle {
        /// The function, without the model's name.
        function: String,
        value: f64,
    },
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
