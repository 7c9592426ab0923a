//! The ranges; the command line's help says what each setting is.

#![allow(missing_docs, reason = "the name of a range is that of its flag")]

use super::Range;

pub const LATENT_DIM: Range = Range::whole("latent-dim", 1, 18);
/// Latent coordinates of a model from elsewhere.
pub const IMPORTED_LATENT_DIM: Range = Range::whole("latent-dim", 1, 64);
pub const SEEDS: Range = Range::whole("seeds", 1, 10_000);
pub const EPOCHS: Range = Range::whole("epochs", 1, 1_000_000);
pub const LIFT_WEIGHT: Range = Range::real("lift-weight", 0.0, 1e6);
pub const BODY_WEIGHT: Range = Range::real("body-weight", 1e-6, 1e6);
pub const BPTT_WEIGHT: Range = Range::real("bptt-weight", 0.0, 1e6);
pub const BPTT_WINDOW: Range = Range::whole("bptt-window", 1, 1000);
pub const REFINEMENTS: Range = Range::whole("refinements", 0, 1000);
/// Growth rate of deviations, 1/s.
pub const GROWTH: Range = Range::real("growth", 1e-2, 1e6);
/// Samples per step of that window.
pub const BPTT_STRIDE: Range = Range::whole("bptt-stride", 1, 1000);
pub const BPTT_DECAY: Range = Range::above("bptt-decay", 0.0, 1.0);
pub const SLACK: Range = Range::real("slack", 0.0, 1e3);
pub const DEGREE: Range = Range::whole("degree", 0, 8);
/// Samples of the mean over accelerations.
pub const MOVING_AVERAGE: Range = Range::whole("moving-average", 1, 10_001);
/// Standard deviation under which a coordinate is masked, rad or m.
pub const MASK_STD: Range = Range::real("mask-std", 0.0, 1e3);
/// Share of the input's energy from which a coordinate counts as actuated.
pub const MASK_INPUT_SHARE: Range = Range::real("mask-input-share", 0.0, 1.0);
/// Scaled units of the state in one rad or m. Squares of far smaller ones underflow, and rollouts with far larger
/// ones would count as diverged.
pub const STATE_SCALING: Range = Range::real("state-scaling", 1e-6, 1e4);
/// Scaled units of joint torques in one N m.
pub const TORQUE_SCALING: Range = Range::real("torque-scaling", 1e-6, 1e4);
/// Scaled units of forces on the body in one N.
pub const FORCE_SCALING: Range = Range::real("force-scaling", 1e-6, 1e4);
/// Scaled units of moments on the body in one N m.
pub const MOMENT_SCALING: Range = Range::real("moment-scaling", 1e-6, 1e4);
pub const LAYER_WIDTH: Range = Range::whole("layers", 1, 1024);
pub const LAMBDA: Range = Range::real("lambda", 0.0, 1e6);
/// Stages of the controller's horizon.
pub const HORIZON: Range = Range::whole("horizon", 1, 500);
/// Length of a stage in seconds.
pub const STEP: Range = Range::real("step", 1e-4, 1.0);
/// Largest change of a commanded torque in N m/s.
pub const TORQUE_RATE: Range = Range::real("torque-rate", 1e-3, 1e9);
/// Time between restarts of rollouts in seconds.
pub const RESTART_EVERY: Range = Range::real("restart-every", 1e-3, 1e4);
/// Reach of a domain beyond the recordings, as a share of each variable's range.
pub const MARGIN: Range = Range::real("margin", 0.0, 100.0);
/// Longest printed line in em.
pub const WIDTH: Range = Range::real("width", 1.0, 1000.0);
pub const DIGITS: Range = Range::whole("digits", 0, 40);
pub const SIGNIFICANT: Range = Range::whole("significant", 1, 40);
/// Scaled units in one SI unit, of a model from elsewhere.
pub const SCALING: Range = Range::real("scaling", 1e-9, 1e9);
pub const INPUT_SCALING: Range = Range::real("input-scaling", 1e-9, 1e9);
/// Sampling period of training recordings in seconds.
pub const SAMPLE_TIME: Range = Range::real("sample-time", 1e-6, 1.0);

/// Distance of the body in a planned jump, m.
pub const DISTANCE: Range = Range::real("distance", -1000.0, 1000.0);
/// Rise of the body in a planned jump, m.
pub const APEX: Range = Range::real("apex", -1000.0, 1000.0);

/// The settings of `romc train`, as flags and in files.
pub static TRAINING: [Range; 20] = [
    LATENT_DIM,
    SEEDS,
    EPOCHS,
    LIFT_WEIGHT,
    BODY_WEIGHT,
    BPTT_WEIGHT,
    BPTT_WINDOW,
    REFINEMENTS,
    GROWTH,
    BPTT_STRIDE,
    BPTT_DECAY,
    SLACK,
    DEGREE,
    MOVING_AVERAGE,
    MASK_STD,
    MASK_INPUT_SHARE,
    STATE_SCALING,
    TORQUE_SCALING,
    FORCE_SCALING,
    MOMENT_SCALING,
];

/// The range of a setting of `romc train` by its name.
pub fn of_training(name: &str) -> Option<&'static Range> {
    TRAINING.iter().find(|range| range.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_that_the_rooms_keep_themselves() {
        assert_eq!(LATENT_DIM.most as usize, crate::robot::STATE_DIM);
        assert_eq!(DIGITS.most as usize, crate::typeset::MOST_DIGITS);
        assert_eq!(SIGNIFICANT.most as usize, crate::typeset::MOST_DIGITS);
        assert_eq!(LAYER_WIDTH.most as usize, crate::model::MAX_LAYER_WIDTH);
    }
}
