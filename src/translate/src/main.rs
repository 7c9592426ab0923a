//! Writes the C of romc's controller from its Rust: `cargo run -p romc-translate`.

use std::error::Error;
use std::path::Path;

use romc_translate::controller;

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (path, text) in controller(&root)? {
        std::fs::write(root.join(path), text)?;
        println!("{path}");
    }
    Ok(())
}
