//! The controller behind its C interface.

use std::ffi::CStr;

use romc::mpc::interface::{
    Handle, INTERNAL, RawCommand, Settings, all_codes, last_error, status_text,
};
use romc::mpc::{Controller, LatentDynamics, Lift, Linearisation, MpcSettings, Solver, Status};

/// Equations that panic.
#[derive(Debug)]
struct Broken;

impl LatentDynamics for Broken {
    fn accelerate(
        &mut self,
        _: usize,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
        _: &mut [f64],
    ) -> usize {
        panic!("equations that panic");
    }

    fn row(&self, _: usize, _: usize) -> usize {
        0
    }

    fn column(&self, _: usize, _: usize) -> usize {
        0
    }
}

#[test]
fn panic_inside_a_step_becomes_a_code_with_the_last_posture_and_no_torque() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/models/go1-d4.json");
    let model = romc::artifact::read(std::path::Path::new(path)).expect("shipped");
    let handle = Handle::<4>::create(None, |settings| {
        let controller = romc::mpc::controller(&model, settings).expect("a complete model");
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
    let set = |handle: &mut Handle<4>, x: &[f64], u: Option<Option<&[f64]>>| {
        handle.set_reference(Some(&time_s), Some(x), Some(&zeros), u, Some(&feet))
    };
    assert_eq!(set(&mut handle, &x[1..], Some(Some(&zeros))), -2);
    assert_eq!(set(&mut handle, &x, Some(Some(&zeros))), 0);
    let mut command = RawCommand::at_rest(romc::robot_file::by_name("go1").expect("known"), 99);
    let rest = command.joint_position;
    for _ in 0..2 {
        let (x, dx, feet) = (Some(&x[..18]), Some(&zeros[..18]), Some(&feet[..4]));
        assert_eq!(handle.step(0.0, x, dx, feet, &mut command), INTERNAL);
        assert_eq!((command.status, command.torque), (INTERNAL, [0.0; 12]));
        assert_eq!(command.joint_position, rest);
    }
    // Without an input the reference asks the equations for one.
    assert_eq!(set(&mut handle, &x, None), INTERNAL);
    // SAFETY: the text lives until the next refusal on this thread.
    let message = unsafe { CStr::from_ptr(last_error()) };
    assert!(message.to_string_lossy().contains("broke down"));
}

#[test]
fn every_code_has_a_text_and_that_of_a_status_begins_with_its_word() {
    let mut known: Vec<i32> = all_codes().map(|(code, _)| code).collect();
    let count = known.len();
    known.sort_unstable();
    known.dedup();
    assert_eq!(known.len(), count);
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
fn choices_come_back_by_their_numbers() {
    for choices in [
        (Lift::Transpose, Linearisation::Reference, Solver::Clarabel),
        (Lift::Consistent, Linearisation::LastPlan, Solver::Riccati),
    ] {
        let settings = Settings {
            lift: choices.0 as i32,
            linearisation: choices.1 as i32,
            solver: choices.2 as i32,
            ..Settings::default()
        };
        let read = settings.to_mpc().expect("sound");
        assert_eq!((read.lift, read.linearisation, read.solver), choices);
    }
}
