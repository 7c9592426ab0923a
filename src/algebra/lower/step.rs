//! One step of the classical Runge-Kutta method, with the input held.

use super::cost::Form;
use super::dynamics::dynamics;
use super::error::LowerError;
use crate::equations::Equations;
use crate::ir::{Program, ProgramBuilder, ValueId};

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
    let z = builder.input("z", d);
    let dz = builder.input("dz", d);
    let u_lat = builder.input("u_lat", d);
    let h = builder.input("h", 1)[0];
    let (half, sixth) = (builder.constant(0.5), builder.constant(6.0));
    let half_step = builder.mul(half, h);
    let sixth_step = builder.div(h, sixth);

    let mut velocities = vec![dz.clone()];
    let mut slopes: Vec<Vec<ValueId>> = Vec::new();
    let mut at = z.clone();
    for stage in 0..4 {
        let arguments = [at.as_slice(), &velocities[stage], &u_lat].concat();
        slopes.push(builder.call(&accelerations, &arguments).remove(0));
        if stage < 3 {
            let length = if stage == 2 { h } else { half_step };
            at = advance(&mut builder, &z, length, &velocities[stage]);
            let velocity = advance(&mut builder, &dz, length, &slopes[stage]);
            velocities.push(velocity);
        }
    }
    let z_next = weighted(&mut builder, &z, sixth_step, &velocities);
    let dz_next = weighted(&mut builder, &dz, sixth_step, &slopes);
    builder.output("z", &z_next);
    builder.output("dz", &dz_next);
    Ok(builder.finish()?)
}

/// `start + length * slope`.
fn advance(
    builder: &mut ProgramBuilder,
    start: &[ValueId],
    length: ValueId,
    slope: &[ValueId],
) -> Vec<ValueId> {
    start
        .iter()
        .zip(slope)
        .map(|(&start, &slope)| {
            let change = builder.mul(length, slope);
            builder.add(start, change)
        })
        .collect()
}

/// `start + sixth_step * ((s_1 + s_4) + 2 (s_2 + s_3))`.
fn weighted(
    builder: &mut ProgramBuilder,
    start: &[ValueId],
    sixth_step: ValueId,
    stages: &[Vec<ValueId>],
) -> Vec<ValueId> {
    let two = builder.constant(2.0);
    let mut sum = |a: &[ValueId], b: &[ValueId]| -> Vec<ValueId> {
        let pairs = a.iter().zip(b);
        pairs.map(|(&a, &b)| builder.add(a, b)).collect()
    };
    let outer = sum(&stages[0], &stages[3]);
    let inner = sum(&stages[1], &stages[2]);
    let mean: Vec<ValueId> = outer
        .into_iter()
        .zip(inner)
        .map(|(outer, inner)| {
            let inner = builder.mul(two, inner);
            builder.add(outer, inner)
        })
        .collect();
    advance(builder, start, sixth_step, &mean)
}
