//! From a goal to a plan by sequential convex programs; which goals can be planned.

use std::time::Instant;

use super::motion::motion;
use super::verdict::verdict;
use super::*;
use crate::recording::mismatch::Balance;

const CONVERGED_DEFECT: f64 = 1e-4;
const CONVERGED_STEP: f64 = 2e-2;
/// First programs after each of which the node of the apex is placed anew; then it stays, so that they converge.
const APEX_PROGRAMS: usize = 3;
const USABLE_DEFECT: f64 = 1e-3;

#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPart {
    pub name: String,
    pub phase: usize,
    pub duration_s: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub goal_m: [f64; 2],
    pub reached_m: [f64; 2],
    pub motion: Segment,
    pub parts: Vec<PlannedPart>,
    pub cost: f64,
    /// Largest Mahalanobis deviation of the latent input from the prior's, per coordinate.
    pub input_deviation: f64,
    /// Expected errors of distance and rise, one standard deviation, m.
    pub error_m: [f64; 2],
    pub margins: Margins,
    pub verdict: Verdict,
    pub programs: usize,
    pub solve_ms: f64,
}

/// Plans a jump. An unreliable plan is no error: its [`Verdict`] reports it.
pub fn plan(model: &ReducedModel, goal: &Goal, settings: &PlanSettings) -> Result<Plan> {
    let clock = Instant::now();
    let seed = Seed::new(model, goal, settings)?;
    let mut task = Task::new(&seed, settings);
    let (y, programs) = solve(&mut task)?;
    let (motion, margins) = motion(&task, &y, model.sample_time_s().unwrap_or(0.002))?;
    let parts = (seed.parts.iter().enumerate())
        .map(|(part, of)| PlannedPart {
            name: of.landmark.name.clone(),
            phase: of.phase,
            duration_s: task.duration_s(part, &y),
        })
        .collect();
    let goal_m = goal.goal_m();
    let mut planned = Plan {
        goal_m,
        reached_m: reached(&motion),
        parts,
        cost: costs::value(&task, &y),
        input_deviation: input_deviation(&task, &y),
        error_m: expected_error(&task, &y),
        verdict: Verdict::Trusted,
        margins,
        motion,
        programs,
        solve_ms: 0.0,
    };
    let balance = Balance::of(&Recording::from(planned.motion.clone()), model.robot()?);
    planned.verdict = verdict(&task, &y, &planned, balance.weight_share);
    planned.solve_ms = 1e3 * clock.elapsed().as_secs_f64();
    Ok(planned)
}

fn solve(task: &mut Task<'_>) -> Result<(Vec<f64>, usize)> {
    let goal_m = task.seed.goal.goal_m();
    let settings = QpSettings {
        profile: SolverProfile::Scaled,
        max_iterations: 60,
        ..QpSettings::default()
    };
    let mut y = task.prior_point();
    for iteration in 1..=task.settings.programs {
        let mut solver = QpSolver::new(task.program(&y), settings)?;
        let outcome = solver.solve();
        let next = solver.solution();
        let usable = matches!(outcome, Outcome::Solved)
            || (outcome == Outcome::Inaccurate && solver.residuals().worst() < 1e-3);
        if !usable || next.iter().any(|value| !value.is_finite()) {
            let found = format!("{outcome:?} in convex program {iteration}");
            return Err(PlanError::Unsolved { goal_m, found });
        }
        let pairs = next.iter().zip(&y);
        let step = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        y.copy_from_slice(next);
        if iteration <= APEX_PROGRAMS {
            task.place_apex(&y);
        }
        let defect = task.defect(&y);
        let has_converged = defect < CONVERGED_DEFECT && step < CONVERGED_STEP;
        let is_last = iteration == task.settings.programs;
        if has_converged || (is_last && defect < USABLE_DEFECT) {
            return Ok((y, iteration));
        }
    }
    let (defect, programs) = (task.defect(&y), task.settings.programs);
    let found = format!(
        "the equations still have a residual of {defect:.1e} after {programs} convex programs"
    );
    Err(PlanError::Unsolved { goal_m, found })
}

fn input_deviation(task: &Task<'_>, y: &[f64]) -> f64 {
    let d = task.seed.latent_dim;
    let nodes = y[..task.duration(0)].chunks(3 * d);
    let deviations = nodes.map(|node| {
        let square: f64 = node[2 * d..].iter().map(|mu| mu * mu).sum();
        (square / d as f64).sqrt()
    });
    deviations.fold(0.0, f64::max)
}

fn reached(motion: &Segment) -> [f64; 2] {
    let (x, last) = (&motion.x, motion.len() - 1);
    let height = x.row(BODY_Z);
    [x[(BODY_X, last)] - x[(BODY_X, 0)], height.max() - height[0]]
}

/// Standard deviations of distance and rise due to the thrust's accelerations that the deviations do not explain.
fn expected_error(task: &Task<'_>, y: &[f64]) -> [f64; 2] {
    let parts = &task.seed.parts;
    let flight = task.flight();
    let thrust = flight - 1;
    let duration_s = task.duration_s(thrust, y);
    let of_latent = &parts[thrust].part.acceleration_std;
    let speed = |coordinate: usize| {
        let row = task.seed.decode.row(coordinate);
        let squares = row.iter().zip(of_latent).map(|(a, std)| (a * std).powi(2));
        squares.sum::<f64>().sqrt() * duration_s
    };
    let up = task.dx(flight, 0, BODY_Z).at(y);
    [
        speed(BODY_X) * task.duration_s(flight, y),
        speed(BODY_Z) * up.abs() / GRAVITY_M_S2,
    ]
}

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

/// Plans a grid of goals around the training jumps; `done` receives the number of finished goals and of all goals.
pub fn reach(
    model: &ReducedModel,
    settings: &PlanSettings,
    mut done: impl FnMut(usize, usize),
) -> Result<GoalMap> {
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

fn point(model: &ReducedModel, goal_m: [f64; 2], settings: &PlanSettings) -> Result<MappedGoal> {
    let clock = std::time::Instant::now();
    let made = Goal::new(goal_m[0], goal_m[1]).and_then(|goal| plan(model, &goal, settings));
    let solve_ms = 1e3 * clock.elapsed().as_secs_f64();
    let (status, input_deviation) = match made {
        Ok(plan) => (plan.verdict.word(), Some(plan.input_deviation)),
        Err(error @ (PlanError::Model(_) | PlanError::Lower(_))) => return Err(error),
        Err(
            PlanError::Goal { .. }
            | PlanError::Unsolved { .. }
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
