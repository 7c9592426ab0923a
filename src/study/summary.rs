//! Outcomes of the trainings of a study, means and spreads over its seeds, and its tables.

use super::*;
use crate::evaluate::combined_loss;
use crate::train::{SetMetrics, TrainReport};
use crate::typeset::Table;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Cell {
    pub id: CellId,
    pub outcome: Outcome,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Outcome {
    Trained(Metrics),
    Refused(String),
}

/// Metrics of one model, on the validation jumps where there are any, else on the training jumps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Metrics {
    pub decoder_mse: f64,
    pub active: usize,
    pub active_all_phases: usize,
    pub torque_r2: f64,
    pub prediction_x_m: f64,
    pub prediction_z_m: f64,
}

impl Metrics {
    pub(crate) fn of(report: &TrainReport) -> Self {
        let set: &SetMetrics = report.validation.as_ref().unwrap_or(&report.training);
        let active = report.active_terms.iter().map(|phase| phase.active);
        Self {
            decoder_mse: set.decoder_mse,
            active: active.clone().next().unwrap_or(0),
            active_all_phases: active.sum(),
            torque_r2: set.torque_r2,
            prediction_x_m: set.prediction_x_m,
            prediction_z_m: set.prediction_z_m,
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let [x, z] = [self.prediction_x_m, self.prediction_z_m];
        let values = [x, z, self.decoder_mse, self.torque_r2];
        values.into_iter().all(f64::is_finite)
    }

    /// `L_mod` (29) over the active coefficients of all phases; without any, the logarithm counts as 0.
    pub(crate) fn combined_loss(&self, lambda: f64) -> f64 {
        combined_loss(self.decoder_mse, self.active_all_phases.max(1), lambda)
            .expect("at least one coefficient")
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Spread {
    pub mean: f64,
    /// Standard deviation (divided by n - 1), 0 for one seed.
    pub std: f64,
}

impl Spread {
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        (!values.is_empty()).then(|| Self {
            mean,
            std: (squares / (n - 1.0).max(1.0)).sqrt(),
        })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct DimensionSummary {
    pub latent_dim: usize,
    pub trained: usize,
    pub refused: usize,
    pub decoder_mse: Spread,
    pub active: Spread,
    pub combined_loss: Spread,
    pub torque_r2: Spread,
    pub prediction_x_m: Spread,
    pub prediction_z_m: Spread,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Summary {
    pub lambda: f64,
    /// Ascending; dimensions without any model are left out.
    pub dimensions: Vec<DimensionSummary>,
}

impl Summary {
    pub(crate) fn of(cells: &[Cell], lambda: f64) -> Self {
        let mut dims: Vec<usize> = cells.iter().map(|cell| cell.id.latent_dim).collect();
        dims.sort_unstable();
        dims.dedup();
        let dimensions = dims.into_iter().filter_map(|d| dimension(cells, d, lambda));
        Self {
            lambda,
            dimensions: dimensions.collect(),
        }
    }

    pub(crate) fn best(&self) -> Option<usize> {
        let loss = |row: &&DimensionSummary| row.combined_loss.mean;
        let rows = self.dimensions.iter();
        let best = rows.min_by(|a, b| loss(a).total_cmp(&loss(b)));
        best.map(|row| row.latent_dim)
    }

    pub(crate) fn table(&self) -> Table {
        let mut table = Table::of(&self.dimensions)
            .column("latent_dim", "", |row| row.latent_dim)
            .column("trained", "", |row| row.trained)
            .column("refused", "", |row| row.refused)
            .table();
        let rows = self.dimensions.iter();
        type Column = (&'static str, fn(&DimensionSummary) -> Spread);
        let columns: [Column; 6] = [
            ("decoder_mse", |row| row.decoder_mse),
            ("active", |row| row.active),
            ("combined_loss", |row| row.combined_loss),
            ("torque_r2", |row| row.torque_r2),
            ("prediction_x_m", |row| row.prediction_x_m),
            ("prediction_z_m", |row| row.prediction_z_m),
        ];
        for (name, spread) in columns {
            let means = rows.clone().map(|row| spread(row).mean.to_string());
            table.column(&format!("{name}_mean"), "", means);
            let stds = rows.clone().map(|row| spread(row).std.to_string());
            table.column(&format!("{name}_std"), "", stds);
        }
        table
    }
}

pub(crate) fn cell_table(cells: &[Cell], lambda: f64) -> Table {
    let columns = "latent_dim,seed,decoder_mse,active,active_all_phases,combined_loss,torque_r2,prediction_x_m,prediction_z_m,refused";
    let mut table = Table::new(columns.split(','));
    for Cell { id, outcome } in cells {
        let mut row = vec![id.latent_dim.to_string(), id.seed.to_string()];
        match outcome {
            Outcome::Trained(metrics) => row.extend([
                metrics.decoder_mse.to_string(),
                metrics.active.to_string(),
                metrics.active_all_phases.to_string(),
                metrics.combined_loss(lambda).to_string(),
                metrics.torque_r2.to_string(),
                metrics.prediction_x_m.to_string(),
                metrics.prediction_z_m.to_string(),
                String::new(),
            ]),
            Outcome::Refused(reason) => {
                row.resize(columns.matches(',').count(), String::new());
                row.push(reason.clone());
            }
        }
        table.row(row);
    }
    table
}

fn dimension(cells: &[Cell], latent_dim: usize, lambda: f64) -> Option<DimensionSummary> {
    let own = cells.iter().filter(|cell| cell.id.latent_dim == latent_dim);
    let (mut metrics, mut refused): (Vec<&Metrics>, usize) = (Vec::new(), 0);
    for cell in own {
        match &cell.outcome {
            Outcome::Trained(found) => metrics.push(found),
            Outcome::Refused(_) => refused += 1,
        }
    }
    let spread = |value: &dyn Fn(&Metrics) -> f64| {
        Spread::of(&metrics.iter().map(|found| value(found)).collect::<Vec<_>>())
    };
    Some(DimensionSummary {
        latent_dim,
        trained: metrics.len(),
        refused,
        decoder_mse: spread(&|found| found.decoder_mse)?,
        active: spread(&|found| found.active as f64)?,
        combined_loss: spread(&|found| found.combined_loss(lambda))?,
        torque_r2: spread(&|found| found.torque_r2)?,
        prediction_x_m: spread(&|found| found.prediction_x_m)?,
        prediction_z_m: spread(&|found| found.prediction_z_m)?,
    })
}
