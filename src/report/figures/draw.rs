//! From a panel to marks on a plane; y grows downwards, lengths are points. Round numbers along an axis.

use super::*;

const LEFT: f64 = 38.0;
const TOP: f64 = 17.0;
const BOTTOM: f64 = 26.0;
const RIGHT: f64 = 8.0;
const MAX_POINTS: usize = 240;
pub(super) const FONT: f64 = 9.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Paint {
    Axis,
    Grid,
    Shade,
    Heat(f64),
}

pub(crate) enum Mark {
    /// A filled rectangle: corner, width, height.
    Rectangle([f64; 4], Paint),
    Rule([f64; 4], Paint),
    Line(Vec<(f64, f64)>, Role),
    Text(f64, f64, Anchor, String),
}

impl Mark {
    fn text(x: f64, y: f64, anchor: Anchor, words: impl Into<String>) -> Self {
        Self::Text(x, y, anchor, words.into())
    }

    fn moved(self, (dx, dy): (f64, f64)) -> Self {
        match self {
            Self::Rectangle([x, y, w, h], paint) => Self::Rectangle([x + dx, y + dy, w, h], paint),
            Self::Rule([x1, y1, x2, y2], paint) => {
                Self::Rule([x1 + dx, y1 + dy, x2 + dx, y2 + dy], paint)
            }
            Self::Line(points, role) => {
                let points = points.into_iter().map(|(x, y)| (x + dx, y + dy));
                Self::Line(points.collect(), role)
            }
            Self::Text(x, y, anchor, words) => Self::Text(x + dx, y + dy, anchor, words),
        }
    }
}

const LEGEND: f64 = 18.0;

pub(super) fn figure_size(figure: &Figure) -> (f64, f64) {
    let columns = figure.columns.min(figure.panels.len()).max(1);
    let rows = figure.panels.len().div_ceil(columns);
    let (width, height) = figure.panel_size;
    let height = rows as f64 * height + legend_height(figure);
    (columns as f64 * width, height)
}

fn legend_height(figure: &Figure) -> f64 {
    match figure.legend.is_empty() {
        true => 0.0,
        false => LEGEND,
    }
}

pub(super) fn placed_marks(figure: &Figure) -> Vec<Vec<Mark>> {
    let (width, height) = figure.panel_size;
    let place = |(place, panel): (usize, &Panel)| {
        let columns = figure.columns.max(1);
        let (column, row) = ((place % columns) as f64, (place / columns) as f64);
        let corner = (column * width, row * height + legend_height(figure));
        let marks = draw_panel(panel, figure.panel_size, &figure.x_label).into_iter();
        marks.map(|mark| mark.moved(corner)).collect()
    };
    let panels = figure.panels.iter().enumerate().map(place);
    [legend_marks(figure)].into_iter().chain(panels).collect()
}

fn legend_marks(figure: &Figure) -> Vec<Mark> {
    let mut marks = Vec::new();
    let mut x = 10.0;
    for (role, words) in &figure.legend {
        marks.push(Mark::Line(vec![(x, 10.0), (x + 24.0, 10.0)], *role));
        marks.push(Mark::text(x + 28.0, 13.0, Anchor::Start, words));
        x += 44.0 + 0.52 * FONT * words.chars().count() as f64;
    }
    marks
}

pub(crate) fn draw_panel(panel: &Panel, size: (f64, f64), x_label: &str) -> Vec<Mark> {
    let title = panel.title.as_str();
    match &panel.drawing {
        Drawing::Lines { series, shaded } => draw_lines(title, (series, shaded), size, x_label),
        Drawing::Spans { rows, over } => draw_spans(title, (rows, *over), size, x_label),
        Drawing::Heat(map) => draw_heat(title, map, size, x_label),
        Drawing::Sticks(plot) => draw_sticks(title, plot, size),
    }
}

struct Axes {
    x: (f64, f64),
    y: (f64, f64),
    left: f64,
    right: f64,
    bottom: f64,
}

impl Axes {
    fn x_at(&self, value: f64) -> f64 {
        let share = (value - self.x.0) / (self.x.1 - self.x.0);
        self.left + share * (self.right - self.left)
    }

    fn y_at(&self, value: f64) -> f64 {
        let share = (value - self.y.0) / (self.y.1 - self.y.0);
        self.bottom - share * (self.bottom - TOP)
    }
}

fn draw_lines(
    title: &str,
    (series, shaded): (&[Series], &[(f64, f64)]),
    size: (f64, f64),
    x_label: &str,
) -> Vec<Mark> {
    let points = || series.iter().flat_map(|series| &series.points);
    let (first, last) = range(points().map(|point| point.0));
    let axes = Axes {
        x: match last > first {
            true => (first, last),
            false => padded(points().map(|point| point.0)),
        },
        y: padded(visible(series)),
        left: LEFT,
        right: size.0 - RIGHT,
        bottom: size.1 - BOTTOM,
    };
    let mut marks = Vec::new();
    for &(from, to) in shaded {
        let (from, to) = (axes.x_at(from.max(axes.x.0)), axes.x_at(to.min(axes.x.1)));
        let rectangle = [from, TOP, (to - from).max(0.0), axes.bottom - TOP];
        marks.push(Mark::Rectangle(rectangle, Paint::Shade));
    }
    draw_axes(&axes, x_label, &mut marks);
    marks.push(Mark::text(LEFT, TOP - 6.0, Anchor::Start, title));
    for series in series {
        for line in clipped(&thinned(&series.points), axes.y) {
            let line = line.into_iter().map(|(x, y)| (axes.x_at(x), axes.y_at(y)));
            marks.push(Mark::Line(line.collect(), series.role));
        }
    }
    marks
}

/// The lines within a range of y: a line that leaves it ends on its edge.
fn clipped(points: &[(f64, Option<f64>)], (low, high): (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    let mut lines: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let [(x0, Some(y0)), (x1, Some(y1))] = *pair else {
            continue;
        };
        let within = |y: f64| (low..=high).contains(&y);
        let beyond = [f64::lt, f64::gt].iter().zip([low, high]);
        let mut beyond = beyond.map(|(is, edge)| is(&y0, &edge) && is(&y1, &edge));
        if !y0.is_finite() || !y1.is_finite() || beyond.any(|both| both) {
            continue;
        }
        let end = |x: f64, y: f64| match within(y) {
            true => (x, y),
            false => {
                let edge = y.clamp(low, high);
                (x0 + (x1 - x0) * (edge - y0) / (y1 - y0), edge)
            }
        };
        let (from, to) = (end(x0, y0), end(x1, y1));
        match lines.last_mut().filter(|line| line.last() == Some(&from)) {
            Some(line) => line.push(to),
            None => lines.push(vec![from, to]),
        }
    }
    lines
}

/// A prediction that runs away does not flatten the record; a limit is always in sight.
fn visible(series: &[Series]) -> impl Iterator<Item = f64> {
    let recorded = (series.iter()).find(|series| series.role == Role::Recorded);
    let bounds = recorded.map(|series| padded(series.points.iter().filter_map(|p| p.1)));
    let follows = move |role: Role, value: f64| match (role, bounds) {
        (Role::Limit, _) | (_, None) => value,
        (_, Some((low, high))) => {
            let reach = high - low;
            value.clamp(low - reach, high + reach)
        }
    };
    series.iter().flat_map(move |series| {
        let values = series.points.iter().filter_map(|point| point.1);
        values.map(move |value| follows(series.role, value))
    })
}

/// At most [`MAX_POINTS`] points, evenly chosen, the last always among them; gaps stay.
fn thinned(points: &[(f64, Option<f64>)]) -> Vec<(f64, Option<f64>)> {
    let stride = points.len().div_ceil(MAX_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    (points.iter().enumerate())
        .filter(|(index, point)| index % stride == 0 || *index == last || point.1.is_none())
        .map(|(_, point)| *point)
        .collect()
}

fn draw_axes(axes: &Axes, x_label: &str, marks: &mut Vec<Mark>) {
    for (value, text) in ticks(axes.y) {
        let y = axes.y_at(value);
        marks.push(Mark::Rule([LEFT, y, axes.right, y], Paint::Grid));
        marks.push(Mark::text(LEFT - 4.0, y + 3.0, Anchor::End, text));
    }
    draw_x_axis(axes, x_label, marks);
}

fn draw_x_axis(axes: &Axes, x_label: &str, marks: &mut Vec<Mark>) {
    let (left, bottom, right) = (axes.left, axes.bottom, axes.right);
    for (value, text) in ticks(axes.x) {
        let x = axes.x_at(value);
        marks.push(Mark::Rule([x, bottom, x, bottom + 3.0], Paint::Axis));
        marks.push(Mark::text(x, bottom + 12.0, Anchor::Middle, text));
    }
    marks.push(Mark::Rule([left, bottom, right, bottom], Paint::Axis));
    marks.push(Mark::Rule([left, TOP, left, bottom], Paint::Axis));
    marks.push(Mark::text(right, bottom + 22.0, Anchor::End, x_label));
}

fn draw_spans(
    title: &str,
    (rows, over): (&[(String, Vec<(f64, f64)>)], (f64, f64)),
    size: (f64, f64),
    x_label: &str,
) -> Vec<Mark> {
    const NAMES: f64 = 104.0; // names of statuses, and the same for all figures of a page
    const THINNEST: f64 = 1.0;
    let axes = Axes {
        x: match over.1 > over.0 {
            true => over,
            false => padded([over.0].into_iter()),
        },
        y: (rows.len() as f64, 0.0),
        left: NAMES,
        right: size.0 - RIGHT,
        bottom: size.1 - BOTTOM,
    };
    let mut marks = vec![Mark::text(axes.left, TOP - 6.0, Anchor::Start, title)];
    for (row, (name, spans)) in rows.iter().enumerate() {
        let [top, bottom] = [0.2, 0.8].map(|part| axes.y_at(row as f64 + part));
        let middle = 0.5 * (top + bottom) + 3.0;
        marks.push(Mark::text(axes.left - 4.0, middle, Anchor::End, name));
        marks.extend(spans.iter().map(|&(from, to)| {
            let [from, to] = [from, to].map(|x| axes.x_at(x));
            let rectangle = [from, top, (to - from).max(THINNEST), bottom - top];
            Mark::Rectangle(rectangle, Paint::Heat(1.0))
        }));
    }
    draw_x_axis(&axes, x_label, &mut marks);
    marks
}

fn draw_heat(title: &str, map: &HeatMap, size: (f64, f64), x_label: &str) -> Vec<Mark> {
    let left = LEFT + 22.0;
    let (width, height) = (size.0 - left - RIGHT, size.1 - TOP - BOTTOM);
    let [columns, rows] = [&map.columns, &map.rows].map(|names| names.len().max(1) as f64);
    let cell = (width / columns, height / rows);
    let largest = map.values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut marks = heat_scale(title, left, largest);
    for (row, name) in map.rows.iter().enumerate() {
        let y = TOP + row as f64 * cell.1;
        let middle = y + 0.5 * cell.1 + 3.0;
        marks.push(Mark::text(left - 4.0, middle, Anchor::End, name));
        for column in 0..map.columns.len() {
            let value = map.values[row * map.columns.len() + column].abs();
            let share = if largest > 0.0 { value / largest } else { 0.0 };
            let x = left + column as f64 * cell.0;
            // a hair of overlap closes the seams between cells
            let rectangle = [x, y, cell.0 - 1.0, cell.1 - 1.0];
            marks.push(Mark::Rectangle(rectangle, Paint::Heat(share)));
        }
    }
    let bottom = TOP + height;
    for (column, name) in map.columns.iter().enumerate() {
        let x = left + (column as f64 + 0.5) * cell.0;
        marks.push(Mark::text(x, bottom + 11.0, Anchor::Middle, name));
    }
    let right = size.0 - RIGHT;
    marks.push(Mark::text(right, bottom + 22.0, Anchor::End, x_label));
    marks
}

fn heat_scale(title: &str, left: f64, largest: f64) -> Vec<Mark> {
    const SHADES: usize = 6;
    const CELL: f64 = 9.0;
    let text = |x: f64, anchor, words: &str| Mark::text(x, TOP - 6.0, anchor, words);
    let bar = left + 0.62 * FONT * title.chars().count() as f64 + 16.0;
    let title = text(left, Anchor::Start, title);
    let mut marks = vec![title, text(bar - 3.0, Anchor::End, &number(0.0, 0))];
    marks.extend((0..SHADES).map(|shade| {
        let corner = [bar + CELL * shade as f64, TOP - 14.0, CELL, CELL];
        Mark::Rectangle(corner, Paint::Heat(shade as f64 / (SHADES - 1) as f64))
    }));
    let end = bar + CELL * SHADES as f64 + 3.0;
    marks.push(text(end, Anchor::Start, &number(largest, 2)));
    marks
}

fn draw_sticks(title: &str, plot: &StickPlot, size: (f64, f64)) -> Vec<Mark> {
    let [x, z] = plot.extent_m;
    let (width, height) = (size.0 - 2.0 * RIGHT, size.1 - TOP - RIGHT);
    let scale = (width / (x.1 - x.0)).min(height / (z.1 - z.0));
    let left = RIGHT + 0.5 * (width - scale * (x.1 - x.0));
    let at = |(forward, up): (f64, f64)| {
        let down = size.1 - RIGHT - scale * (up - z.0);
        (left + scale * (forward - x.0), down)
    };
    let floor = at((0.0, plot.floor_m)).1;
    let mut marks = vec![
        Mark::text(RIGHT, TOP - 6.0, Anchor::Start, title),
        Mark::Rule([RIGHT, floor, size.0 - RIGHT, floor], Paint::Axis),
    ];
    for (role, sticks) in &plot.sticks {
        let lines = sticks.lines.iter();
        marks.extend(lines.map(|line| Mark::Line(line.iter().copied().map(at).collect(), *role)));
    }
    marks
}

fn ticks((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let rough = (high - low) / 4.0;
    if !rough.is_finite() || rough <= 0.0 {
        return vec![(low, number(low, 2))];
    }
    let power = 10f64.powf(rough.log10().floor());
    let mut steps = ([1.0, 2.0, 5.0, 10.0].map(|factor| factor * power)).into_iter();
    let step = (steps.find(|step| *step >= rough * 0.999)).unwrap_or(10.0 * power);
    let places = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    let values = (first..=last).map(|index| index as f64 * step);
    values.map(|value| (value, number(value, places))).collect()
}

fn number(value: f64, places: usize) -> String {
    format!("{value:.places$}").replace('-', "\u{2212}")
}

pub(crate) fn subscript(index: usize) -> String {
    let below = |digit: char| match digit.to_digit(10) {
        Some(value) => char::from_u32(0x2080 + value).unwrap_or(digit),
        None => digit,
    };
    index.to_string().chars().map(below).collect()
}

pub(crate) fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(none, |(low, high), value| (low.min(value), high.max(value)))
}

fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = range(values.filter(|value| value.is_finite()));
    if low > high {
        return (0.0, 1.0);
    }
    let margin = match 0.06 * (high - low) {
        margin if margin > 0.0 => margin,
        _ => 0.05 * low.abs() + 1e-6,
    };
    (low - margin, high + margin)
}

#[cfg(test)]
#[test]
fn a_line_that_leaves_the_frame_ends_on_its_edge() {
    let points = [
        (0.0, 0.5),
        (1.0, 1.5),
        (2.0, 3.0),
        (3.0, -1.0),
        (4.0, f64::NAN),
    ];
    let points = points.map(|(x, y)| (x, Some(y)));
    let lines = clipped(&points, (0.0, 1.0));
    let expected = vec![vec![(0.0, 0.5), (0.5, 1.0)], vec![(2.5, 1.0), (2.75, 0.0)]];
    assert_eq!(lines, expected);
}
