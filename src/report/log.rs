//! The page of a generated controller's log: the status that ended it, all statuses, figures over time.

use askama::Template;
use serde::Serialize;

use super::figures::{Drawing, panel_svg};
use super::page::{html, layout, prose};
use super::*;
use crate::mpc::{Status, interface};
use crate::recording::{Column, ControllerLog, stretches};
use crate::robot::{JOINT_NAMES, Leg};
use crate::typeset::TypesetError;
use crate::typeset::words::rendered;

/// A status of the log and its first step.
#[derive(Debug, Clone, Serialize)]
struct StatusSteps {
    status: &'static str,
    code: i32,
    meaning: &'static str,
    steps: usize,
    first_s: f64,
    /// Row of the file.
    first_row: usize,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct LogFacts {
    pub headline: String,
    pub sentences: [String; 2],
    steps: usize,
    /// The first status from 20 on.
    fault: Option<StatusSteps>,
    /// In the order of their first steps.
    statuses: Vec<StatusSteps>,
}

const FIRST_ROW: usize = 2;

fn text(code: i32) -> &'static str {
    let text = interface::status_text(code).to_str();
    text.expect("texts of statuses are ASCII")
}

fn codes(log: &ControllerLog) -> Vec<i32> {
    let codes = log.values("status").iter();
    codes.map(|code| *code as i32).collect()
}

impl LogFacts {
    pub(crate) fn of(log: &ControllerLog) -> Self {
        let (codes, times_s) = (codes(log), log.values(&Column::Time.name()));
        let mut statuses: Vec<StatusSteps> = Vec::new();
        for (row, (&code, &first_s)) in codes.iter().zip(times_s).enumerate() {
            if let Some(of) = statuses.iter_mut().find(|of| of.code == code) {
                of.steps += 1;
                continue;
            }
            let (status, meaning) = text(code).split_once(": ").unwrap_or((text(code), ""));
            statuses.push(StatusSteps {
                status,
                code,
                meaning,
                steps: 1,
                first_s,
                first_row: row + FIRST_ROW,
            });
        }
        let (steps, least) = (codes.len(), Status::Tilt.code());
        let fault = statuses.iter().find(|of| of.code >= least).cloned();
        let first = fault.as_ref().map(|of| {
            let (status, time, row) = (of.status, seconds(of.first_s), of.first_row);
            format!("First status from {least} on: {status} at {time} s, row {row}.")
        });
        let counts = statuses
            .iter()
            .map(|of| format!("{} {}", of.steps, of.status));
        let counts = counts.collect::<Vec<_>>().join(", ");
        let [from, to] = [times_s[0], times_s[steps - 1]].map(seconds);
        let counts = format!(
            "{} from {from} s to {to} s: {counts}.",
            counted(steps, "step")
        );
        Self {
            headline: format!("Last step, at {to} s: {}.", text(codes[steps - 1])),
            sentences: [
                first.unwrap_or(format!("No status from {least} on.")),
                counts,
            ],
            steps,
            fault,
            statuses,
        }
    }

    fn table(&self) -> Table {
        Table::of(&self.statuses)
            .column("status", "", |of| of.status)
            .column("code", "", |of| of.code.to_string())
            .column("steps", "", |of| of.steps)
            .column("first at", "s", |of| seconds(of.first_s))
            .column("row", "", |of| of.first_row)
            .column("meaning", "", |of| of.meaning)
            .table()
            .captioned("Statuses of the steps, in the order of their first steps")
    }
}

fn seconds(time_s: f64) -> String {
    rounded(time_s, 6).to_string()
}

struct Drawn<'a> {
    log: &'a ControllerLog,
    /// Times of the steps; where one is not finite, the one before.
    time_s: Vec<f64>,
    over: (f64, f64),
    /// From the first fault on.
    shaded: Vec<(f64, f64)>,
}

const LARGEST: f64 = 1e9; // nothing beyond is drawn
const SIZE: (f64, f64) = (240.0, 150.0);
const WIDE: (f64, f64) = (560.0, 16.0); // width of a panel of spans, height of a row
const AROUND: f64 = 46.0; // height of title and axis

fn drawable(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.abs() < LARGEST)
}

/// The figures over time.
pub(crate) fn log_figures(log: &ControllerLog, facts: &LogFacts) -> Vec<Figure> {
    let mut last_s = 0.0;
    let times_s = log.values(&Column::Time.name()).iter();
    let times_s = times_s.map(|time_s| {
        last_s = drawable(*time_s).unwrap_or(last_s);
        last_s
    });
    let time_s: Vec<f64> = times_s.collect();
    let over = range(time_s.iter().copied());
    let faults = facts.fault.iter();
    let shaded = faults.map(|of| (time_s[of.first_row - FIRST_ROW], over.1));
    let drawn = Drawn {
        shaded: shaded.collect(),
        log,
        time_s,
        over,
    };
    drawn.figures(facts)
}

impl Drawn<'_> {
    fn figures(&self, facts: &LogFacts) -> Vec<Figure> {
        let codes = codes(self.log);
        let statuses = facts.statuses.iter().map(|of| {
            let spans = self.spans(|step| codes[step] == of.code);
            (of.status.to_owned(), spans)
        });
        let contacts = Leg::ALL.iter().enumerate().map(|(foot, leg)| {
            let down = self.log.values(&Column::Foot(foot).name());
            (leg.to_string(), self.spans(|step| down[step] != 0.0))
        });
        let body = ["height, m", "roll, rad", "pitch, rad", "yaw, rad"];
        let body = body.iter().zip(BODY_Z..).map(|(title, row)| {
            let position = (Role::Recorded, Column::Position(row).name());
            self.panel((*title).to_owned(), vec![position])
        });
        let angles = by_leg(|joint, name| {
            let measured = (Role::Recorded, Column::Position(joint).name());
            let desired = (Role::Full, format!("{name}.desired"));
            self.panel(format!("{name}, rad"), vec![measured, desired])
        });
        let torques = by_leg(|joint, name| {
            let torque = (Role::Full, Column::Torque(joint).name());
            self.panel(format!("{name}, N m"), vec![torque])
        });
        let legend = [(Role::Recorded, "measured"), (Role::Full, "desired")];
        let panels = |id, caption: &str, panels, legend| {
            let caption = format!("{caption} Grey is from the first status from 20 on.");
            Figure::over_time(id, caption, panels, legend).in_columns(4, SIZE)
        };
        vec![
            self.strip("statuses", "How the steps ended.", statuses.collect()),
            self.strip("contacts", "Feet on the ground.", contacts.collect()),
            panels("body", "Measured height and angles.", body.collect(), &[]),
            panels("joints", "Joint angles, a leg per column.", angles, &legend),
            panels(
                "torques",
                "Commanded torques, a leg per column.",
                torques,
                &[],
            ),
        ]
    }

    fn panel(&self, title: String, lines: Vec<(Role, String)>) -> Panel {
        let lines = lines.into_iter().map(|(role, column)| {
            let values = self.log.values(&column);
            Series::over(role, &self.time_s, |step| drawable(values[step]))
        });
        Panel::shaded(title, lines.collect(), self.shaded.clone())
    }

    /// Time spans of the steps that satisfy a condition.
    fn spans(&self, is_so: impl Fn(usize) -> bool) -> Vec<(f64, f64)> {
        let end = self.time_s.len();
        let all = stretches(0..end, |a, b| is_so(a) == is_so(b)).into_iter();
        all.filter(|of| is_so(of.start))
            .map(|of| (self.time_s[of.start], self.time_s[of.end.min(end - 1)]))
            .collect()
    }

    fn strip(&self, id: &str, caption: &str, rows: Vec<(String, Vec<(f64, f64)>)>) -> Figure {
        let size = (WIDE.0, AROUND + WIDE.1 * rows.len() as f64);
        let (title, over) = (String::new(), self.over);
        let drawing = Drawing::Spans { rows, over };
        Figure::over_time(id, caption, vec![Panel { title, drawing }], &[]).in_columns(1, size)
    }
}

/// A panel for each joint: a row of legs for each kind of joint.
fn by_leg(panel: impl Fn(usize, &str) -> Panel) -> Vec<Panel> {
    let joints = (0..3).flat_map(|kind| (0..4).map(move |leg| 3 * leg + kind));
    joints
        .map(|joint| panel(joint, JOINT_NAMES[joint]))
        .collect()
}

#[derive(Template)]
#[template(path = "report/log.askama", config = "templates/askama.toml")]
struct LogPage<'a> {
    version: &'static str,
    name: String,
    facts: &'a LogFacts,
    figures: &'a [Figure],
}

/// The page of a log: one HTML file without requests.
pub(crate) fn log_page(
    path: &Path,
    facts: &LogFacts,
    figures: &[Figure],
) -> Result<String, TypesetError> {
    Ok(rendered(&LogPage {
        version: env!("CARGO_PKG_VERSION"),
        name: tables::file_name(path),
        facts,
        figures,
    })?)
}
