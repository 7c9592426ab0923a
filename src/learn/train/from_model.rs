//! A trained model refined on few recordings: of hardware after a simulation, or of another robot.
//!
//! Encoder and decoder stay. In each equation of each phase the coefficients that the model uses, and a constant,
//! change by the least that predicts left-out recordings better: `xi + argmin |Y - Theta (xi + delta)|^2 / n + ridge
//! |delta rms(Theta)|^2`. The ridge is the largest whose error on left-out parts is within a standard error of the
//! best.
//!
//! If it predicts left-out parts better, the equation is multiplied by one number instead, because recorded torques may
//! differ from the motors' torques. In flight a joint control that torques do not contain is added (`joint_control`).
//! Equations without a variable (free fall, a rotation that nothing changes) are physics and stay.

use serde_json::{Map, Value, json};

use super::dataset::Scaling;
use super::equation_change::{Change, Family, Kind, Shift, Sums};
use super::joint_control::{self, Controlled};
use super::weak_form::{flight_samples, windowed_samples};
use super::*;
use crate::model::Phase;
use crate::recording::{CHATTER_SAMPLES, PhasePattern, Segment};
use crate::robot::Actuators;

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

#[derive(Clone, Debug)]
pub struct Refined {
    pub model: ReducedModel,
    pub coefficients: Vec<RefinedCoefficient>,
    /// Equations that stay as they were, and why.
    pub unchanged: Vec<String>,
    /// Equations all of whose coefficients are multiplied by one number, and that number.
    pub multiplied: Vec<String>,
}

#[derive(Default)]
struct Notes {
    unchanged: Vec<String>,
    multiplied: Vec<String>,
}

const NO_SAMPLES: &str = "too few samples of the phase";
const NO_BETTER: &str = "no change predicts left-out parts better";
const ROLLOUTS: &str =
    "with its changes, predictions over 0.1 s get no better, or whole motions diverge";

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
) -> Result<Refined> {
    let rule = InputRule::new(robot, actuators.clone(), model.wrench_frame());
    let data = Data {
        model,
        features: Features::new(model.library()),
        whole: encoded(model, recordings, &rule)?,
        jumps: encoded(model, recordings, &rule)?.each(),
        parts: encoded(model, &parts(recordings), &rule)?.each(),
    };
    let all = data.whole.set();
    let judge = Judge::new(&data.features, all, 0);
    let whole = Judge::new(&data.features, all, model.latent_dim());
    let score = |xi: &[DMatrix<f64>]| judge.score_within(xi, f64::MAX);
    let stays_finite = |xi: &[DMatrix<f64>]| whole.score_within(xi, f64::MAX).is_finite();
    let before = model.phases().iter().map(|phase| phase.xi.clone());
    let mut xi: Vec<DMatrix<f64>> = before.collect();
    let (mut coefficients, mut notes) = (Vec::new(), Notes::default());
    for phase in 0..xi.len() {
        let mut of_phase = Notes::default();
        let found = data.refined_phase(phase, &mut of_phase);
        notes.unchanged.append(&mut of_phase.unchanged);
        let mut tried = xi.clone();
        for (term, of) in &found {
            tried[phase][(*term, of.coordinate - 1)] = of.after;
        }
        let diverges = !stays_finite(&tried) && stays_finite(&xi);
        if score(&tried) < score(&xi) && !diverges {
            xi = tried;
            coefficients.extend(found.into_iter().map(|(_, of)| of));
            notes.multiplied.append(&mut of_phase.multiplied);
        } else if !found.is_empty() {
            notes
                .unchanged
                .push(format!("{}: {ROLLOUTS}", model.phases()[phase].name));
        }
    }
    if coefficients.is_empty() {
        let reasons = notes.unchanged.join("; ");
        return Err(TrainError::NothingToRefine { reasons });
    }
    let phases = model.phases().iter().cloned().zip(xi);
    let phases = phases.map(|(phase, xi)| Phase { xi, ..phase });
    let is_same_robot = model.robot().is_ok_and(|own| own.name == robot.name);
    // Jumps of another robot are no prior for those of this one.
    let mut prior = model.jump_prior().ok().cloned().filter(|_| is_same_robot);
    // Plans then obey the refined equations.
    for part in prior.iter_mut().flat_map(|prior| &mut prior.parts) {
        part.xi = None;
    }
    let builder = model.clone().into_builder().phases(phases.collect());
    let builder = builder.all_input_statistics(data.statistics(is_same_robot));
    let builder = builder.robot(robot).actuators(actuators).jump_prior(prior);
    let model = builder
        .provenance(provenance(model, origin, &coefficients))
        .build()?;
    Ok(Refined {
        model,
        coefficients,
        unchanged: notes.unchanged,
        multiplied: notes.multiplied,
    })
}

/// The model's provenance, with the command and recordings of the refinement and its changes.
fn provenance(
    model: &ReducedModel,
    origin: &Origin,
    coefficients: &[RefinedCoefficient],
) -> Map<String, Value> {
    let mut provenance = model.provenance().clone();
    provenance.insert("command".to_owned(), origin.command.clone().into());
    let mut recordings = provenance
        .get("recordings")
        .and_then(Value::as_array)
        .cloned();
    let all = recordings.get_or_insert_default();
    all.extend(origin.recordings.iter().map(|file| json!(file)));
    provenance.insert("recordings".to_owned(), json!(all));
    provenance.insert("refined_on".to_owned(), json!(origin.recordings));
    provenance.insert("refined_coefficients".to_owned(), json!(coefficients));
    provenance
}

struct Encoded {
    dataset: Dataset,
    latent: Vec<Latent>,
}

impl Encoded {
    fn set(&self) -> EncodedSet<'_> {
        EncodedSet::new(&self.dataset, &self.latent)
    }

    fn each(self) -> Vec<Self> {
        let Self { dataset, latent } = self;
        let jumps = dataset.jumps.iter().zip(latent);
        let each = jumps.map(|(jump, latent)| Self {
            dataset: Dataset {
                jumps: vec![jump.clone()],
                ..dataset.clone()
            },
            latent: vec![latent],
        });
        each.collect()
    }
}

fn encoded(model: &ReducedModel, recordings: &[Recording], rule: &InputRule) -> Result<Encoded> {
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
    let dataset = Dataset::new(recordings, rule, &phases, &scaling, SMOOTHING)?;
    let latent = Latent::of(&dataset, model.encoder_map()?);
    Ok(Encoded { dataset, latent })
}

struct Data<'a> {
    model: &'a ReducedModel,
    features: Features,
    whole: Encoded,
    jumps: Vec<Encoded>,
    parts: Vec<Encoded>,
}

impl Data<'_> {
    /// Of the inputs: the model's own for its robot, of another robot those of the recordings where there are some.
    fn statistics(&self, is_same_robot: bool) -> Vec<(String, InputStatistics)> {
        let phases = self.model.phases().iter().enumerate();
        let each = phases.filter_map(|(phase, own)| {
            let dataset = &self.whole.dataset;
            let statistics = match !is_same_robot && dataset.samples(Some(phase)) >= MIN_SAMPLES {
                true => dataset.input_statistics(phase),
                false => self.model.input_statistics(phase).ok()?.clone(),
            };
            Some((own.name.clone(), statistics))
        });
        each.collect()
    }

    /// Changed coefficients of a phase with the number of their term; reasons for its other equations are noted.
    fn refined_phase(&self, phase: usize, notes: &mut Notes) -> Vec<(usize, RefinedCoefficient)> {
        let own = &self.model.phases()[phase];
        let is_flight = own.feet == FeetRule::None;
        let sums = |of: &Encoded| {
            let (theta, target) = match is_flight {
                true => flight_samples(of.set(), &self.features, phase),
                false => windowed_samples(of.set(), &self.features, phase, WINDOW),
            };
            Sums::of(&theta, &target)
        };
        let all = sums(&self.whole);
        // Pieces of one flight do not judge how another goes.
        let flights = is_flight.then_some(&self.jumps).filter(|of| of.len() > 1);
        let parts: Vec<Sums> = flights
            .unwrap_or(&self.parts)
            .iter()
            .map(sums)
            .filter(|sums| sums.rows > 0)
            .collect();
        let is_enough = all.rows >= LEAST_ROWS && parts.len() > 1;
        let control = match flights {
            Some(_) if is_enough => self.joint_control(own, &all, &parts),
            _ => Vec::new(),
        };
        let mut control: BTreeMap<usize, Shift> = control.into_iter().collect();
        let mut found = Vec::new();
        for k in 0..self.model.latent_dim() {
            let mut support = support(&own.xi, &self.features, k, is_flight);
            // A term that is zero throughout has no part in a change.
            support.retain(|&term| !is_enough || all.gram[(term, term)] > 0.0);
            if support.is_empty() {
                continue;
            }
            let place = format!("ddz{} in {}", k + 1, own.name);
            if !is_enough {
                notes.unchanged.push(format!("{place}: {NO_SAMPLES}"));
                continue;
            }
            let xi = own.xi.column(k).into_owned();
            let mut families = vec![Family::terms(&support, xi.len())];
            if !is_flight || flights.is_some() {
                let offset = self.features.constant_term().filter(|_| is_flight);
                families.push(Family::share(&xi, offset).shifted(control.remove(&k)));
            }
            let mut changes = families
                .iter()
                .filter_map(|family| Some((family, family.change(&all, &parts, k, &xi)?)));
            // In flight the equation as a whole, if it changes: of few flights single terms are guesses.
            let best = match is_flight {
                true => changes.next_back(),
                false => changes.max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain)),
            };
            let Some((family, change)) = best else {
                notes.unchanged.push(format!("{place}: {NO_BETTER}"));
                continue;
            };
            if family.kind == Kind::Share {
                let share = 1.0 + change.change[0];
                notes.multiplied.push(format!("{place}: {share:.2}"));
            }
            found.extend(self.changed_coefficients(own, k, &change));
        }
        found
    }

    /// Joint control of the legs in flight as changes of each equation; empty if the sums show none.
    fn joint_control(&self, own: &Phase, all: &Sums, parts: &[Sums]) -> Vec<(usize, Shift)> {
        let (features, d) = (&self.features, self.model.latent_dim());
        let controlled = |k: usize| {
            let is_physics = support(&own.xi, features, k, true).is_empty();
            let terms = [features.variable_term(d + k)?, features.variable_term(k)?];
            let xi = own.xi.column(k).into_owned();
            (!is_physics).then_some(Controlled { k, xi, terms })
        };
        let equations: Vec<Controlled> = (0..d).filter_map(controlled).collect();
        let Some(constant) = features.constant_term() else {
            return Vec::new();
        };
        let found = |sums: &Sums| joint_control::coefficients(&equations, sums, constant);
        let without = (0..parts.len()).map(|part| found(&Sums::without(parts, part)));
        let (Some(of_all), Some(without)) = (found(all), without.collect::<Option<Vec<_>>>())
        else {
            return Vec::new();
        };
        let each = equations.iter().map(|of| {
            let change = |values: &[f64; 2]| {
                let mut change = DVector::zeros(of.xi.len());
                for (&term, value) in of.terms.iter().zip(values) {
                    change[term] = value - of.xi[term];
                }
                change
            };
            let without = without.iter().map(change).collect();
            let of_all = change(&of_all);
            (of.k, Shift { of_all, without })
        });
        each.collect()
    }

    /// Coefficients of an equation that a change moves, with the number of their term.
    fn changed_coefficients(
        &self,
        own: &Phase,
        k: usize,
        change: &Change,
    ) -> Vec<(usize, RefinedCoefficient)> {
        let d = self.model.latent_dim();
        // A constant that the equation lacked comes last.
        let is_new = |term: &usize| own.xi[(*term, k)] == 0.0;
        let terms = (0..own.xi.nrows()).filter(|term| change.after[*term] != own.xi[(*term, k)]);
        let (added, terms): (Vec<_>, Vec<_>) = terms.partition(is_new);
        let terms = terms.into_iter().chain(added);
        let coefficient = |term: usize| {
            let (before, mut after) = (own.xi[(term, k)], change.after[term]);
            let least = f64::MIN_POSITIVE.sqrt();
            let errors = (after - before).abs() / change.deviations[term].max(least);
            // A damping term of the momentum must not become driving.
            let is_braking = self.features.variable_term(d + k) == Some(term);
            if k < 2 && is_braking && before <= 0.0 {
                after = after.min(0.0);
            }
            let coefficient = RefinedCoefficient {
                phase: own.name.clone(),
                coordinate: k + 1,
                term: self.model.library().terms()[term].text.clone(),
                before,
                after,
                standard_errors: errors,
            };
            (term, coefficient)
        };
        terms.map(coefficient).collect()
    }
}

/// The segments; cut into parts of [`PART_S`] where there are fewer than [`LEAST_PARTS`], so that some can be left out.
fn parts(recordings: &[Recording]) -> Vec<Recording> {
    let count: usize = recordings.iter().map(|of| of.segments.len()).sum();
    let cut = |segment: &Segment| -> Vec<Segment> {
        if count >= LEAST_PARTS {
            return vec![segment.clone()];
        }
        let pieces = (segment.duration_s() / PART_S) as usize;
        let pieces = pieces.min(segment.len() / MIN_SAMPLES).max(1);
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
