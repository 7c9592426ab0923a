//! Equations averaged over short windows within one stance, away from impacts: noise of differences is averaged out.

use super::equations::{BODY_ROWS, JOINT_ROWS, joint_unknowns};
use super::*;
use crate::recording::preprocess::SavitzkyGolay;

const WINDOW_S: f64 = 0.03; // length of a window, s
const MARGIN_S: f64 = 0.02; // distance of windows from a change of the feet on the ground, s
pub(crate) const OVERLAP: usize = 4; // windows a window's length: neighbours overlap
const BLOCK_S: f64 = 0.1; // length of the blocks that are left out in turn for standard errors, s
const LEAST_JUMPS: usize = 6; // fewest jumps that are left out in turn
const LARGEST_SHARE: f64 = 1.0 / 3.0; // of the equations that one of them may have
const MOVING_RAD_S: f64 = 0.1; // mean speed of the bearing joints from which their dry friction has a direction, rad/s
const SIDEWAYS: usize = 1; // axis along which abductions push
const TURNING_RAD_S: f64 = 0.15;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Group {
    Contact(usize), // trunk's acceleration along an axis (x, y, z) with feet on the ground
    Flight(usize),
    Joint(usize), // torque of a joint (hx, hy, kn) of a leg in the air
}

impl Group {
    pub(crate) const COUNT: usize = 9;

    pub(crate) fn index(self) -> usize {
        match self {
            Self::Contact(axis) => axis,
            Self::Flight(axis) => 3 + axis,
            Self::Joint(kind) => 6 + kind,
        }
    }
}

pub(crate) struct Row {
    pub coefficients: [f64; PARAMETER_DIM],
    pub left: f64, // left side: m/s^2, or N m for a joint
    pub group: Group,
    pub block: usize, // block of time that it belongs to, counted over all segments
    pub moving: bool, // whether joints move enough for their friction to have a direction
}

#[derive(Default)]
pub(crate) struct Windows {
    pub rows: Vec<Row>,
    pub blocks: Vec<usize>, // the segment that each block lies in, counted from zero
    pub contact_samples: usize,
    pub flight_samples: usize,
    pub singular_samples: usize,
    pub clipped_torques: usize,
    segments: usize,
}

impl Windows {
    pub(crate) fn add(
        &mut self,
        segment: &Segment,
        equations: &SampleEquations,
        lost: &[bool],
    ) -> Result<(), IdentifyError> {
        self.clipped_torques += equations.clipped_torques;
        let step_s = segment.mean_step_s();
        let samples = |time_s: f64| (time_s / step_s).round() as usize;
        let window = (samples(WINDOW_S) | 1).max(3);
        let filter = SavitzkyGolay::new(window, 1)?;
        let per_block = samples(BLOCK_S).max(1);
        self.segments += 1;
        let feet = &segment.feet;
        for stance in stretches(0..segment.len(), |a, b| feet[a] == feet[b]) {
            let margin = samples(MARGIN_S);
            let inner = stance.start + margin..stance.end.saturating_sub(margin).max(stance.start);
            self.singular_samples += inner.clone().filter(|s| equations.singular[*s]).count();
            let kept = |sample: usize| !equations.singular[sample] && !lost[sample];
            for span in stretches(inner, |a, b| kept(a) == kept(b)) {
                if !kept(span.start) || span.len() < window {
                    continue;
                }
                let half = window / 2;
                let first_block = self.blocks.len();
                let centres = (half..span.len() - half).step_by((window / OVERLAP).max(1));
                let block = |centre| (centre, first_block + (centre - half) / per_block);
                let blocks: Vec<(usize, usize)> = centres.map(block).collect();
                let last = blocks.last().map_or(first_block, |(_, block)| *block);
                self.blocks.resize(last + 1, self.segments - 1);
                let averaged = Averaged {
                    segment,
                    equations,
                    filter: &filter,
                    span,
                    blocks,
                };
                self.add_body(&averaged);
                self.add_joints(&averaged);
            }
        }
        Ok(())
    }

    pub(crate) fn groupings(&self) -> Vec<Vec<usize>> {
        let mut groupings = vec![(0..self.blocks.len()).collect()];
        let mut counts = vec![0; self.segments];
        for row in self.rows.iter().filter(|row| row.moving) {
            counts[self.blocks[row.block]] += 1;
        }
        let total: usize = counts.iter().sum();
        let is_large = |count: &usize| *count as f64 > LARGEST_SHARE * total as f64;
        let n_jumps = counts.iter().filter(|count| **count > 0).count();
        if n_jumps >= LEAST_JUMPS && !counts.iter().any(is_large) {
            groupings.push(self.blocks.clone());
        }
        groupings
    }

    fn add_body(&mut self, averaged: &Averaged<'_>) {
        let segment = averaged.segment;
        let feet = segment.feet[averaged.span.start];
        let in_contact = feet.contains(&true);
        let (group, count): (fn(usize) -> Group, _) = match in_contact {
            true => (Group::Contact, &mut self.contact_samples),
            false => (Group::Flight, &mut self.flight_samples),
        };
        *count += averaged.span.len();
        let mean_speed = |is_meant: fn(usize) -> bool| {
            let bearing = || (0..JOINT_DIM).filter(|joint| is_meant(*joint) && feet[joint / 3]);
            let count = bearing().count().max(1) as f64;
            let speed = DMatrix::from_fn(1, segment.len(), |_, sample| {
                let speeds = bearing().map(|joint| segment.dx[(joint, sample)].abs());
                speeds.sum::<f64>() / count
            });
            averaged.of(&speed)
        };
        let flexion = mean_speed(|joint| joint % 3 != 0);
        let abduction = mean_speed(|joint| joint % 3 == 0);
        let means = averaged.of(&averaged.equations.body);
        for &(centre, block) in &averaged.blocks {
            for axis in 0..3 {
                let row = axis * BODY_ROWS;
                let turning = |speed: &DMatrix<f64>| speed[centre] > MOVING_RAD_S;
                let moving = turning(&flexion) && (axis != SIDEWAYS || turning(&abduction));
                self.rows.push(Row {
                    coefficients: std::array::from_fn(|i| means[(row + i, centre)]),
                    left: means[(row + PARAMETER_DIM, centre)],
                    group: group(axis),
                    block,
                    moving: !in_contact || moving,
                });
            }
        }
    }

    fn add_joints(&mut self, averaged: &Averaged<'_>) {
        let segment = averaged.segment;
        let feet = segment.feet[averaged.span.start];
        let half = averaged.filter.window / 2;
        for joint in (0..JOINT_DIM).filter(|joint| !feet[joint / 3]) {
            let unknowns = joint_unknowns(joint % 3);
            let joints = &averaged.equations.joints;
            let means = averaged.of(&joints.rows(joint * JOINT_ROWS, JOINT_ROWS).into_owned());
            for &(centre, block) in &averaged.blocks {
                let at = averaged.span.start + centre;
                let turns = |sample| segment.dx[(joint, sample)].abs() > TURNING_RAD_S;
                let mut coefficients = [0.0; PARAMETER_DIM];
                for (row, unknown) in unknowns.into_iter().enumerate() {
                    coefficients[unknown] = means[(row, centre)];
                }
                self.rows.push(Row {
                    coefficients,
                    left: means[(JOINT_ROWS - 1, centre)],
                    group: Group::Joint(joint % 3),
                    block,
                    moving: (at - half..=at + half).all(turns),
                });
            }
        }
    }
}

struct Averaged<'a> {
    segment: &'a Segment,
    equations: &'a SampleEquations,
    filter: &'a SavitzkyGolay,
    span: Range<usize>,
    blocks: Vec<(usize, usize)>, // centre of each window, counted from the start, and its block
}

impl Averaged<'_> {
    fn of(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let part = rows.columns(self.span.start, self.span.len()).into_owned();
        (self.filter.smooth(&part)).expect("invariant: a stretch is as long as the window")
    }
}

#[cfg(test)]
#[path = "../../../tests/units/data_identify_windows.rs"]
mod tests;
