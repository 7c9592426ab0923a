//! Whether the rollouts of whole jumps are worth anything.

use crate::Error;
use crate::recording::Source;
use crate::robot::JOINT_DIM;
use crate::train::SetMetrics;
use crate::typeset::significant;

/// Rows of the body's position forwards and upwards.
const BODY: [usize; 2] = [JOINT_DIM, JOINT_DIM + 2];

/// A note if rollouts of whole jumps end up further off than a body would be that stays where each jump starts: root mean
/// squares over all samples of the body's error forwards and upwards, and of its way from the start.
///
/// # Errors
/// [`Error::Recording`] for a recording that cannot be read.
pub fn whole_jump_note<'a>(
    metrics: &SetMetrics,
    (set, recordings): (&str, impl Into<Source<'a>>),
) -> Result<Option<String>, Error> {
    let (mut squares, mut samples) = (0.0, 0);
    recordings.into().for_each(|recording| {
        for segment in &recording.segments {
            for row in BODY {
                let start = segment.x[(row, 0)];
                squares += (segment.x.row(row).iter())
                    .map(|value| (value - start).powi(2))
                    .sum::<f64>();
            }
            samples += segment.len();
        }
        Ok::<_, Error>(())
    })?;
    let moved_m = (squares / f64::from(u32::try_from(samples.max(1)).unwrap_or(u32::MAX))).sqrt();
    let off = match (metrics.rollout_x_m, metrics.rollout_z_m) {
        (Some(x), Some(z)) if x.hypot(z) <= moved_m => return Ok(None),
        (Some(x), Some(z)) => format!("are {} m off", significant(x.hypot(z))),
        (None, _) | (_, None) => "diverge".to_owned(),
    };
    Ok(Some(format!(
        "rollouts of the whole {set} jumps {off}, where a body that stays at its start is {} m off: rely on predictions \
         of 0.1 s only, try another number of latent coordinates, or record more jumps",
        significant(moved_m)
    )))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::recording;

    #[test]
    fn whole_jump_note_appears_where_standing_still_is_better() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1");
        // moves by 0.140 m forwards and 0.065 m upwards, root mean squares
        let jumps = [recording::read(&folder.join("test_01.csv.gz")).expect("shipped")];
        let note = |x: Option<f64>, z: f64| {
            let metrics = SetMetrics {
                decoder_mse: 0.0,
                ddz_r2: Vec::new(),
                torque_r2: 1.0,
                prediction_x_m: 0.0,
                prediction_z_m: 0.0,
                rollout_x_m: x,
                rollout_z_m: Some(z),
            };
            whole_jump_note(&metrics, ("validation", &jumps)).expect("in memory")
        };
        assert_eq!(note(Some(0.13), 0.06), None);
        let found = note(Some(0.15), 0.07).expect("a note");
        assert!(
            found.contains("validation jumps are 0.1655 m off"),
            "{found}"
        );
        assert!(note(Some(3.0), 4.0).expect("a note").contains("5.000 m"));
        assert!(note(None, 0.0).expect("a note").contains("diverge"));
    }
}
