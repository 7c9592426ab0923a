//! The command line's grammar: commands, options, an example for each. Read `command.rs` first.

pub(super) mod command;
pub(super) mod compile;
mod evaluation;
mod help;
mod idle;
mod import;
mod plan;
mod recordings;
mod study;
mod train;
mod value;

pub(crate) use command::*;
pub(crate) use compile::*;
pub(crate) use evaluation::*;
pub(crate) use import::*;
pub(crate) use plan::*;
pub(crate) use recordings::*;
pub(crate) use study::*;
pub(crate) use train::*;

use std::path::{Path, PathBuf};

use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use help::{OUTPUT, RECORDINGS, help_flag, version_flag};
use recordings::clock_help;
use value::{RobotParser, choice, count, finite, overwrite, real, wrench_frame};

use crate::codegen::{Precision, SineCosine, Units};
use crate::deploy::Target;
use crate::files::Overwrite;
use crate::import::{Format, ImportError, Mapping, WeightVectors, XiLayout, parse_standard};
use crate::model::{Activation, CoordinateOrder, LibraryOrder, StandardLibrary};
use crate::mpc::{LIFTS, Lift, SOLVERS, Solver};
use crate::robot::{ContactFlags, PhasePattern, STATE_DIM, WrenchFrame};
use crate::simplify::Tolerance;
