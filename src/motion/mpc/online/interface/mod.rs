//! The controller behind a C interface: numbers in, numbers and codes out, never a panic.
//!
//! A generated controller wraps these functions under its model's name; pointers are turned into
//! slices there, everything else happens here. A pointer that cannot be used arrives as `None`.
//! Read `handle` first, which answers with `codes`.

mod codes;
mod handle;

pub use super::settings::{Accepts, SETTINGS, Setting, Settings};
pub use codes::{
    BAD_POINTER, BAD_SETTING, INTERNAL, SOLVER_REFUSED, TIME_ORDER, UNKNOWN_FEET, all_codes,
    last_error, report, status_text,
};
pub use handle::{Handle, RawCommand, RawMeasurement, RawReference};
