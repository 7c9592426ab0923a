//! The ranges of settings; the command line's help describes each setting.

use super::Range;

macro_rules! ranges {
    ($($(#[$doc:meta])* $name:ident = $range:expr;)*) => {
        $($(#[$doc])* pub const $name: Range = $range;)*

        /// All ranges; of two with one name that of `romc train` comes first.
        pub(crate) static ALL: &[Range] = &[$($name),*];
    };
}

ranges! {
    LATENT_DIM = Range::whole("latent-dim", 1, 18);
    IMPORTED_LATENT_DIM = Range::whole("latent-dim", 1, 64);
    SEEDS = Range::whole("seeds", 1, 10_000);
    EPOCHS = Range::whole("epochs", 1, 1_000_000);
    LIFT_WEIGHT = Range::real("lift-weight", 0.0, 1e6);
    BODY_WEIGHT = Range::real("body-weight", 1e-6, 1e6);
    BPTT_WEIGHT = Range::real("bptt-weight", 0.0, 1e6);
    BPTT_WINDOW = Range::whole("bptt-window", 1, 1000);
    REFINEMENTS = Range::whole("refinements", 0, 1000);
    /// Growth rate of deviations, 1/s.
    GROWTH = Range::real("growth", 1e-2, 1e6);
    BPTT_STRIDE = Range::whole("bptt-stride", 1, 1000);
    BPTT_DECAY = Range::above("bptt-decay", 0.0, 1.0);
    SLACK = Range::real("slack", 0.0, 1e3);
    DEGREE = Range::whole("degree", 0, 8);
    MOVING_AVERAGE = Range::whole("moving-average", 1, 10_001);
    /// Standard deviation under which a coordinate is masked, rad or m.
    MASK_STD = Range::real("mask-std", 0.0, 1e3);
    /// Share of the input's energy from which a coordinate counts as actuated.
    MASK_INPUT_SHARE = Range::real("mask-input-share", 0.0, 1.0);
    /// Squares of far smaller ones underflow, and rollouts with far larger ones would count as diverged.
    STATE_SCALING = Range::real("state-scaling", 1e-6, 1e4);
    TORQUE_SCALING = Range::real("torque-scaling", 1e-6, 1e4);
    FORCE_SCALING = Range::real("force-scaling", 1e-6, 1e4);
    MOMENT_SCALING = Range::real("moment-scaling", 1e-6, 1e4);
    LAYER_WIDTH = Range::whole("layers", 1, 1024);
    LAMBDA = Range::real("lambda", 0.0, 1e6);
    HORIZON = Range::whole("horizon", 1, 500);
    STEP = Range::real("step", 1e-4, 1.0);
    /// Largest change of a commanded torque in N m/s.
    TORQUE_RATE = Range::real("torque-rate", 1e-3, 1e9);
    RESTART_EVERY = Range::real("restart-every", 1e-3, 1e4);
    /// Reach of a domain beyond the recordings, as a share of each variable's range.
    MARGIN = Range::real("margin", 0.0, 100.0);
    WIDTH = Range::real("width", 1.0, 1000.0);
    DIGITS = Range::whole("digits", 0, 40);
    SIGNIFICANT = Range::whole("significant", 1, 40);
    SCALING = Range::real("scaling", 1e-9, 1e9);
    INPUT_SCALING = Range::real("input-scaling", 1e-9, 1e9);
    SAMPLE_TIME = Range::real("sample-time", 1e-6, 1.0);
    DISTANCE = Range::real("distance", -1000.0, 1000.0);
    APEX = Range::real("apex", -1000.0, 1000.0);
    SPEED = Range::real("speed", -10.0, 10.0);
    YAW_RATE = Range::real("yaw-rate", -10.0, 10.0);
    DURATION = Range::real("duration", 0.1, 600.0);
}

/// The range of a setting of `romc train` by its name.
pub fn of_training(name: &str) -> Option<&'static Range> {
    ALL.iter().find(|range| range.name == name)
}
