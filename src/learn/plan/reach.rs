//! Which distances and heights can be planned.

use super::error::PlanError;
use super::goal::Goal;
use super::settings::PlanSettings;
use super::solve::plan;
use crate::model::ReducedModel;

/// Steps of a map across the recorded range of distances and of apexes; it goes on as far at either side.
const STEPS: [i32; 2] = [4, 3];

#[derive(Clone, Debug, PartialEq)]
pub struct MappedGoal {
    pub goal_m: [f64; 2],
    pub status: &'static str,
    pub input_deviation: Option<f64>,
    pub solve_ms: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct GoalMap {
    pub distances_m: Vec<f64>,
    pub apexes_m: Vec<f64>,
    /// One point per distance and apex, distances of one apex together.
    pub points: Vec<MappedGoal>,
}

/// Plans a grid of goals around the training jumps; `done` is told how many of how many.
pub fn reach(
    model: &ReducedModel,
    settings: &PlanSettings,
    mut done: impl FnMut(usize, usize),
) -> Result<GoalMap, PlanError> {
    let prior = model.jump_prior()?;
    let axis = |i: usize| -> Vec<f64> {
        let range = &prior.ranges()[i];
        let place = |k: i32| {
            let share = f64::from(k) / f64::from(STEPS[i]);
            range.least * (1.0 - share) + range.most * share
        };
        let values = (-STEPS[i]..=2 * STEPS[i]).map(place);
        values.filter(|value| *value > 0.0).collect()
    };
    let (distances_m, apexes_m) = (axis(0), axis(1));
    let total = distances_m.len() * apexes_m.len();
    let mut points = Vec::with_capacity(total);
    for k in 0..total {
        let goal_m = [
            distances_m[k % distances_m.len()],
            apexes_m[k / distances_m.len()],
        ];
        points.push(point(model, goal_m, settings)?);
        done(points.len(), total);
    }
    Ok(GoalMap {
        distances_m,
        apexes_m,
        points,
    })
}

fn point(
    model: &ReducedModel,
    goal_m: [f64; 2],
    settings: &PlanSettings,
) -> Result<MappedGoal, PlanError> {
    let clock = std::time::Instant::now();
    let made = Goal::new(goal_m[0], goal_m[1]).and_then(|goal| plan(model, &goal, settings));
    let solve_ms = 1e3 * clock.elapsed().as_secs_f64();
    let (status, input_deviation) = match made {
        Ok(plan) => (plan.verdict.word(), Some(plan.input_deviation)),
        Err(error @ (PlanError::Model(_) | PlanError::Lower(_))) => return Err(error),
        Err(
            PlanError::Goal { .. }
            | PlanError::Unsolved { .. }
            | PlanError::NotConverged { .. }
            | PlanError::Control(_)
            | PlanError::Recording(_),
        ) => ("no plan", None),
    };
    Ok(MappedGoal {
        goal_m,
        status,
        input_deviation,
        solve_ms,
    })
}
