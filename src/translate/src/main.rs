//! Writes the C of romc's structured solver from its Rust: `cargo run -p romc-translate`.

use std::error::Error;
use std::path::Path;

use romc_translate::solver;

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (path, text) in solver(&root)? {
        std::fs::write(root.join(path), text)?;
        println!("{path}");
    }
    Ok(())
}
