//! Learning: recordings in, a reduced-order model with its metrics out.
//!
//! In: recordings of jumps, a robot, [`TrainOptions`]. Out: a [`Trained`] model, whose provenance contains the command
//! to repeat it, and a [`TrainReport`]. Read `closed_form.rs` first: it goes from the dataset over the encoder's row
//! space (`subspace`) and the decoder (`latent`) to the dynamics (`weak_form`, `sparse`, `select`), judged by rollouts.

mod body;
mod closed_form;
mod dataset;
mod equation_change;
mod error;
mod features;
mod frame;
mod from_model;
mod growth;
mod joint;
mod joint_control;
mod judge;
mod jumps;
mod knowledge;
mod latent;
mod metrics;
mod mirror;
mod momentum;
mod options;
mod pairing;
mod progress;
mod random;
mod recipe;
mod refine;
mod rollout;
mod seeds;
mod select;
mod sparse;
mod strides;
mod subspace;
mod task;
mod weak_form;

pub use body::BodyRows;
pub use dataset::{MIN_SAMPLES, ScaleOptions, Split};
pub use error::TrainError;
pub use from_model::{Refined, refine_from};
pub use joint::unroll::{Integrator, Unroll};
pub use metrics::{PartScore, PhaseTerms, SeedReport, SetMetrics, TrainReport, Trained, assess};
pub use options::{
    BodyEquations, Coordinates, EncoderOptions, JointOptions, MapOptions, Method, MirrorImages,
    RegressionOptions, TrainOptions, Transfer,
};
pub use progress::{Monitor, Progress};
pub use recipe::RecipePart;
pub use task::{Origin, Recordings, SourceFile, sha256};

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

use crate::model::{
    AffineMap, InputStatistics, LatentVariable, Library, ModelError, ReducedModel, StateMap,
};
use crate::recording::{PhaseRule, Recording};
use crate::robot::{
    BODY_X, BODY_Z, FeetRule, GRAVITY_M_S2, InputRule, JOINT_DIM, Robot, STATE_DIM, WrenchFrame,
    YAW,
};
use crate::sim::Restart;
use body::is_lateral;
use dataset::{Dataset, Jump, centred, mean};
use features::{FeatureValues, Features};
use frame::Frame;
use growth::Growth;
use joint::Losses;
use judge::Judge;
use knowledge::Knowledge;
use latent::{EncodedSet, Latent, input_projection, lift_samples};
use metrics::PLACE;
use mirror::Mirror;
use random::Random;
use rollout::{Candidate, Change, Window, Xi, plain, predict, windows};
use select::Choice;
use sparse::{Regression, active_terms};
use subspace::Moments;
use task::Task;

type Result<T, E = TrainError> = std::result::Result<T, E>;
