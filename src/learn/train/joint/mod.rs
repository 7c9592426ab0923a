//! Joint training of encoder, decoder and dynamics by Adam, as published and improved: recordings and
//! [`JointOptions`](super::JointOptions) in, a trained model out. Read `loss` first (equations 9 to 20 and their
//! gradient), then `descent` (Adam, transfer steps of section IV-D) and [`joint`] (seeds, choice, assembly). Linear
//! maps are networks of one layer.

mod batch;
mod descent;
mod loss;
mod network;
mod parameters;
pub(super) mod run;
pub(super) mod unroll;

pub(super) use descent::Schedule;
pub(super) use loss::{LossWeights, Losses};

use super::*;
use crate::model::{Activation, Layer};
use batch::Batch;
use descent::Moved;
use loss::JointLoss;
use network::{dot, product};
use parameters::Parameters;
