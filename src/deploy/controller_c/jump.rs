//! A recorded jump as constant arrays, for the example and the self-test.

use nalgebra::DMatrix;

use super::Facts;
use super::numbers::{Numbers, integers, nested};
use crate::codegen::Precision;
use crate::deploy::{EmitError, PlannedJump};
use crate::model::ReducedModel;
use crate::recording;
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, STATE_DIM};

/// A jump of a simulated go1 that no shipped model was trained on.
const SHIPPED: &[u8] = include_bytes!("../../../examples/recordings/go1/test_01.csv.gz");
/// Distance of samples, s, where the recording's are denser.
const STEP_S: f64 = 0.01;

/// Samples of a jump.
#[derive(Debug)]
pub(super) struct Jump {
    /// What it is, in words.
    what: &'static str,
    pub time_s: Vec<f64>,
    pub x: Vec<Vec<f64>>,
    pub dx: Vec<Vec<f64>>,
    pub torque_nm: Vec<[f64; JOINT_DIM]>,
    pub feet: Vec<ContactFlags>,
}

impl Jump {
    /// The shipped jump.
    ///
    /// # Errors
    /// [`EmitError::Jump`] if it cannot be read.
    pub(super) fn shipped() -> Result<Self, EmitError> {
        let mut recording = recording::read_from_bytes("test_01.csv.gz", SHIPPED)?;
        let segment = recording.segments.swap_remove(0);
        let (x, dx, torque) = (&segment.x, &segment.dx, &segment.torque_nm);
        let (what, time_s) = ("A jump of a simulated go1", &segment.time_s);
        Ok(Self::of(what, time_s, [x, dx, torque], &segment.feet))
    }

    /// A jump of one's own.
    pub(super) fn planned(plan: &PlannedJump) -> Self {
        let rows = [&plan.x, &plan.dx, &plan.torque_nm];
        Self::of("A jump of one's own", &plan.time_s, rows, &plan.feet)
    }

    /// Every so many samples of states, velocities and torques, and the last.
    fn of(
        what: &'static str,
        time_s: &[f64],
        [x, dx, torque_nm]: [&DMatrix<f64>; 3],
        feet: &[ContactFlags],
    ) -> Self {
        let (start, end) = (time_s[0], time_s[time_s.len() - 1]);
        let mean_step_s = (end - start) / (time_s.len().max(2) - 1) as f64;
        let stride = (STEP_S / mean_step_s).round().max(1.0) as usize;
        let last = time_s.len() - 1;
        let samples = || (0..last).step_by(stride).chain([last]);
        let columns = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            let column = |k| matrix.column(k).iter().copied().collect();
            samples().map(column).collect()
        };
        Self {
            what,
            time_s: samples().map(|k| time_s[k] - start).collect(),
            x: columns(x),
            dx: columns(dx),
            torque_nm: samples()
                .map(|k| std::array::from_fn(|joint| torque_nm[(joint, k)]))
                .collect(),
            feet: samples().map(|k| feet[k]).collect(),
        }
    }

    /// Of the jump the longest part for which a model has phases; all of it where there is no such part, which the
    /// controller then refuses.
    pub(super) fn within(mut self, model: &ReducedModel) -> Self {
        let all: Vec<usize> = (0..self.time_s.len()).collect();
        let parts = all.split(|&k| model.phase_for(self.feet[k]).is_none());
        let part = parts.max_by_key(|part| part.len()).unwrap_or(&[]);
        if let [first, .., last] = *part {
            let part = first..=last;
            let from_start = |time: &f64| time - self.time_s[first];
            self.time_s = self.time_s[part.clone()].iter().map(from_start).collect();
            self.x = self.x[part.clone()].to_vec();
            self.dx = self.dx[part.clone()].to_vec();
            self.torque_nm = self.torque_nm[part.clone()].to_vec();
            self.feet = self.feet[part].to_vec();
        }
        self
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
            "{}\n/* {}: times, states, velocities, motor torques and feet of {count} samples. */\n\
             #ifndef {upper}_JUMP_H\n#define {upper}_JUMP_H\n\n#include <stdint.h>\n\n\
             static const double JUMP_TIME_S[{count}] = {times};\n{}\
             static const {real} JUMP_TORQUE[{count}][{JOINT_DIM}] = {torques};\n\
             static const uint8_t JUMP_FEET[{count}][{FOOT_DIM}] = {};\n\n#endif\n",
            facts.banner,
            self.what,
            states.concat(),
            nested(feet),
        )
    }
}
