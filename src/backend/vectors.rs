//! Input and output vectors for self-tests of generated code, made by the interpreter.

use super::code::Role;
use super::entries::Entry;
use crate::ir::Interpreter;

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
}

/// The vectors of all parameters of an entry.
pub fn vectors(entry: &Entry) -> Vec<ParameterVectors> {
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
        })
        .collect();
    for _ in 0..N_POINTS {
        let inputs: Vec<Vec<f64>> = entry
            .program
            .inputs()
            .iter()
            .map(|slot| match slot.name.as_str() {
                "h" => vec![0.002],
                _ => (0..slot.len).map(|_| random.next()).collect(),
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
        for parameter in &mut result {
            let slots = entry.program.inputs().iter().zip(&inputs);
            if let Some((_, values)) = slots.into_iter().find(|(s, _)| s.name == parameter.name) {
                parameter.before.extend(values);
            }
            let slots = entry.program.outputs().iter().zip(&outputs);
            if let Some((_, values)) = slots.into_iter().find(|(s, _)| s.name == parameter.name) {
                parameter.after.extend(values);
            }
        }
    }
    result
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
