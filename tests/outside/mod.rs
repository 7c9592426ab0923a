//! Recordings next to the checkout, which exist on some machines only.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The jump recorded on a Go1; without it, prints that the calling test is skipped.
pub fn hardware_jump() -> Option<PathBuf> {
    beside("go1_hardware_jump.csv")
}

/// A file or folder of the recordings next to the checkout; without it, prints that the calling test is skipped.
pub fn beside(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = folder.join(name);
    if path.exists() {
        return Some(path);
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // not by eprintln!, which the test harness captures
    let _ = writeln!(
        std::io::stderr(),
        "skipped: {test}: {} does not exist",
        path.display()
    );
    None
}
