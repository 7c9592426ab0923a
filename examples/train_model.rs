//! Trains a model from the library, without the command line, and prints its figures on jumps it never saw.
//!
//! `cargo run --release --example train_model -- 4 [OUTPUT.json]`

use std::sync::atomic::AtomicBool;

use romc::recording::{self, Recording};
use romc::robot::Robot;
use romc::train::{self, Origin, Recordings, TrainOptions, Watch};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let latent_dim = std::env::args().nth(1).map_or(Ok(4), |text| text.parse())?;
    let folder = "examples/recordings/go1";
    let read = |set: &str, count: usize| -> Result<Vec<Recording>, recording::RecordingError> {
        (1..=count)
            .map(|i| recording::read(format!("{folder}/{set}_{i:02}.csv.gz").as_ref()))
            .collect()
    };
    let (training, validation, test) =
        (read("train", 14)?, read("validation", 3)?, read("test", 3)?);
    let robot = Robot::by_name("go1")?;
    let options = TrainOptions::new(format!("go1-d{latent_dim}"), latent_dim);

    let output = std::env::args().nth(2);
    let command = format!(
        "cargo run --release -- train {folder}/train_*.csv.gz --validation {folder}/validation_*.csv.gz \
         --latent-dim {latent_dim} --method closed-form --output models/go1-d{latent_dim}.json"
    );
    let started = std::time::Instant::now();
    let (cancel, mut listener) = (AtomicBool::new(false), |_| ());
    let trained = train::closed_form(
        Recordings {
            training: &training,
            validation: &validation,
        },
        robot,
        &options,
        &Origin::new(command, &training),
        &mut Watch::new(&mut listener, &cancel),
    )?;
    println!(
        "trained in {:.2} s: {:#?}",
        started.elapsed().as_secs_f64(),
        trained.report
    );
    if let Some(output) = output {
        romc::artifact::write(output.as_ref(), &trained.model)?;
    }
    println!("test jumps: {:#?}", train::assess(&trained.model, &test)?);
    Ok(())
}
