//! Recorded jumps: reading, checking, phases, preprocessing, writing. In: CSV files of one or several jumps, plain or
//! gzip, or logs of other programs. Out: segments of consecutive samples in SI units, samples as columns; spans of
//! contact phases; reports of implausible samples and of recordings that are not of this robot. Read [`Segment`] for
//! the data first, then [`Reader`] for the format. [`mod@check`], [`mismatch`], [`condition()`], [`PhaseRule`] and
//! [`preprocess`] process recordings, [`write()`] writes them.
//!
//! ```
//! use romc::recording::{self, PhaseRule};
//! use romc::robot::{InputRule, Robot};
//!
//! # let folder = std::env::temp_dir().join(format!("romc-doc-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let path = folder.join("hop.csv");
//! # let mut hop = recording::Segment::still(&path, (0..8).map(|i| 0.002 * i as f64).collect());
//! # hop.x = nalgebra::DMatrix::from_fn(18, 8, |i, _| if i < 12 { [0.0, 0.7, -1.4][i % 3] } else { 0.3 });
//! # hop.torque_nm.fill(1.0);
//! # hop.feet[3..6].fill([false; 4]);
//! # recording::write(&path, &hop.into())?;
//! let jump = recording::read(&path)?;
//! let segment = &jump.segments[0];
//! let rule = InputRule::published(romc::robot_file::by_name("go1")?);
//! let u = segment.input(&rule)?; // 18 x samples: [tau; F; M]
//! assert_eq!(u.shape(), (18, segment.len()));
//! let spans = PhaseRule::two_phase().spans(segment)?;
//! assert_eq!(spans[1].range, 3..6); // the flight
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod check;
pub mod mismatch;
pub mod preprocess;

pub(crate) mod clock;
#[cfg(test)]
#[path = "../../../tests/recording/clock.rs"]
mod clock_tests;
mod controller_log;
mod decimals;
mod delays;
mod error;
mod files;
mod foreign;
mod heading;
mod lines;
mod phases;
mod reader;
mod segment;
mod write;

pub use self::write::{Notation, WriteOptions, write, write_as, write_mcap, write_to};
pub use clock::Mended;
pub use controller_log::ControllerLog;
pub use error::{RecordingError, RecordingFault};
pub use files::{
    Accelerations, ConditionOptions, ImplausibleSamples, RecordingFile, RecordingSet, SmoothedRows,
    as_recorded, condition,
};
pub use foreign::{
    guess::{Guess, guess},
    map::ColumnMap,
};
pub use heading::{about_vertical, stride_s};
pub use phases::{CHATTER_SAMPLES, PhasePattern, PhaseRule, PhaseSpan, Stance};
pub use reader::{Clocks, Column, Reader, Reading, ReadingNotes, read, read_from_bytes};
pub use segment::{Recording, Segment, between, stretches};

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::{fmt, fs, io};

use check::check;
use clap::ValueEnum;
use error::{Outcome, io_fault, listed, text, unexpected};
use nalgebra::DMatrix;
use preprocess::{differences, median};
use segment::{DERIVED_DDX, Rows, divided};
use serde::{Deserialize, Serialize};

use crate::robot::{
    BODY_DIM, BODY_X, ContactFlags, FOOT_DIM, FeetRule, GRAVITY_M_S2, InputRule, JOINT_DIM,
    JOINT_NAMES, LEAST_HEIGHT, LEAST_SPAN, LEG_JOINT_DIM, Leg, Robot, RobotError, STATE_DIM, YAW,
    rotation,
};
