//! Settings of the controller: one table of names, defaults, ranges and descriptions. The structures in Rust and C,
//! their checks, the headers, the Python binding and the parameters of ROS are generated from it.

pub use super::choices::{
    AfterEnd, Drift, Legs, Lift, Linearisation, MissingInput, RowSelection, Solver,
};
use super::error::ControlError;
use super::qp::QpSettings;
use super::supervisor::Bounds;
use crate::robot::{Leg, Robot};

/// Behaviour of the controller without a trusted plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FallbackSettings {
    /// How many stages of the last good plan may be used after a failure.
    pub plan_stages: usize,
    /// Time constant with which the feed-forward torque of a hold decays, s.
    pub torque_decay_s: Real,
    /// Joint damping of a hold, N m s/rad, on measured joint velocities.
    pub damping_nm_s: Real,
    /// Deviation from the prediction, in standard deviations of the reference, that is not believed at first.
    pub jump_deviations: Real,
    /// Number of consecutive steps in which a measurement is refused as a jump before it is accepted.
    pub jump_patience: usize,
}

impl Default for FallbackSettings {
    fn default() -> Self {
        Self {
            plan_stages: 5,
            torque_decay_s: 0.05,
            damping_nm_s: 1.0,
            jump_deviations: 6.0,
            jump_patience: 3,
        }
    }
}

/// Gains of the joint PD that holds the commanded posture, in the motors or in the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drives {
    /// N m/rad; 0 without one.
    pub stiffness_nm_rad: f64,
    /// N m s/rad.
    pub damping_nm_s_rad: f64,
}

impl Drives {
    /// Of the Go1, and its mass times the length of its legs, kg m.
    const GO1: Self = Self {
        stiffness_nm_rad: 20.0,
        damping_nm_s_rad: 0.8,
    };
    const GO1_SIZE: f64 = 12.01 * 0.426;

    /// Gains of a robot: those of the Go1 in proportion to mass times length of the legs.
    pub fn of(robot: &Robot) -> Self {
        let legs = robot.geometry(Leg::FrontRight).lengths_m;
        let share = robot.mass_kg() * (legs[0] + legs[1]) / Self::GO1_SIZE;
        let gain = |of_go1: f64| (1e3 * of_go1 * share).round() / 1e3;
        Self {
            stiffness_nm_rad: gain(Self::GO1.stiffness_nm_rad),
            damping_nm_s_rad: gain(Self::GO1.damping_nm_s_rad),
        }
    }
}

/// Longest horizon that is accepted.
pub(crate) const MAX_HORIZON: usize = 500;

/// Accepted values of a setting.
#[derive(Debug, Clone, Copy)]
pub enum Accepts {
    /// A whole number from the first to the second, in words; the generated C checks these by hand.
    Whole(usize, usize, &'static str),
    /// A positive number.
    Positive,
    /// Zero or a positive number.
    NotNegative,
    /// A positive number, or none, which is zero in C.
    Optional,
    /// As [`Self::Optional`], for rows that link stages: the switch that compiles them in C, and their description.
    LinkRows(&'static str, &'static str),
    /// A number from 0 to 1.
    Share,
    /// A positive number; infinity disables the bound.
    Bound,
    /// A whole number; zero disables the check.
    Count,
}

impl Accepts {
    pub(super) fn check(self, name: &'static str, found: f64) -> Result<(), ControlError> {
        let is_positive = found.is_finite() && found > 0.0;
        let (is_accepted, expected) = match self {
            Self::Whole(least, most, expected) => {
                ((least as f64..=most as f64).contains(&found), expected)
            }
            Self::Positive | Self::Optional | Self::LinkRows(..) => {
                (is_positive, "a positive number")
            }
            Self::Share => ((0.0..=1.0).contains(&found), "a number from 0 to 1"),
            Self::NotNegative => (is_positive || found == 0.0, "zero or a positive number"),
            Self::Bound => (found > 0.0, "a positive number or infinity"),
            Self::Count => (
                (0.0..=f64::from(i32::MAX)).contains(&found),
                "zero or a positive number",
            ),
        };
        let refused = ControlError::Setting {
            name,
            found,
            expected,
        };
        is_accepted.then_some(()).ok_or(refused)
    }

    /// Whether this number switches a bound of the supervisor off.
    fn is_off(self, number: f64) -> bool {
        match self {
            Self::Bound => !number.is_finite(),
            Self::Count => number == 0.0,
            _ => false,
        }
    }
}

/// A setting that interfaces in C have too. In descriptions `UPPER` stands for the model's name.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Name in C, Python and ROS.
    pub name: &'static str,
    /// Field of [`MpcSettings`].
    pub field: &'static str,
    /// `i32`, `f64`, or `Real` for a number with the precision of the generated C.
    pub kind: &'static str,
    /// Accepted range.
    pub accepts: Accepts,
    /// Description in the header of the generated crate.
    pub text: &'static str,
    /// Description in the header of the generated C; empty if the setting is not in it.
    pub in_c: &'static str,
    /// Description as a parameter of the ros2_control plugin, if it differs; `None` if there is none.
    pub in_ros: Option<&'static str>,
}

impl Setting {
    /// Description as a parameter of the ros2_control plugin; none if it is not one.
    pub fn of_ros(&self) -> Option<String> {
        let off = match self.accepts {
            Accepts::Bound => "; .inf disables it",
            Accepts::Count => "; 0 disables it",
            _ => "",
        };
        let own = (self.field == "bounds")
            .then_some(self.text)
            .or(self.in_ros)?;
        Some(own.to_owned() + off)
    }
}

type Real = f64;

/// A field of [`MpcSettings`] as its numbers in C.
trait InC<const N: usize>: Sized {
    /// The numbers, all `none` where there is none.
    fn numbers(self, none: f64) -> [f64; N];

    fn of(numbers: [f64; N]) -> Self;
}

macro_rules! in_c {
    ($($type:ty, $n:literal: ($value:ident, $none:ident) $to:expr, $numbers:pat => $of:expr;)*) => {$(
        impl InC<$n> for $type {
            fn numbers(self, $none: f64) -> [f64; $n] {
                let $value = self;
                $to
            }

            fn of($numbers: [f64; $n]) -> Self {
                $of
            }
        }
    )*};
}

in_c! {
    f64, 1: (value, _none) [value], [number] => number;
    usize, 1: (value, _none) [value as f64], [number] => number as usize;
    Option<f64>, 1: (value, none) [value.unwrap_or(none)],
        [number] => (number != 0.0).then_some(number);
    Lift, 1: (value, _none) [f64::from(value as u8)],
        [number] => [Self::Transpose, Self::Consistent][number as usize];
    Linearisation, 1: (value, _none) [f64::from(value as u8)],
        [number] => [Self::Reference, Self::LastPlan][number as usize];
    Solver, 1: (value, _none) [f64::from(value as u8)],
        [number] => [Self::Clarabel, Self::Riccati][number as usize];
    QpSettings, 1: (value, _none) [f64::from(value.max_iterations)],
        [number] => Self { max_iterations: number as u32, ..Self::default() };
    Legs, 1: (value, _none) [f64::from(value as u8)],
        [number] => [Self::Decoded, Self::Reference][number as usize];
    AfterEnd, 1: (value, _none) [f64::from(value as u8)],
        [number] => [Self::Hold, Self::Damp, Self::Stop][number as usize];
}

/// The same of structs, by the numbers of their fields.
macro_rules! fields_in_c {
    ($($type:ident, $n:literal: $($field:ident)*;)*) => {$(
        impl InC<$n> for $type {
            fn numbers(self, none: f64) -> [f64; $n] {
                let [$($field),*] = [$(InC::<1>::numbers(self.$field, none)),*];
                [$($field[0]),*]
            }

            fn of([$($field),*]: [f64; $n]) -> Self {
                Self { $($field: InC::<1>::of([$field])),* }
            }
        }
    )*};
}

fields_in_c! {
    Drives, 2: stiffness_nm_rad damping_nm_s_rad;
    Bounds, 13: tilt_rad joint_margin_rad joint_velocity distance_m posture_rad clock_gap_s frozen_steps
        velocity_mismatch contact_mismatch_steps poor_steps fade_s damping_nm_s_rad damping_torque_nm;
}

/// Generates the structures of Rust and C and [`SETTINGS`] from a table. Rows of `c` are fields of [`MpcSettings`],
/// each with its name, type, range and description in C. `in_c` replaces the description in the generated C, `in_ros`
/// for a parameter of ROS. Rows of `rust` exist in Rust only.
macro_rules! settings {
    (
        c {$(
            $(#[$doc:meta])*
            $field:ident: $type:ty = $default:expr => $(
                $name:ident: $kind:ident, $accepts:expr, $text:literal
                    $(, in_c $in_c:literal)? $(, in_ros $in_ros:literal)?
            )|+;
        )*}
        rust {$(
            $(#[$rust_doc:meta])*
            $rust_field:ident: $rust_type:ty = $rust_default:expr;
        )*}
    ) => {
        /// Settings of the controller. `UPPER` stands for the model's name in capitals, in C.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct MpcSettings {
            $($(#[doc = $text])* $(#[$doc])* pub $field: $type,)*
            $($(#[$rust_doc])* pub $rust_field: $rust_type,)*
        }

        impl Default for MpcSettings {
            fn default() -> Self {
                Self { $($field: $default,)* $($rust_field: $rust_default,)* }
            }
        }

        /// Settings as C has them; zero is none.
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Settings {
            $($(#[doc = $text] pub $name: $kind,)*)*
        }

        impl From<&MpcSettings> for Settings {
            fn from(settings: &MpcSettings) -> Self {
                $(let [$($name),*] = settings.$field.numbers(0.0);)*
                Self { $($($name: $name as $kind,)*)* }
            }
        }

        impl Default for Settings {
            fn default() -> Self {
                Self::from(&MpcSettings::default())
            }
        }

        impl Settings {
            /// Sets the number of this name; false if there is none.
            pub fn set(&mut self, name: &str, number: f64) -> bool {
                match name {
                    $($(stringify!($name) => self.$name = number as $kind,)*)*
                    _ => return false,
                }
                true
            }

            /// Its numbers, in the order of [`SETTINGS`].
            pub fn numbers(&self) -> Vec<f64> {
                vec![$($(self.$name as f64),*),*]
            }

            /// Names of the bounds of the supervisor that are off.
            pub fn off(&self) -> impl Iterator<Item = &'static str> {
                let all = SETTINGS.iter().zip(self.numbers());
                let off = all.filter(|(setting, number)| setting.accepts.is_off(*number));
                off.map(|(setting, _)| setting.name)
            }

            /// Checked settings of the controller.
            pub fn to_mpc(&self) -> Result<MpcSettings, ControlError> {
                for (setting, found) in SETTINGS.iter().zip(self.numbers()) {
                    if let Accepts::Whole(..) | Accepts::Count = setting.accepts {
                        setting.accepts.check(setting.name, found)?;
                    }
                }
                let settings = MpcSettings {
                    $($field: InC::of([$(self.$name as f64),*]),)*
                    ..MpcSettings::default()
                };
                settings.check().map(|()| settings)
            }
        }

        impl MpcSettings {
            fn check_table(&self) -> Result<(), ControlError> {
                let mut settings = SETTINGS.iter();
                // One, where there is none, passes every check.
                $(for found in self.$field.numbers(1.0) {
                    let setting = settings.next().expect("a row for each number");
                    setting.accepts.check(setting.name, found)?;
                })*
                Ok(())
            }
        }

        /// The settings that C has, in the order of its structure.
        pub const SETTINGS: &[Setting] = &[$($(Setting {
            name: stringify!($name),
            field: stringify!($field),
            kind: stringify!($kind),
            accepts: $accepts,
            text: $text,
            in_c: [$($in_c,)? $text][0],
            in_ros: [$(Some($in_ros),)? None][0],
        }),*),*];
    };
}

settings! {
    c {
        horizon: usize = 20 => horizon: i32, Accepts::Whole(1, MAX_HORIZON, "1 to 500 stages"), "stages, 1 to 500",
            in_c "stages, 1 to UPPER_MAX_HORIZON";
        /// Also tolerance and accepted residual of the conic solver; the structured solver uses the same residual.
        qp: QpSettings = QpSettings::default() =>
            max_iterations: i32, Accepts::Whole(0, i32::MAX as usize, "a positive number"),
            "interior-point iterations, the deadline of a step";
        lift: Lift = Lift::Transpose => lift: i32, Accepts::Whole(0, 1, "0 (transpose) or 1 (consistent)"),
            "UPPER_LIFT_TRANSPOSE (default) or _CONSISTENT", in_c "UPPER_LIFT_TRANSPOSE or _CONSISTENT";
        linearisation: Linearisation = Linearisation::Reference =>
            linearisation: i32, Accepts::Whole(0, 1, "0 (the reference) or 1 (the last plan)"),
            "UPPER_ABOUT_REFERENCE (default) or _LAST_PLAN", in_c "UPPER_ABOUT_REFERENCE or _ABOUT_LAST_PLAN";
        /// It solves the program of a step, and that of the consistent lift.
        solver: Solver = Solver::Clarabel => solver: i32, Accepts::Whole(0, 1, "0 (clarabel) or 1 (Riccati)"),
            "UPPER_CLARABEL (default) or _RICCATI", in_c "";
        /// The input is held over it.
        step_s: f64 = 0.01 => step_s: f64, Accepts::Positive, "duration of a stage, s";
        /// (`w_u`), measured by the inverse covariance of the training inputs. Along a recording it has little effect.
        /// In closed loop (`examples/mujoco/closed_loop.py`) the robot falls with a weight of one, because the
        /// controller follows errors of the model. A weight of hundreds applies the reference input without feedback.
        input_weight: f64 = 10.0 => input_weight: Real, Accepts::Positive,
            "weight of deviations from the reference's input";
        /// (`w_v`). In closed loop small weights let a jump that is under-powered, by a payload or weak motors, end
        /// short; see `docs/reference/controller-settings.md`.
        velocity_weight: f64 = 0.1 => velocity_weight: Real, Accepts::Positive,
            "weight of velocities against positions";
        terminal_weight: f64 = 1.0 => terminal_weight: Real, Accepts::Positive,
            "factor on the weights of the last stage";
        /// by their whole half range at one stage.
        joint_penalty: f64 = 100.0 => joint_penalty: Real, Accepts::Positive, "price of leaving the joint limits";
        body_friction: Option<f64> = None => body_friction: Real, Accepts::Optional,
            "friction coefficient of the lifted body force, 0 leaves it free",
            in_c "friction coefficient of the lifted body force, by the pyramid inside its cone; 0 leaves it free",
            in_ros "friction coefficient of the body's force; 0 leaves it free";
        foot_friction: f64 = 0.6 => foot_friction: Real, Accepts::Positive,
            "friction coefficient of each foot, consistent lift",
            in_c "friction coefficient of each foot in the consistent lift";
        /// Weighed against the reproduction of the latent input.
        lift_prior_weight: f64 = 1e-3 => lift_prior_weight: Real, Accepts::Positive,
            "weight of the training torques, consistent lift",
            in_c "weight of the training's torques in the consistent lift";
        /// The torques of the consistent lift are not limited by it.
        torque_rate_nm_s: Option<f64> = None => torque_rate_nm_s: Real,
            Accepts::LinkRows("TORQUE_RATES", "limits on torque rates"),
            "largest change of a torque, N m/s, plain lift; 0 leaves it free",
            in_c "largest change of a torque of LIFT_TRANSPOSE, N m/s; 0 leaves it free, as it must if UPPER_TORQUE_RATES is 0",
            in_ros "largest change of a torque of the plain lift, N m/s, where the controller is compiled with \
                    `UPPER_TORQUE_RATES=1`; 0 leaves it free";
        effectiveness: Option<f64> = None => effectiveness_time_s: Real, Accepts::Optional,
            "time constant of the estimate of how much of the input arrives, s; 0 for none",
            in_ros "time constant of the estimate of the share of the input that arrives; 0 for none";
        drives: Drives = Drives::GO1 => drive_stiffness_nm_rad: Real, Accepts::NotNegative,
            "stiffness of the joint PD that holds joint_position, N m/rad"
            | drive_damping_nm_s_rad: Real, Accepts::NotNegative, "its damping, of joint_velocity, N m s/rad";
        /// Zero leaves them where the reference has them from the body, 1 where it has them from the ground.
        swing_turn: f64 = 1.0 => swing_turn: Real, Accepts::NotNegative,
            "share of the error of pitch that joint_position turns the legs against in flight";
        /// They swing the legs; the ground does not answer them.
        flight_torque: f64 = 1.0 => flight_torque: Real, Accepts::Share,
            "share of the torques that acts in flight, 0 to 1; 0 leaves the legs to the joint PD",
            in_ros "share of the feed-forward torques that acts in flight, 0 to 1; 0 leaves the legs to the PD";
        /// Of a walk the deviation over the reference grows with the path.
        place_scale_m: Option<f64> = None => place_scale_m: Real, Accepts::Optional,
            "scale of deviations in x and y, m; 0 for their standard deviation over the reference";
        heading_scale_rad: Option<f64> = None => heading_scale_rad: Real, Accepts::Optional,
            "the same in yaw, rad";
        legs: Legs = Legs::Decoded => legs: i32, Accepts::Whole(0, 1, "0 (decoded) or 1 (reference)"),
            "joint targets, losses and prior torques: UPPER_LEGS_DECODED (default) or _OF_REFERENCE",
            in_c "joint targets, losses and prior torques: UPPER_LEGS_DECODED or _OF_REFERENCE";
        after_end: AfterEnd = AfterEnd::Hold => after_end: i32, Accepts::Whole(0, 2, "0 (hold), 1 (damp) or 2 (stop)"),
            "after the reference: UPPER_HOLD (default), _DAMP or _STOP", in_c "after the reference: UPPER_HOLD, _DAMP or _STOP";
        /// Chosen so that no valid recording, plan or simulated jump of the repository comes near; see
        /// `docs/reference/controller-settings.md`.
        bounds: Bounds = Bounds::USUAL =>
            tilt_rad: Real, Accepts::Bound, "most angle between the verticals of body and reference, rad"
            | joint_margin_rad: Real, Accepts::Bound, "how far joints may be outside their limits, rad"
            | joint_velocity: Real, Accepts::Bound, "most joint velocity, in largest speeds of the joint"
            | distance_m: Real, Accepts::Bound,
            "most distance of the body from the reference, m; half of it at the start and from its prediction"
            | posture_rad: Real, Accepts::Bound,
            "most distance of a joint from the reference, rad; half of it at the start and from its prediction"
            | clock_gap_s: f64, Accepts::Bound, "most time between steps, s; infinite: clocks may also stand and go back"
            | frozen_steps: i32, Accepts::Count, "steps in which a clock may stand or a moving measurement stay the same"
            | velocity_mismatch: Real, Accepts::Bound, "most velocity of the body that its positions do not show, m/s"
            | contact_mismatch_steps: i32, Accepts::Count, "steps with contacts that heights of feet or the fall contradict"
            | poor_steps: i32, Accepts::Count, "steps in a row without a plan or with unknown contacts"
            | fade_s: f64, Accepts::Positive, "time in which torques fade into damping after a fault, s"
            | damping_nm_s_rad: Real, Accepts::NotNegative, "damping of the joints then, N m s/rad"
            | damping_torque_nm: Real, Accepts::Positive, "most torque of it, N m";
    }
    rust {
        /// Dynamics along the reference itself.
        drift: Drift = Drift::Automatic;
        /// Input of a reference that has none.
        missing_input: MissingInput = MissingInput::Estimate;
        /// Selection of the constraint rows.
        rows: RowSelection = RowSelection::Needed;
        /// Behaviour without a plan.
        fallback: FallbackSettings = FallbackSettings::default();
    }
}

impl MpcSettings {
    /// Checks every number.
    pub(crate) fn check(&self) -> Result<(), ControlError> {
        self.check_table()?;
        let (qp, fallback) = (&self.qp, &self.fallback);
        for (name, found) in [
            ("qp.tolerance", qp.tolerance),
            ("qp.accepted_residual", qp.accepted_residual),
            ("qp.max_iterations", f64::from(qp.max_iterations)),
            ("fallback.torque_decay_s", fallback.torque_decay_s),
            ("fallback.jump_deviations", fallback.jump_deviations),
        ] {
            Accepts::Positive.check(name, found)?;
        }
        Accepts::NotNegative.check("fallback.damping_nm_s", fallback.damping_nm_s)
    }
}
