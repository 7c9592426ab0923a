//! A plan as a recording, and its margins between the nodes. Velocities and inputs are linear there, positions their
//! integral. Torques are the lifted input plus the losses of the same motion.

use super::costs::moved_foot;
use super::transcribe::NodeValues;
use super::*;

const SOURCE: &str = "plan";

#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Margins {
    pub torque_share: f64,
    pub beyond_joint_limit_rad: f64, // largest over the joints, negative inside
    pub beyond_friction_n: f64,
    /// Displacement at the nodes beyond that in the prior, along and above the floor, m.
    pub foot_slip_m: [f64; 2],
    /// Displacement of a foot on the ground from its touchdown, along the floor, and below its height at the start, m.
    pub foot_drift_m: [f64; 2],
}

/// Samples at equal distances, as close to `sample_time_s` apart as a whole number of steps allows.
pub(crate) fn motion(task: &Task<'_>, y: &[f64], sample_time_s: f64) -> Result<(Segment, Margins)> {
    let durations = (0..task.seed.parts.len()).map(|part| task.duration_s(part, y));
    let ends = durations.scan(0.0, |end, duration| {
        *end += duration;
        Some(*end)
    });
    let ends: Vec<f64> = ends.collect();
    let total = ends[ends.len() - 1];
    let steps = (total / sample_time_s).round().max(1.0) as usize;
    let count = steps + 1;
    let times = (0..count).map(|sample| total * (sample as f64 / steps as f64));
    let mut motion = Segment::still(SOURCE, times.collect());
    let mut input = DMatrix::zeros(STATE_DIM, count);
    for sample in 0..count {
        let time = motion.time_s[sample];
        let part = ends.partition_point(|end| *end <= time).min(ends.len() - 1);
        let start = if part == 0 { 0.0 } else { ends[part - 1] };
        let (at, ddz) = at(task, y, part, (time - start, ends[part] - start));
        let x = &task.seed.decode * at.z + &task.seed.decode_bias;
        motion.x.set_column(sample, &x);
        motion.dx.set_column(sample, &(&task.seed.decode * at.dz));
        motion.ddx.set_column(sample, &(&task.seed.decode * ddz));
        input.set_column(sample, &(&task.seed.lift * at.u_lat));
        motion.feet[sample] = task.seed.parts[part].landmark.feet;
    }
    motion.torque_nm = input.rows(0, JOINT_DIM) + motion.losses(&task.seed.rule);
    let margins = margins(task, y, (&motion, &input));
    Ok((motion, margins))
}

fn at(
    task: &Task<'_>,
    y: &[f64],
    part: usize,
    (time_s, duration_s): (f64, f64),
) -> (NodeValues, DVector<f64>) {
    let of = &task.seed.parts[part];
    let step = duration_s / of.intervals() as f64;
    let interval = ((time_s / step) as usize).min(of.intervals() - 1);
    let since = time_s - interval as f64 * step;
    let share = since / step;
    let here = task.values(part, interval, y);
    let next = task.values(part, interval + 1, y);
    let ddz = (&next.dz - &here.dz) / step;
    let drift = &of.drift[interval];
    let values = NodeValues {
        z: here.z + (&here.dz + drift) * since + &ddz * (0.5 * since * since),
        dz: here.dz + &ddz * since,
        u_lat: &here.u_lat + (&next.u_lat - &here.u_lat) * share,
    };
    (values, ddz)
}

fn margins(task: &Task<'_>, y: &[f64], (motion, input): (&Segment, &DMatrix<f64>)) -> Margins {
    let robot = task.seed.rule.robot();
    let mut margins = Margins {
        torque_share: 0.0,
        beyond_joint_limit_rad: f64::NEG_INFINITY,
        beyond_friction_n: f64::NEG_INFINITY,
        foot_slip_m: foot_slip(task, y),
        foot_drift_m: foot_drift(robot, motion),
    };
    for sample in 0..motion.len() {
        for joint in 0..JOINT_DIM {
            let share = motion.torque_nm[(joint, sample)].abs() / robot.torque_limit_nm()[joint];
            margins.torque_share = margins.torque_share.max(share);
            let (least, most) = robot.joint_limit_rad()[joint];
            let angle = motion.x[(joint, sample)];
            let beyond = (least - angle).max(angle - most);
            margins.beyond_joint_limit_rad = margins.beyond_joint_limit_rad.max(beyond);
        }
        if motion.feet[sample].contains(&true) {
            let [forwards, up] = [BODY_X, BODY_Z].map(|row| input[(row, sample)]);
            let beyond = forwards.abs() - task.settings.friction * up;
            margins.beyond_friction_n = margins.beyond_friction_n.max(beyond);
        }
    }
    margins
}

fn foot_slip(task: &Task<'_>, y: &[f64]) -> [f64; 2] {
    let mut farthest = [0.0_f64; 2];
    for (part, of) in task.seed.parts.iter().enumerate() {
        let anchor = (task.anchor_part(part), 0);
        for leg in Leg::down(of.landmark.feet) {
            let moved = |at| moved_foot(task, y, leg, at).map(|moved| moved.at(y));
            let from = moved(anchor);
            for now in (0..of.z.len()).map(|node| moved((part, node))) {
                farthest = std::array::from_fn(|k| farthest[k].max((now[k] - from[k]).abs()));
            }
        }
    }
    farthest
}

fn foot_drift(robot: &Robot, motion: &Segment) -> [f64; 2] {
    let place = |leg: Leg, sample: usize| robot.foot_in_world(leg, &motion.state(sample));
    let mut farthest = [0.0_f64; 2];
    for leg in Leg::ALL {
        let floor = place(leg, 0).z;
        let mut down = None;
        for sample in 0..motion.len() {
            if !motion.feet[sample][leg.index()] {
                down = None;
                continue;
            }
            let now = place(leg, sample);
            let from = *down.get_or_insert(now);
            farthest[0] = farthest[0].max((now - from).xy().norm());
            farthest[1] = farthest[1].max(floor - now.z);
        }
    }
    farthest
}
