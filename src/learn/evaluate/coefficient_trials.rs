//! Coefficients of an imported model read in other ways: terms in another order, two phases exchanged, or fitted anew.

use super::*;

const SAMPLES: usize = 1000;
/// R^2 of latent accelerations at which a reading explains that those of another were worse.
pub(super) const GOOD_R2: f64 = 0.2;
/// Factor by which an order with a name must reduce the residual to be accepted.
const NAMED: f64 = 1.2;
/// The same for exchanged phases and for orders without a name, which are many.
const UNNAMED: f64 = 4.0;
const NO_RESIDUAL: f64 = 1e-9; // share of the variance below which residuals count as equal

pub(super) type Tensors<'a> = &'a dyn Fn(&str) -> Option<String>; // name of a tensor by its part of the model

#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientTrials {
    /// R^2 in each order that has a name, without those that are the same in this library.
    pub by_order: Vec<(LibraryOrder, f64)>,
    /// The reading that explains the residual with the options that state it, in words, and its R^2.
    pub slip: Option<(String, f64)>,
    /// R^2 of coefficients fitted to these samples; none where these are too few.
    pub fitted: Option<f64>,
}

type PhaseSamples = (DMatrix<f64>, DMatrix<f64>);

struct Reading {
    order: Option<LibraryOrder>,
    rows: Vec<usize>,
}

impl CoefficientTrials {
    /// `order` is that of a shorthand's terms in the file.
    pub(super) fn new(
        model: &ReducedModel,
        segments: &[&Segment],
        order: Option<LibraryOrder>,
        tensors: Tensors<'_>,
    ) -> Result<Self> {
        let samples = samples(model, segments)?;
        let readings = readings(model, order)?;
        let n = model.phases().len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| Some([a, b])));
        let exchanges: Vec<_> = std::iter::once(None).chain(pairs).collect();
        let mut by_order = Vec::new();
        let mut best = (f64::INFINITY, f64::NAN, &readings[0], None);
        for (place, reading) in readings.iter().enumerate() {
            let is_named = reading.order.is_none_or(|order| order.name().is_some());
            let of_order = match (place, is_named) {
                (0, _) => 1.0,
                (_, true) => NAMED,
                (_, false) => UNNAMED,
            };
            for &exchanged in &exchanges[..if is_named { exchanges.len() } else { 1 }] {
                let xi = |phase| Some(read(model, phase, exchanged, [&readings[0], reading]));
                let Some(found) = r2(&samples, xi) else {
                    continue;
                };
                let weight = of_order * exchanged.map_or(1.0, |_| UNNAMED);
                let score = weight * (1.0 - found).max(NO_RESIDUAL);
                if score < best.0 && (weight == 1.0 || found >= GOOD_R2) {
                    best = (score, found, reading, exchanged);
                }
                if let (Some(order), true, None) = (reading.order, is_named, exchanged) {
                    by_order.push((order, found));
                }
            }
        }
        let (_, found, reading, exchanged) = best;
        let other = reading.order.filter(|_| reading.order != readings[0].order);
        let slip = advice(model, other, exchanged, tensors);
        Ok(Self {
            by_order,
            slip: slip.map(|slip| (slip, found)),
            fitted: fitted(&samples),
        })
    }

    pub fn decided_order(&self) -> Option<LibraryOrder> {
        let residual = |r2: f64| (1.0 - r2).max(NO_RESIDUAL);
        let (best, r2) = (self.by_order.iter().copied())
            .filter(|(_, r2)| *r2 >= GOOD_R2)
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        // Coefficients that are the same in two orders give the same R^2.
        let others = self.by_order.iter().filter(|(_, other)| *other != r2);
        let is_clear = |(_, other): &(_, f64)| residual(*other) >= NAMED * residual(r2);
        others.clone().all(is_clear).then_some(best)
    }
}

fn read(
    model: &ReducedModel,
    phase: usize,
    exchanged: Option<[usize; 2]>,
    [given, reading]: [&Reading; 2],
) -> DMatrix<f64> {
    let source = match exchanged {
        Some([a, b]) if phase == a => b,
        Some([a, b]) if phase == b => a,
        _ => phase,
    };
    let from = &model.phases()[source].xi;
    let mut to = from.clone();
    for (&to_row, &from_row) in reading.rows.iter().zip(&given.rows) {
        to.row_mut(to_row).copy_from(&from.row(from_row));
    }
    to
}

/// The order given, then the others that differ from it; those with names first.
fn readings(model: &ReducedModel, given: Option<LibraryOrder>) -> Result<Vec<Reading>, ModelError> {
    let library = model.library();
    let is_list = matches!(library.choice(), LibraryChoice::Terms(_));
    let as_listed = Reading {
        order: None,
        rows: (0..library.terms().len()).collect(),
    };
    let mut readings: Vec<Reading> = Vec::from_iter(is_list.then_some(as_listed));
    if let Some((standard, places)) = library.as_standard() {
        for order in given.into_iter().chain(LibraryOrder::common()) {
            let rows = standard.rows_in(order, library.latent_dim())?;
            let rows: Vec<usize> = rows.iter().map(|&row| places[row]).collect();
            if readings.iter().all(|reading| reading.rows != rows) {
                let order = Some(order);
                readings.push(Reading { order, rows });
            }
        }
    }
    Ok(readings)
}

fn advice(
    model: &ReducedModel,
    order: Option<LibraryOrder>,
    exchanged: Option<[usize; 2]>,
    tensors: Tensors<'_>,
) -> Option<String> {
    let (mut with, mut expected) = (Vec::new(), Vec::new());
    if let Some([a, b]) = exchanged.map(|pair| pair.map(|phase| &model.phases()[phase].name)) {
        with.push(format!("the coefficients of {a} and {b} exchanged"));
        for part in ["xi", "mask"] {
            for [to, from] in [[a, b], [b, a]] {
                let tensor = tensors(&format!("{part}.{from}"));
                expected.extend(tensor.map(|tensor| format!("--map {part}.{to}={tensor}")));
            }
        }
    }
    if let Some(order) = order {
        with.push("the terms in another order".to_owned());
        expected.push(option(model, order));
    }
    let (words, options) = (with.join(" and "), expected.join(" "));
    (!with.is_empty()).then(|| format!("with {words}: expected {options}"))
}

fn option(model: &ReducedModel, order: LibraryOrder) -> String {
    let (library, name) = (model.library(), order.name());
    match (library.choice(), name, library.as_standard()) {
        (LibraryChoice::Standard(_), Some(name), _) => format!("--library-order {name}"),
        (_, _, Some((standard, _))) => {
            let terms = standard.texts_in(order, library.latent_dim());
            format!("--library \"{}\"", terms.unwrap_or_default().join("; "))
        }
        (_, _, None) => String::new(),
    }
}

fn samples(model: &ReducedModel, segments: &[&Segment]) -> Result<Vec<PhaseSamples>> {
    let d = model.latent_dim();
    let total: usize = segments.iter().map(|segment| segment.len()).sum();
    let every = total.div_ceil(SAMPLES).max(1);
    let mut columns = vec![(Vec::new(), Vec::new()); model.phases().len()];
    let mut place = 0;
    for segment in segments {
        let latent = LatentSegment::encode(model, segment)?;
        for sample in 0..latent.time_s.len() {
            place += 1;
            if place % every == 0 {
                let (variables, ddz) = &mut columns[latent.phase[sample]];
                for of in [&latent.z, &latent.dz, &latent.u_lat] {
                    variables.extend(of.column(sample).iter());
                }
                ddz.extend(latent.ddz.column(sample).iter());
            }
        }
    }
    let samples = columns.into_iter().map(|(variables, ddz)| {
        let count = ddz.len() / d;
        let variables = DMatrix::from_vec(3 * d, count, variables);
        let theta = model.library().evaluate_points(&variables)?;
        Ok((theta, DMatrix::from_vec(d, count, ddz).transpose()))
    });
    samples.collect()
}

/// R^2 of all accelerations; none without coefficients or deviations, or if a value is not finite.
fn r2(samples: &[PhaseSamples], xi: impl Fn(usize) -> Option<DMatrix<f64>>) -> Option<f64> {
    let (mut residual, mut deviation) = (0.0, 0.0);
    for (phase, (theta, ddz)) in samples.iter().enumerate() {
        if ddz.nrows() > 0 {
            residual += (theta * xi(phase)? - ddz).norm_squared();
            let squares = ddz.column_iter().map(|y| y.variance() * y.len() as f64);
            deviation += squares.sum::<f64>();
        }
    }
    let r2 = 1.0 - residual / deviation;
    r2.is_finite().then_some(r2)
}

/// R^2 of coefficients fitted by least squares, with a ridge for terms that are alike on the samples.
fn fitted(samples: &[PhaseSamples]) -> Option<f64> {
    const RIDGE: f64 = 1e-10;
    r2(samples, |phase| {
        let (theta, ddz) = &samples[phase];
        if theta.nrows() < 3 * theta.ncols() {
            return None;
        }
        let mut gram = theta.tr_mul(theta);
        let ridge = RIDGE * gram.trace();
        (0..gram.nrows()).for_each(|k| gram[(k, k)] += ridge);
        Some(gram.cholesky()?.solve(&theta.tr_mul(ddz)))
    })
}
