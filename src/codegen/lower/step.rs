//! One step of the classical Runge-Kutta method, with the input held.

use super::cost::Form;
use super::dynamics::dynamics;
use super::error::LowerError;
use super::number::{Number, Sheet, ids, numbers};
use crate::equations::Equations;
use crate::ir::{Program, ProgramBuilder};

/// The program of one fourth-order Runge-Kutta step of `d/dt (z, dz) = (dz, ddz)` over
/// `h` seconds with constant `u_lat`: inputs `z`, `dz`, `u_lat`, `h`; outputs `z`, `dz`
/// after the step. It calls the program of the accelerations four times.
///
/// # Errors
/// As [`dynamics`].
pub fn rk4_step(system: &Equations<'_>, phase: usize, form: Form) -> Result<Program, LowerError> {
    let accelerations = dynamics(system, phase, form)?;
    let d = system.latent_dim();
    let mut builder = ProgramBuilder::new("step");
    let inputs = ["z", "dz", "u_lat"].map(|name| builder.input(name, d));
    let h = builder.input("h", 1)[0];
    let sheet = &Sheet::new(&mut builder);
    let [z, dz, u_lat] = inputs.map(|ids| numbers(sheet, &ids));
    let h = Number::new(sheet, h);
    let (half_step, sixth_step) = (0.5 * h, h / 6.0);

    let mut velocities = vec![dz.clone()];
    let mut slopes: Vec<Vec<Number>> = Vec::new();
    let mut at = z.clone();
    for stage in 0..4 {
        let arguments = ids(&[at.as_slice(), &velocities[stage], &u_lat].concat());
        let ddz = sheet
            .borrow_mut()
            .call(&accelerations, &arguments)
            .remove(0);
        slopes.push(numbers(sheet, &ddz));
        if stage < 3 {
            let length = if stage == 2 { h } else { half_step };
            at = advance(&z, length, &velocities[stage]);
            velocities.push(advance(&dz, length, &slopes[stage]));
        }
    }
    let z_next = ids(&weighted(&z, sixth_step, &velocities));
    let dz_next = ids(&weighted(&dz, sixth_step, &slopes));
    builder.output("z", &z_next);
    builder.output("dz", &dz_next);
    Ok(builder.finish()?)
}

/// `start + length * slope`.
fn advance<'b>(start: &[Number<'b>], length: Number<'b>, slope: &[Number<'b>]) -> Vec<Number<'b>> {
    let pairs = start.iter().zip(slope);
    pairs
        .map(|(&start, &slope)| start + length * slope)
        .collect()
}

/// `start + sixth_step * ((s_1 + s_4) + 2 (s_2 + s_3))`.
fn weighted<'b>(
    start: &[Number<'b>],
    sixth_step: Number<'b>,
    stages: &[Vec<Number<'b>>],
) -> Vec<Number<'b>> {
    let sum = |a: &[Number<'b>], b: &[Number<'b>]| -> Vec<Number<'b>> {
        a.iter().zip(b).map(|(&a, &b)| a + b).collect()
    };
    let outer = sum(&stages[0], &stages[3]);
    let inner = sum(&stages[1], &stages[2]);
    let pairs = outer.into_iter().zip(inner);
    let mean: Vec<Number> = pairs.map(|(outer, inner)| outer + 2.0 * inner).collect();
    advance(start, sixth_step, &mean)
}
