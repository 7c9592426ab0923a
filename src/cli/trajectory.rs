//! The CSV table of rollouts that `romc simulate --output` writes.

use std::fmt::Write as _;

use crate::Error;
use crate::evaluate::SegmentRun;
use crate::model::ReducedModel;
use crate::robot::Robot;

/// One row a sample: time, phase, recorded and predicted latent state and coordinates.
///
/// Columns: `segment, time, phase`, then `z_i, z_i_full, z_i_restarted` a latent coordinate, then
/// the same three of every robot coordinate in SI units. A prediction that diverged leaves its cell
/// empty.
#[derive(Debug, Clone)]
pub struct TrajectoryTable {
    text: String,
}

impl TrajectoryTable {
    /// A table that has only its header.
    pub fn new(model: &ReducedModel) -> Self {
        let mut text = "segment,time,phase".to_owned();
        let latent = (1..=model.latent_dim()).map(|index| format!("z_{index}"));
        let names = model.state().map(|state| state.names.clone());
        let names = names.unwrap_or_else(|| Robot::state_names().to_vec());
        for name in latent.chain(names) {
            let _ = write!(text, ",{name},{name}_full,{name}_restarted");
        }
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
                columns[sample] = Some(window.z.column(column).into_owned());
            }
            columns
        });
        for (sample, (full, restarted)) in full.iter().zip(&restarted).enumerate() {
            let phase = &model.phases()[latent.phase[sample]].name;
            let _ = write!(self.text, "{index},{},{phase}", segment.time_s[sample]);
            let z = [full.as_ref(), restarted.as_ref()];
            let recorded = latent.z.column(sample).into_owned();
            self.cells(recorded.as_slice(), z.map(|z| z.map(|z| z.as_slice())));
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
