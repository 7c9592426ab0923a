//! The CSV table of rollouts that `romc simulate --output` writes.

use nalgebra::DVector;

use crate::Error;
use crate::evaluate::SegmentRun;
use crate::model::ReducedModel;
use crate::robot::Robot;
use crate::typeset::Table;

/// One row per sample: time, phase, recorded and predicted latent state and coordinates.
///
/// Columns: `segment, time, phase`, then `z_i, z_i_full, z_i_restarted` for each latent coordinate, the same
/// three of its velocity `dz_i`, the latent input `u_lat_i`, then the three of every robot coordinate
/// in SI units. A prediction that diverged leaves its cell empty.
///
/// # Errors
/// [`Error::Model`] for a model without decoder.
pub fn trajectory_table(model: &ReducedModel, runs: &[SegmentRun<'_>]) -> Result<Table, Error> {
    let mut table = Table::new(columns(model));
    for (index, run) in runs.iter().enumerate() {
        let [full, restarted] =
            [&run.full, &run.restarted].map(|rollout| rollout.states(run.latent.len()));
        for (sample, predictions) in full.iter().zip(&restarted).enumerate() {
            let (segment, latent) = (run.segment, &run.latent);
            let phase = &model.phases()[latent.phase[sample]].name;
            let mut row = vec![
                index.to_string(),
                segment.time_s[sample].to_string(),
                phase.clone(),
            ];
            let states = [predictions.0.as_ref(), predictions.1.as_ref()];
            let z = states.map(|state| state.map(|(z, _)| z));
            add(&mut row, latent.z.column(sample).iter(), z);
            let dz = states.map(|state| state.map(|(_, dz)| dz));
            add(&mut row, latent.dz.column(sample).iter(), dz);
            row.extend(latent.u_lat.column(sample).iter().map(f64::to_string));
            let [full, restarted] = z.map(|z| z.map(|z| model.decode(z)).transpose());
            let decoded = [full?, restarted?];
            let decoded = decoded.each_ref().map(Option::as_ref);
            add(&mut row, segment.x.column(sample).iter(), decoded);
            table.row(row);
        }
    }
    Ok(table)
}

fn columns(model: &ReducedModel) -> Vec<String> {
    const KINDS: [&str; 3] = ["", "_full", "_restarted"];
    let latent = |symbol: &str| -> Vec<String> {
        let indices = 1..=model.latent_dim();
        indices.map(|index| format!("{symbol}_{index}")).collect()
    };
    let thrice = |names: Vec<String>| {
        let of = |name: String| KINDS.map(|kind| format!("{name}{kind}"));
        names.into_iter().flat_map(of)
    };
    let names = model.state().map(|state| state.names.clone());
    let names = names.unwrap_or_else(|| Robot::state_names().to_vec());
    let first = ["segment", "time", "phase"].map(str::to_owned).into_iter();
    first
        .chain(thrice(latent("z")))
        .chain(thrice(latent("dz")))
        .chain(latent("u_lat"))
        .chain(thrice(names))
        .collect()
}

/// Adds each recorded value with its two predictions to a row.
fn add<'a>(
    row: &mut Vec<String>,
    recorded: impl Iterator<Item = &'a f64>,
    predicted: [Option<&DVector<f64>>; 2],
) {
    for (index, value) in recorded.enumerate() {
        row.push(value.to_string());
        let cell = |values: Option<&DVector<f64>>| {
            values.map_or(String::new(), |values| values[index].to_string())
        };
        row.extend(predicted.map(cell));
    }
}
