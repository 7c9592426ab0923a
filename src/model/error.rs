//! Faults of models, and of calls of their functions.

use std::fmt;

use nalgebra::{Dim, Matrix, RawStorage};
use thiserror::Error;

use super::identifier::IdentifierError;
use super::library::LibraryError;
use crate::robot::RobotError;

/// Rows and columns of a tensor, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimensions(pub usize, pub usize);

impl fmt::Display for Dimensions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {}", self.0, self.1)
    }
}

/// One of the two texts of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalPart {
    /// The coordinate's name, such as `fr.hx`.
    Name,
    /// Its unit, such as `rad`.
    Unit,
}

impl fmt::Display for SignalPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            SignalPart::Name => "name",
            SignalPart::Unit => "unit",
        })
    }
}

/// Why a model was refused, or could not answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    /// The model's or a phase's name cannot become an identifier.
    #[error("{what} {name:?} cannot be used in generated code")]
    Name {
        /// `model name` or `phases[i].name`.
        what: String,
        /// The name as given.
        name: String,
        /// What is wrong with it.
        #[source]
        source: IdentifierError,
    },
    /// Two phases would get the same identifier (identifiers are compared without case, because
    /// macros are upper case).
    #[error(
        "phases[{second}].name {name:?} becomes the identifier `{identifier}`, which phases[{first}] has already"
    )]
    DuplicatePhase {
        /// The earlier phase.
        first: usize,
        /// The later phase.
        second: usize,
        /// Name of the later phase.
        name: String,
        /// What both become.
        identifier: String,
    },
    /// There are too few or too many phases, layers, units of a layer, or robot coordinates.
    #[error("`{part}`: found {found} {unit}, expected {expected}")]
    Count {
        /// Path of the part in the model file.
        part: String,
        /// How many there are.
        found: usize,
        /// The things counted.
        unit: &'static str,
        /// How many there may be.
        expected: String,
    },
    /// The foot rule of a phase can never be the first that matches.
    #[error(
        "phases[{phase}].feet of {name:?}: no foot pattern selects this phase, because earlier phases take all that it names"
    )]
    UnreachablePhase {
        /// Index of the phase.
        phase: usize,
        /// Its name.
        name: String,
    },
    /// A list of foot patterns names one pattern twice.
    #[error("phases[{phase}].feet[{index}]: this pattern is in the list already")]
    DuplicatePattern {
        /// Index of the phase.
        phase: usize,
        /// Index of the second occurrence.
        index: usize,
    },
    /// A tensor has the wrong number of rows or columns.
    #[error("`{tensor}`: found {found}, expected {expected} (rows x columns)")]
    Shape {
        /// Path of the tensor in the model file.
        tensor: String,
        /// Its shape.
        found: Dimensions,
        /// The shape that the rest of the model asks for.
        expected: Dimensions,
    },
    /// A tensor holds an infinity or a NaN.
    #[error("`{tensor}`[{row}][{column}]: found {found}, expected a finite number")]
    NonFinite {
        /// Path of the tensor in the model file.
        tensor: String,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The value.
        found: f64,
    },
    /// The encoder's rows are (nearly) linearly dependent, so latent inputs have no unique lift.
    #[error(
        "`encoder.weights`: found singular values from {smallest:e} to {largest:e}, expected full row rank {expected} (smallest above {tolerance:e} times the largest)"
    )]
    RankDeficient {
        /// Smallest singular value.
        smallest: f64,
        /// Largest singular value.
        largest: f64,
        /// Number of latent coordinates.
        expected: usize,
        /// Relative tolerance.
        tolerance: f64,
    },
    /// A scale factor is not a positive number with a finite reciprocal.
    #[error(
        "`scaling.{tensor}`[{index}]: found {found}, expected a positive number with a finite reciprocal"
    )]
    ScaleFactor {
        /// `state` or `input`.
        tensor: &'static str,
        /// Coordinate (0 for a common factor).
        index: usize,
        /// The value.
        found: f64,
    },
    /// The library was refused.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// A covariance is not symmetric.
    #[error(
        "`{tensor}`[{row}][{column}]: found {found}, expected {expected} as in [{column}][{row}] (a covariance is symmetric)"
    )]
    NotSymmetric {
        /// Path of the tensor.
        tensor: String,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The entry.
        found: f64,
        /// Its mirror image.
        expected: f64,
    },
    /// A covariance has a negative eigenvalue.
    #[error(
        "`{tensor}`: found the eigenvalue {smallest:e}, expected none below {bound:e} (a covariance is positive semidefinite)"
    )]
    NotPositive {
        /// Path of the tensor.
        tensor: String,
        /// Smallest eigenvalue.
        smallest: f64,
        /// Smallest eigenvalue that counts as rounding.
        bound: f64,
    },
    /// Statistics for a phase which the model does not have, or has twice.
    #[error("`input_statistics`: {name:?} is not the name of one phase, or is there twice")]
    StatisticsPhase {
        /// The name.
        name: String,
    },
    /// Eigenvalues or singular values could not be computed (numbers of wildly different size).
    #[error("`{tensor}`: its singular values or eigenvalues could not be computed")]
    Decomposition {
        /// Path of the tensor.
        tensor: String,
    },
    /// A signal's name or unit has a character that generated files cannot carry, or no character.
    #[error(
        "`{signals}`: {part} [{index}] is {found:?}, expected 1 to {max} characters out of {allowed}"
    )]
    SignalText {
        /// `state` or `input`.
        signals: &'static str,
        /// Name or unit.
        part: SignalPart,
        /// Index, from 0.
        index: usize,
        /// The text.
        found: String,
        /// Longest text allowed.
        max: usize,
        /// Allowed characters in words.
        allowed: &'static str,
    },
    /// Two signals have one name.
    #[error("`{signals}.names`[{second}]: {name:?} is the name of [{first}] already")]
    DuplicateSignal {
        /// `state` or `input`.
        signals: &'static str,
        /// First index.
        first: usize,
        /// Second index.
        second: usize,
        /// The name.
        name: String,
    },
    /// A signal differs from what the named robot has at this place.
    #[error(
        "`{signals}.names`[{index}]: found {found:?}, expected {expected:?} as on robot {robot}"
    )]
    RobotSignal {
        /// `state` or `input`.
        signals: &'static str,
        /// Index, from 0.
        index: usize,
        /// The model's name.
        found: String,
        /// The robot's name for that coordinate.
        expected: String,
        /// The robot.
        robot: String,
    },
    /// The robot is unknown.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A friction or an armature is negative or not finite.
    #[error(
        "`actuators.{array}`[{index}], joint {joint}: found {found}, expected a number of at least 0"
    )]
    Actuator {
        /// `viscous`, `dry` or `armature`.
        array: &'static str,
        /// Index of the joint, from 0.
        index: usize,
        /// Its name.
        joint: &'static str,
        /// The value.
        found: f64,
    },
    /// The sample time is not a positive number of seconds.
    #[error("`sample_time_s`: found {found}, expected a positive number up to {max}")]
    SampleTime {
        /// The value.
        found: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// A free text is too long or has control characters.
    #[error(
        "`description`: found {found} bytes or a control character, expected at most {max} bytes of text"
    )]
    Description {
        /// Length in bytes.
        found: usize,
        /// Longest accepted.
        max: usize,
    },
    /// A part of the file makes sense only with another.
    #[error("`{part}` needs `{needs}`, which the model does not have")]
    Incomplete {
        /// What is there.
        part: &'static str,
        /// What is missing.
        needs: &'static str,
    },
    /// The model was asked for something it does not carry.
    #[error("model {model} has no `{part}`, needed for {purpose}")]
    Missing {
        /// Name of the model.
        model: String,
        /// Key of the model file which is absent.
        part: &'static str,
        /// What needs it.
        purpose: &'static str,
    },
    /// Something needs a linear encoder or decoder, and the model's has activations.
    #[error("model {model}: found a nonlinear {part}, expected a linear one, needed for {purpose}")]
    Nonlinear {
        /// Name of the model.
        model: String,
        /// `encoder` or `decoder`.
        part: &'static str,
        /// What needs it to be linear.
        purpose: &'static str,
    },
    /// The Jacobian of a nonlinear encoder does not have full row rank at a state.
    #[error(
        "encoder at this state: found singular values of its Jacobian from {smallest:e} to {largest:e}, expected full row rank {expected} (smallest above {tolerance:e} times the largest)"
    )]
    SingularJacobian {
        /// Smallest singular value.
        smallest: f64,
        /// Largest singular value.
        largest: f64,
        /// Number of latent coordinates.
        expected: usize,
        /// Relative tolerance.
        tolerance: f64,
    },
    /// An activation is not known.
    #[error("found the activation {found:?}, expected one of {expected}")]
    UnknownActivation {
        /// The name.
        found: String,
        /// All names.
        expected: String,
    },
    /// A vector has the wrong length.
    #[error("{what}: found {found} entries, expected {expected}")]
    Dimension {
        /// The vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length asked for.
        expected: usize,
    },
    /// There is no phase with this index.
    #[error("found phase {found}, expected one below {count}")]
    PhaseIndex {
        /// The index asked for.
        found: usize,
        /// How many phases there are.
        count: usize,
    },
}

impl ModelError {
    /// Refuses a vector of another length than expected.
    pub(super) fn check_dimension(
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), ModelError> {
        if found == expected {
            Ok(())
        } else {
            Err(ModelError::Dimension {
                what,
                found,
                expected,
            })
        }
    }
}

/// Refuses a tensor of another shape than expected.
pub(super) fn check_shape(
    tensor: &str,
    found: (usize, usize),
    expected: (usize, usize),
) -> Result<(), ModelError> {
    if found == expected {
        return Ok(());
    }
    Err(ModelError::Shape {
        tensor: tensor.to_owned(),
        found: Dimensions(found.0, found.1),
        expected: Dimensions(expected.0, expected.1),
    })
}

/// Refuses the first entry that is infinite or not a number.
pub(super) fn check_finite<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    tensor: &str,
    values: &Matrix<f64, R, C, S>,
) -> Result<(), ModelError> {
    for row in 0..values.nrows() {
        for column in 0..values.ncols() {
            let found = values[(row, column)];
            if !found.is_finite() {
                return Err(ModelError::NonFinite {
                    tensor: tensor.to_owned(),
                    row,
                    column,
                    found,
                });
            }
        }
    }
    Ok(())
}
