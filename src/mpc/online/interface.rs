//! The controller behind a C interface: numbers in, numbers and codes out, never a panic.
//!
//! A generated controller wraps these functions under its model's name; pointers are turned into
//! slices there, everything else happens here. A pointer that cannot be used arrives as `None`.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::command::{Command, Status};
use super::controller::{Controller, Measurement};
use super::error::ControlError;
use super::reference::ReferenceSamples;
use super::settings::{Lift, Linearisation, MpcSettings};
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, Robot};

/// A pointer is null or not aligned.
pub const BAD_POINTER: i32 = -4;
/// The time of a reference does not increase.
pub const TIME_ORDER: i32 = -5;
/// No phase of the model has the feet of a reference's sample in contact.
pub const UNKNOWN_FEET: i32 = -6;
/// A setting is out of its range.
pub const BAD_SETTING: i32 = -7;
/// The conic solver refused the problem.
pub const SOLVER_REFUSED: i32 = -8;
/// The controller broke down inside; it works again after a new reference.
pub const INTERNAL: i32 = -9;

/// Settings as C has them; zero friction of the body and zero rate leave both free.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Stages of the horizon.
    pub horizon: i32,
    /// Cap on interior-point iterations.
    pub max_iterations: i32,
    /// 0 transpose, 1 consistent.
    pub lift: i32,
    /// 0 about the reference, 1 about the last plan.
    pub linearisation: i32,
    /// Duration of a stage, s.
    pub step_s: f64,
    /// Weight of the input deviation.
    pub input_weight: f64,
    /// Weight of velocities against positions.
    pub velocity_weight: f64,
    /// Factor on the state weights of the last stage.
    pub terminal_weight: f64,
    /// Price of leaving the joint limits.
    pub joint_penalty: f64,
    /// Friction coefficient of the lifted body force, or 0.
    pub body_friction: f64,
    /// Friction coefficient of each foot in the consistent lift.
    pub foot_friction: f64,
    /// Weight of the consistent lift's prior.
    pub lift_prior_weight: f64,
    /// Largest change of a lifted torque, N m/s, or 0.
    pub torque_rate_nm_s: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let settings = MpcSettings::default();
        Self {
            horizon: settings.horizon as i32,
            max_iterations: settings.qp.max_iterations as i32,
            lift: match settings.lift {
                Lift::Transpose => 0,
                Lift::Consistent => 1,
            },
            linearisation: match settings.linearisation {
                Linearisation::Reference => 0,
                Linearisation::LastPlan => 1,
            },
            step_s: settings.step_s,
            input_weight: settings.input_weight,
            velocity_weight: settings.velocity_weight,
            terminal_weight: settings.terminal_weight,
            joint_penalty: settings.joint_penalty,
            body_friction: settings.body_friction.unwrap_or(0.0),
            foot_friction: settings.foot_friction,
            lift_prior_weight: settings.lift_prior_weight,
            torque_rate_nm_s: settings.torque_rate_nm_s.unwrap_or(0.0),
        }
    }
}

impl Settings {
    /// The same for the controller.
    ///
    /// # Errors
    /// [`ControlError::Setting`] for a choice or a count that does not exist; other ranges are
    /// checked when the controller is built.
    pub fn to_mpc(&self) -> Result<MpcSettings, ControlError> {
        let refuse = |name, found: i32, expected| ControlError::Setting {
            name,
            found: f64::from(found),
            expected,
        };
        let mut settings = MpcSettings {
            horizon: usize::try_from(self.horizon)
                .map_err(|_| refuse("horizon", self.horizon, "1 to 500 stages"))?,
            step_s: self.step_s,
            lift: match self.lift {
                0 => Lift::Transpose,
                1 => Lift::Consistent,
                found => return Err(refuse("lift", found, "0 (transpose) or 1 (consistent)")),
            },
            linearisation: match self.linearisation {
                0 => Linearisation::Reference,
                1 => Linearisation::LastPlan,
                found => {
                    let expected = "0 (the reference) or 1 (the last plan)";
                    return Err(refuse("linearisation", found, expected));
                }
            },
            input_weight: self.input_weight,
            velocity_weight: self.velocity_weight,
            terminal_weight: self.terminal_weight,
            joint_penalty: self.joint_penalty,
            body_friction: (self.body_friction != 0.0).then_some(self.body_friction),
            foot_friction: self.foot_friction,
            lift_prior_weight: self.lift_prior_weight,
            torque_rate_nm_s: (self.torque_rate_nm_s != 0.0).then_some(self.torque_rate_nm_s),
            ..MpcSettings::default()
        };
        settings.qp.max_iterations = u32::try_from(self.max_iterations)
            .map_err(|_| refuse("max_iterations", self.max_iterations, "a positive number"))?;
        Ok(settings)
    }
}

/// What a robot's low-level interface takes, as C has it; `D` latent coordinates.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawCommand<const D: usize> {
    /// Feed-forward torques, N m.
    pub torque: [f64; JOINT_DIM],
    /// Desired joint positions, rad.
    pub joint_position: [f64; JOINT_DIM],
    /// Desired joint velocities, rad/s.
    pub joint_velocity: [f64; JOINT_DIM],
    /// Latent input behind the torques.
    pub u_lat: [f64; D],
    /// How the step ended.
    pub status: i32,
    /// Interior-point iterations.
    pub iterations: i32,
    /// Wall time of the step, µs.
    pub solve_us: f64,
}

impl<const D: usize> RawCommand<D> {
    /// No torque, at the middle of the joints' ranges: what is commanded when nothing is known.
    pub fn at_rest(robot: &Robot, status: i32) -> Self {
        Self {
            torque: [0.0; JOINT_DIM],
            joint_position: robot
                .joint_limit_rad()
                .map(|(lower, upper)| 0.5 * (lower + upper)),
            joint_velocity: [0.0; JOINT_DIM],
            u_lat: [0.0; D],
            status,
            iterations: 0,
            solve_us: 0.0,
        }
    }
}

/// A controller with the memory that its interface needs; `D` latent coordinates.
#[derive(Debug)]
pub struct Handle<const D: usize> {
    controller: Controller,
    command: Command,
    last: RawCommand<D>,
    /// A panic was caught: what the controller holds may contradict itself.
    is_broken: bool,
}

/// A trajectory as it comes through the interface; see [`ReferenceSamples`].
#[derive(Debug, Clone, Copy)]
pub struct RawReference<'a> {
    /// Time of each sample, s.
    pub time_s: Option<&'a [f64]>,
    /// States, 18 values a sample.
    pub x: Option<&'a [f64]>,
    /// Velocities, 18 values a sample.
    pub dx: Option<&'a [f64]>,
    /// Inputs, 18 values a sample, unless there are none; the inner `None` is a bad pointer.
    pub u: Option<Option<&'a [f64]>>,
    /// Feet in contact, 4 values a sample, zero in the air.
    pub feet: Option<&'a [u8]>,
}

/// A measurement as it comes through the interface.
#[derive(Debug, Clone, Copy)]
pub struct RawMeasurement<'a> {
    /// Time, s.
    pub time_s: f64,
    /// State, 18 values.
    pub x: Option<&'a [f64]>,
    /// Velocity, 18 values.
    pub dx: Option<&'a [f64]>,
    /// Feet in contact, 4 values, zero in the air.
    pub feet: Option<&'a [u8]>,
}

impl<const D: usize> Handle<D> {
    /// Builds a controller with `build`, from settings or the defaults; a message is left for
    /// [`last_error`] if there is none to be made.
    pub fn create(
        settings: Option<&Settings>,
        build: impl FnOnce(MpcSettings) -> Result<Controller, ControlError>,
    ) -> Option<Box<Self>> {
        let made = guarded(|| {
            let settings = settings.copied().unwrap_or_default().to_mpc()?;
            let controller = build(settings)?;
            let last = RawCommand::at_rest(controller.plant().robot(), Status::NoReference.code());
            Ok(Box::new(Self {
                command: Command::zeros(controller.plant().latent_dim()),
                controller,
                last,
                is_broken: false,
            }))
        });
        made.ok()
    }

    /// Takes a trajectory to follow; 0, or a code with a message for [`last_error`]. A refused
    /// trajectory leaves the old one.
    pub fn set_reference(&mut self, raw: &RawReference<'_>) -> i32 {
        let is_missing = |name: &str| {
            tell(&format!("reference: `{name}` is null or not aligned"));
            BAD_POINTER
        };
        let Some(time_s) = raw.time_s else {
            return is_missing("time_s");
        };
        let Some(x) = raw.x else {
            return is_missing("x");
        };
        let Some(dx) = raw.dx else {
            return is_missing("dx");
        };
        let Some(feet) = raw.feet else {
            return is_missing("feet");
        };
        let u = match raw.u {
            None => None,
            Some(Some(u)) => Some(u),
            Some(None) => return is_missing("u"),
        };
        let controller = &mut self.controller;
        let taken = guarded(|| {
            let feet: Vec<ContactFlags> = feet.chunks_exact(FOOT_DIM).map(contact).collect();
            controller.set_reference(ReferenceSamples {
                time_s,
                x,
                dx,
                u,
                feet: &feet,
            })
        });
        match taken {
            Ok(()) => {
                self.is_broken = false;
                Status::Solved.code()
            }
            Err(code) => {
                self.is_broken |= code == INTERNAL;
                code
            }
        }
    }

    /// Computes the command for a measurement; returns its status.
    pub fn step(&mut self, raw: &RawMeasurement<'_>, out: &mut RawCommand<D>) -> i32 {
        if self.is_broken {
            *out = self.safe(INTERNAL);
            return INTERNAL;
        }
        let has_all = raw.x.is_some() && raw.dx.is_some() && raw.feet.is_some();
        let measurement = Measurement {
            time_s: raw.time_s,
            // No values are the wrong number of them: the controller falls back.
            x: raw.x.filter(|_| has_all).unwrap_or(&[]),
            dx: raw.dx.filter(|_| has_all).unwrap_or(&[]),
            feet: raw.feet.map_or([false; FOOT_DIM], contact),
        };
        let (controller, command) = (&mut self.controller, &mut self.command);
        let stepped = catch_unwind(AssertUnwindSafe(|| {
            controller.step_into(measurement, command);
        }));
        if stepped.is_err() {
            self.is_broken = true;
            *out = self.safe(INTERNAL);
            return INTERNAL;
        }
        *out = RawCommand {
            torque: command.torque_nm,
            joint_position: command.joint_position_rad,
            joint_velocity: command.joint_velocity_rad_s,
            u_lat: std::array::from_fn(|latent| command.u_lat[latent]),
            status: match has_all {
                true => command.status.code(),
                false => BAD_POINTER,
            },
            iterations: command.iterations as i32,
            solve_us: command.solve_us,
        };
        self.last = *out;
        out.status
    }

    /// Forgets plan and past measurements, but not the reference.
    pub fn reset(&mut self) {
        let controller = &mut self.controller;
        if catch_unwind(AssertUnwindSafe(|| controller.reset())).is_err() {
            self.is_broken = true;
        }
    }

    /// No torque, at the posture of the last command.
    fn safe(&self, status: i32) -> RawCommand<D> {
        RawCommand {
            torque: [0.0; JOINT_DIM],
            joint_velocity: [0.0; JOINT_DIM],
            u_lat: [0.0; D],
            iterations: 0,
            solve_us: 0.0,
            status,
            ..self.last
        }
    }
}

/// Feet in contact of four flags; zero is in the air.
fn contact(flags: &[u8]) -> ContactFlags {
    std::array::from_fn(|foot| flags.get(foot).is_some_and(|&flag| flag != 0))
}

/// Runs `action`; its error or panic becomes a code, and a message for [`last_error`].
fn guarded<T>(action: impl FnOnce() -> Result<T, ControlError>) -> Result<T, i32> {
    match catch_unwind(AssertUnwindSafe(action)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => {
            tell(&error.to_string());
            Err(code_of(&error))
        }
        Err(_) => {
            tell("the controller broke down inside");
            Err(INTERNAL)
        }
    }
}

fn code_of(error: &ControlError) -> i32 {
    match error {
        ControlError::Shape { .. } => INTERNAL,
        ControlError::Setting { .. } => BAD_SETTING,
        ControlError::ReferenceLen { .. } | ControlError::ReferenceShape { .. } => {
            Status::WrongDimension.code()
        }
        ControlError::ReferenceValue { .. } => Status::NotFinite.code(),
        ControlError::ReferenceTime { .. } => TIME_ORDER,
        ControlError::ReferencePhase { .. } => UNKNOWN_FEET,
        ControlError::Solver { .. } => SOLVER_REFUSED,
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::new(CString::default());
}

/// Leaves a message for [`last_error`].
pub fn tell(message: &str) {
    let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
    LAST_ERROR.with_borrow_mut(|last| *last = text);
}

/// Why the last call on this thread that made a controller or set a reference was refused; valid
/// until the next such call on this thread.
pub fn last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|last| last.as_ptr())
}

/// A status or return code in words.
pub fn status_text(code: i32) -> &'static CStr {
    match TEXTS.iter().find(|(known, _)| *known == code) {
        Some((_, text)) => text,
        None => c"unknown status",
    }
}

/// Every code that the interface returns, with its meaning.
pub const TEXTS: [(i32, &CStr); 20] = [
    (
        0,
        c"solved: a plan whose optimality conditions were checked",
    ),
    (
        1,
        c"softened: a checked plan that leaves the joint limits somewhere",
    ),
    (
        2,
        c"contact early: a checked plan, the feet are in the reference's next phase",
    ),
    (
        3,
        c"contact late: a checked plan, the feet are in the reference's last phase",
    ),
    (
        4,
        c"contact unknown: a checked plan in the reference's phase, not the feet's",
    ),
    (
        10,
        c"inaccurate: the solver's point fails the optimality conditions; fallback",
    ),
    (
        11,
        c"infeasible: the constraints contradict each other; fallback",
    ),
    (
        12,
        c"iteration cap: the solver reached its deadline; fallback",
    ),
    (13, c"numerical failure: the solver broke down; fallback"),
    (
        14,
        c"measurement jump: a measurement far from the prediction; fallback",
    ),
    (
        15,
        c"lift failed: no torques for the latent input; fallback",
    ),
    (
        -1,
        c"not finite: a number is infinite or not a number; fallback",
    ),
    (
        -2,
        c"wrong dimension: the wrong number of values or too few samples; fallback",
    ),
    (-3, c"no reference: none has been set; fallback"),
    (BAD_POINTER, c"bad pointer: null or not aligned; fallback"),
    (
        TIME_ORDER,
        c"time order: the reference's time does not increase",
    ),
    (
        UNKNOWN_FEET,
        c"unknown feet: no phase of the model has these feet in contact",
    ),
    (BAD_SETTING, c"bad setting: a setting is out of its range"),
    (
        SOLVER_REFUSED,
        c"solver refused: the conic solver does not take the problem",
    ),
    (
        INTERNAL,
        c"internal: the controller broke down; set a reference to use it again",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mpc::online::LatentDynamics;
    use nalgebra::DMatrix;

    /// Equations that panic.
    #[derive(Debug)]
    struct Broken;

    impl LatentDynamics for Broken {
        fn jacobian(
            &mut self,
            _: usize,
            _: &[f64],
            _: &[f64],
            _: &[f64],
            _: &mut [f64],
            _: &mut DMatrix<f64>,
        ) {
            panic!("equations that panic");
        }
    }

    fn handle(is_broken: bool) -> Box<Handle<4>> {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/go1-d4.json");
        let model = crate::artifact::read(&path).expect("a shipped model");
        Handle::create(None, |settings| {
            let controller = Controller::new(&model, settings).expect("a complete model");
            if !is_broken {
                return Ok(controller);
            }
            Controller::with_plant(controller.plant().clone(), Box::new(Broken), settings)
        })
        .expect("default settings")
    }

    /// A robot that stands for 0.2 s.
    struct Stand {
        time_s: Vec<f64>,
        x: Vec<f64>,
        zeros: Vec<f64>,
        feet: Vec<u8>,
    }

    impl Stand {
        fn new() -> Self {
            let stand = [0.0, 0.8, -1.6].repeat(4);
            let x = [stand, vec![0.0, 0.0, 0.3, 0.0, 0.0, 0.0]].concat();
            Self {
                time_s: (0..100).map(|sample| 0.002 * f64::from(sample)).collect(),
                x: x.repeat(100),
                zeros: vec![0.0; 1800],
                feet: vec![1; 400],
            }
        }

        fn reference(&self) -> RawReference<'_> {
            RawReference {
                time_s: Some(&self.time_s),
                x: Some(&self.x),
                dx: Some(&self.zeros),
                u: Some(Some(&self.zeros)),
                feet: Some(&self.feet),
            }
        }

        fn measurement(&self) -> RawMeasurement<'_> {
            RawMeasurement {
                time_s: 0.0,
                x: Some(&self.x[..18]),
                dx: Some(&self.zeros[..18]),
                feet: Some(&self.feet[..4]),
            }
        }
    }

    fn message() -> String {
        // SAFETY: the text lives until the next refusal on this thread.
        let text = unsafe { CStr::from_ptr(last_error()) };
        text.to_string_lossy().into_owned()
    }

    #[test]
    fn every_status_has_a_text_that_begins_with_its_word() {
        let mut codes: Vec<i32> = TEXTS.iter().map(|(code, _)| *code).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), TEXTS.len());
        for status in Status::ALL {
            let text = status_text(status.code()).to_string_lossy();
            let word = status.word().replace('_', " ");
            assert!(text.starts_with(&format!("{word}:")), "{text}");
        }
        assert_eq!(status_text(77), c"unknown status");
    }

    #[test]
    fn default_settings_are_those_of_the_library() {
        let settings = Settings::default().to_mpc().expect("sound");
        assert_eq!(settings, MpcSettings::default());
    }

    #[test]
    fn settings_out_of_range_make_no_controller_and_say_which() {
        let base = Settings::default();
        let bad = [
            (
                "horizon",
                Settings {
                    horizon: -1,
                    ..base
                },
            ),
            ("horizon", Settings { horizon: 0, ..base }),
            ("lift", Settings { lift: 2, ..base }),
            (
                "linearisation",
                Settings {
                    linearisation: -1,
                    ..base
                },
            ),
            (
                "max_iterations",
                Settings {
                    max_iterations: -3,
                    ..base
                },
            ),
            (
                "step_s",
                Settings {
                    step_s: f64::NAN,
                    ..base
                },
            ),
            (
                "body_friction",
                Settings {
                    body_friction: -0.6,
                    ..base
                },
            ),
        ];
        for (name, settings) in bad {
            let found = Handle::<4>::create(Some(&settings), |settings| {
                settings.check()?;
                panic!("{name} was accepted");
            });
            assert!(found.is_none());
            assert!(message().contains(name), "{name}: {}", message());
        }
    }

    #[test]
    fn reference_with_a_fault_is_refused_with_its_code_and_the_old_one_stays() {
        let stand = Stand::new();
        let mut handle = handle(false);
        assert_eq!(handle.set_reference(&stand.reference()), 0);
        let sound = stand.reference();
        let mut nan = stand.x.clone();
        nan[20] = f64::NAN;
        let mut repeated = stand.time_s.clone();
        repeated[7] = repeated[6];
        let faults = [
            (BAD_POINTER, RawReference { x: None, ..sound }),
            (
                BAD_POINTER,
                RawReference {
                    feet: None,
                    ..sound
                },
            ),
            (
                BAD_POINTER,
                RawReference {
                    u: Some(None),
                    ..sound
                },
            ),
            (
                -1,
                RawReference {
                    x: Some(&nan),
                    ..sound
                },
            ),
            (
                -2,
                RawReference {
                    x: Some(&stand.x[1..]),
                    ..sound
                },
            ),
            (
                -2,
                RawReference {
                    time_s: Some(&[]),
                    ..sound
                },
            ),
            (
                TIME_ORDER,
                RawReference {
                    time_s: Some(&repeated),
                    ..sound
                },
            ),
        ];
        for (expected, reference) in faults {
            assert_eq!(handle.set_reference(&reference), expected, "{}", message());
        }
        let mut command = RawCommand::at_rest(handle.controller.plant().robot(), 99);
        assert_eq!(handle.step(&stand.measurement(), &mut command), 0);
        assert_eq!(handle.set_reference(&RawReference { u: None, ..sound }), 0);
    }

    #[test]
    fn measurement_without_values_gets_a_safe_command_and_the_next_one_a_plan() {
        let stand = Stand::new();
        let mut handle = handle(false);
        let mut command = RawCommand::at_rest(handle.controller.plant().robot(), 99);
        assert_eq!(handle.step(&stand.measurement(), &mut command), -3);
        assert_eq!(handle.set_reference(&stand.reference()), 0);
        let sound = stand.measurement();
        let no_state = RawMeasurement { x: None, ..sound };
        assert_eq!(handle.step(&no_state, &mut command), BAD_POINTER);
        assert!(command.torque.iter().all(|torque| torque.abs() <= 23.7));
        let no_feet = RawMeasurement {
            feet: None,
            ..sound
        };
        assert_eq!(handle.step(&no_feet, &mut command), BAD_POINTER);
        let not_finite = RawMeasurement {
            time_s: f64::NAN,
            ..sound
        };
        assert_eq!(handle.step(&not_finite, &mut command), -1);
        assert_eq!(handle.step(&sound, &mut command), 0);
        handle.reset();
        assert_eq!(handle.step(&sound, &mut command), 0);
    }

    #[test]
    fn panic_inside_a_step_becomes_a_code_with_the_last_posture_and_no_torque() {
        let stand = Stand::new();
        let mut handle = handle(true);
        assert_eq!(handle.set_reference(&stand.reference()), 0);
        let mut command = RawCommand::at_rest(handle.controller.plant().robot(), 99);
        let rest = command.joint_position;
        for _ in 0..2 {
            assert_eq!(handle.step(&stand.measurement(), &mut command), INTERNAL);
            assert_eq!((command.status, command.torque), (INTERNAL, [0.0; 12]));
            assert_eq!(command.joint_position, rest);
        }
        // Without an input the reference asks the equations for one.
        let no_input = RawReference {
            u: None,
            ..stand.reference()
        };
        assert_eq!(handle.set_reference(&no_input), INTERNAL);
        assert!(message().contains("broke down"));
    }
}
