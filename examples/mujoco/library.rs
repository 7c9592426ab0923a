//! The latent controller as a shared library, for simulators in other languages.
//!
//! `cargo build --release --example romc_mujoco` makes it; `romc_controller.py` beside this file
//! loads it. One opaque pointer a controller; every array belongs to the caller, in SI units and in
//! the orders of [`romc::mpc`].

use std::ffi::{CStr, c_char, c_int};
use std::path::Path;
use std::slice::from_raw_parts;

use romc::mpc::{Command, Controller, Measurement, MpcSettings, ReferenceSamples};
use romc::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, STATE_DIM};

/// What a robot's low-level interface takes.
#[repr(C)]
pub struct RomcCommand {
    /// Feed-forward torques, N m.
    pub torque: [f64; JOINT_DIM],
    /// Desired joint positions, rad.
    pub joint_position: [f64; JOINT_DIM],
    /// Desired joint velocities, rad/s.
    pub joint_velocity: [f64; JOINT_DIM],
    /// [`romc::mpc::Status::code`].
    pub status: i32,
    /// Interior-point iterations.
    pub iterations: i32,
    /// Wall time of the step, µs.
    pub solve_us: f64,
}

/// A controller with the command that its steps fill.
pub struct RomcController {
    controller: Controller,
    command: Command,
}

/// A controller of a model file with default settings; null, and a message on stderr, if there is
/// none to be made.
///
/// # Safety
/// `model` is a string that ends in zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn romc_controller_new(model: *const c_char) -> *mut RomcController {
    // SAFETY: the caller's promise.
    let path = unsafe { CStr::from_ptr(model) }.to_string_lossy();
    match open(Path::new(path.as_ref())) {
        Ok(controller) => Box::into_raw(Box::new(controller)),
        Err(error) => {
            eprintln!("{path}: {error}");
            std::ptr::null_mut()
        }
    }
}

fn open(path: &Path) -> Result<RomcController, romc::Error> {
    let model = romc::artifact::read(path)?;
    Ok(RomcController {
        controller: Controller::new(&model, MpcSettings::default())?,
        command: Command::zeros(model.latent_dim()),
    })
}

/// Sets the trajectory to follow; 0, or -1 and a message on stderr if it is refused.
///
/// # Safety
/// `controller` comes from [`romc_controller_new`]; the arrays hold `count` times, `count` times 18
/// states, velocities and inputs (or `u` is null), and `count` times 4 feet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn romc_controller_set_reference(
    controller: *mut RomcController,
    count: usize,
    time_s: *const f64,
    x: *const f64,
    dx: *const f64,
    u: *const f64,
    feet: *const u8,
) -> c_int {
    // SAFETY: the caller's promise.
    let (controller, flags, samples) = unsafe {
        let rows = |values: *const f64| from_raw_parts(values, count * STATE_DIM);
        let samples = (
            from_raw_parts(time_s, count),
            rows(x),
            rows(dx),
            (!u.is_null()).then(|| rows(u)),
        );
        (
            &mut *controller,
            from_raw_parts(feet, count * FOOT_DIM),
            samples,
        )
    };
    let feet: Vec<ContactFlags> = flags.chunks_exact(FOOT_DIM).map(contact).collect();
    let (time_s, x, dx, u) = samples;
    let samples = ReferenceSamples {
        time_s,
        x,
        dx,
        u,
        feet: &feet,
    };
    match controller.controller.set_reference(samples) {
        Ok(()) => 0,
        Err(error) => {
            eprintln!("{error}");
            -1
        }
    }
}

/// One control step; returns its status.
///
/// # Safety
/// `controller` comes from [`romc_controller_new`]; `x` and `dx` hold 18 values, `feet` holds 4,
/// `command` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn romc_controller_step(
    controller: *mut RomcController,
    time_s: f64,
    x: *const f64,
    dx: *const f64,
    feet: *const u8,
    command: *mut RomcCommand,
) -> c_int {
    // SAFETY: the caller's promise.
    let (controller, measurement, command) = unsafe {
        let measurement = Measurement {
            time_s,
            x: from_raw_parts(x, STATE_DIM),
            dx: from_raw_parts(dx, STATE_DIM),
            feet: contact(from_raw_parts(feet, FOOT_DIM)),
        };
        (&mut *controller, measurement, &mut *command)
    };
    let RomcController {
        controller,
        command: found,
    } = controller;
    controller.step_into(measurement, found);
    *command = RomcCommand {
        torque: found.torque_nm,
        joint_position: found.joint_position_rad,
        joint_velocity: found.joint_velocity_rad_s,
        status: found.status.code(),
        iterations: found.iterations as i32,
        solve_us: found.solve_us,
    };
    command.status
}

/// Frees a controller.
///
/// # Safety
/// `controller` comes from [`romc_controller_new`] and is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn romc_controller_free(controller: *mut RomcController) {
    if !controller.is_null() {
        // SAFETY: the caller's promise.
        drop(unsafe { Box::from_raw(controller) });
    }
}

fn contact(flags: &[u8]) -> ContactFlags {
    std::array::from_fn(|foot| flags[foot] != 0)
}
