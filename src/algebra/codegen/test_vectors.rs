//! Input and output vectors for self-tests of generated code, made by the interpreter.

use super::code::Role;
use super::interface::{FunctionSpec, PhaseInterface};
use super::precision::Precision;
use super::test_points::{BatchPoints, N_BATCH, Random, point};
use crate::ir::{Range, rounding_errors};

/// Points at which each function is compared.
pub const N_POINTS: usize = 6;

/// Largest accepted difference, relative to one plus the largest magnitude of the
/// expected vector: room for another mathematics library and for fused operations,
/// none for a wrong coefficient.
pub const TOLERANCE_F64: f64 = 1e-11;

/// The vectors of a function.
#[derive(Clone, Debug, PartialEq)]
pub struct FunctionVectors {
    /// Those of its parameters, in order.
    pub parameters: Vec<ParameterVectors>,
    /// At how many of the points all results are finite.
    pub defined: usize,
}

/// What a parameter holds at each point: before the call, and what is expected after it.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterVectors {
    /// What it is for.
    pub role: Role,
    /// Name of the parameter.
    pub name: String,
    /// Number of elements.
    pub len: usize,
    /// Values before the call, point after point; empty for outputs.
    pub before: Vec<f64>,
    /// Values after the call, point after point; empty for inputs.
    pub after: Vec<f64>,
    /// Largest accepted difference of single precision at these points: the bound of the rounding
    /// errors, or a share of the largest value where there is none.
    pub tolerance_single: f64,
}

/// Share of the largest value by which single precision may be off where its errors have no bound.
const TOLERANCE_UNBOUNDED: f64 = 1e-3;

/// The vectors of all parameters of an entry, at points where its results are finite if such points are found;
/// inputs are numbers of the precision.
pub fn vectors(entry: &FunctionSpec, precision: Precision) -> FunctionVectors {
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
        parameters: parameters.collect(),
        defined: 0,
    };
    for _ in 0..N_POINTS {
        let point = point(entry, precision, &mut random);
        vectors.defined += usize::from(point.is_defined());
        let tolerances = match precision {
            Precision::Double => vec![0.0; point.outputs.len()],
            Precision::Single => {
                let at = |slot: &Vec<f64>| slot.iter().map(|&x| Range::point(x)).collect();
                let points: Vec<Vec<Range>> = point.inputs.iter().map(at).collect();
                tolerances(entry, &points, &point.outputs)
            }
        };
        for parameter in &mut vectors.parameters {
            let slots = entry.program.inputs().iter().zip(&point.inputs);
            if let Some((_, values)) = slots.into_iter().find(|(s, _)| s.name == parameter.name) {
                parameter.before.extend(values);
            }
            let slots = entry.program.outputs().iter();
            if let Some(position) = slots.into_iter().position(|s| s.name == parameter.name) {
                parameter.after.extend(&point.outputs[position]);
                parameter.tolerance_single = parameter.tolerance_single.max(tolerances[position]);
            }
        }
    }
    vectors
}

/// Largest accepted difference between a batch and single calls in single precision, both of which
/// may be off.
pub fn batch_tolerance(phase: &PhaseInterface, points: &BatchPoints) -> f64 {
    let mut worst = 0.0_f64;
    for point in 0..N_BATCH {
        let point = points.at(phase, point, Precision::Single);
        // Compilers may round these inputs differently.
        let near = |&x: &f64| Range {
            low: x - 1e-7,
            high: x + 1e-7,
        };
        let ranges: Vec<Vec<Range>> = (point.inputs.iter())
            .map(|slot| slot.iter().map(near).collect())
            .collect();
        let at_point = tolerances(&phase.dynamics, &ranges, &point.outputs);
        worst = at_point.into_iter().fold(worst, f64::max);
    }
    2.0 * worst
}

/// Largest accepted difference of each output in single precision.
fn tolerances(entry: &FunctionSpec, inputs: &[Vec<Range>], outputs: &[Vec<f64>]) -> Vec<f64> {
    let bounds = rounding_errors(&entry.program, inputs);
    bounds
        .into_iter()
        .zip(outputs)
        .map(|(bounds, values)| {
            let finite = values
                .iter()
                .filter(|value| Precision::Single.holds(**value));
            let unbounded = TOLERANCE_UNBOUNDED * finite.fold(1.0, |m: f64, x| m.max(x.abs()));
            let bounds = bounds
                .into_iter()
                .map(|bound| bound.filter(|b| b.is_finite()).unwrap_or(unbounded));
            bounds.fold(0.0, f64::max)
        })
        .collect()
}
