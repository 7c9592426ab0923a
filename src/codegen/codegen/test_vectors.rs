//! Input and output vectors for self-tests of generated code, made by the interpreter.

use super::code::Role;
use super::dialect::Dialect;
use super::interface::{FunctionSpec, ModelInterface, PhaseInterface};
use super::options::{Precision, rounded_up};
use super::test_points::{BatchPoints, N_BATCH, Random, point};
use crate::ir::Interpreter;

/// Points at which each function is compared.
pub(crate) const N_POINTS: usize = 6;

/// Largest accepted difference, relative to one plus the largest magnitude of the
/// expected vector: room for another mathematics library and for fused operations,
/// none for a wrong coefficient.
pub(crate) const TOLERANCE_F64: f64 = 1e-11;

pub(crate) struct TestVectors<'a> {
    pub functions: Vec<FunctionVectors>,
    pub batches: Vec<Batch<'a>>,
}

impl<'a> TestVectors<'a> {
    /// The vectors of all functions in a precision, with numbers as a language spells them and its words for
    /// what is not a number or infinite.
    pub(crate) fn new(
        entries: &'a ModelInterface,
        dialect: &dyn Dialect,
        precision: Precision,
        [nan, infinite, negative]: [&str; 3],
    ) -> Self {
        let text = |value: f64, digits: &dyn Fn(f64) -> String| match (
            value.is_finite(),
            value.is_nan(),
            value > 0.0,
        ) {
            (true, _, _) => digits(value),
            (false, true, _) => nan.to_owned(),
            (false, false, true) => infinite.to_owned(),
            (false, false, false) => negative.to_owned(),
        };
        let spell = |value: f64| text(value, &|value| dialect.literal(value));
        let with_all_digits = |value: f64| text(value, &|value| Precision::Double.digits(value));
        let functions = entries.all();
        let functions =
            functions.map(|entry| vectors(entry, precision, [&spell, &with_all_digits]));
        let batches = entries.phases.iter();
        Self {
            functions: functions.collect(),
            batches: batches.map(|phase| Batch::new(phase, precision)).collect(),
        }
    }
}

pub(crate) struct Batch<'a> {
    pub phase: &'a str,
    /// First elements of the arrays, and an angle that the batch meets.
    pub points: BatchPoints,
    /// Absolute tolerance of single precision.
    pub tolerance: String,
}

impl<'a> Batch<'a> {
    fn new(phase: &'a PhaseInterface, precision: Precision) -> Self {
        let points = BatchPoints::new(phase, precision);
        Self {
            phase: phase.identifier.as_str(),
            tolerance: match precision {
                Precision::Double => String::new(),
                Precision::Single => rounded_up(batch_tolerance(phase, &points)),
            },
            points,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FunctionVectors {
    pub name: String,
    pub parameters: Vec<ParameterVectors>,
    /// Whether all results are finite at one of the points.
    pub is_defined: bool,
}

impl FunctionVectors {
    /// The arguments of a call, each as `spell` prints it.
    pub(crate) fn arguments(&self, spell: impl Fn(&ParameterVectors) -> String) -> String {
        let arguments: Vec<String> = self.parameters.iter().map(spell).collect();
        arguments.join(", ")
    }
}

/// What a parameter holds at each point: before the call, and what is expected after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ParameterVectors {
    pub role: Role,
    pub name: String,
    pub len: usize,
    /// Values before the call, a row a point; empty for outputs.
    pub before: Vec<Vec<String>>,
    /// Values after the call with all digits in either precision, a row a point; empty for inputs.
    pub after: Vec<Vec<String>>,
    /// Largest accepted difference of single precision at these points, see [`tolerances`].
    pub tolerance_single: f64,
}

impl ParameterVectors {
    pub(crate) fn is_written(&self) -> bool {
        matches!(self.role, Role::Output | Role::InOut)
    }

    pub(crate) fn tolerance(&self) -> String {
        rounded_up(self.tolerance_single)
    }
}

/// Accepted share of one plus the largest value of an output in single precision.
const TOLERANCE_F32: f64 = 1e-4;

/// Accepted multiple of the error that the interpreter has in single precision: other libraries and fused operations
/// round otherwise.
const ERROR_MARGIN: f64 = 16.0;

/// The vectors of all parameters of an entry, at points where its results are finite if such points are found;
/// inputs are numbers of the precision.
fn vectors(
    entry: &FunctionSpec,
    precision: Precision,
    [before, after]: [&dyn Fn(f64) -> String; 2],
) -> FunctionVectors {
    let row = |values: &[f64], text: &dyn Fn(f64) -> String| -> Vec<String> {
        values.iter().map(|&value| text(value)).collect()
    };
    let mut random = Random::new();
    let parameters = entry.parameters.iter().map(|parameter| ParameterVectors {
        role: parameter.role,
        name: parameter.name.clone(),
        len: parameter.len,
        before: Vec::new(),
        after: Vec::new(),
        tolerance_single: 0.0,
    });
    let mut vectors = FunctionVectors {
        name: entry.name.clone(),
        parameters: parameters.collect(),
        is_defined: false,
    };
    for position in 0..N_POINTS {
        let point = point(entry, precision, &mut random);
        let point = match N_POINTS - position {
            1 => point.at_rest(entry, precision, &["z", "dz", "u_lat"]),
            2 => point.at_rest(entry, precision, &["dz", "u_lat"]),
            _ => point,
        };
        vectors.is_defined |= point.is_defined();
        let tolerances = match precision {
            Precision::Double => vec![0.0; point.outputs.len()],
            Precision::Single => tolerances(entry, &point.inputs, &point.outputs),
        };
        for parameter in &mut vectors.parameters {
            let slots = entry.program.inputs().iter().zip(&point.inputs);
            if let Some((_, values)) = slots.into_iter().find(|(s, _)| s.name == parameter.name) {
                parameter.before.push(row(values, before));
            }
            let slots = entry.program.outputs().iter();
            if let Some(position) = slots.into_iter().position(|s| s.name == parameter.name) {
                let values = &point.outputs[position];
                parameter.after.push(row(values, after));
                parameter.tolerance_single = parameter.tolerance_single.max(tolerances[position]);
            }
        }
    }
    vectors
}

/// Largest accepted difference between a batch and single calls in single precision, both of which have errors.
fn batch_tolerance(phase: &PhaseInterface, points: &BatchPoints) -> f64 {
    let of_point = |point| {
        let point = points.at(phase, point, Precision::Single);
        tolerances(&phase.dynamics, &point.inputs, &point.outputs)
    };
    2.0 * (0..N_BATCH).flat_map(of_point).fold(0.0, f64::max)
}

/// Largest accepted difference of each output in single precision: a share of one plus its largest value, or a multiple
/// of the interpreter's own error there, which is larger where terms cancel.
fn tolerances(entry: &FunctionSpec, inputs: &[Vec<f64>], outputs: &[Vec<f64>]) -> Vec<f64> {
    let nearest = |slot: &Vec<f64>| slot.iter().map(|&x| x as f32).collect();
    let inputs: Vec<Vec<f32>> = inputs.iter().map(nearest).collect();
    let single = Interpreter::<f32>::new(&entry.program).results(&inputs);
    let of_output = |(single, exact): (Vec<f32>, &Vec<f64>)| {
        let held = |value: &&f64| Precision::Single.holds(**value);
        let largest = exact
            .iter()
            .filter(held)
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        let errors = single
            .iter()
            .zip(exact)
            .map(|(s, x)| (f64::from(*s) - x).abs());
        let error = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        (TOLERANCE_F32 * (1.0 + largest)).max(ERROR_MARGIN * error)
    };
    single.into_iter().zip(outputs).map(of_output).collect()
}
