//! Runs the latent-space controller along a recorded jump, from the library, and prints its torques:
//! `cargo run --release --example latent_mpc -- models/go1-d4.json examples/recordings/go1/test_01.csv.gz`

use std::path::Path;

use romc::mpc::{Measurement, MpcSettings, ReferenceSamples};
use romc::robot::STATE_DIM;
use romc::{artifact, recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, jump] = arguments.as_slice() else {
        return Err("usage: latent_mpc MODEL.json JUMP.csv".into());
    };
    let model = artifact::read(Path::new(model))?;
    let jump = recording::read(Path::new(jump))?;
    let segment = jump.segments.first().ok_or("the recording is empty")?;
    let input = segment.input(&model.input_rule()?)?;

    let mut controller = romc::mpc::controller(&model, MpcSettings::default())?;
    controller.set_reference(ReferenceSamples {
        time_s: &segment.time_s,
        x: segment.x.as_slice(),
        dx: segment.dx.as_slice(),
        u: Some(input.as_slice()),
        feet: &segment.feet,
    })?;
    // a measurement every 10 ms; on a robot these come from its state estimator
    let mut due_s = f64::NEG_INFINITY;
    for (sample, &time_s) in segment.time_s.iter().enumerate() {
        if time_s < due_s {
            continue;
        }
        due_s = time_s + controller.settings().step_s - 1e-6;
        let values = sample * STATE_DIM..(sample + 1) * STATE_DIM;
        let command = controller.step(Measurement {
            time_s,
            x: &segment.x.as_slice()[values.clone()],
            dx: &segment.dx.as_slice()[values],
            feet: segment.feet[sample],
        });
        let torques = command.torque_nm.map(|torque| format!("{torque:7.2}"));
        println!("{time_s:.3} s  {:?}  {}", command.status, torques.join(" "));
    }
    Ok(())
}
