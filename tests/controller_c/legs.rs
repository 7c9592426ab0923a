//! The generated controller's own functions of legs against the library's, bit for bit: forces of torques and the
//! consistent lift, on robots of all shapes.

use romc::codegen::Precision;
use romc::model::ReducedModel;
use romc::mpc::{ConsistentLift, Lift, MpcSettings, Solver, StanceState};
use romc::robot::WrenchFrame;

use crate::emitted::Emitted;
use crate::programs::{root, shipped};
use crate::push;
use crate::random::Random;
use crate::tools::is_thorough;

/// The model on the robot of a file, with forces in one of the frames.
pub fn on_robot(name: &str, frame: WrenchFrame) -> ReducedModel {
    let path = root().join("examples/robots").join(name);
    let robot = romc::robot_file::find(&path.to_string_lossy()).expect("an example");
    let builder = shipped("go1-d4").into_builder().robot(robot);
    builder.wrench_frame(frame).build().expect("a sound model")
}

fn robot_name(model: &ReducedModel) -> &str {
    model.robot().expect("a robot").name
}

#[test]
fn forces_of_the_drives_have_the_librarys_bits_for_planar_legs_and_chains_in_both_frames() {
    let mut random = Random::new(5);
    for model in [
        on_robot("solo12.toml", WrenchFrame::Body),
        on_robot("hare.urdf", WrenchFrame::World),
        on_robot("anymal_c.toml", WrenchFrame::Body),
        shipped("go1-d4"),
    ] {
        // A robot is seconds of compiling: one of either kind of leg.
        if !is_thorough() && !["solo12", "hare"].contains(&robot_name(&model)) {
            continue;
        }
        let rule = model.input_rule().expect("a robot");
        let mut bytes = Vec::new();
        for sample in 0..2000 {
            // Every third posture is near a stretched knee.
            let reach = if sample % 3 == 0 { 0.2 } else { 2.0 };
            let x: [f64; 18] = std::array::from_fn(|i| match i % 3 {
                2 if i < 12 => reach * random.signed(),
                _ => 1.5 * random.signed(),
            });
            let torque: [f64; 12] = std::array::from_fn(|_| 20.0 * random.signed());
            let feet: [bool; 4] = std::array::from_fn(|_| random.signed() > -0.5);
            let wrench = rule.wrench(&x, &torque, feet).expect("finite");
            push(&mut bytes, &x);
            push(&mut bytes, &torque);
            push(&mut bytes, wrench.as_slice());
            bytes.extend(feet.map(u8::from));
        }
        let emitted = Emitted::new(&model, Precision::Double);
        println!("{}", emitted.with_source("wrench.c", &bytes));
    }
}

#[test]
fn consistent_lift_has_the_librarys_bits_for_planar_legs_and_chains_in_both_frames() {
    let mut random = Random::new(6);
    let mut unlifted = 0;
    for model in [
        on_robot("solo12.toml", WrenchFrame::Body),
        on_robot("hare.urdf", WrenchFrame::World),
        on_robot("anymal_c.toml", WrenchFrame::Body),
        shipped("go2-async-d4"),
    ] {
        if !is_thorough() && !["solo12", "hare"].contains(&robot_name(&model)) {
            continue;
        }
        let settings = MpcSettings {
            solver: Solver::Riccati,
            lift: Lift::Consistent,
            ..MpcSettings::default()
        };
        let plant = romc::mpc::control_model(&model).expect("a complete model");
        let mut lift = ConsistentLift::new(&plant, &settings).expect("a sound program");
        let (mut bytes, mut limited, mut failed) = (Vec::new(), 0, 0);
        for sample in 0..2000 {
            let feet: [bool; 4] = std::array::from_fn(|_| random.signed() > -0.5);
            let Some(phase) = plant.phase_for(feet) else {
                continue;
            };
            // Every third posture is near a stretched knee.
            let reach = if sample % 3 == 0 { 0.02 } else { 2.0 };
            let stance = StanceState {
                joints_rad: std::array::from_fn(|i| match i % 3 {
                    2 => reach * random.signed(),
                    _ => random.signed(),
                }),
                attitude_rad: std::array::from_fn(|_| random.signed()),
                feet,
                phase,
                losses_nm: std::array::from_fn(|_| 2.0 * random.signed()),
                near_nm: None,
                keeps_swing: false,
            };
            let inputs = &plant.phases()[phase];
            let size = [0.3, 1.0, 5.0][sample / 3 % 3];
            let off = inputs.latent_mean.map(|_| size * random.normal());
            let u_lat = &inputs.latent_mean + &inputs.latent_root * off;
            let torque = lift.lift(&plant, u_lat.as_slice(), &stance);
            limited += usize::from(lift.iterations() > 0);
            failed += usize::from(torque.is_err());
            push(&mut bytes, &stance.joints_rad);
            push(&mut bytes, &stance.attitude_rad);
            push(&mut bytes, u_lat.as_slice());
            push(&mut bytes, &stance.losses_nm);
            push(&mut bytes, &torque.unwrap_or_default());
            bytes.extend(feet.map(u8::from));
            bytes.extend([phase as u8, u8::from(torque.is_ok())]);
        }
        let emitted = Emitted::new(&model, Precision::Double);
        let text = emitted.with_source("lift.c", &bytes);
        println!(
            "{}: {limited} limited, {failed} failed, {text}",
            emitted.name
        );
        assert!(limited > 100, "{limited}");
        unlifted += failed;
    }
    assert!(unlifted > 100, "legs are hardly stretched: {unlifted}");
}
