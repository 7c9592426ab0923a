//! Simplification with a certificate: fewer terms and digits, and bounds of the error of `ddz`. In: a model, a
//! [`Domain`] (a box of latent states and inputs per phase, from recordings or given) and a [`Tolerance`]. Out: a
//! simpler model with a [`Certificate`]. It lists every change with the interval of its error over the whole box, and
//! with its error at the recorded samples. `docs/explanation/simplification.md` has the mathematics. Read `run.rs` first, then
//! `equation.rs` (the changes made to one equation) and `ranges.rs` (the intervals).
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

mod certificate;
#[cfg(test)]
#[path = "../../tests/simplification/certificates.rs"]
mod certificates;
mod domain;
mod equation;
mod measure;
mod ranges;
mod run;
mod tables;

pub use certificate::{Certificate, Tolerance, ToleranceError, certificate_json};
pub use domain::{Domain, MARGIN, Samples, SimplifyError};
pub(crate) use measure::{RolloutBasis, RolloutEffect, printed, rollouts_json};
pub use run::{Simplified, simplify};
pub use tables::certificate_page;
pub(crate) use tables::{
    bound_words, change_table, equation_table, lost_words, markdown, rollout_table,
};

use std::collections::{BTreeMap, BTreeSet};

use certificate::{Change, ChangeKind, PhaseCertificate};
use nalgebra::DMatrix;
use ranges::{Ranges, Workspace};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use crate::equations::{Equations, ExactStep};
use crate::model::{LatentVariable, Library, ModelError, ReducedModel};
use crate::sim::{LatentSegment, Restart, Rollout, Window, rollout};
use crate::symbolic::{ExprId, ExprPool, Interval, Node, SymbolId};
use crate::typeset::{Cell, Decimal, Rounding, Table, rounded, rounded_up, significant};
use crate::{artifact, lower};

type Result<T, E = SimplifyError> = std::result::Result<T, E>;
