//! A jump, planned or recorded, as C arrays for examples and self-tests of generated controllers.

use super::controller_c::source::{Numbers, integers, list, nested};
use super::*;

/// A jump of a simulated go1 that no shipped model was trained on.
const SHIPPED: &[u8] = include_bytes!("../../examples/recordings/go1/test_01.csv.gz");
/// Distance of samples, s, where those of a jump are denser.
const STEP_S: f64 = 0.01;

/// Significant digits, beyond those of any sensor.
const DIGITS: usize = 9;

/// A reference of a controller: samples in columns, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedJump {
    pub time_s: Vec<f64>,
    /// States, 18 x n.
    pub x: DMatrix<f64>,
    /// Velocities, 18 x n.
    pub dx: DMatrix<f64>,
    /// Inputs by the rule of the model, 18 x n; zeros of a recorded jump.
    pub u: DMatrix<f64>,
    /// Torques of the motors, N m, 12 x n.
    pub torque_nm: DMatrix<f64>,
    pub feet: Vec<ContactFlags>,
    /// Of the controller that follows it: the defaults of generated code.
    pub settings: MpcSettings,
}

impl PlannedJump {
    pub(super) fn shipped() -> Result<Self, EmitError> {
        let mut recording = recording::read_from_bytes("test_01.csv.gz", SHIPPED)?;
        let segment = recording.segments.swap_remove(0);
        Ok(Self {
            u: DMatrix::zeros(STATE_DIM, segment.x.ncols()),
            time_s: segment.time_s,
            x: segment.x,
            dx: segment.dx,
            torque_nm: segment.torque_nm,
            feet: segment.feet,
            settings: MpcSettings::default(),
        })
    }

    /// Some of the samples, with times from the first of them on.
    fn select(&self, samples: &[usize]) -> Self {
        let start_s = self.time_s[samples[0]];
        Self {
            time_s: samples.iter().map(|&k| self.time_s[k] - start_s).collect(),
            x: self.x.select_columns(samples),
            dx: self.dx.select_columns(samples),
            u: self.u.select_columns(samples),
            torque_nm: self.torque_nm.select_columns(samples),
            feet: samples.iter().map(|&k| self.feet[k]).collect(),
            settings: self.settings,
        }
    }

    /// Every so many samples, and the last.
    pub(super) fn thinned(&self) -> Self {
        let last = self.time_s.len() - 1;
        let mean_step_s = (self.time_s[last] - self.time_s[0]) / last.max(1) as f64;
        let stride = (STEP_S / mean_step_s).round().max(1.0) as usize;
        let samples: Vec<usize> = (0..last).step_by(stride).chain([last]).collect();
        self.select(&samples)
    }

    /// The longest part for which a model has phases; all of it if there is none, which the controller then refuses.
    pub(super) fn within(self, model: &ReducedModel) -> Self {
        let all: Vec<usize> = (0..self.time_s.len()).collect();
        let parts = all.split(|&k| model.phase_for(self.feet[k]).is_none());
        match parts.max_by_key(|part| part.len()) {
            Some(part @ [_, _, ..]) => self.select(part),
            _ => self,
        }
    }

    /// Path and text of `NAME_jump.h`; `what` describes the jump in words.
    pub(super) fn constants(
        &self,
        what: &str,
        name: &str,
        provenance: &str,
        precision: Precision,
    ) -> (String, String) {
        let upper = name.to_ascii_uppercase();
        let count = self.time_s.len();
        let real = match precision {
            Precision::Double => "double",
            Precision::Single => "float",
        };
        let times = Numbers(Precision::Double).vector(&self.time_s);
        let columns = |name: &str, rows: usize, matrix: &DMatrix<f64>| {
            let columns = (0..count).map(|k| matrix.column(k).iter().copied().collect::<Vec<_>>());
            let values = Numbers(precision).matrix(columns);
            format!("static const {real} JUMP_{name}[{count}][{rows}] = {values};\n")
        };
        let text = format!(
            "/* {provenance} */\n\
             /* {what}: times, states, velocities, motor torques and feet of {count} samples. */\n\
             #ifndef {upper}_JUMP_H\n#define {upper}_JUMP_H\n\n#include <stdint.h>\n\n\
             static const double JUMP_TIME_S[{count}] = {times};\n{}{}{}\
             static const uint8_t JUMP_FEET[{count}][{FOOT_DIM}] = {};\n\n#endif\n",
            columns("X", STATE_DIM, &self.x),
            columns("DX", STATE_DIM, &self.dx),
            columns("TORQUE", JOINT_DIM, &self.torque_nm),
            self.feet_in_c(),
        );
        (format!("{name}_jump.h"), tidy(&text))
    }

    fn feet_in_c(&self) -> String {
        nested(self.feet.iter().map(|feet| integers(feet.map(i64::from))))
    }

    /// `NAME_plan.h` and `NAME_plan.c` below `folder`, C99; `provenance` is their first line.
    pub(crate) fn files(&self, folder: &str, name: &str, provenance: &str) -> [EmittedFile; 2] {
        let upper = name.to_ascii_uppercase();
        let one = |value: &f64| format!("{value:.*e}", DIGITS - 1);
        let columns = |rows: &DMatrix<f64>| {
            let columns = rows.column_iter();
            nested(columns.map(|column| list(column.iter().map(one))))
        };
        let states = format!("[{STATE_DIM}]");
        let arrays = [
            ("double", "time_s", "", list(self.time_s.iter().map(one))),
            ("double", "x", &states, columns(&self.x)),
            ("double", "dx", &states, columns(&self.dx)),
            ("double", "u", &states, columns(&self.u)),
            ("uint8_t", "feet", "[4]", self.feet_in_c()),
        ];
        let (mut declared, mut defined) = (String::new(), String::new());
        for (kind, of, width, values) in arrays {
            let array = format!("const {kind} {name}_plan_{of}[{upper}_PLAN_COUNT]{width}");
            declared += &format!("extern {array};\n");
            defined += &format!("\n{array} = {values};\n");
        }
        let header = format!(
            "/* {provenance} */\n\
             /* A planned jump: states, velocities and inputs in SI units, one row per sample. */\n\
             #ifndef {upper}_PLAN_H\n#define {upper}_PLAN_H\n\n\
             #include <stdint.h>\n\n\
             #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
             enum {{ {upper}_PLAN_COUNT = {} }};\n\n{declared}\n\
             #ifdef __cplusplus\n}}\n#endif\n\n#endif\n",
            self.time_s.len(),
        );
        let source = format!("/* {provenance} */\n#include \"{name}_plan.h\"\n{defined}");
        [("h", header), ("c", source)]
            .map(|(ending, text)| EmittedFile::new(format!("{folder}/{name}_plan.{ending}"), text))
    }
}
