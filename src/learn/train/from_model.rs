//! A trained model refined on few recordings: of hardware after a simulation, or of another robot.
//!
//! Encoder and decoder stay. In each equation of each phase the coefficients that the model uses, and a constant, change
//! by the least that predicts left-out recordings better: `xi + argmin |Y - Theta (xi + delta)|^2 / n + ridge |delta
//! rms(Theta)|^2`, with the largest ridge whose error on left-out parts is within a standard error of the best. Equations
//! without a variable (free fall, a rotation that nothing changes) are physics and stay.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::dataset::{Dataset, Scaling};
use super::error::TrainError;
use super::features::Features;
use super::judge::Judge;
use super::latent::{EncodedSet, Latent};
use super::task::Origin;
use super::weak_form::{flight_samples, windowed_samples};
use crate::model::{Phase, ReducedModel};
use crate::recording::{CHATTER_SAMPLES, PhasePattern, PhaseRule, Recording, Segment};
use crate::robot::{Actuators, FeetRule, InputRule, Robot};

const RIDGES: [f64; 5] = [1.0, 0.1, 1e-2, 1e-3, 1e-4]; // strongest first
const WINDOW: usize = 25; // samples over which the dynamics in contact are integrated
const SMOOTHING: usize = 11;
const LEAST_PARTS: usize = 4; // fewer jumps than that are cut
const PART_S: f64 = 0.2;
const LEAST_ROWS: usize = 20;

/// A coefficient that recordings changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RefinedCoefficient {
    pub phase: String,
    /// Latent coordinate of the equation, from 1.
    pub coordinate: usize,
    pub term: String,
    pub before: f64,
    pub after: f64,
    /// The change in standard errors, of left-out parts of the recordings.
    pub standard_errors: f64,
}

/// An equation that stays as it was, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnchangedEquation {
    pub phase: String,
    pub coordinate: usize,
    pub reason: &'static str,
}

#[derive(Clone, Debug)]
pub struct Refined {
    pub model: ReducedModel,
    pub coefficients: Vec<RefinedCoefficient>,
    pub unchanged: Vec<UnchangedEquation>,
}

const NO_SAMPLES: &str = "too few samples of the phase";
const NO_BETTER: &str = "no change predicts left-out parts better";
const ROLLOUTS: &str = "with the changes of this phase, predictions over 0.1 s get worse";

/// Refines `model` on recordings of `robot`, whose joints have the losses `actuators`.
///
/// # Errors
/// [`TrainError::NothingToRefine`] if the recordings change no equation; those of a training otherwise.
pub fn refine_from(
    model: &ReducedModel,
    recordings: &[Recording],
    robot: &'static Robot,
    actuators: Option<Actuators>,
    origin: &Origin,
) -> Result<Refined, TrainError> {
    let rule = InputRule::new(robot, actuators.clone(), model.wrench_frame());
    let scaling = Scaling {
        state: model.state_factors()?,
        input: model.input_factors()?,
    };
    let pattern = |phase: &Phase| PhasePattern {
        name: phase.name.clone(),
        feet: phase.feet.clone(),
    };
    let phases = PhaseRule::new(model.phases().iter().map(pattern).collect());
    let phases = phases.with_min_samples(CHATTER_SAMPLES);
    let dataset =
        |recordings: &[Recording]| Dataset::new(recordings, &rule, &phases, &scaling, SMOOTHING);
    let features = &Features::new(model.library());
    let encoder = model.encoder_map()?;
    let whole = dataset(recordings)?;
    let latent = Latent::of(&whole, encoder);
    let all = EncodedSet::new(&whole, &latent);
    let cut = dataset(&parts(recordings))?;
    let parts = cut.jumps.iter().map(|jump| {
        let part = Dataset {
            jumps: vec![jump.clone()],
            ..cut.clone()
        };
        let latent = Latent::of(&part, encoder);
        (part, latent)
    });
    let parts: Vec<(Dataset, Vec<Latent>)> = parts.collect();
    let judge = Judge::new(features, all, 0);
    let mut xi: Vec<DMatrix<f64>> = model
        .phases()
        .iter()
        .map(|phase| phase.xi.clone())
        .collect();
    let (mut coefficients, mut unchanged) = (Vec::new(), Vec::new());
    for (phase, own) in model.phases().iter().enumerate() {
        let is_flight = own.feet == FeetRule::None;
        let sums_of = |set: EncodedSet<'_>| {
            let (theta, target) = match is_flight {
                true => flight_samples(set, features, phase),
                false => windowed_samples(set, features, phase, WINDOW),
            };
            Sums::of(&theta, &(target - &theta * &own.xi))
        };
        let of_parts = parts.iter();
        let of_parts = of_parts.map(|(part, latent)| sums_of(EncodedSet::new(part, latent)));
        let of_parts: Vec<Sums> = of_parts.filter(|sums| sums.rows > 0).collect();
        let of_all = sums_of(all);
        let (mut tried, mut found) = (xi.clone(), Vec::new());
        let stays = |coordinate: usize, reason| UnchangedEquation {
            phase: own.name.clone(),
            coordinate: coordinate + 1,
            reason,
        };
        for k in 0..model.latent_dim() {
            let support = support(&own.xi, features, k, is_flight);
            if support.is_empty() {
                continue;
            }
            let enough = of_all.rows >= LEAST_ROWS && of_parts.len() > 1;
            match enough.then(|| change(&of_all, &of_parts, k, &support)) {
                None => unchanged.push(stays(k, NO_SAMPLES)),
                Some(None) => unchanged.push(stays(k, NO_BETTER)),
                Some(Some((change, deviation))) => {
                    for ((&term, change), deviation) in support.iter().zip(&change).zip(&deviation)
                    {
                        let before = own.xi[(term, k)];
                        tried[phase][(term, k)] = before + change;
                        found.push(RefinedCoefficient {
                            phase: own.name.clone(),
                            coordinate: k + 1,
                            term: model.library().terms()[term].text.clone(),
                            before,
                            after: before + change,
                            standard_errors: (change / deviation).abs(),
                        });
                    }
                }
            }
        }
        let [before, after] = [&xi, &tried].map(|xi| judge.score_within(xi, f64::MAX));
        if after < before {
            xi = tried;
            coefficients.extend(found);
        } else {
            found.dedup_by_key(|coefficient| coefficient.coordinate);
            unchanged.extend((found.iter()).map(|of| stays(of.coordinate - 1, ROLLOUTS)));
        }
    }
    if coefficients.is_empty() {
        let reasons = unchanged.iter();
        let reasons = reasons.map(|of| format!("{}, z{}: {}", of.phase, of.coordinate, of.reason));
        return Err(TrainError::NothingToRefine {
            reasons: reasons.collect::<Vec<_>>().join("; "),
        });
    }
    let mut provenance = model.provenance().clone();
    provenance.insert("command".to_owned(), origin.command.clone().into());
    let recorded = serde_json::to_value(&origin.recordings).expect("texts");
    provenance.insert("refined_on".to_owned(), recorded);
    let changes = serde_json::to_value(&coefficients).expect("texts and numbers");
    provenance.insert("refined_coefficients".to_owned(), changes);
    let phases = model.phases().iter().cloned().zip(xi);
    let phases = phases.map(|(phase, xi)| Phase { xi, ..phase });
    let is_same_robot = model.robot().is_ok_and(|own| own.name == robot.name);
    // What another robot's jumps look like is not what this one's do.
    let prior = model.jump_prior().ok().cloned().filter(|_| is_same_robot);
    let builder = model.clone().into_builder().phases(phases.collect());
    let builder = builder.robot(robot).actuators(actuators).jump_prior(prior);
    Ok(Refined {
        model: builder.provenance(provenance).build()?,
        coefficients,
        unchanged,
    })
}

/// The segments; cut into parts of [`PART_S`] where there are fewer than [`LEAST_PARTS`], so that some can be left out.
fn parts(recordings: &[Recording]) -> Vec<Recording> {
    let count: usize = recordings.iter().map(|of| of.segments.len()).sum();
    let cut = |segment: &Segment| -> Vec<Segment> {
        if count >= LEAST_PARTS {
            return vec![segment.clone()];
        }
        let pieces = ((segment.duration_s() / PART_S) as usize).max(1);
        let border = |piece: usize| piece * segment.len() / pieces;
        (0..pieces)
            .map(|piece| segment.slice(border(piece)..border(piece + 1)))
            .collect()
    };
    let each = recordings.iter();
    each.map(|recording| Recording {
        segments: recording.segments.iter().flat_map(cut).collect(),
        ..recording.clone()
    })
    .collect()
}

/// Terms of an equation that may change; none of one that is physics.
fn support(xi: &DMatrix<f64>, features: &Features, k: usize, is_flight: bool) -> Vec<usize> {
    let constant = features.constant_term();
    let active: Vec<usize> = (0..xi.nrows())
        .filter(|&term| xi[(term, k)] != 0.0)
        .collect();
    if active.iter().all(|term| Some(*term) == constant) {
        return Vec::new();
    }
    let offset = constant.filter(|one| !is_flight && !active.contains(one));
    active.into_iter().chain(offset).collect()
}

/// Normal equations of one left-out part: the residuals of the model as targets.
struct Sums {
    rows: usize,
    gram: DMatrix<f64>,
    product: DMatrix<f64>,
}

impl Sums {
    fn of(theta: &DMatrix<f64>, residual: &DMatrix<f64>) -> Self {
        Self {
            rows: theta.nrows(),
            gram: theta.tr_mul(theta),
            product: theta.tr_mul(residual),
        }
    }

    /// Gram matrix and product of the terms of an equation.
    fn of_terms(&self, k: usize, support: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let gram = self.gram.select_rows(support).select_columns(support);
        let product = support.iter().map(|&term| self.product[(term, k)]);
        (gram, DVector::from_iterator(support.len(), product))
    }
}

/// The least change of an equation that predicts left-out parts better, with its standard deviation; none if no change
/// does.
fn change(
    all: &Sums,
    parts: &[Sums],
    k: usize,
    support: &[usize],
) -> Option<(DVector<f64>, DVector<f64>)> {
    let each: Vec<_> = parts.iter().map(|part| part.of_terms(k, support)).collect();
    let m = support.len();
    let total = |left_out: usize| {
        let kept = each
            .iter()
            .enumerate()
            .filter(|(part, _)| *part != left_out);
        let zero = (DMatrix::zeros(m, m), DVector::zeros(m));
        kept.fold(zero, |(gram, product), (_, of)| {
            (gram + &of.0, product + &of.1)
        })
    };
    let gains: Vec<Vec<f64>> = (RIDGES.iter())
        .map(|ridge| {
            let gain = |part: usize| {
                let (gram, product) = total(part);
                let change = solved(&gram, &product, *ridge).unwrap_or_else(|| DVector::zeros(m));
                let (gram, product) = &each[part];
                let rows = parts[part].rows as f64;
                (2.0 * change.dot(product) - change.dot(&(gram * &change))) / rows
            };
            (0..parts.len()).map(gain).collect()
        })
        .collect();
    let mean = |gains: &[f64]| gains.iter().sum::<f64>() / gains.len() as f64;
    let error = |gains: &[f64]| {
        let own = mean(gains);
        let square: f64 = gains.iter().map(|gain| (gain - own).powi(2)).sum();
        (square / (gains.len() * (gains.len() - 1).max(1)) as f64).sqrt()
    };
    let best = gains.iter().max_by(|a, b| mean(a).total_cmp(&mean(b)))?;
    if mean(best) <= error(best) {
        return None;
    }
    let least = mean(best) - error(best);
    let chosen = gains.iter().position(|gains| mean(gains) >= least)?;
    let (gram, product) = all.of_terms(k, support);
    let change = solved(&gram, &product, RIDGES[chosen])?;
    // Of parts as a whole: errors within one are correlated.
    let inverse = ridged(&gram, RIDGES[chosen]).try_inverse()?;
    let scores = each.iter().map(|(gram, product)| product - gram * &change);
    let scores = scores.fold(DMatrix::zeros(m, m), |sum, score| {
        sum + &score * score.transpose()
    });
    let covariance = &inverse * scores * &inverse;
    Some((change, covariance.diagonal().map(f64::sqrt)))
}

fn ridged(gram: &DMatrix<f64>, ridge: f64) -> DMatrix<f64> {
    let largest = gram.diagonal().amax().max(f64::MIN_POSITIVE);
    let scales = gram
        .diagonal()
        .map(|square| ridge * square.max(1e-12 * largest));
    gram + DMatrix::from_diagonal(&scales)
}

fn solved(gram: &DMatrix<f64>, product: &DVector<f64>, ridge: f64) -> Option<DVector<f64>> {
    Some(ridged(gram, ridge).cholesky()?.solve(product))
}
