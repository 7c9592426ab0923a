//! Trains a model from the library, without the command line, and prints its figures on jumps it never saw.
//!
//! `cargo run --release --example train_model -- 4 [closed-form|joint|paper]`

use std::sync::atomic::AtomicBool;

use romc::recording::{self, Recording};
use romc::train::{self, Method, Monitor, Origin, Recordings, TrainOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let latent_dim = std::env::args().nth(1).map_or(Ok(4), |text| text.parse())?;
    let method = std::env::args().nth(2).unwrap_or("closed-form".into());
    let folder = "examples/recordings/go1";
    let read = |set: &str, count: usize| -> Result<Vec<Recording>, recording::RecordingError> {
        (1..=count)
            .map(|i| recording::read(format!("{folder}/{set}_{i:02}.csv.gz").as_ref()))
            .collect()
    };
    let (training, validation, test) =
        (read("train", 14)?, read("validation", 3)?, read("test", 3)?);
    let robot = romc::robot_file::by_name("go1")?;
    let name = format!("go1-d{latent_dim}");
    let options = match method.as_str() {
        "paper" => TrainOptions::paper(name, latent_dim),
        _ => TrainOptions::new(name, latent_dim),
    };
    let command = "cargo run --release --example train_model";
    let files = training.iter().map(|recording| &recording.path);
    let method = match method.as_str() {
        "closed-form" => Method::ClosedForm,
        _ => Method::Joint,
    };

    let started = std::time::Instant::now();
    let (cancel, mut listener) = (AtomicBool::new(false), |_| ());
    let trained = method.learn(
        Recordings::new(&training, &validation),
        robot,
        &options,
        &Origin::new(command, files),
        &mut Monitor::new(&mut listener, &cancel),
    )?;
    println!(
        "trained in {:.2} s: {:#?}",
        started.elapsed().as_secs_f64(),
        trained.report
    );
    println!("test jumps: {:#?}", train::assess(&trained.model, &test)?);
    Ok(())
}
