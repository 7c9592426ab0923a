//! A recorded jump as constant arrays, for the example and the self-test.

use nalgebra::DMatrix;

use super::Facts;
use super::numbers::{Numbers, integers, nested};
use crate::codegen::Precision;
use crate::deploy::EmitError;
use crate::recording::{self, Segment};
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, STATE_DIM};

/// A jump of a simulated go1 that no shipped model was trained on.
const SHIPPED: &[u8] = include_bytes!("../../../examples/recordings/go1/test_01.csv.gz");
/// Samples of the recording per sample here.
const STRIDE: usize = 5;

/// Samples of a jump.
#[derive(Debug)]
pub(super) struct Jump {
    pub time_s: Vec<f64>,
    pub x: Vec<Vec<f64>>,
    pub dx: Vec<Vec<f64>>,
    pub torque_nm: Vec<[f64; JOINT_DIM]>,
    pub feet: Vec<ContactFlags>,
}

impl Jump {
    /// The shipped jump, every fifth sample.
    ///
    /// # Errors
    /// [`EmitError::Jump`] if it cannot be read.
    pub(super) fn shipped() -> Result<Self, EmitError> {
        let recording = recording::read_from_bytes("test_01.csv.gz", SHIPPED)?;
        let segment: &Segment = &recording.segments[0];
        let samples = || (0..segment.len()).step_by(STRIDE);
        let columns = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            let column = |k| matrix.column(k).iter().copied().collect();
            samples().map(column).collect()
        };
        Ok(Self {
            time_s: samples()
                .map(|k| segment.time_s[k] - segment.time_s[0])
                .collect(),
            x: columns(&segment.x),
            dx: columns(&segment.dx),
            torque_nm: samples().map(|k| segment.torque(k)).collect(),
            feet: samples().map(|k| segment.feet[k]).collect(),
        })
    }

    /// `NAME_jump.h`.
    pub(super) fn header(&self, facts: &Facts<'_>, precision: Precision) -> String {
        let (count, real, upper) = (self.time_s.len(), facts.real, &facts.upper);
        let numbers = Numbers(precision);
        let times = Numbers(Precision::Double).vector(self.time_s.iter().copied());
        let states = [("X", &self.x), ("DX", &self.dx)].map(|(name, rows)| {
            let rows = numbers.matrix(rows.iter().cloned());
            format!("static const {real} JUMP_{name}[{count}][{STATE_DIM}] = {rows};\n")
        });
        let torques = numbers.matrix(self.torque_nm.iter().copied());
        let feet = self.feet.iter().map(|feet| integers(feet.map(i64::from)));
        format!(
            "{}\n/* A jump of a simulated go1: times, states, velocities, motor torques and feet of {count} samples. */\n\
             #ifndef {upper}_JUMP_H\n#define {upper}_JUMP_H\n\n#include <stdint.h>\n\n\
             static const double JUMP_TIME_S[{count}] = {times};\n{}\
             static const {real} JUMP_TORQUE[{count}][{JOINT_DIM}] = {torques};\n\
             static const uint8_t JUMP_FEET[{count}][{FOOT_DIM}] = {};\n\n#endif\n",
            facts.banner,
            states.concat(),
            nested(feet),
        )
    }
}
