//! The content of a figure: panels, lines, shades, captions.

use super::Sticks;

/// The meaning of a line, which selects its colour and dashes in every figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    Recorded,
    Full,
    Restarted,
    Baseline,
    SecondBaseline,
    Limit,
}

/// Class in SVG, colour on white, and lengths of dashes and gaps, by which lines differ in grey print too.
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
    /// Ranges of x in named rows, such as the times at which a foot is down.
    Spans {
        rows: Vec<(String, Vec<(f64, f64)>)>,
        over: (f64, f64),
    },
    Heat(HeatMap),
    Sticks(StickPlot),
}

pub(crate) struct HeatMap {
    pub rows: Vec<String>,
    pub columns: Vec<String>,
    pub values: Vec<f64>,
}

pub(crate) struct StickPlot {
    pub sticks: Vec<(Role, Sticks)>,
    /// Ranges forwards and upwards.
    pub extent_m: [(f64, f64); 2],
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
    pub x_label: String,
    pub panel_size: (f64, f64),
    pub columns: usize,
    pub panels: Vec<Panel>,
    pub legend: Vec<(Role, String)>,
}

impl Figure {
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
