//! The page on a generated controller's log: what ended it, statuses, figures over time.

use askama::Template;
use serde::Serialize;

use super::figures::{Drawing, panel_svg};
use super::page::{html, layout, prose};
use super::*;
use crate::mpc::{Status, interface};
use crate::recording::{Column, ControllerLog, LogColumn, stretches};
use crate::robot::{FOOT_DIM, JOINT_NAMES, Leg};
use crate::typeset::TypesetError;
use crate::typeset::words::rendered;

/// A status of the log and its first step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct StatusSteps {
    pub status: &'static str,
    pub code: i32,
    pub meaning: &'static str,
    pub steps: usize,
    pub first_s: f64,
    /// Row of the file.
    pub first_row: usize,
}

/// A quantity with numbers that are infinite or undefined.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct NotFinite {
    pub column: String,
    pub steps: usize,
    pub first_row: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct LogFacts {
    pub headline: String,
    pub sentences: Vec<String>,
    pub steps: usize,
    pub from_s: f64,
    pub to_s: f64,
    pub last_status: &'static str,
    /// The first status from 20 on.
    pub fault: Option<StatusSteps>,
    /// In the order of their first steps.
    pub statuses: Vec<StatusSteps>,
    pub not_finite: Vec<NotFinite>,
}

const FIRST_ROW: usize = 2;

fn text(code: i32) -> &'static str {
    let text = interface::status_text(code).to_str();
    text.expect("texts of statuses are ASCII")
}

fn word(code: i32) -> &'static str {
    text(code).split(':').next().unwrap_or_default()
}

fn codes(log: &ControllerLog) -> Vec<i32> {
    let codes = log.values(LogColumn::Status).iter();
    codes.map(|code| *code as i32).collect()
}

impl LogFacts {
    pub(crate) fn of(log: &ControllerLog) -> Self {
        let (codes, time_s) = (codes(log), log.values(LogColumn::Sample(Column::Time)));
        let mut statuses: Vec<StatusSteps> = Vec::new();
        for (row, &code) in codes.iter().enumerate() {
            match statuses.iter_mut().find(|status| status.code == code) {
                Some(status) => status.steps += 1,
                None => statuses.push(StatusSteps {
                    status: word(code),
                    code,
                    meaning: text(code).split_once(": ").map_or("", |words| words.1),
                    steps: 1,
                    first_s: time_s[row],
                    first_row: row + FIRST_ROW,
                }),
            }
        }
        let is_fault = |status: &&StatusSteps| status.code >= Status::Tilt.code();
        let fault = statuses.iter().find(is_fault).cloned();
        let not_finite = not_finite(log);
        let end = codes.len() - 1;
        let (last, from_s, to_s) = (codes[end], time_s[0], time_s[end]);
        Self {
            headline: format!("Last step, at {} s: {}.", seconds(to_s), text(last)),
            sentences: sentences([from_s, to_s], fault.as_ref(), &statuses, &not_finite),
            steps: codes.len(),
            from_s,
            to_s,
            last_status: word(last),
            fault,
            statuses,
            not_finite,
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

fn not_finite(log: &ControllerLog) -> Vec<NotFinite> {
    let of_column = |(column, values): &(LogColumn, Vec<f64>)| {
        let first = values.iter().position(|value| !value.is_finite())?;
        Some(NotFinite {
            column: column.name(),
            steps: values.iter().filter(|value| !value.is_finite()).count(),
            first_row: first + FIRST_ROW,
        })
    };
    log.columns().iter().filter_map(of_column).collect()
}

fn sentences(
    [from_s, to_s]: [f64; 2],
    fault: Option<&StatusSteps>,
    statuses: &[StatusSteps],
    not_finite: &[NotFinite],
) -> Vec<String> {
    const MOST: usize = 3;
    let first = match fault {
        None => format!("No status from {} on.", Status::Tilt.code()),
        Some(of) => format!(
            "First status from {} on: {} at {} s, row {}.",
            Status::Tilt.code(),
            of.status,
            seconds(of.first_s),
            of.first_row
        ),
    };
    let counts = statuses
        .iter()
        .map(|of| format!("{} {}", of.steps, of.status));
    let counts = counts.collect::<Vec<_>>().join(", ");
    let steps = statuses.iter().map(|of| of.steps).sum();
    let (steps, from, to) = (counted(steps, "step"), seconds(from_s), seconds(to_s));
    let mut sentences = vec![first, format!("{steps} from {from} s to {to} s: {counts}.")];
    let undefined = not_finite.iter().take(MOST);
    let undefined: Vec<String> = undefined
        .map(|of| {
            format!(
                "{} in {} from row {}",
                of.column,
                counted(of.steps, "step"),
                of.first_row
            )
        })
        .collect();
    if !undefined.is_empty() {
        let rest = match not_finite.len().saturating_sub(MOST) {
            0 => String::new(),
            rest => format!("; and {rest} more columns"),
        };
        sentences.push(format!(
            "Infinite or undefined: {}{rest}.",
            undefined.join("; ")
        ));
    }
    sentences
}

/// Figures over time, each with a title.
pub(crate) fn log_figures(log: &ControllerLog, facts: &LogFacts) -> Vec<(&'static str, Figure)> {
    let drawn = Drawn::new(log, facts);
    vec![
        ("Statuses", drawn.statuses(facts)),
        ("Contacts", drawn.contacts()),
        ("Body", drawn.body()),
        ("Joint angles", drawn.joints()),
        ("Torques", drawn.torques()),
    ]
}

struct Drawn<'a> {
    log: &'a ControllerLog,
    /// Times of the steps; where one is not finite, the one before.
    time_s: Vec<f64>,
    over: (f64, f64),
    /// From the first fault on.
    shaded: Vec<(f64, f64)>,
}

const LARGEST: f64 = 1e9; // beyond, nothing is drawn
const WIDE: (f64, f64) = (560.0, 16.0); // width of a panel of spans, height of a row
const AROUND: f64 = 46.0; // height of title and axis
const AFTER_FAULT: &str = "Grey is from the first status from 20 on.";

fn drawable(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.abs() < LARGEST)
}

impl<'a> Drawn<'a> {
    fn new(log: &'a ControllerLog, facts: &LogFacts) -> Self {
        let mut last_s = 0.0;
        let times = log.values(LogColumn::Sample(Column::Time)).iter();
        let time_s: Vec<f64> = times
            .map(|time_s| {
                last_s = drawable(*time_s).unwrap_or(last_s);
                last_s
            })
            .collect();
        let over = range(time_s.iter().copied());
        let from = facts
            .fault
            .iter()
            .map(|of| time_s[of.first_row - FIRST_ROW]);
        Self {
            shaded: from.map(|from_s| (from_s, over.1)).collect(),
            log,
            time_s,
            over,
        }
    }

    fn line(&self, role: Role, column: LogColumn) -> Series {
        let values = self.log.values(column);
        Series::over(role, &self.time_s, |step| drawable(values[step]))
    }

    fn panel(&self, title: String, lines: Vec<Series>) -> Panel {
        Panel::shaded(title, lines, self.shaded.clone())
    }

    /// Times of the stretches of steps that are so.
    fn spans(&self, is_so: impl Fn(usize) -> bool) -> Vec<(f64, f64)> {
        let all = stretches(0..self.time_s.len(), |a, b| is_so(a) == is_so(b));
        let times = |of: &std::ops::Range<usize>| {
            let end = of.end.min(self.time_s.len() - 1);
            (self.time_s[of.start], self.time_s[end])
        };
        (all.iter().filter(|of| is_so(of.start)).map(times)).collect()
    }

    fn strip(&self, id: &str, caption: &str, rows: Vec<(String, Vec<(f64, f64)>)>) -> Figure {
        let size = (WIDE.0, AROUND + WIDE.1 * rows.len() as f64);
        let over = self.over;
        let (title, drawing) = (String::new(), Drawing::Spans { rows, over });
        let figure = Figure::over_time(id, caption, vec![Panel { title, drawing }], &[]);
        figure.in_columns(1, size)
    }

    fn statuses(&self, facts: &LogFacts) -> Figure {
        let codes = codes(self.log);
        let row = |of: &StatusSteps| {
            let spans = self.spans(|step| codes[step] == of.code);
            (of.status.to_owned(), spans)
        };
        let rows = facts.statuses.iter().map(row).collect();
        self.strip("statuses", "How the steps ended.", rows)
    }

    fn contacts(&self) -> Figure {
        let row = |foot: usize| {
            let down = self.log.values(LogColumn::Sample(Column::Foot(foot)));
            let spans = self.spans(|step| down[step] != 0.0);
            (Leg::ALL[foot].to_string(), spans)
        };
        let rows = (0..FOOT_DIM).map(row).collect();
        self.strip("contacts", "Feet on the ground, as measured.", rows)
    }

    fn body(&self) -> Figure {
        let coordinates = [("height, m", BODY_Z)];
        let angles = ["roll, rad", "pitch, rad", "yaw, rad"].into_iter();
        let panels = coordinates.into_iter().chain(angles.zip(BODY_Z + 1..));
        let panels = panels.map(|(title, row)| {
            let position = LogColumn::Sample(Column::Position(row));
            self.panel(title.to_owned(), vec![self.line(Role::Recorded, position)])
        });
        let caption = format!("Height and angles of the body, as measured. {AFTER_FAULT}");
        Figure::over_time("body", caption, panels.collect(), &[]).in_columns(4, SIZE)
    }

    fn joints(&self) -> Figure {
        let panels = by_leg().map(|joint| {
            let position = LogColumn::Sample(Column::Position(joint));
            let lines = vec![
                self.line(Role::Recorded, position),
                self.line(Role::Full, LogColumn::Desired(joint)),
            ];
            self.panel(format!("{}, rad", JOINT_NAMES[joint]), lines)
        });
        let legend = [(Role::Recorded, "measured"), (Role::Full, "desired")];
        let caption = format!("Joint angles, a leg per column. {AFTER_FAULT}");
        Figure::over_time("joints", caption, panels.collect(), &legend).in_columns(4, SIZE)
    }

    fn torques(&self) -> Figure {
        let panels = by_leg().map(|joint| {
            let torque = self.line(Role::Full, LogColumn::Sample(Column::Torque(joint)));
            self.panel(format!("{}, N m", JOINT_NAMES[joint]), vec![torque])
        });
        let caption = format!("Feed-forward torques, a leg per column. {AFTER_FAULT}");
        let legend = [(Role::Full, "commanded")];
        Figure::over_time("torques", caption, panels.collect(), &legend).in_columns(4, SIZE)
    }
}

const SIZE: (f64, f64) = (240.0, 150.0);

/// Joints in the order of panels: a row of legs for each kind of joint.
fn by_leg() -> impl Iterator<Item = usize> {
    (0..3).flat_map(|kind| (0..4).map(move |leg| 3 * leg + kind))
}

#[derive(Template)]
#[template(path = "report/log.askama", config = "templates/askama.toml")]
struct LogPage<'a> {
    version: &'static str,
    name: String,
    facts: &'a LogFacts,
    statuses: Table,
    figures: &'a [(&'static str, Figure)],
    command: &'a str,
}

/// The page of a log: one HTML file without requests.
pub(crate) fn log_page(
    path: &Path,
    facts: &LogFacts,
    figures: &[(&'static str, Figure)],
    command: &str,
) -> Result<String, TypesetError> {
    let page = LogPage {
        version: env!("CARGO_PKG_VERSION"),
        name: tables::file_name(path),
        facts,
        statuses: facts.table(),
        figures,
        command,
    };
    Ok(rendered(&page)?)
}
