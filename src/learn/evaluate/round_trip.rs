//! Whether a model made elsewhere fits recordings, before anything is integrated, and the common mistake that explains
//! a bad fit.

use super::coefficient_trials::{CoefficientTrials, GOOD_R2, Tensors};
use super::*;

const SAMPLES: usize = 240;
const LARGEST_ERROR: f64 = 1.0; // relative; beyond it maps do not fit: that of an answer that never changes
const EXPLAINED: f64 = 4.0; // times smaller that a slip has to make the error to explain it
/// Largest error relative to the smallest at which an earlier slip is preferred: left and right differ little.
const ALIKE: f64 = 1.5;
const SMALL_ERROR: f64 = 0.01; // relative; needs no explanation
const UNEXPLAINED: f64 = 0.3; // relative error beyond which no slip explains anything, however much larger it was

#[derive(Debug, Clone, PartialEq)]
pub struct RoundTrip {
    /// Mean square of `decode(encode(x)) - x` over that of the deviation of `x` from its mean, scaled units.
    pub error: f64,
    /// The explanation of the error, in words with the option of an import that corrects it, and the error then.
    pub slip: Option<(String, f64)>,
    /// Name of each phase and R^2 of its latent accelerations; none without samples of it.
    pub acceleration_r2: Vec<(String, Option<f64>)>,
    pub all_acceleration_r2: Option<f64>,
    /// The same of the accelerations, and their R^2.
    pub acceleration_slip: Option<(String, f64)>,
    pub trials: CoefficientTrials,
}

/// Common mistakes in a foreign model: wrong order or scaling of the coordinates, or both.
type Slip = (Option<CoordinateOrder>, Option<ScalingSlip>);

#[derive(Debug, Clone, Copy, PartialEq)]
enum ScalingSlip {
    Factor(f64),
    Centred,
    Standardised,
}

impl RoundTrip {
    /// None without recordings or both maps. `order`: a standard library's terms in the file; `tensors`: names by part.
    pub fn of_import(
        model: &ReducedModel,
        segments: &[&Segment],
        order: Option<LibraryOrder>,
        tensors: Tensors<'_>,
    ) -> Result<Option<Self>> {
        let (Ok(encoder), Ok(decoder)) = (model.encoder_map(), model.decoder_map()) else {
            return Ok(None);
        };
        if segments.is_empty() {
            return Ok(None);
        }
        let samples = Samples::new((encoder, decoder), model.state_factors()?, segments);
        let error = samples.error(&(None, None))?;
        let best = samples.best_slip()?;
        let is_explained =
            |found: f64| error > SMALL_ERROR && EXPLAINED * found < error && found < UNEXPLAINED;
        let still = DVector::zeros(STATE_DIM);
        let (acceleration_r2, all) = accelerations(model, segments, 1.0, &still)?;
        let trials = CoefficientTrials::new(model, segments, order, tensors)?;
        let other = match all {
            Some(r2) if r2 < 0.0 => acceleration_slip(model, segments, &samples.mean)?,
            _ => None,
        };
        let slips = trials.slip.clone().into_iter().chain(other);
        let explained = best.filter(|(_, found)| is_explained(*found));
        Ok(Some(Self {
            error,
            slip: explained.map(|(slip, found)| (advice(slip), found)),
            acceleration_r2,
            all_acceleration_r2: all,
            acceleration_slip: slips.max_by(|a, b| a.1.total_cmp(&b.1)),
            trials,
        }))
    }

    pub fn maps_fit(&self) -> bool {
        self.error <= LARGEST_ERROR && self.slip.is_none()
    }

    /// Equations that miss the recordings for no known reason may be right for other motions.
    pub fn is_refused(&self) -> bool {
        !self.maps_fit() || self.acceleration_slip.is_some()
    }

    /// The fault of the model along the recordings, if there is one, and the option of an import that corrects it.
    pub fn fault(&self) -> Option<String> {
        if !self.maps_fit() {
            let found = "decode(encode(x)) misses the recordings by";
            let found = format!("{found} {:.3} times their variance", self.error);
            return Some(match &self.slip {
                Some((advice, error)) => format!("{found}, by {error:.3} times {advice}"),
                None => format!(
                    "{found}, with any of the usual factors, means and orders: has the training \
                     converged, is it this robot, and are these its maps?"
                ),
            });
        }
        // Equations that explain the accelerations no better than a constant do not fit.
        let equations_fit = self.all_acceleration_r2.is_none_or(|r2| r2 >= 0.0);
        if equations_fit && self.acceleration_slip.is_none() {
            return None;
        }
        let r2 = self.all_acceleration_r2.unwrap_or(f64::NAN);
        let found = format!("R^2 of the latent accelerations is {r2:.3}");
        Some(match &self.acceleration_slip {
            Some((advice, better)) => format!("{found}, {better:.3} {advice}"),
            None => format!("{found}, below that of a constant, {}", self.unexplained()),
        })
    }

    fn unexplained(&self) -> String {
        let or = ", or the terms of --library are in another order than the coefficients";
        let (orders, or) = match self.trials.by_order.is_empty() {
            true => ("", or),
            false => ("in every usual order of the terms and ", ""),
        };
        let reach = |r2| format!("; fitted to these recordings, the same terms reach {r2:.3}");
        let fitted = self.trials.fitted.map(reach).unwrap_or_default();
        format!(
            "{orders}with phases exchanged too{fitted}: the training has not converged, or these motions are unlike \
             the training's{or}"
        )
    }
}

fn advice((order, scaling): Slip) -> String {
    match (order, scaling.map(ScalingSlip::advice)) {
        (None, scaling) => scaling.unwrap_or_default(),
        (Some(order), None) => {
            format!(
                "in another order: expected --order {order}, or another that swaps left and right"
            )
        }
        (Some(order), Some(scaling)) => format!("in another order, {scaling}, and --order {order}"),
    }
}

impl ScalingSlip {
    fn advice(self) -> String {
        let words = match self {
            Self::Factor(factor) => {
                return format!("with factor {factor}: expected --scaling {factor}");
            }
            Self::Centred => "with their mean subtracted: expected a tensor mean.state",
            Self::Standardised => {
                "as (x - mean) / standard deviation: expected tensors mean.state and std.state"
            }
        };
        format!("{words} (SI units)")
    }
}

struct Samples<'m> {
    encoder: &'m StateMap,
    decoder: &'m StateMap,
    factors: DVector<f64>,
    x: Vec<DVector<f64>>,
    mean: DVector<f64>,
    deviation: DVector<f64>,
}

impl<'m> Samples<'m> {
    fn new(
        (encoder, decoder): (&'m StateMap, &'m StateMap),
        factors: DVector<f64>,
        segments: &[&Segment],
    ) -> Self {
        let total: usize = segments.iter().map(|segment| segment.len()).sum();
        let every = total.div_ceil(SAMPLES).max(1);
        let columns = segments.iter().flat_map(|segment| segment.x.column_iter());
        let x: Vec<DVector<f64>> = columns.step_by(every).map(|x| x.into_owned()).collect();
        let count = x.len().max(1) as f64;
        let mean = x.iter().sum::<DVector<f64>>() / count;
        let squares = x.iter().map(|x| (x - &mean).map(|v| v * v));
        let deviation = (squares.sum::<DVector<f64>>() / count).map(f64::sqrt);
        Self {
            encoder,
            decoder,
            factors,
            x,
            mean,
            deviation,
        }
    }

    /// [`RoundTrip::error`] where `y_k = factor_k (x_order(k) - mean_order(k))`.
    fn error(&self, (order, scaling): &Slip) -> Result<f64, ModelError> {
        let same = std::array::from_fn(|k| k);
        let order = order.as_ref().map_or(same, |order| order.places);
        let none = DVector::zeros(STATE_DIM);
        let factors = match *scaling {
            None | Some(ScalingSlip::Centred) => self.factors.clone(),
            Some(ScalingSlip::Factor(factor)) => self.factors.map(|_| factor),
            // Factors of coordinates, not of places.
            Some(ScalingSlip::Standardised) => {
                DVector::from_fn(STATE_DIM, |k, _| 1.0 / self.deviation[order[k]].max(1e-9))
            }
        };
        let mean = match scaling {
            None | Some(ScalingSlip::Factor(_)) => &none,
            Some(ScalingSlip::Centred | ScalingSlip::Standardised) => &self.mean,
        };
        let mut sums = vec![FitSums::default(); STATE_DIM];
        for x in &self.x {
            let y = DVector::from_fn(STATE_DIM, |k, _| {
                factors[k] * (x[order[k]] - mean[order[k]])
            });
            let back = self.decoder.apply(&self.encoder.apply(&y)?)?;
            for ((sums, &y), &back) in sums.iter_mut().zip(&y).zip(&back) {
                sums.add(y, back);
            }
        }
        let r2 = FitSums::jointly(&sums).r2();
        Ok(r2.map_or(0.0, |r2| 1.0 - r2))
    }

    fn best_slip(&self) -> Result<Option<(Slip, f64)>, ModelError> {
        use ScalingSlip::{Centred, Factor, Standardised};
        let orders: Vec<_> = CoordinateOrder::common().into_iter().map(Some).collect();
        let both = [Centred, Standardised];
        let factors = [1.0, 0.1, 10.0, 0.01, 100.0].map(Factor);
        let scalings = factors.into_iter().chain(both);
        let one = orders.iter().map(|order| (order.clone(), None));
        let one = one.chain(scalings.map(|scaling| (None, Some(scaling))));
        let best = self.best_of(one)?;
        let error_of = |found: &Option<(Slip, f64)>| found.as_ref().map_or(f64::MAX, |f| f.1);
        if error_of(&best) < SMALL_ERROR * EXPLAINED {
            return Ok(best);
        }
        let with_both =
            |order: &Option<CoordinateOrder>| both.map(|scaling| (order.clone(), Some(scaling)));
        let two = self.best_of(orders.iter().flat_map(with_both))?;
        Ok(match EXPLAINED * error_of(&two) < error_of(&best) {
            true => two,
            false => best,
        })
    }

    fn best_of(&self, all: impl Iterator<Item = Slip>) -> Result<Option<(Slip, f64)>, ModelError> {
        let found = all.map(|slip| self.error(&slip).map(|error| (slip, error)));
        let found: Vec<(Slip, f64)> = found.collect::<Result<_, _>>()?;
        let least = found.iter().map(|(_, error)| *error);
        let least = least.fold(f64::INFINITY, f64::min);
        Ok((found.into_iter()).find(|(_, error)| *error <= ALIKE * least))
    }
}

type Accelerations = (Vec<(String, Option<f64>)>, Option<f64>);

fn accelerations(
    model: &ReducedModel,
    segments: &[&Segment],
    input_factor: f64,
    mean: &DVector<f64>,
) -> Result<Accelerations> {
    let mut sums = PointwiseSums::new(model);
    for segment in segments {
        let mut latent = LatentSegment::encode(model, segment)?;
        latent.u_lat *= input_factor;
        for (x, mut z) in segment.x.column_iter().zip(latent.z.column_iter_mut()) {
            z.copy_from(&model.encode(&(x - mean))?);
        }
        sums.add(model, segment, &latent)?;
    }
    let names = model.phases().iter().map(|phase| phase.name.clone());
    let by_phase = names.zip(sums.acceleration.iter().map(FitSums::r2));
    let all = FitSums::jointly(&sums.acceleration).r2();
    Ok((by_phase.collect(), all))
}

fn acceleration_slip(
    model: &ReducedModel,
    segments: &[&Segment],
    mean: &DVector<f64>,
) -> Result<Option<(String, f64)>> {
    let still = &DVector::zeros(STATE_DIM);
    let factors = [0.001, 0.01, 0.1, 10.0, 100.0, 1000.0];
    let slips = factors.map(|factor| {
        let words = format!(
            "with the inputs times {factor}: expected other factors of the inputs (--input-scaling, or a tensor \
             scaling.input or std.input)"
        );
        (words, factor, still)
    });
    // The maps hide a mean of the training that they reproduce.
    let centred = (ScalingSlip::Centred.advice(), 1.0, mean);
    let mut best: Option<(String, f64)> = None;
    for (advice, factor, mean) in slips.into_iter().chain([centred]) {
        let (_, r2) = accelerations(model, segments, factor, mean)?;
        if let Some(r2) = r2.filter(|r2| best.as_ref().is_none_or(|(_, known)| r2 > known)) {
            best = Some((advice, r2));
        }
    }
    Ok(best.filter(|(_, r2)| *r2 > GOOD_R2))
}
