//! A planned jump as C arrays: what an example of a generated controller jumps.

use nalgebra::DMatrix;

use super::controller_c::numbers::{integers, list, nested};
use crate::files::EmittedFile;
use crate::robot::{ContactFlags, STATE_DIM};

/// Significant digits, beyond those of any sensor.
const DIGITS: usize = 9;

/// A reference of a controller: samples in columns, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedJump {
    /// Time of each sample, s.
    pub time_s: Vec<f64>,
    /// States, 18 x n.
    pub x: DMatrix<f64>,
    /// Velocities, 18 x n.
    pub dx: DMatrix<f64>,
    /// Inputs by the rule of the model, 18 x n.
    pub u: DMatrix<f64>,
    /// Torques of the motors, N m, 12 x n.
    pub torque_nm: DMatrix<f64>,
    /// Feet on the ground.
    pub feet: Vec<ContactFlags>,
}

impl PlannedJump {
    /// `NAME_plan.h` and `NAME_plan.c` below `folder`, C99; `provenance` is their first line.
    pub fn files(&self, folder: &str, name: &str, provenance: &str) -> [EmittedFile; 2] {
        let path = |ending: &str| format!("{folder}/{name}_plan.{ending}");
        [
            EmittedFile::new(path("h"), self.header(name, provenance)),
            EmittedFile::new(path("c"), self.source(name, provenance)),
        ]
    }

    fn header(&self, name: &str, provenance: &str) -> String {
        let upper = name.to_ascii_uppercase();
        let count = self.time_s.len();
        format!(
            "/* {provenance} */\n\
             /* A planned jump: states, velocities and inputs in SI units, one row per sample. */\n\
             #ifndef {upper}_PLAN_H\n#define {upper}_PLAN_H\n\n\
             #include <stdint.h>\n\n\
             #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
             enum {{ {upper}_PLAN_COUNT = {count} }};\n\n\
             extern const double {name}_plan_time_s[{upper}_PLAN_COUNT];\n\
             extern const double {name}_plan_x[{upper}_PLAN_COUNT][{STATE_DIM}];\n\
             extern const double {name}_plan_dx[{upper}_PLAN_COUNT][{STATE_DIM}];\n\
             extern const double {name}_plan_u[{upper}_PLAN_COUNT][{STATE_DIM}];\n\
             extern const uint8_t {name}_plan_feet[{upper}_PLAN_COUNT][4];\n\n\
             #ifdef __cplusplus\n}}\n#endif\n\n#endif\n"
        )
    }

    fn source(&self, name: &str, provenance: &str) -> String {
        let upper = name.to_ascii_uppercase();
        let one = |value: &f64| format!("{value:.*e}", DIGITS - 1);
        let columns = |rows: &DMatrix<f64>| {
            let columns = rows.column_iter();
            nested(columns.map(|column| list(column.iter().map(one))))
        };
        let feet = self.feet.iter().map(|feet| integers(feet.map(i64::from)));
        let states = format!("[{STATE_DIM}]");
        let arrays = [
            ("double", "time_s", "", list(self.time_s.iter().map(one))),
            ("double", "x", &states, columns(&self.x)),
            ("double", "dx", &states, columns(&self.dx)),
            ("double", "u", &states, columns(&self.u)),
            ("uint8_t", "feet", "[4]", nested(feet)),
        ];
        let arrays = arrays.map(|(kind, of, width, values)| {
            format!("\nconst {kind} {name}_plan_{of}[{upper}_PLAN_COUNT]{width} = {values};\n")
        });
        format!(
            "/* {provenance} */\n#include \"{name}_plan.h\"\n{}",
            arrays.concat()
        )
    }
}
