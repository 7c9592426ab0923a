//! Input and output vectors for self-tests of generated code, made by the interpreter.

use super::code::Role;
use super::interface::{FunctionSpec, PhaseInterface};
use super::precision::Precision;
use crate::ir::{Interpreter, Range, rounding_errors};
use crate::robot::JOINT_DIM;
use crate::robot::joints::LEG_JOINT_DIM;

/// Points at which each function is compared.
pub const N_POINTS: usize = 6;

/// Largest accepted difference, relative to one plus the largest magnitude of the
/// expected vector: room for another mathematics library and for fused operations,
/// none for a wrong coefficient.
pub const TOLERANCE_F64: f64 = 1e-11;

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

/// The vectors of all parameters of an entry; inputs are numbers of the precision.
pub fn vectors(entry: &FunctionSpec, precision: Precision) -> Vec<ParameterVectors> {
    let mut interpreter = Interpreter::new(&entry.program);
    let mut random = Random(0x5eed);
    let mut result: Vec<ParameterVectors> = entry
        .parameters
        .iter()
        .map(|parameter| ParameterVectors {
            role: parameter.role,
            name: parameter.name.clone(),
            len: parameter.len,
            before: Vec::new(),
            after: Vec::new(),
            tolerance_single: 0.0,
        })
        .collect();
    for _ in 0..N_POINTS {
        let inputs: Vec<Vec<f64>> = entry
            .program
            .inputs()
            .iter()
            .map(|slot| match slot.name.as_str() {
                "h" => vec![precision.nearest(0.002)],
                name => (0..slot.len)
                    .map(|k| precision.nearest(element(entry, name, k, random.next())))
                    .collect(),
            })
            .collect();
        let mut outputs: Vec<Vec<f64>> = entry
            .program
            .outputs()
            .iter()
            .map(|slot| vec![0.0; slot.len])
            .collect();
        let read: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut written: Vec<&mut [f64]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        interpreter.run(&read, &mut written);
        let tolerances = match precision {
            Precision::Double => vec![0.0; outputs.len()],
            Precision::Single => {
                let at = |slot: &Vec<f64>| slot.iter().map(|&x| Range::point(x)).collect();
                let points: Vec<Vec<Range>> = inputs.iter().map(at).collect();
                tolerances(entry, &points, &outputs)
            }
        };
        for parameter in &mut result {
            let slots = entry.program.inputs().iter().zip(&inputs);
            if let Some((_, values)) = slots.into_iter().find(|(s, _)| s.name == parameter.name) {
                parameter.before.extend(values);
            }
            let slots = entry.program.outputs().iter();
            if let Some(position) = slots.into_iter().position(|s| s.name == parameter.name) {
                parameter.after.extend(&outputs[position]);
                parameter.tolerance_single = parameter.tolerance_single.max(tolerances[position]);
            }
        }
    }
    result
}

/// Element `k` of an input from a number between -1 and 1: that number, except that the function of the
/// feet's forces gets knees that are bent and feet on the ground or in the air.
fn element(entry: &FunctionSpec, slot: &str, k: usize, random: f64) -> f64 {
    let has_feet = entry.parameters.iter().any(|p| p.name == "feet");
    match (slot, k % LEG_JOINT_DIM) {
        ("feet", _) => f64::from(u8::from(random > -0.4)),
        ("x", joint) if has_feet && k < JOINT_DIM => {
            let (middle, reach) = [(0.0, 0.4), (0.8, 0.4), (-1.6, 0.5)][joint];
            middle + reach * random
        }
        _ => random,
    }
}

/// Points of the batch that self-tests run.
pub const N_BATCH: usize = 21;

/// Largest accepted difference between a batch and single calls in single precision, both of which
/// may be off, at the points of the self-tests: element `i` of the batch's arrays is
/// `0.01 (i mod 97) - 0.5` for `z`, `0.5 - 0.01 (i mod 89)` for `dz` and `0.01 (i mod 83) - 0.3` for
/// `u_lat`, except for `far_angle` in point 3 of `z1` and in the last but one of `dz1`.
pub fn batch_tolerance(phase: &PhaseInterface, far_angle: f64) -> f64 {
    let program = &phase.dynamics.program;
    let mut interpreter = Interpreter::new(program);
    let mut worst = 0.0_f64;
    for point in 0..N_BATCH {
        let element = |slot: &str, k: usize| {
            let i = k * N_BATCH + point;
            let cycle = |modulus: usize| 0.01 * (i % modulus) as f64;
            match slot {
                "z" if i == 3 => far_angle,
                "dz" if i == N_BATCH - 2 => far_angle,
                "z" => cycle(97) - 0.5,
                "dz" => 0.5 - cycle(89),
                _ => cycle(83) - 0.3,
            }
        };
        let inputs: Vec<Vec<f64>> = program
            .inputs()
            .iter()
            .map(|slot| (0..slot.len).map(|k| element(&slot.name, k)).collect())
            .collect();
        let mut ddz = vec![0.0; phase.dynamics.program.outputs()[0].len];
        let read: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        interpreter.run(&read, &mut [&mut ddz]);
        // Compilers may round these inputs differently.
        let near = |&x: &f64| Range {
            low: x - 1e-7,
            high: x + 1e-7,
        };
        let points: Vec<Vec<Range>> = inputs
            .iter()
            .map(|slot| slot.iter().map(near).collect())
            .collect();
        let at_point = tolerances(&phase.dynamics, &points, &[ddz]);
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
            let unbounded =
                TOLERANCE_UNBOUNDED * values.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            let bounds = bounds.into_iter().map(|bound| bound.unwrap_or(unbounded));
            bounds.fold(0.0, f64::max)
        })
        .collect()
}

/// Numbers between -1 and 1 with three decimals, the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from((self.0 >> 33) as u32 % 2001) / 1000.0 - 1.0
    }
}
