//! Steps of romc's own controller that the one in C has to repeat.

use super::source::integers;
use super::*;
use crate::mpc::{
    Bounds, Command, Lift, Linearisation, Measurement, MissingInput, ReferenceSamples, Solver,
};

/// Most steps of each run of the self-test: the shipped jump to its end, where the horizon is at rest.
const STEPS: usize = 200;
/// How far measurements are pushed off the jump, times -2 to 2: height (m), pitch (rad), vertical velocity (m/s).
pub(super) const PUSH: [f64; 3] = [0.05, 0.15, 0.9];
/// Largest difference of a torque, N m, by precision.
const TOLERANCE_NM: [f64; 2] = [1e-6, 0.1];
/// Steps of a run that may have another status, by precision: single precision moves a plan's residuals past bounds.
const OTHER_STATUSES: [usize; 2] = [0, 3];

#[derive(Template)]
#[template(
    path = "controller_c/selftest.askama",
    config = "templates/askama.toml"
)]
struct SelfTest<'a> {
    facts: &'a Facts<'a>,
    steps: usize,
    horizon: usize,
    torques: String,
    statuses: String,
    tolerance: f64,
    others: usize,
}

extends! { <'a> SelfTest<'a>: Facts<'a>, facts }

pub(super) fn text(
    facts: &Facts<'_>,
    model: &ReducedModel,
    jump: &PlannedJump,
    precision: Precision,
) -> Result<String, EmitError> {
    let transpose = MpcSettings {
        solver: Solver::Riccati,
        missing_input: match facts.has_given_state {
            true => MissingInput::Estimate,
            false => MissingInput::Mean,
        },
        lift: Lift::Transpose,
        linearisation: Linearisation::Reference,
        bounds: Bounds::OFF,
        ..jump.settings
    };
    let supervised = MpcSettings {
        bounds: jump.settings.bounds,
        ..transpose
    };
    let consistent = MpcSettings {
        lift: Lift::Consistent,
        ..transpose
    };
    let about_plan = MpcSettings {
        linearisation: Linearisation::LastPlan,
        ..transpose
    };
    let runs = [
        commands(model, jump, transpose, true)?,
        commands(model, jump, consistent, true)?,
        commands(model, jump, about_plan, false)?,
        commands(model, jump, supervised, true)?,
    ];
    let torques = runs.each_ref().map(|commands| {
        Numbers(Precision::Double).matrix(commands.iter().map(|command| command.torque_nm))
    });
    let statuses = runs.each_ref().map(|commands| {
        let codes = commands.iter().map(|command| command.status.code());
        integers(codes.map(i64::from))
    });
    let place = usize::from(precision == Precision::Single);
    let text = SelfTest {
        facts,
        steps: runs[0].len(),
        horizon: jump.settings.horizon,
        torques: nested(torques),
        statuses: nested(statuses),
        tolerance: TOLERANCE_NM[place],
        others: OTHER_STATUSES[place],
    };
    Ok(text.render()?)
}

fn commands(
    model: &ReducedModel,
    jump: &PlannedJump,
    settings: MpcSettings,
    knows_torques: bool,
) -> Result<Vec<Command>, EmitError> {
    let mut controller = crate::mpc::controller(model, settings)?;
    let u = inputs(controller.plant().input_rule(), jump)?;
    let reference = ReferenceSamples {
        time_s: &jump.time_s,
        x: jump.x.as_slice(),
        dx: jump.dx.as_slice(),
        u: knows_torques.then_some(&u[..]),
        feet: &jump.feet,
    };
    (controller.set_reference(reference)).map_err(MpcError::from)?;
    let steps = STEPS.min(jump.time_s.len());
    Ok((0..steps)
        .map(|k| {
            let [mut x, mut dx] = [&jump.x, &jump.dx].map(|rows| rows.column(k).into_owned());
            let push = (k / 8 % 5) as f64 - 2.0;
            x[14] += PUSH[0] * push;
            x[16] += PUSH[1] * push;
            dx[14] += PUSH[2] * push;
            controller.step(Measurement {
                time_s: jump.time_s[k],
                x: x.as_slice(),
                dx: dx.as_slice(),
                feet: jump.feet[k],
            })
        })
        .collect())
}

/// Inputs of all samples as `set_reference_torque` makes them; motor accelerations by differences of both neighbours.
fn inputs(rule: &InputRule, jump: &PlannedJump) -> Result<Vec<f64>, EmitError> {
    let mut u = Vec::with_capacity(jump.time_s.len() * STATE_DIM);
    for k in 0..jump.time_s.len() {
        let torque = jump.torque_nm.column(k);
        let x: [f64; STATE_DIM] = std::array::from_fn(|i| jump.x[(i, k)]);
        let dx = std::array::from_fn(|i| jump.dx[(i, k)]);
        let (before, after) = (k.saturating_sub(1), (k + 1).min(jump.time_s.len() - 1));
        let passed_s = jump.time_s[after] - jump.time_s[before];
        let ddx = std::array::from_fn(|i| (jump.dx[(i, after)] - jump.dx[(i, before)]) / passed_s);
        let losses = rule.losses([&x, &dx, &ddx], jump.feet[k]);
        let limits = rule.robot().torque_limit_nm();
        let within = |joint: usize| torque[joint].clamp(-limits[joint], limits[joint]);
        let net: [f64; JOINT_DIM] = std::array::from_fn(|joint| within(joint) - losses[joint]);
        let wrench = rule.input_wrench(&x, &net, jump.feet[k])?;
        u.extend(net);
        u.extend(wrench.iter());
    }
    Ok(u)
}
