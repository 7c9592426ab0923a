//! Input and output vectors for self-tests of generated code, made by the interpreter.

use super::code::Role;
use super::interface::{FunctionSpec, ModelInterface, PhaseInterface};
use super::options::Precision;
use super::test_points::{BatchPoints, N_BATCH, Random, TestPoint, point};
use crate::ir::{Interpreter, Slot};
use crate::typeset::rounded_up;

pub(crate) const N_POINTS: usize = 6;

/// Largest accepted difference, relative to one plus the largest magnitude of the
/// expected vector: room for another mathematics library and for fused operations,
/// none for a wrong coefficient.
pub(crate) const TOLERANCE_F64: f64 = 1e-11;

/// Accepted share of one plus the largest value of an output in single precision.
const TOLERANCE_F32: f64 = 1e-4;

/// Accepted multiple of the error that the interpreter has in single precision: other libraries and fused operations
/// round otherwise.
const ERROR_MARGIN: f64 = 16.0;

pub(crate) struct TestVectors<'a> {
    pub functions: Vec<FunctionVectors<'a>>,
    pub batches: Vec<Batch<'a>>,
}

impl<'a> TestVectors<'a> {
    pub(crate) fn new(entries: &'a ModelInterface, precision: Precision) -> Self {
        let batches = entries.phases.iter();
        Self {
            functions: entries
                .all()
                .map(|entry| vectors(entry, precision))
                .collect(),
            batches: batches.map(|phase| Batch::new(phase, precision)).collect(),
        }
    }
}

pub(crate) struct Batch<'a> {
    pub phase: &'a str,
    /// First elements of the arrays, and an angle that the batch meets.
    pub points: BatchPoints,
    pub tolerance: String,
}

impl<'a> Batch<'a> {
    fn new(phase: &'a PhaseInterface, precision: Precision) -> Self {
        let points = BatchPoints::new(phase, precision);
        // Single calls and the batch both have errors.
        let of_point = |point| {
            let point = points.at(phase, point, precision);
            tolerances(&phase.dynamics, precision, &point.inputs, &point.outputs)
        };
        let largest = (0..N_BATCH).flat_map(of_point).fold(0.0, f64::max);
        Self {
            phase: phase.identifier.as_str(),
            tolerance: spelled(2.0 * largest, precision),
            points,
        }
    }
}

pub(crate) struct FunctionVectors<'a> {
    pub name: &'a str,
    pub parameters: Vec<ParameterVectors<'a>>,
    pub is_defined: bool,
}

impl FunctionVectors<'_> {
    /// The arguments of a call, each as `spell` prints it.
    pub(crate) fn arguments(&self, spell: impl Fn(&ParameterVectors<'_>) -> String) -> String {
        let arguments: Vec<String> = self.parameters.iter().map(spell).collect();
        arguments.join(", ")
    }
}

/// What a parameter holds at each point: before the call, and what is expected after it.
pub(crate) struct ParameterVectors<'a> {
    pub role: Role,
    pub name: &'a str,
    pub len: usize,
    /// A row per point; empty for outputs.
    pub before: Vec<Vec<f64>>,
    /// A row per point; empty for inputs.
    pub after: Vec<Vec<f64>>,
    pub tolerance: String,
}

impl ParameterVectors<'_> {
    pub(crate) fn is_written(&self) -> bool {
        matches!(self.role, Role::Output | Role::InOut)
    }
}

/// The tolerance of a self-test: relative in double precision; in single precision the given one, rounded up to two
/// digits.
fn spelled(bound: f64, precision: Precision) -> String {
    match precision {
        Precision::Double => format!("{TOLERANCE_F64:?}"),
        Precision::Single => format!("{:.1e}", rounded_up(bound, 2)),
    }
}

/// The vectors of all parameters of an entry, at points where its results are finite if such points are found;
/// inputs are numbers of the precision.
fn vectors(entry: &FunctionSpec, precision: Precision) -> FunctionVectors<'_> {
    let mut random = Random::new();
    let points = (0..N_POINTS).map(|position| {
        let point = point(entry, precision, &mut random);
        match N_POINTS - position {
            1 => point.at_rest(entry, precision, &["z", "dz", "u_lat"]),
            2 => point.at_rest(entry, precision, &["dz", "u_lat"]),
            _ => point,
        }
    });
    let points: Vec<_> = points.collect();
    let tolerances = points
        .iter()
        .map(|p| tolerances(entry, precision, &p.inputs, &p.outputs));
    let tolerances: Vec<Vec<f64>> = tolerances.collect();
    let place = |slots: &[Slot], name: &str| slots.iter().position(|slot| slot.name == name);
    let parameters = entry.parameters.iter().map(|parameter| {
        let read = place(entry.program.inputs(), &parameter.name);
        let written = place(entry.program.outputs(), &parameter.name);
        let before = read.map(|slot| points.iter().map(|p| p.inputs[slot].clone()).collect());
        let after = written.map(|slot| points.iter().map(|p| p.outputs[slot].clone()).collect());
        let errors = written.map(|slot| tolerances.iter().map(|t| t[slot]).fold(0.0, f64::max));
        ParameterVectors {
            role: parameter.role,
            name: &parameter.name,
            len: parameter.len,
            before: before.unwrap_or_default(),
            after: after.unwrap_or_default(),
            tolerance: spelled(errors.unwrap_or(0.0), precision),
        }
    });
    FunctionVectors {
        name: &entry.name,
        parameters: parameters.collect(),
        is_defined: points.iter().any(TestPoint::is_defined),
    }
}

/// Largest accepted difference of each output in single precision: a share of one plus its largest value, or a multiple
/// of the interpreter's own error there, which is larger where terms cancel. Zero in double precision.
fn tolerances(
    entry: &FunctionSpec,
    precision: Precision,
    inputs: &[Vec<f64>],
    outputs: &[Vec<f64>],
) -> Vec<f64> {
    if precision == Precision::Double {
        return vec![0.0; outputs.len()];
    }
    let nearest = |slot: &Vec<f64>| slot.iter().map(|&x| x as f32).collect();
    let inputs: Vec<Vec<f32>> = inputs.iter().map(nearest).collect();
    let single = Interpreter::<f32>::new(&entry.program).results(&inputs);
    let of_output = |(single, exact): (Vec<f32>, &Vec<f64>)| {
        let held = exact.iter().filter(|value| precision.holds(**value));
        let largest = held.fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let pairs = single.iter().zip(exact);
        let errors = pairs.map(|(single, exact)| (f64::from(*single) - exact).abs());
        let error = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        (TOLERANCE_F32 * (1.0 + largest)).max(ERROR_MARGIN * error)
    };
    single.into_iter().zip(outputs).map(of_output).collect()
}
