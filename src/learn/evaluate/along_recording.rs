//! The controller along a recording, which is its reference: each command at a measured state is compared with the
//! recorded one. Not a closed loop: the robot does not feel the commands.

use std::collections::BTreeMap;
use std::time::Instant;

use super::control_metrics::Tally;
use super::coordinates::exceeds;
use super::*;
use crate::mpc::problem::to_upright;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum ReferenceInput {
    /// Projection of the recorded torques and forces
    Recorded,
    /// No input; the controller computes its own
    None,
}

#[derive(Debug, Clone, PartialEq)]
pub struct StepRow {
    pub segment: usize,
    pub time_s: f64,
    pub command: Command,
    /// In SI units: `W_eᵀ u_lat`, or with the consistent lift the torques at the links and their force.
    pub input: [f64; STATE_DIM],
    pub recorded_torque_nm: [f64; JOINT_DIM],
    pub z_reference: Vec<f64>,
    pub z: Vec<f64>,
    /// Latent position that the step's own plan expects at the end of its horizon.
    pub z_planned: Option<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub rows: Vec<StepRow>,
    pub summary: Summary,
    pub metrics: Option<ControlMetrics>,
}

impl Run {
    /// Why nothing was controlled, if so: most steps have no plan of their own.
    pub fn failure(&self) -> Option<String> {
        let Summary { steps, failed, .. } = self.summary;
        if steps > 0 && 2 * failed <= steps {
            return None;
        }
        let mut statuses: BTreeMap<&str, usize> = BTreeMap::new();
        let of_steps = self.rows.iter().map(|row| row.command.status);
        for status in of_steps.filter(|status| !status.has_plan()) {
            *statuses.entry(status.word()).or_default() += 1;
        }
        let statuses = (statuses.iter()).map(|(word, count)| format!("{word} {count}"));
        let statuses: Vec<String> = statuses.collect();
        Some(format!(
            "{failed} of {steps} control steps have no plan of their own ({})",
            statuses.join(", ")
        ))
    }
}

/// Torques beyond twice the robot's limits are counted, not compared. `progress(done, total)` is called once per step.
/// # Errors
/// Those of [`Controller::set_reference`], [`MpcError::Step`], [`MpcError::NoStep`] for segments that are all shorter
/// than one step, [`MpcError::Recording`].
pub fn along_recording(
    controller: &mut Controller,
    recording: &Recording,
    reference_input: ReferenceInput,
    mut progress: impl FnMut(usize, usize),
) -> Result<Run, MpcError> {
    let step_s = controller.settings().step_s;
    for segment in recording.segments.iter().filter(|s| s.len() >= 2) {
        let recorded_s = segment.mean_step_s();
        if step_s < STEP_SLACK * recorded_s {
            return Err(MpcError::Step {
                path: recording.path.clone(),
                found_s: step_s,
                recorded_s,
            });
        }
    }
    let segments = recording.segments.iter();
    let schedules: Vec<Vec<usize>> = (segments.clone())
        .map(|segment| control_samples(&segment.time_s, step_s))
        .collect();
    let total = schedules.iter().map(Vec::len).sum();
    if total == 0 {
        let durations = segments.map(Segment::duration_s);
        return Err(MpcError::NoStep {
            path: recording.path.clone(),
            found_s: step_s,
            longest_s: durations.fold(0.0, f64::max),
        });
    }
    let mut rows = Vec::with_capacity(total);
    let mut tally = Tally::default();
    for (number, (segment, schedule)) in recording.segments.iter().zip(&schedules).enumerate() {
        if segment.len() < 2 {
            continue;
        }
        set_reference(controller, segment, reference_input)?;
        controller.reset(); // a fault along one segment does not end the next
        for &sample in schedule {
            let started = Instant::now();
            controller.prepare(segment.time_s[sample]);
            (tally.preparations_us).push(started.elapsed().as_secs_f64() * 1e6);
            rows.push(one_step(controller, segment, number, sample, &mut tally));
            progress(rows.len(), total);
        }
    }
    tally.lift = lift_comparison(controller, recording)?;
    Ok(Run {
        summary: tally.summary(),
        rows,
        metrics: None,
    })
}

/// Lifted torques of exactly projected recorded inputs, at every sample: the error of the lift alone.
fn lift_comparison(
    controller: &mut Controller,
    recording: &Recording,
) -> Result<Comparison, MpcError> {
    let mut comparison = Comparison::default();
    let mut u_lat = vec![0.0; controller.plant().latent_dim()];
    for segment in &recording.segments {
        let input = segment.input(controller.plant().input_rule())?;
        let losses = segment.losses(controller.plant().input_rule());
        for (sample, u) in input.as_slice().chunks_exact(STATE_DIM).enumerate() {
            let recorded = segment.torque(sample);
            if !is_plausible(controller.plant().robot(), &recorded) {
                continue;
            }
            let x = segment.x.column(sample);
            controller.stand_at(x.as_slice());
            (controller.local_plant()).project(x.as_slice(), u, &mut u_lat);
            let Some(mut stance) = stance(controller, segment, sample) else {
                continue;
            };
            let losses = std::array::from_fn(|joint| losses[(joint, sample)]);
            stance.losses_nm = controller.plant().clamp_torque(losses);
            if let Ok(torque) = controller.lift(&u_lat, &stance) {
                comparison.add(segment.feet[sample], &torque, &recorded);
            }
        }
    }
    Ok(comparison)
}

/// First samples at or after each multiple of the period whose whole hold lies within the recording.
pub(super) fn control_samples(time_s: &[f64], step_s: f64) -> Vec<usize> {
    let mut samples = Vec::new();
    let (Some(&first), Some(&last)) = (time_s.first(), time_s.last()) else {
        return samples;
    };
    let mut sample = 0;
    for step in 0.. {
        let due = first + step as f64 * step_s;
        if due + step_s > last + 1e-9 {
            return samples;
        }
        while time_s[sample] < due - 1e-9 {
            sample += 1;
        }
        samples.push(sample);
    }
    samples
}

fn one_step(
    controller: &mut Controller,
    segment: &Segment,
    number: usize,
    sample: usize,
    tally: &mut Tally,
) -> StepRow {
    let (time_s, feet) = (segment.time_s[sample], segment.feet[sample]);
    let (x, dx) = (segment.x.column(sample), segment.dx.column(sample));
    let command = controller.step(Measurement {
        time_s,
        x: x.as_slice(),
        dx: dx.as_slice(),
        feet,
    });
    let recorded = held_torque(segment, sample, controller.settings().step_s);
    let d = controller.plant().latent_dim();
    let mut z = vec![0.0; d];
    controller.plant().encode(x.as_slice(), &mut z);
    let mut reference = vec![0.0; 2 * d];
    if let Some(trajectory) = controller.reference() {
        trajectory.state_at(time_s, &mut reference);
    }
    tally.count(&command);
    match recorded {
        Some(recorded) if is_plausible(controller.plant().robot(), &recorded) => {
            tally.torque.add(feet, &command.torque_nm, &recorded);
        }
        Some(_) | None => tally.summary.implausible += 1,
    }
    let limits = controller.plant().robot().torque_limit_nm();
    tally.summary.limit_violations += usize::from(exceeds(&command.torque_nm, limits, 1.0));
    if command.status.has_plan() {
        let planned = controller.planned_deviations();
        planned.for_each(|deviation| tally.tracking.add(deviation * deviation));
    }
    let stance = stance(controller, segment, sample);
    if let Some(violated) = friction_violated(controller, &command, stance.as_ref()) {
        *tally.summary.friction_violations.get_or_insert(0) += usize::from(violated);
    }
    StepRow {
        segment: number,
        time_s,
        input: lifted_input(controller, &command, segment, sample),
        recorded_torque_nm: recorded.unwrap_or([0.0; JOINT_DIM]),
        z_reference: reference[..d].to_vec(),
        z,
        z_planned: (command.status.has_plan())
            .then(|| controller.plan().end(controller.settings().horizon - 1)[..d].to_vec()),
        command,
    }
}

pub(super) fn set_reference(
    controller: &mut Controller,
    segment: &Segment,
    reference_input: ReferenceInput,
) -> Result<(), MpcError> {
    let input = segment.input(controller.plant().input_rule())?;
    controller.set_reference(ReferenceSamples {
        time_s: &segment.time_s,
        x: segment.x.as_slice(),
        dx: segment.dx.as_slice(),
        u: match reference_input {
            ReferenceInput::Recorded => Some(input.as_slice()),
            ReferenceInput::None => None,
        },
        feet: &segment.feet,
    })?;
    Ok(())
}

fn held_torque(segment: &Segment, sample: usize, step_s: f64) -> Option<[f64; JOINT_DIM]> {
    let until = segment.time_s[sample] + step_s - 1e-9;
    let held = segment.time_s[sample..].iter();
    let count = held.take_while(|&&time_s| time_s < until).count();
    let mut mean = [0.0; JOINT_DIM];
    for held in sample..sample + count {
        for (mean, torque) in mean.iter_mut().zip(segment.torque(held)) {
            *mean += torque / count as f64;
        }
    }
    mean.iter().all(|torque| torque.is_finite()).then_some(mean)
}

fn stance(controller: &Controller, segment: &Segment, sample: usize) -> Option<StanceState> {
    let feet = segment.feet[sample];
    let phase = controller.plant().phase_for(feet)?;
    Some(StanceState::at(&segment.state(sample), feet, phase))
}

fn lifted_input(
    controller: &Controller,
    command: &Command,
    segment: &Segment,
    sample: usize,
) -> [f64; STATE_DIM] {
    let mut input = controller.local_plant().lift(&command.u_lat);
    if controller.settings().lift == Lift::Consistent {
        let net = command.net_torque_nm();
        input[..JOINT_DIM].copy_from_slice(&net);
        let rule = controller.plant().input_rule();
        if let Ok(wrench) = rule.input_wrench(&segment.state(sample), &net, segment.feet[sample]) {
            input[JOINT_DIM..].copy_from_slice(wrench.as_slice());
        }
    }
    input
}

/// Whether a command leaves its friction cone by more than a thousandth of the weight; none where it has none.
fn friction_violated(
    controller: &Controller,
    command: &Command,
    stance: Option<&StanceState>,
) -> Option<bool> {
    let stance = stance.filter(|stance| stance.feet.contains(&true))?;
    let (plant, settings) = (controller.plant(), controller.settings());
    let tolerance_n = 1e-3 * plant.robot().mass_kg() * GRAVITY_M_S2;
    match settings.lift {
        Lift::Consistent => {
            let forces = foot_forces(plant, stance)?;
            let net = command.net_torque_nm();
            Some(forces.iter().zip(net.chunks(3)).any(|(force, torque)| {
                force.is_some_and(|map| {
                    let force = map * nalgebra::Vector3::from_column_slice(torque);
                    force.x.hypot(force.y) > settings.foot_friction * force.z + tolerance_n
                })
            }))
        }
        Lift::Transpose => {
            let coefficient = settings.body_friction?;
            let lifted = controller.local_plant().lift(&command.u_lat);
            let [roll, pitch, _] = stance.attitude_rad;
            let frame = plant.input_rule().wrench_frame();
            let rotation = to_upright(frame, [roll, pitch]);
            let force =
                rotation.map(|row| (0..3).map(|k| row[k] * lifted[JOINT_DIM + k]).sum::<f64>());
            Some(force[0].hypot(force[1]) > coefficient * force[2] + tolerance_n)
        }
    }
}
