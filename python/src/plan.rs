//! Jumps and walks that nobody recorded.

use nalgebra::DMatrix;
use pyo3::prelude::*;
use romc::Error;
use romc::limits::table;
use romc::plan::{Goal, PlanSettings, Verdict, WalkGoal};
use romc::report::plan_json;

use crate::errors::{python_error, within};
use crate::model::Model;
use crate::recording::{Recording, Segment};

/// Plans a jump; returns it as a recording, and its figures as JSON. A plan that is not trusted
/// is an error if it is not forced.
#[pyfunction]
pub fn plan(
    py: Python<'_>,
    model: &Model,
    distance: f64,
    apex: f64,
    start: Option<PyRef<'_, Segment>>,
    force: bool,
) -> PyResult<(Recording, String)> {
    let distance = within(py, table::DISTANCE, distance)?;
    let apex = within(py, table::APEX, apex)?;
    let start = start.map(|start| {
        let column = |rows: &DMatrix<f64>| rows.column(0).into_owned();
        (column(&start.data().x), column(&start.data().dx))
    });
    let planned = py.detach(|| -> Result<_, Error> {
        let goal = Goal::new(distance, apex)?;
        let goal = match start {
            Some((x, dx)) => goal.from_start(x, dx),
            None => goal,
        };
        let planned = romc::plan::plan(&model.data, &goal, &PlanSettings::default())?;
        match &planned.verdict {
            Verdict::Refused(reasons) if !force => Err(Error::Distrusted(reasons.join("; "))),
            _ => Ok(planned),
        }
    });
    let planned = planned.map_err(|error| python_error(py, error))?;
    let json = plan_json(&planned).to_string();
    Ok((Recording::made(planned.motion.into()), json))
}

/// Plans a walk; returns it as a recording. One that is not trusted is an error if it is not forced.
#[pyfunction]
pub fn walk(
    py: Python<'_>,
    model: &Model,
    speed: f64,
    yaw_rate: f64,
    duration: f64,
    force: bool,
) -> PyResult<Recording> {
    let goal = WalkGoal {
        speed_m_s: within(py, table::SPEED, speed)?,
        yaw_rate_rad_s: within(py, table::YAW_RATE, yaw_rate)?,
        duration_s: within(py, table::DURATION, duration)?,
    };
    let planned = py.detach(|| -> Result<_, Error> {
        let planned = romc::plan::walk(&model.data, &goal)?;
        match &planned.verdict {
            Verdict::Refused(reasons) if !force => Err(Error::Distrusted(reasons.join("; "))),
            _ => Ok(planned),
        }
    });
    let planned = planned.map_err(|error| python_error(py, error))?;
    Ok(Recording::made(planned.motion.into()))
}
