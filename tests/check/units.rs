//! Two sides of a comparison: models against their own print, mutated ones, papers typed by hand.

mod domains;
mod models;
mod papers;
mod printed;
#[path = "../tools/mod.rs"]
mod tools;
