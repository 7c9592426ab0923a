//! The controller behind a C interface: numbers in, numbers and codes out, never a panic.
//!
//! A generated controller wraps these functions under its model's name; pointers are turned into slices there,
//! everything else happens here. A pointer that cannot be used arrives as `None`.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::command::{Command, Status};
use super::controller::{Controller, Measurement};
use super::error::ControlError;
use super::reference::ReferenceSamples;
use super::settings::MpcSettings;
pub use super::settings::{Accepts, SETTINGS, Setting, Settings};
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, Robot};

macro_rules! codes {
    ($($name:ident = $code:literal, $text:literal;)*) => {
        $(#[doc = $text] pub const $name: i32 = $code;)*

        const BEYOND_STEPS: &[(i32, &str)] = &[$(($name, concat!($text, "\0"))),*];
    };
}

codes! {
    BAD_POINTER = -4, "bad pointer: null or not aligned; fallback";
    TIME_ORDER = -5, "time order: the reference's time does not increase";
    UNKNOWN_FEET = -6, "unknown feet: no phase of the model has these feet in contact";
    BAD_SETTING = -7, "bad setting: a setting is out of its range";
    SOLVER_REFUSED = -8, "solver refused: the conic solver rejects the problem";
    INTERNAL = -9, "internal: the controller broke down; set a reference to use it again";
}

/// Runs `action`; its error or panic becomes a code, and a message for [`last_error`].
fn guarded<T>(action: impl FnOnce() -> Result<T, ControlError>) -> Result<T, i32> {
    match catch_unwind(AssertUnwindSafe(action)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => {
            report(&error.to_string());
            Err(code_of(&error))
        }
        Err(_) => {
            report("the controller broke down inside");
            Err(INTERNAL)
        }
    }
}

fn code_of(error: &ControlError) -> i32 {
    match error {
        ControlError::Shape { .. } => INTERNAL,
        ControlError::Setting { .. } | ControlError::StructuredDim { .. } => BAD_SETTING,
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
pub fn report(message: &str) {
    let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
    LAST_ERROR.with_borrow_mut(|last| *last = text);
}

/// Why the last call on this thread that made a controller or set a reference was refused; valid until the next such
/// call on this thread.
pub fn last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|last| last.as_ptr())
}

/// Every code that the interface returns, with its text.
pub fn all_codes() -> impl Iterator<Item = (i32, &'static CStr)> {
    let of_steps = (Status::ALL.iter()).map(|status| (status.code(), status.text()));
    let texts = of_steps.chain(BEYOND_STEPS.iter().copied());
    texts.map(|(code, text)| {
        let text = CStr::from_bytes_until_nul(text.as_bytes());
        (code, text.expect("texts end with a nul"))
    })
}

/// A status or return code in words.
pub fn status_text(code: i32) -> &'static CStr {
    let mut codes = all_codes();
    let found = codes.find(|(known, _)| *known == code);
    found.map_or(c"unknown status", |(_, text)| text)
}

/// The [`Command`] as C has it; `D` latent coordinates.
#[repr(C)]
#[allow(missing_docs, reason = "as in `Command`")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawCommand<const D: usize> {
    pub torque: [f64; JOINT_DIM],
    pub joint_position: [f64; JOINT_DIM],
    pub joint_velocity: [f64; JOINT_DIM],
    pub stiffness: f64,
    pub damping: f64,
    pub u_lat: [f64; D],
    pub status: i32,
    pub iterations: i32,
    pub solve_us: f64,
}

impl<const D: usize> RawCommand<D> {
    /// No torque, at the middle of the joints' ranges: the command without any measurement or plan.
    pub fn at_rest(robot: &Robot, status: i32) -> Self {
        Self {
            torque: [0.0; JOINT_DIM],
            joint_position: robot
                .joint_limit_rad()
                .map(|(lower, upper)| 0.5 * (lower + upper)),
            joint_velocity: [0.0; JOINT_DIM],
            stiffness: 0.0,
            damping: 0.0,
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
    /// A panic was caught: the controller's state may be inconsistent.
    is_broken: bool,
}

impl<const D: usize> Handle<D> {
    /// Builds a controller with `build`, from settings or the defaults; a message is left for [`last_error`] if there
    /// is none to be made.
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

    /// Sets [`ReferenceSamples`] as the trajectory to follow. `feet` has four values per sample, zero in the air. For
    /// `u` the inner `None` is an invalid pointer. Returns 0, or a code with a message for [`last_error`]; after an
    /// error the old trajectory stays.
    pub fn set_reference(
        &mut self,
        time_s: Option<&[f64]>,
        x: Option<&[f64]>,
        dx: Option<&[f64]>,
        u: Option<Option<&[f64]>>,
        feet: Option<&[u8]>,
    ) -> i32 {
        let mut take = || {
            let (time_s, x) = (present("time_s", time_s)?, present("x", x)?);
            let (dx, feet) = (present("dx", dx)?, present("feet", feet)?);
            let u = u.map(|u| present("u", u)).transpose()?;
            let feet: Vec<ContactFlags> = feet.chunks_exact(FOOT_DIM).map(contact).collect();
            let samples = ReferenceSamples {
                time_s,
                x,
                dx,
                u,
                feet: &feet,
            };
            guarded(|| self.controller.set_reference(samples))
        };
        let code = take().err().unwrap_or(0); // 0 without a fault
        self.is_broken = code == INTERNAL || self.is_broken && code != 0;
        code
    }

    /// Computes the command for a measurement; returns its status.
    pub fn step(
        &mut self,
        time_s: f64,
        x: Option<&[f64]>,
        dx: Option<&[f64]>,
        feet: Option<&[u8]>,
        out: &mut RawCommand<D>,
    ) -> i32 {
        let has_all = x.is_some() && dx.is_some() && feet.is_some();
        let measurement = Measurement {
            time_s,
            // No values are the wrong number of them: the controller falls back.
            x: x.filter(|_| has_all).unwrap_or(&[]),
            dx: dx.filter(|_| has_all).unwrap_or(&[]),
            feet: feet.map_or([false; FOOT_DIM], contact),
        };
        let (controller, command) = (&mut self.controller, &mut self.command);
        let step = AssertUnwindSafe(|| controller.step_into(measurement, command));
        self.is_broken = self.is_broken || catch_unwind(step).is_err();
        if self.is_broken {
            *out = self.safe();
            return INTERNAL;
        }
        let command = &self.command;
        *out = RawCommand {
            torque: command.torque_nm,
            joint_position: command.joint_position_rad,
            joint_velocity: command.joint_velocity_rad_s,
            stiffness: command.drives.stiffness_nm_rad,
            damping: command.drives.damping_nm_s_rad,
            u_lat: std::array::from_fn(|latent| command.u_lat[latent]),
            status: if has_all {
                command.status.code()
            } else {
                BAD_POINTER
            },
            iterations: command.iterations as i32,
            solve_us: command.solve_us,
        };
        self.last = *out;
        out.status
    }

    /// Forgets plan and past measurements, but not the reference.
    pub fn reset(&mut self) {
        let reset = AssertUnwindSafe(|| self.controller.reset());
        self.is_broken |= catch_unwind(reset).is_err();
    }

    /// No torque, at the posture of the last command.
    fn safe(&self) -> RawCommand<D> {
        RawCommand {
            joint_position: self.last.joint_position,
            ..RawCommand::at_rest(self.controller.plant().robot(), INTERNAL)
        }
    }
}

/// An array of a reference, or the code for one whose pointer cannot be used.
fn present<T>(name: &str, array: Option<T>) -> Result<T, i32> {
    array.ok_or_else(|| {
        report(&format!("reference: `{name}` is null or not aligned"));
        BAD_POINTER
    })
}

fn contact(flags: &[u8]) -> ContactFlags {
    std::array::from_fn(|foot| flags.get(foot).is_some_and(|&flag| flag != 0))
}
