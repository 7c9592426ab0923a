//! The content of a figure: panels, lines, shades, captions.

use super::sticks::{Extent, Sticks};

/// The meaning of a line, which selects its colour and dashes in every figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Measured, or encoded from what was measured.
    Recorded,
    /// Predicted over the whole recording.
    Full,
    /// Predicted between restarts.
    Restarted,
    /// A template model, or the first of two things compared.
    Baseline,
    SecondBaseline,
    /// A bound that the others keep, always within the frame.
    Limit,
}

/// Of each role the class of its lines in SVG, their colour on white (red, green and blue from 0 to 255), and the
/// lengths of dashes and gaps as SVG and PDF list them, none for a full line; by these lines differ in grey print too.
pub(crate) const STYLES: [(&str, [u8; 3], &str); 6] = [
    ("recorded", [31, 95, 168], ""),
    ("full", [194, 87, 12], "6 2.5"),
    ("restarted", [35, 122, 62], "2 1.6"),
    ("baseline", [123, 63, 160], "8 2 2 2"),
    ("baseline2", [110; 3], "1 2"),
    ("limit", [110; 3], "1 2"),
];

impl Role {
    pub(crate) fn class(self) -> &'static str {
        STYLES[self as usize].0
    }
}

/// One line: points in the order of x; a point without y breaks the line.
pub(crate) struct Series {
    pub role: Role,
    pub points: Vec<(f64, Option<f64>)>,
}

impl Series {
    pub(crate) fn over(role: Role, time_s: &[f64], value: impl Fn(usize) -> Option<f64>) -> Self {
        let times = time_s.iter().enumerate();
        Self::through(role, times.map(|(sample, &time)| (time, value(sample))))
    }

    pub(crate) fn through(
        role: Role,
        points: impl IntoIterator<Item = (f64, Option<f64>)>,
    ) -> Self {
        let points = points.into_iter().collect();
        Self { role, points }
    }
}

pub(crate) struct Panel {
    /// The quantity with its unit, such as `body.x, m`, or the instant, such as `0.12 s`.
    pub title: String,
    pub drawing: Drawing,
}

pub(crate) enum Drawing {
    /// Lines over one axis; shaded are ranges of x with a grey ground, such as flight.
    Lines {
        series: Vec<Series>,
        shaded: Vec<(f64, f64)>,
    },
    Heat(HeatMap),
    Sticks(StickPlot),
}

pub(crate) struct HeatMap {
    pub rows: Vec<String>,
    pub columns: Vec<String>,
    /// Row by row.
    pub values: Vec<f64>,
}

/// Robots as sticks in a vertical plane, one length for a metre in both directions.
pub(crate) struct StickPlot {
    /// The robots, the first below the others.
    pub sticks: Vec<(Role, Sticks)>,
    pub extent: Extent,
    pub floor_m: f64,
}

impl Panel {
    pub(crate) fn lines(title: impl Into<String>, series: Vec<Series>) -> Self {
        Self::shaded(title, series, Vec::new())
    }

    pub(crate) fn shaded(
        title: impl Into<String>,
        series: Vec<Series>,
        shaded: Vec<(f64, f64)>,
    ) -> Self {
        Self {
            title: title.into(),
            drawing: Drawing::Lines { series, shaded },
        }
    }
}

pub(crate) struct Figure {
    pub id: String,
    pub caption: String,
    /// The common axis below, such as `time, s`.
    pub x_label: String,
    /// Size of a panel in points: width and height.
    pub panel_size: (f64, f64),
    /// Panels side by side when drawn on a page of their own.
    pub columns: usize,
    pub panels: Vec<Panel>,
    pub legend: Vec<(Role, String)>,
}

impl Figure {
    /// Small panels over time, three side by side; the legend explains the lines.
    pub(crate) fn over_time(
        id: impl Into<String>,
        caption: impl Into<String>,
        panels: Vec<Panel>,
        legend: &[(Role, &str)],
    ) -> Self {
        let words = |(role, words): &(Role, &str)| (*role, (*words).to_owned());
        Self {
            id: id.into(),
            caption: caption.into(),
            x_label: "time, s".to_owned(),
            panel_size: (240.0, 150.0),
            columns: 3,
            panels,
            legend: legend.iter().map(words).collect(),
        }
    }

    pub(crate) fn in_columns(mut self, columns: usize, panel_size: (f64, f64)) -> Self {
        (self.columns, self.panel_size) = (columns, panel_size);
        self
    }

    pub(crate) fn over(self, x_label: &str) -> Self {
        let x_label = x_label.to_owned();
        Self { x_label, ..self }
    }
}
