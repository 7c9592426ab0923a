//! The loss over a window of predictions from every sample of a batch (appendix D of the paper, equations 40 and 41),
//! and its exact gradient.

use super::*;

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Explicit Euler
    Euler,
    /// Midpoint rule
    Rk2,
    /// Classical Runge-Kutta
    Rk4,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unroll {
    pub window: usize,
    /// Samples per step: 5 at 500 Hz are the published 10 ms.
    pub stride: usize,
    /// Weight of a prediction relative to that one step earlier, above 0 and at most 1.
    pub decay: f64,
    pub integrator: Integrator,
}

impl Integrator {
    /// Per stage: where in the step it stands, as the share of the earlier stage's slope too, and its weight.
    fn stages(self) -> &'static [(f64, f64)] {
        match self {
            Self::Euler => &[(0.0, 1.0)],
            Self::Rk2 => &[(0.0, 0.0), (0.5, 1.0)],
            Self::Rk4 => &[
                (0.0, 1.0 / 6.0),
                (0.5, 1.0 / 3.0),
                (0.5, 1.0 / 3.0),
                (1.0, 1.0 / 6.0),
            ],
        }
    }
}

#[derive(Clone, Copy)]
pub(super) struct Window<'a> {
    pub features: &'a Features,
    pub variables: &'a DMatrix<f64>, // z, dz, u_lat: n x 3d
    pub xi: &'a DMatrix<f64>,        // library_dim x d
    pub step_s: f64,
}

type Adjoints<'a> = [&'a mut DMatrix<f64>; 2]; // of the variables (n x 3d) and Xi

/// One evaluation of the dynamics for all starts, kept for the reverse sweep.
struct Stage {
    values: FeatureValues,
    theta: DMatrix<f64>,
    first: usize, // row of u_lat
}

impl Unroll {
    /// Mean over starts, coordinates and (decaying) steps of `(z_pred - z)^2`; 0 for a batch shorter than the window.
    /// Adds `weight` times its gradient to `adjoints`. Inputs are those of the last sample before each stage.
    pub(super) fn evaluate(
        &self,
        samples: Window<'_>,
        weight: f64,
        mut adjoints: Adjoints<'_>,
    ) -> f64 {
        let d = samples.features.latent_dim;
        let reach = self.window * self.stride;
        let starts = samples.variables.nrows().saturating_sub(reach);
        if starts == 0 {
            return 0.0;
        }
        let h = samples.step_s * self.stride as f64;
        let scale = 1.0 / (self.window * starts * d) as f64;
        let mut state = samples.variables.view((0, 0), (starts, 2 * d)).into_owned();
        let (mut steps, mut residuals, mut loss) = (Vec::new(), Vec::new(), 0.0);
        for step in 0..self.window {
            steps.push(self.forward(samples, step, h, &mut state));
            let target = samples
                .variables
                .view(((step + 1) * self.stride, 0), (starts, d));
            let residual = state.columns(0, d) - target;
            loss += scale * self.decay.powi(step as i32) * residual.norm_squared();
            residuals.push(residual);
        }
        let mut adjoint = DMatrix::zeros(starts, 2 * d);
        for (step, (mut stages, residual)) in steps.into_iter().zip(residuals).enumerate().rev() {
            let residual = residual * (2.0 * weight * scale * self.decay.powi(step as i32));
            let mut target = adjoints[0].view_mut(((step + 1) * self.stride, 0), (starts, d));
            target -= &residual;
            let mut position = adjoint.columns_mut(0, d);
            position += residual;
            self.backward(samples, (&mut stages, h), &mut adjoint, &mut adjoints);
        }
        let mut start = adjoints[0].view_mut((0, 0), (starts, 2 * d));
        start += adjoint;
        loss
    }

    /// One step of all starts; `state` is `starts x 2d`.
    fn forward(
        &self,
        samples: Window<'_>,
        step: usize,
        h: f64,
        state: &mut DMatrix<f64>,
    ) -> Vec<Stage> {
        let (starts, d) = (state.nrows(), samples.features.latent_dim);
        let (before, mut slope) = (state.clone(), DMatrix::zeros(starts, 2 * d));
        let mut stages = Vec::new();
        for &(at, share) in self.integrator.stages() {
            let now = &before + &slope * (h * at);
            let first = step * self.stride + (at * self.stride as f64) as usize;
            let mut variables = DMatrix::zeros(starts, 3 * d);
            variables.columns_mut(0, 2 * d).copy_from(&now);
            let inputs = samples.variables.view((first, 2 * d), (starts, d));
            variables.columns_mut(2 * d, d).copy_from(&inputs);
            let mut values = FeatureValues::default();
            let theta = samples.features.evaluate(&variables, &mut values);
            slope.columns_mut(0, d).copy_from(&now.columns(d, d));
            slope.columns_mut(d, d).copy_from(&(&theta * samples.xi));
            *state += &slope * (h * share);
            stages.push(Stage {
                values,
                theta,
                first,
            });
        }
        stages
    }

    /// Turns the gradient with respect to the state after a step into the one before it.
    fn backward(
        &self,
        samples: Window<'_>,
        (stages, h): (&mut [Stage], f64),
        adjoint: &mut DMatrix<f64>,
        adjoints: &mut Adjoints<'_>,
    ) {
        let (starts, d) = (adjoint.nrows(), samples.features.latent_dim);
        let after = adjoint.clone();
        let mut onto_earlier = DMatrix::zeros(starts, 2 * d);
        let weights = self.integrator.stages();
        for (stage, &(at, share)) in stages.iter_mut().zip(weights).rev() {
            let slope = &after * (h * share) + &onto_earlier;
            let acceleration = slope.columns(d, d);
            *adjoints[1] += stage.theta.tr_mul(&acceleration);
            let onto_theta = acceleration * samples.xi.transpose();
            let mut variables = DMatrix::zeros(starts, 3 * d);
            let features = samples.features;
            features.backward(&onto_theta, &mut stage.values, &mut variables);
            let mut inputs = adjoints[0].view_mut((stage.first, 2 * d), (starts, d));
            inputs += variables.columns(2 * d, d);
            let mut own = variables.columns(0, 2 * d).into_owned();
            let mut velocity = own.columns_mut(d, d);
            velocity += slope.columns(0, d);
            onto_earlier = &own * (h * at);
            *adjoint += own;
        }
    }
}
