//! Template models that a learned model is compared with: the actuated spring-loaded inverted pendulum, equations (27)
//! and (28), with the published constants and with fitted ones.

use super::*;
use crate::sim::integrate::{IntegrationOptions, OdeSystem, integrate};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aslip {
    pub mass_kg: f64,
    pub stiffness_n_m: f64,
    /// Vertical rest length `l_0`, m; the horizontal one is 0.
    pub rest_length_m: f64,
    pub gravity_m_s2: f64,
}

impl Aslip {
    pub(crate) const PUBLISHED: Self = Self {
        mass_kg: 12.01,
        stiffness_n_m: 250.0,
        rest_length_m: 0.32,
        gravity_m_s2: 9.81,
    };

    pub fn constants(&self) -> String {
        let spring = match (self.stiffness_n_m, self.rest_length_m) {
            (0.0, _) => String::new(),
            (stiffness, length) => format!("k_s = {stiffness:.1} N/m, l_0 = {length:.3} m, "),
        };
        let (mass, gravity) = (self.mass_kg, self.gravity_m_s2);
        format!("m = {mass:.2} kg, {spring}g = {gravity:.2} m/s^2")
    }

    fn acceleration(&self, position: Vector2<f64>, stance: Option<Stance>) -> Vector2<f64> {
        let gravity = Vector2::new(0.0, -self.gravity_m_s2);
        match stance {
            None => gravity,
            Some(stance) => {
                let rest = stance.foot_m + Vector2::new(0.0, self.rest_length_m);
                gravity
                    + (rest - position) * (self.stiffness_n_m / self.mass_kg)
                    + stance.force_n / self.mass_kg
            }
        }
    }

    /// Rolls the pendulum out, driven by the same forces as a learned model of this rule, in the world's axes.
    pub(crate) fn rollout(
        &self,
        rule: &InputRule,
        segment: &Segment,
        restart: Restart,
    ) -> Result<AslipRollout, SimError> {
        let stances = stances(rule, segment)?;
        let mut position_m = vec![None; segment.len()];
        let down = |sample: usize| stances[sample].is_some();
        for window in restart_windows(&segment.time_s, restart) {
            let start = window.start;
            let at = |rows: &DMatrix<f64>| [BODY_X, BODY_Z].map(|row| rows[(row, start)]);
            let initial = [at(&segment.x), at(&segment.dx)].concat();
            let (states, _) = integrate_stretches(
                &initial,
                &segment.time_s,
                window,
                |a, b| down(a) == down(b),
                |stretch, state, times| {
                    let mut span = PendulumSpan {
                        pendulum: self,
                        stances: &stances[stretch],
                        times,
                    };
                    integrate(&mut span, state, times, &IntegrationOptions::default())
                },
            );
            for (state, position) in states.column_iter().zip(&mut position_m[start..]) {
                *position = Some(Vector2::new(state[0], state[1]));
            }
        }
        Ok(position_m)
    }
}

/// `y = [x, z, dx, dz]` of the pendulum within one contact or flight; `stances` of its samples.
struct PendulumSpan<'a> {
    pendulum: &'a Aslip,
    stances: &'a [Option<Stance>],
    times: &'a [f64],
}

impl PendulumSpan<'_> {
    fn stance_at(&self, time_s: f64) -> Option<Stance> {
        let times = &self.times[..self.stances.len()];
        let (left, right, share) = between(times, time_s);
        let (from, to) = (self.stances[left]?, self.stances[right]?);
        Some(Stance {
            foot_m: from.foot_m,
            force_n: from.force_n.lerp(&to.force_n, share),
        })
    }
}

impl OdeSystem for PendulumSpan<'_> {
    fn rate(&mut self, time_s: f64, y: &[f64], dy: &mut [f64]) {
        let position = Vector2::new(y[0], y[1]);
        let acceleration = self.pendulum.acceleration(position, self.stance_at(time_s));
        dy.copy_from_slice(&[y[2], y[3], acceleration.x, acceleration.y]);
    }

    fn jacobian(&mut self, _time_s: f64, _y: &[f64], jacobian: &mut DMatrix<f64>) {
        jacobian.fill(0.0);
        let spring = match self.stances[0] {
            Some(_) => self.pendulum.stiffness_n_m / self.pendulum.mass_kg,
            None => 0.0,
        };
        for axis in 0..2 {
            jacobian[(axis, 2 + axis)] = 1.0;
            jacobian[(2 + axis, axis)] = -spring;
        }
    }
}

pub(crate) type AslipRollout = Vec<Option<Vector2<f64>>>;

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AslipSums {
    pub x: FitSums,
    pub z: FitSums,
}

impl AslipSums {
    /// Root mean square errors of body x and z, m.
    pub fn rms(&self) -> [Option<f64>; 2] {
        [&self.x, &self.z].map(|sums| Some(sums.fit()?.rms))
    }

    pub(crate) fn add(&mut self, segment: &Segment, rollout: &[Option<Vector2<f64>>]) {
        for (sample, position) in rollout.iter().enumerate() {
            if let Some(position) = position {
                self.x.add(segment.x[(BODY_X, sample)], position.x);
                self.z.add(segment.x[(BODY_Z, sample)], position.y);
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stance {
    /// Mean position of the feet where the contact began.
    pub(super) foot_m: Vector2<f64>,
    pub(super) force_n: Vector2<f64>,
}

pub(super) fn stances(
    rule: &InputRule,
    segment: &Segment,
) -> Result<Vec<Option<Stance>>, RecordingError> {
    let input = segment.input(rule)?;
    let mut stances = Vec::with_capacity(segment.len());
    let mut foot_m = None;
    for sample in 0..segment.len() {
        if !segment.feet[sample].contains(&true) {
            foot_m = None;
            stances.push(None);
            continue;
        }
        let foot = *foot_m.get_or_insert_with(|| mean_foot(rule.robot(), segment, sample));
        let force = input.fixed_view::<3, 1>(JOINT_DIM, sample).into_owned();
        let force = match rule.wrench_frame() {
            WrenchFrame::Body => orientation(segment, sample) * force,
            WrenchFrame::World | WrenchFrame::Ground => force,
        };
        stances.push(Some(Stance {
            foot_m: foot,
            force_n: Vector2::new(force.x, force.z),
        }));
    }
    Ok(stances)
}

fn orientation(segment: &Segment, sample: usize) -> Rotation3<f64> {
    let angle = |index: usize| segment.x[(JOINT_DIM + 3 + index, sample)];
    Rotation3::from_euler_angles(angle(0), angle(1), angle(2))
}

fn mean_foot(robot: &Robot, segment: &Segment, sample: usize) -> Vector2<f64> {
    let joints = segment.joints(sample);
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for leg in Leg::down(segment.feet[sample]) {
        sum += robot.foot_from_body(leg, &leg.of_joints(&joints));
        count += 1.0;
    }
    let in_body = sum / f64::max(count, 1.0);
    let body = segment.x.column(sample);
    let in_world = orientation(segment, sample) * in_body
        + Vector3::new(body[BODY_X], body[BODY_X + 1], body[BODY_Z]);
    Vector2::new(in_world.x, in_world.z)
}

#[derive(Debug, Clone, PartialEq)]
pub struct Baseline {
    pub name: &'static str,
    pub template: Aslip,
    pub full: AslipSums,
    pub restarted: AslipSums,
}

impl Baseline {
    pub(crate) fn all(
        rule: &InputRule,
        segments: &[&Segment],
    ) -> Result<Vec<Self>, RecordingError> {
        let published = ("ASLIP (published constants)", Aslip::PUBLISHED);
        let fitted = fit_aslip(rule, segments)?.map(|fitted| match fitted.stiffness_n_m {
            0.0 => ("point mass (fitted)", fitted),
            _ => ("ASLIP (fitted constants)", fitted),
        });
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
    pub(crate) fn add(
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

/// Constants that fit the recorded accelerations in contact best: `ddx = a (p_f,x - x) + c F_x` and `ddz + g = a (p_f,z
/// - z) + b + c F_z` with `a = k_s / m`, `b = a l_0`, `c = 1 / m`. A spring that pushes away (`a <= 0`) is left out.
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
    let mut fits = [&[0, 1, 2][..], &[2]].into_iter().filter_map(|columns| {
        let solution = least_squares(&rows, columns, &right)?;
        let (stiffness, rest_length_m, c) = match solution[..] {
            [a, b, c] if a > 0.0 => (a, b / a, c),
            [c] => (0.0, 0.0, c),
            _ => return None,
        };
        (c > 0.0).then(|| Aslip {
            mass_kg: 1.0 / c,
            stiffness_n_m: stiffness / c,
            rest_length_m,
            ..published
        })
    });
    Ok(fits.next())
}

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
