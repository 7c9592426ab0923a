//! Compiles a model file to C and Rust:
//! `cargo run --release --example compile_model -- models/paper-2d.json out`

use std::path::Path;
use std::process::ExitCode;

use romc::artifact;
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::{Overwrite, write_files};
use romc::typeset::PrintOptions;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, folder] = arguments.as_slice() else {
        eprintln!("usage: compile_model MODEL.json FOLDER");
        return ExitCode::from(2);
    };
    match compile(Path::new(model), Path::new(folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn compile(model: &Path, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let model = artifact::read(model)?;
    let options = EmitOptions {
        print: PrintOptions {
            digest: Some(artifact::digest(&model).short()),
            ..PrintOptions::default()
        },
        ..EmitOptions::default()
    };
    let files = emit(&Equations::of(&model), &[Target::C, Target::Rust], &options)?;
    for path in write_files(folder, &files, Overwrite::Refuse)? {
        println!("{}", path.display());
    }
    Ok(())
}
