//! The controller's settings as C has them.

use super::super::error::ControlError;
use super::super::settings::{Effectiveness, Lift, Linearisation, MpcSettings, Solver};

/// Settings as C has them; zero friction of the body and zero rate leave both free.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Stages of the horizon.
    pub horizon: i32,
    /// Cap on interior-point iterations.
    pub max_iterations: i32,
    /// 0 transpose, 1 consistent.
    pub lift: i32,
    /// 0 about the reference, 1 about the last plan.
    pub linearisation: i32,
    /// 0 clarabel, 1 Riccati.
    pub solver: i32,
    /// Duration of a stage, s.
    pub step_s: f64,
    /// Weight of the input deviation.
    pub input_weight: f64,
    /// Weight of velocities against positions.
    pub velocity_weight: f64,
    /// Factor on the state weights of the last stage.
    pub terminal_weight: f64,
    /// Price of leaving the joint limits.
    pub joint_penalty: f64,
    /// Friction coefficient of the lifted body force, or 0.
    pub body_friction: f64,
    /// Friction coefficient of each foot in the consistent lift.
    pub foot_friction: f64,
    /// Weight of the consistent lift's prior.
    pub lift_prior_weight: f64,
    /// Largest change of a lifted torque, N m/s, or 0.
    pub torque_rate_nm_s: f64,
    /// Time constant of the estimate of how much of the input arrives, s, or 0 for none.
    pub effectiveness_time_s: f64,
    /// Stiffness of the joint PD that holds the commanded posture, N m/rad, for that estimate.
    pub drive_stiffness_nm_rad: f64,
    /// Its damping, N m s/rad.
    pub drive_damping_nm_s_rad: f64,
    /// Share of the error of pitch that legs in flight are turned against.
    pub swing_turn: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let settings = MpcSettings::default();
        let estimate = settings.effectiveness;
        Self {
            horizon: settings.horizon as i32,
            max_iterations: settings.qp.max_iterations as i32,
            lift: settings.lift as i32,
            linearisation: settings.linearisation as i32,
            solver: settings.solver as i32,
            step_s: settings.step_s,
            input_weight: settings.input_weight,
            velocity_weight: settings.velocity_weight,
            terminal_weight: settings.terminal_weight,
            joint_penalty: settings.joint_penalty,
            body_friction: settings.body_friction.unwrap_or(0.0),
            foot_friction: settings.foot_friction,
            lift_prior_weight: settings.lift_prior_weight,
            torque_rate_nm_s: settings.torque_rate_nm_s.unwrap_or(0.0),
            effectiveness_time_s: estimate.map_or(0.0, |estimate| estimate.time_constant_s),
            drive_stiffness_nm_rad: estimate.map_or(0.0, |estimate| estimate.stiffness_nm_rad),
            drive_damping_nm_s_rad: estimate.map_or(0.0, |estimate| estimate.damping_nm_s_rad),
            swing_turn: settings.swing_turn,
        }
    }
}

impl Settings {
    /// The same for the controller.
    ///
    /// # Errors
    /// [`ControlError::Setting`] for a choice or a count that does not exist; other ranges are
    /// checked when the controller is built.
    pub fn to_mpc(&self) -> Result<MpcSettings, ControlError> {
        let lifts = [Lift::Transpose, Lift::Consistent];
        let points = [Linearisation::Reference, Linearisation::LastPlan];
        let about = "0 (the reference) or 1 (the last plan)";
        let solvers = [Solver::Clarabel, Solver::Riccati];
        let which = "0 (clarabel) or 1 (Riccati)";
        let mut settings = MpcSettings {
            horizon: usize::try_from(self.horizon)
                .map_err(|_| refused("horizon", self.horizon, "1 to 500 stages"))?,
            step_s: self.step_s,
            lift: chosen("lift", self.lift, lifts, "0 (transpose) or 1 (consistent)")?,
            linearisation: chosen("linearisation", self.linearisation, points, about)?,
            solver: chosen("solver", self.solver, solvers, which)?,
            input_weight: self.input_weight,
            velocity_weight: self.velocity_weight,
            terminal_weight: self.terminal_weight,
            joint_penalty: self.joint_penalty,
            body_friction: (self.body_friction != 0.0).then_some(self.body_friction),
            foot_friction: self.foot_friction,
            lift_prior_weight: self.lift_prior_weight,
            torque_rate_nm_s: (self.torque_rate_nm_s != 0.0).then_some(self.torque_rate_nm_s),
            effectiveness: (self.effectiveness_time_s != 0.0).then_some(Effectiveness {
                time_constant_s: self.effectiveness_time_s,
                stiffness_nm_rad: self.drive_stiffness_nm_rad,
                damping_nm_s_rad: self.drive_damping_nm_s_rad,
            }),
            swing_turn: self.swing_turn,
            ..MpcSettings::default()
        };
        settings.qp.max_iterations = u32::try_from(self.max_iterations)
            .map_err(|_| refused("max_iterations", self.max_iterations, "a positive number"))?;
        Ok(settings)
    }
}

fn refused(name: &'static str, found: i32, expected: &'static str) -> ControlError {
    ControlError::Setting {
        name,
        found: f64::from(found),
        expected,
    }
}

/// The choice with a number.
fn chosen<T: Copy>(
    name: &'static str,
    found: i32,
    choices: [T; 2],
    expected: &'static str,
) -> Result<T, ControlError> {
    let place = usize::try_from(found).ok();
    let choice = place.and_then(|place| choices.get(place));
    choice.copied().ok_or(refused(name, found, expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_settings_are_those_of_the_library() {
        let settings = Settings::default().to_mpc().expect("sound");
        assert_eq!(settings, MpcSettings::default());
    }

    #[test]
    fn choices_come_back_by_their_numbers() {
        for choices in [
            (Lift::Transpose, Linearisation::Reference, Solver::Clarabel),
            (Lift::Consistent, Linearisation::LastPlan, Solver::Riccati),
        ] {
            let settings = Settings {
                lift: choices.0 as i32,
                linearisation: choices.1 as i32,
                solver: choices.2 as i32,
                ..Settings::default()
            };
            let read = settings.to_mpc().expect("sound");
            assert_eq!((read.lift, read.linearisation, read.solver), choices);
        }
    }
}
