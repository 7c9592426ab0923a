//! A controller that C holds by its address: a trajectory and measurements in, commands out.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::super::command::{Command, Status};
use super::super::controller::{Controller, Measurement};
use super::super::error::ControlError;
use super::super::reference::ReferenceSamples;
use super::super::settings::{MpcSettings, Settings};
use super::codes::{BAD_POINTER, INTERNAL, guarded, report};
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, Robot};

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

/// A trajectory as it comes through the interface; see [`ReferenceSamples`].
#[derive(Debug, Clone, Copy)]
pub struct RawReference<'a> {
    /// Time of each sample, s.
    pub time_s: Option<&'a [f64]>,
    /// States, 18 values per sample.
    pub x: Option<&'a [f64]>,
    /// Velocities, 18 values per sample.
    pub dx: Option<&'a [f64]>,
    /// Inputs, 18 values per sample, unless there are none; the inner `None` is a bad pointer.
    pub u: Option<Option<&'a [f64]>>,
    /// Feet in contact, 4 values per sample, zero in the air.
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

/// A controller with the memory that its interface needs; `D` latent coordinates.
#[derive(Debug)]
pub struct Handle<const D: usize> {
    controller: Controller,
    command: Command,
    last: RawCommand<D>,
    /// A panic was caught: what the controller holds may contradict itself.
    is_broken: bool,
}

impl<const D: usize> Handle<D> {
    /// Builds a controller with `build`, from settings or the defaults; a message is left for
    /// [`last_error`](super::last_error) if there is none to be made.
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

    /// Takes a trajectory to follow; 0, or a code with a message for [`last_error`](super::last_error). A refused
    /// trajectory leaves the old one.
    pub fn set_reference(&mut self, raw: &RawReference<'_>) -> i32 {
        match self.take_reference(raw) {
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

    fn take_reference(&mut self, raw: &RawReference<'_>) -> Result<(), i32> {
        let (time_s, x) = (present("time_s", raw.time_s)?, present("x", raw.x)?);
        let (dx, feet) = (present("dx", raw.dx)?, present("feet", raw.feet)?);
        let u = raw.u.map(|u| present("u", u)).transpose()?;
        guarded(|| {
            let feet: Vec<ContactFlags> = feet.chunks_exact(FOOT_DIM).map(contact).collect();
            self.controller.set_reference(ReferenceSamples {
                time_s,
                x,
                dx,
                u,
                feet: &feet,
            })
        })
    }

    /// Computes the command for a measurement; returns its status.
    pub fn step(&mut self, raw: &RawMeasurement<'_>, out: &mut RawCommand<D>) -> i32 {
        let has_all = raw.x.is_some() && raw.dx.is_some() && raw.feet.is_some();
        let measurement = Measurement {
            time_s: raw.time_s,
            // No values are the wrong number of them: the controller falls back.
            x: raw.x.filter(|_| has_all).unwrap_or(&[]),
            dx: raw.dx.filter(|_| has_all).unwrap_or(&[]),
            feet: raw.feet.map_or([false; FOOT_DIM], contact),
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
    fn safe(&self) -> RawCommand<D> {
        RawCommand {
            torque: [0.0; JOINT_DIM],
            joint_velocity: [0.0; JOINT_DIM],
            u_lat: [0.0; D],
            iterations: 0,
            solve_us: 0.0,
            status: INTERNAL,
            ..self.last
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

/// Feet in contact of four flags; zero is in the air.
fn contact(flags: &[u8]) -> ContactFlags {
    std::array::from_fn(|foot| flags.get(foot).is_some_and(|&flag| flag != 0))
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use nalgebra::DMatrix;

    use super::super::codes::last_error;
    use super::*;
    use crate::mpc::online::LatentDynamics;

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

    #[test]
    fn panic_inside_a_step_becomes_a_code_with_the_last_posture_and_no_torque() {
        let model = crate::evaluate::shipped_model("go1-d4");
        let handle = Handle::<4>::create(None, |settings| {
            let controller = Controller::new(&model, settings).expect("a complete model");
            Controller::with_plant(controller.plant().clone(), Box::new(Broken), settings)
        });
        let mut handle = handle.expect("default settings");
        // A robot that stands for 0.2 s.
        let time_s: Vec<f64> = (0..100).map(|sample| 0.002 * f64::from(sample)).collect();
        let joints = [0.0, 0.8, -1.6].repeat(4);
        let x = [&joints[..], &[0.0, 0.0, 0.3, 0.0, 0.0, 0.0]]
            .concat()
            .repeat(100);
        let (zeros, feet) = ([0.0; 1800], [1; 400]);
        let reference = RawReference {
            time_s: Some(&time_s),
            x: Some(&x),
            dx: Some(&zeros),
            u: Some(Some(&zeros)),
            feet: Some(&feet),
        };
        let short = RawReference {
            x: Some(&x[1..]),
            ..reference
        };
        assert_eq!(handle.set_reference(&short), -2);
        assert_eq!(handle.set_reference(&reference), 0);
        let measurement = RawMeasurement {
            time_s: 0.0,
            x: Some(&x[..18]),
            dx: Some(&zeros[..18]),
            feet: Some(&feet[..4]),
        };
        let mut command = RawCommand::at_rest(handle.controller.plant().robot(), 99);
        let rest = command.joint_position;
        for _ in 0..2 {
            assert_eq!(handle.step(&measurement, &mut command), INTERNAL);
            assert_eq!((command.status, command.torque), (INTERNAL, [0.0; 12]));
            assert_eq!(command.joint_position, rest);
        }
        // Without an input the reference asks the equations for one.
        let no_input = RawReference {
            u: None,
            ..reference
        };
        assert_eq!(handle.set_reference(&no_input), INTERNAL);
        // SAFETY: the text lives until the next refusal on this thread.
        let message = unsafe { CStr::from_ptr(last_error()) };
        assert!(message.to_string_lossy().contains("broke down"));
    }
}
