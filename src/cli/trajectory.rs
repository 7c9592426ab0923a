//! The CSV table of rollouts that `romc simulate --output` writes.

use std::fmt::Write as _;

use crate::Error;
use crate::evaluate::SegmentRun;
use crate::model::ReducedModel;
use crate::robot::Robot;

/// One row a sample: time, phase, recorded and predicted latent state and coordinates.
///
/// Columns: `segment, time, phase`, then `z_i, z_i_full, z_i_restarted` a latent coordinate, the same
/// three of its velocity `dz_i`, the latent input `u_lat_i`, then the three of every robot coordinate
/// in SI units. A prediction that diverged leaves its cell empty.
#[derive(Debug, Clone)]
pub struct TrajectoryTable {
    text: String,
}

impl TrajectoryTable {
    /// A table that has only its header.
    pub fn new(model: &ReducedModel) -> Self {
        let mut text = "segment,time,phase".to_owned();
        let latent = |symbol: &str| -> Vec<String> {
            let indices = 1..=model.latent_dim();
            indices.map(|index| format!("{symbol}_{index}")).collect()
        };
        let names = model.state().map(|state| state.names.clone());
        let names = names.unwrap_or_else(|| Robot::state_names().to_vec());
        let mut columns = |names: &[String], kinds: &[&str]| {
            for (name, kind) in names.iter().flat_map(|n| kinds.iter().map(move |k| (n, k))) {
                let _ = write!(text, ",{name}{kind}");
            }
        };
        let kinds = ["", "_full", "_restarted"];
        columns(&latent("z"), &kinds);
        columns(&latent("dz"), &kinds);
        columns(&latent("u_lat"), &[""]);
        columns(&names, &kinds);
        text.push('\n');
        Self { text }
    }

    /// Adds the samples of a segment and its two rollouts.
    ///
    /// # Errors
    /// [`Error::Model`] for a model without decoder.
    pub fn add(
        &mut self,
        model: &ReducedModel,
        index: usize,
        run: &SegmentRun<'_>,
    ) -> Result<(), Error> {
        let SegmentRun {
            segment,
            latent,
            full,
            restarted,
            ..
        } = run;
        let [full, restarted] = [full, restarted].map(|rollout| {
            let mut columns = vec![None; latent.len()];
            for (sample, window, column) in rollout.predictions() {
                columns[sample] = Some((
                    window.z.column(column).into_owned(),
                    window.dz.column(column).into_owned(),
                ));
            }
            columns
        });
        for (sample, (full, restarted)) in full.iter().zip(&restarted).enumerate() {
            let phase = &model.phases()[latent.phase[sample]].name;
            let _ = write!(self.text, "{index},{},{phase}", segment.time_s[sample]);
            let states = [full.as_ref(), restarted.as_ref()];
            let z = states.map(|state| state.map(|(z, _)| z));
            let dz = states.map(|state| state.map(|(_, dz)| dz));
            let recorded = latent.z.column(sample).into_owned();
            self.cells(recorded.as_slice(), z.map(|z| z.map(|z| z.as_slice())));
            let recorded = latent.dz.column(sample).into_owned();
            self.cells(recorded.as_slice(), dz.map(|dz| dz.map(|dz| dz.as_slice())));
            for value in latent.u_lat.column(sample).iter() {
                let _ = write!(self.text, ",{value}");
            }
            let [full, restarted] = z.map(|z| z.map(|z| model.decode(z)).transpose());
            let decoded = [full?, restarted?];
            let recorded = segment.x.column(sample).into_owned();
            let decoded = decoded.each_ref().map(|x| x.as_ref().map(|x| x.as_slice()));
            self.cells(recorded.as_slice(), decoded);
            self.text.push('\n');
        }
        Ok(())
    }

    fn cells(&mut self, recorded: &[f64], predicted: [Option<&[f64]>; 2]) {
        for (index, value) in recorded.iter().enumerate() {
            let _ = write!(self.text, ",{value}");
            for values in predicted {
                self.text.push(',');
                if let Some(values) = values {
                    let _ = write!(self.text, "{}", values[index]);
                }
            }
        }
    }

    /// The table as the bytes of a CSV file.
    pub fn as_bytes(&self) -> &[u8] {
        self.text.as_bytes()
    }
}
