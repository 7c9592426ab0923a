//! Template models that a learned model is held against.
//!
//! A baseline is a pendulum with a name that says where its constants come from.

use nalgebra::{DMatrix, DVector};

use super::aslip::{Aslip, AslipRollout, AslipSums, stances};
use crate::recording::{RecordingError, Segment};
use crate::robot::{BODY_X, BODY_Z, InputRule};
use crate::sim::{Restart, SimError};

/// A template, where its constants come from, and its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    pub name: &'static str,
    pub template: Aslip,
    pub full: AslipSums,
    pub restarted: AslipSums,
}

impl Baseline {
    /// The pendulum with the published constants, and with those that `segments` fit best.
    ///
    /// # Errors
    /// [`RecordingFault::Wrench`](crate::recording::RecordingFault::Wrench) if an angle or torque is not finite.
    pub fn all(rule: &InputRule, segments: &[&Segment]) -> Result<Vec<Self>, RecordingError> {
        let published = ("ASLIP, published constants", Aslip::PUBLISHED);
        let fitted = fit_aslip(rule, segments)?.map(|fitted| ("ASLIP, fitted constants", fitted));
        let templates = [published].into_iter().chain(fitted);
        let baselines = templates.map(|(name, template)| Self {
            name,
            template,
            full: AslipSums::default(),
            restarted: AslipSums::default(),
        });
        Ok(baselines.collect())
    }

    /// Adds the residuals over one segment; the rollout over the whole of it is returned.
    ///
    /// # Errors
    /// As [`Aslip::rollout`].
    pub fn add(
        &mut self,
        rule: &InputRule,
        segment: &Segment,
        restart: Restart,
    ) -> Result<AslipRollout, SimError> {
        let full = self.template.rollout(rule, segment, Restart::Never)?;
        self.full.add(segment, &full);
        let restarted = self.template.rollout(rule, segment, restart)?;
        self.restarted.add(segment, &restarted);
        Ok(full)
    }
}

/// Constants of the pendulum that fit the recorded accelerations in contact best; gravity stays.
///
/// With `a = k_s / m`, `b = a l_0` and `c = 1 / m`, equation (27) is linear:
/// `ddx = a (p_f,x - x) + c F_x` and `ddz + g = a (p_f,z - z) + b + c F_z`; `a`, `b`, `c` minimise the
/// squared residuals over all samples with a foot down. A spring that pushes away (`a <= 0`) is no
/// spring: it is left out, and only the mass is fitted. None without contact, or where the forces say
/// nothing about a mass.
fn fit_aslip(rule: &InputRule, segments: &[&Segment]) -> Result<Option<Aslip>, RecordingError> {
    let published = Aslip::PUBLISHED;
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for segment in segments {
        for (sample, stance) in stances(rule, segment)?.into_iter().enumerate() {
            let Some(stance) = stance else { continue };
            let (x, z) = (segment.x[(BODY_X, sample)], segment.x[(BODY_Z, sample)]);
            rows.push([stance.foot_m.x - x, 0.0, stance.force_n.x]);
            right.push(segment.ddx[(BODY_X, sample)]);
            rows.push([stance.foot_m.y - z, 1.0, stance.force_n.y]);
            right.push(segment.ddx[(BODY_Z, sample)] + published.gravity_m_s2);
        }
    }
    let right = DVector::from_vec(right);
    let with_spring = least_squares(&rows, &[0, 1, 2], &right);
    if let Some([a, b, c]) = with_spring.as_deref()
        && *a > 0.0
        && *c > 0.0
    {
        return Ok(Some(Aslip {
            mass_kg: 1.0 / c,
            stiffness_n_m: a / c,
            rest_length_m: b / a,
            ..published
        }));
    }
    let mass_only = least_squares(&rows, &[2], &right);
    Ok(match mass_only.as_deref() {
        Some([c]) if *c > 0.0 => Some(Aslip {
            mass_kg: 1.0 / c,
            stiffness_n_m: 0.0,
            rest_length_m: 0.0,
            ..published
        }),
        Some(_) | None => None,
    })
}

/// Least-squares coefficients of some columns; none where they are not independent.
fn least_squares(rows: &[[f64; 3]], columns: &[usize], right: &DVector<f64>) -> Option<Vec<f64>> {
    if rows.len() <= columns.len() {
        return None;
    }
    let matrix = DMatrix::from_fn(rows.len(), columns.len(), |r, c| rows[r][columns[c]]);
    // columns of unit length, so that newtons and metres are of one size
    let norms: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    if norms.contains(&0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(rows.len(), columns.len(), |r, c| matrix[(r, c)] / norms[c]);
    let normal = scaled.tr_mul(&scaled).cholesky()?;
    let solution = normal.solve(&scaled.tr_mul(right));
    Some((solution.iter().zip(&norms)).map(|(s, n)| s / n).collect())
}
