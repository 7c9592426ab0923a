//! `landmarks` and `prior` of a model file: types, spelling, and both ways.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::manifest::{Rows, from_rows, to_rows};
use super::read::ArtifactError;
use crate::model::{FEATURE_DIM, GOAL_DIM, JumpPart, JumpPrior, ModelError, Phase, ReducedModel};
use crate::robot::FOOT_DIM;

/// Where jumps are cut, and what the training jumps were.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LandmarksEntry {
    /// Distance, rise at the apex and height at the start of each training jump, m.
    jumps: Vec<[f64; GOAL_DIM]>,
    start: Vec<f64>,
    end_height_m: [f64; 2],
    landing_height_m: f64,
    parts: Vec<LandmarkEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LandmarkEntry {
    name: String,
    phase: String,
    feet: [u8; FOOT_DIM],
    duration_range_s: [f64; 2],
}

/// The regressions over the goal, one entry per part.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PriorEntry {
    state_std: Vec<f64>,
    parts: Vec<PartEntry>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PartEntry {
    duration_s: [f64; FEATURE_DIM],
    z: Rows,
    dz: Rows,
    u_lat: Rows,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    xi: Option<Rows>,
    input_covariance: Rows,
    acceleration_std: Vec<f64>,
}

/// Both keys, or neither, for a model's prior.
pub(super) fn entries_of(model: &ReducedModel) -> (Option<LandmarksEntry>, Option<PriorEntry>) {
    let Ok(prior) = model.jump_prior() else {
        return (None, None);
    };
    let landmark = |part: &JumpPart| LandmarkEntry {
        name: part.name.clone(),
        phase: model.phases()[part.phase].name.clone(),
        feet: part.feet.map(u8::from),
        duration_range_s: part.duration_range_s,
    };
    let entry = |part: &JumpPart| PartEntry {
        duration_s: part.duration_s,
        z: to_rows(&part.z),
        dz: to_rows(&part.dz),
        u_lat: to_rows(&part.u_lat),
        xi: part.xi.as_ref().map(to_rows),
        input_covariance: to_rows(&part.input_covariance),
        acceleration_std: part.acceleration_std.as_slice().to_vec(),
    };
    let landmarks = LandmarksEntry {
        jumps: prior.jumps.clone(),
        start: prior.start.as_slice().to_vec(),
        end_height_m: prior.end_height_m,
        landing_height_m: prior.landing_height_m,
        parts: prior.parts.iter().map(landmark).collect(),
    };
    let prior = PriorEntry {
        state_std: prior.state_std.as_slice().to_vec(),
        parts: prior.parts.iter().map(entry).collect(),
    };
    (Some(landmarks), Some(prior))
}

/// The prior that the two keys describe; its numbers are checked with the model.
pub(super) fn prior_of(
    file: &str,
    keys: (Option<LandmarksEntry>, Option<PriorEntry>),
    phases: &[Phase],
) -> Result<Option<JumpPrior>, ArtifactError> {
    let refused = |error: ModelError| ArtifactError::unusable(file, error);
    let incomplete = |part, needs| refused(ModelError::Incomplete { part, needs });
    let (landmarks, prior) = match keys {
        (None, None) => return Ok(None),
        (Some(_), None) => return Err(incomplete("landmarks", "prior")),
        (None, Some(_)) => return Err(incomplete("prior", "landmarks")),
        (Some(landmarks), Some(prior)) => (landmarks, prior),
    };
    let invalid = |place: &str, found: String, expected: &str| {
        refused(ModelError::invalid(place, found, expected))
    };
    let (found, expected) = (prior.parts.len(), landmarks.parts.len());
    if found != expected {
        let expected = format!("{expected} as in `landmarks.parts`");
        return Err(invalid(
            "`prior.parts`",
            format!("{found} parts"),
            &expected,
        ));
    }
    let mut parts = Vec::with_capacity(found);
    for (index, (landmark, entry)) in landmarks.parts.into_iter().zip(prior.parts).enumerate() {
        let phase = phases.iter().position(|phase| phase.name == landmark.phase);
        let place = format!("`landmarks.parts[{index}]`");
        let Some(phase) = phase else {
            let found = format!("phase {:?}", landmark.phase);
            return Err(invalid(&place, found, "the name of a phase"));
        };
        if let Some(flag) = landmark.feet.iter().find(|flag| **flag > 1) {
            return Err(invalid(&place, format!("a foot {flag}"), "0 or 1 per foot"));
        }
        let matrix = |rows: &Rows, key: &str| {
            from_rows(file, &format!("prior.parts[{index}].{key}"), rows, None)
        };
        parts.push(JumpPart {
            name: landmark.name,
            phase,
            feet: landmark.feet.map(|flag| flag == 1),
            duration_s: entry.duration_s,
            duration_range_s: landmark.duration_range_s,
            z: matrix(&entry.z, "z")?,
            dz: matrix(&entry.dz, "dz")?,
            u_lat: matrix(&entry.u_lat, "u_lat")?,
            xi: entry.xi.map(|xi| matrix(&xi, "xi")).transpose()?,
            input_covariance: matrix(&entry.input_covariance, "input_covariance")?,
            acceleration_std: DVector::from_vec(entry.acceleration_std),
        });
    }
    Ok(Some(JumpPrior {
        jumps: landmarks.jumps,
        start: DVector::from_vec(landmarks.start),
        state_std: DVector::from_vec(prior.state_std),
        end_height_m: landmarks.end_height_m,
        landing_height_m: landmarks.landing_height_m,
        parts,
    }))
}
