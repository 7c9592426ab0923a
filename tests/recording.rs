//! Recordings from outside: every kind of bad file, random bytes, real jumps.
//!
//! `fixtures/recordings/landing.csv` is 24 rows around the touchdown of
//! `examples/recordings/go1/train_01.csv.gz` (its lines 401 to 424).

#[path = "recording/bad_files.rs"]
mod bad_files;
#[path = "recording/checks.rs"]
mod checks;
#[path = "recording/foreign.rs"]
mod foreign;
#[path = "recording/formats.rs"]
mod formats;
#[path = "recording/guesses.rs"]
mod guesses;
#[path = "recording/mcap.rs"]
mod mcap;
#[path = "recording/mismatches.rs"]
mod mismatches;
mod outside;
#[path = "recording/random_bytes.rs"]
mod random_bytes;
#[path = "recording/real_jumps.rs"]
mod real_jumps;
#[path = "recording/repairs.rs"]
mod repairs;
#[path = "recording/samples.rs"]
mod samples;
#[path = "recording/sheet.rs"]
mod sheet;
mod tools;
