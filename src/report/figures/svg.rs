//! The SVG spelling of marks: panels for a page that has styles, or a file of its own.

use std::fmt::Write as _;

use super::draw::{Anchor, FONT, Mark, Paint, PanelDrawing, draw_panel};
use super::figure::{Figure, Panel, Role};
use crate::typeset::mathml::HtmlText;

/// One panel as an `svg` element that takes its colours from the page.
pub fn panel_svg(figure: &Figure, panel: &Panel) -> String {
    let drawing = draw_panel(panel, figure.panel_size, &figure.x_label);
    let mut text = format!(
        "<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
        drawing.width,
        drawing.height,
        HtmlText(panel.title())
    );
    write_marks(&mut text, &drawing, (0.0, 0.0));
    text.push_str("</svg>");
    text
}

/// A figure as a file of its own, with legend and colours for paper.
pub fn standalone_svg(figure: &Figure) -> String {
    let (width, height) = figure_size(figure);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\">\n<title>{}</title>\n<style>{}</style>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n",
        HtmlText(&figure.caption),
        style()
    );
    for (mark, at) in legend_marks(figure) {
        write_mark(&mut text, &mark, at);
    }
    for (place, panel) in figure.panels.iter().enumerate() {
        let drawing = draw_panel(panel, figure.panel_size, &figure.x_label);
        write_marks(&mut text, &drawing, panel_corner(figure, place));
        text.push('\n');
    }
    text.push_str("</svg>\n");
    text
}

/// Height of the legend's line.
const LEGEND: f64 = 18.0;

/// Size of a figure on a page of its own.
pub(super) fn figure_size(figure: &Figure) -> (f64, f64) {
    let columns = figure.columns.min(figure.panels.len()).max(1);
    let rows = figure.panels.len().div_ceil(columns);
    let legend = if figure.legend.is_empty() {
        0.0
    } else {
        LEGEND
    };
    (
        columns as f64 * figure.panel_size.0,
        rows as f64 * figure.panel_size.1 + legend,
    )
}

/// Upper left corner of a panel.
pub(super) fn panel_corner(figure: &Figure, place: usize) -> (f64, f64) {
    let columns = figure.columns.max(1);
    let legend = if figure.legend.is_empty() {
        0.0
    } else {
        LEGEND
    };
    (
        (place % columns) as f64 * figure.panel_size.0,
        (place / columns) as f64 * figure.panel_size.1 + legend,
    )
}

/// The legend's marks, each with its offset.
pub(super) fn legend_marks(figure: &Figure) -> Vec<(Mark, (f64, f64))> {
    let mut marks = Vec::new();
    let mut x = 10.0;
    for (role, words) in &figure.legend {
        marks.push((
            Mark::Line(vec![(x, 10.0), (x + 24.0, 10.0)], *role),
            (0.0, 0.0),
        ));
        let text = Mark::Text(x + 28.0, 13.0, Anchor::Start, words.clone());
        marks.push((text, (0.0, 0.0)));
        x += 44.0 + 0.52 * FONT * words.chars().count() as f64;
    }
    marks
}

fn style() -> String {
    let mut text = format!(
        "text{{font:{FONT}px Helvetica,Arial,sans-serif;fill:#222}}\
         .axis{{stroke:#444;stroke-width:.7}}.grid{{stroke:#ddd;stroke-width:.5}}\
         .shade{{fill:#eee}}.heat{{fill:#1f5fa8}}polyline{{fill:none;stroke-width:1.2}}"
    );
    for role in Role::ALL {
        let [r, g, b] = role.colour();
        let dashes = role.dashes().iter().map(f64::to_string);
        let dashes: Vec<String> = dashes.collect();
        let dashes = match dashes.is_empty() {
            true => "none".to_owned(),
            false => dashes.join(" "),
        };
        let _ = write!(
            text,
            ".{}{{stroke:#{r:02x}{g:02x}{b:02x};stroke-dasharray:{dashes}}}",
            role.class()
        );
    }
    text
}

fn write_marks(text: &mut String, drawing: &PanelDrawing, corner: (f64, f64)) {
    for mark in &drawing.marks {
        write_mark(text, mark, corner);
    }
}

fn write_mark(text: &mut String, mark: &Mark, (dx, dy): (f64, f64)) {
    let written = match mark {
        Mark::Rectangle([x, y, width, height], paint) => {
            let opacity = match paint {
                Paint::Heat(share) => format!(" fill-opacity=\"{share:.3}\""),
                Paint::Axis | Paint::Grid | Paint::Shade => String::new(),
            };
            write!(
                text,
                "<rect class=\"{}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"{opacity}/>",
                class(*paint),
                x + dx,
                y + dy
            )
        }
        Mark::Rule([x1, y1, x2, y2], paint) => write!(
            text,
            "<line class=\"{}\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
            class(*paint),
            x1 + dx,
            y1 + dy,
            x2 + dx,
            y2 + dy
        ),
        Mark::Line(points, role) => {
            let points: Vec<String> = (points.iter())
                .map(|(x, y)| format!("{:.1},{:.1}", x + dx, y + dy))
                .collect();
            let points = points.join(" ");
            write!(
                text,
                "<polyline class=\"{}\" points=\"{points}\"/>",
                role.class()
            )
        }
        Mark::Text(x, y, anchor, words) => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            write!(
                text,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
                x + dx,
                y + dy,
                HtmlText(words)
            )
        }
    };
    written.expect("writing to a string does not fail");
}

fn class(paint: Paint) -> &'static str {
    match paint {
        Paint::Axis => "axis",
        Paint::Grid => "grid",
        Paint::Shade => "shade",
        Paint::Heat(_) => "heat",
    }
}
