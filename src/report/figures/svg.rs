//! The SVG spelling of marks: panels for a page that has styles, or a file of its own.

use std::fmt::Write as _;

use super::draw::{Anchor, FONT, Mark, Paint, draw_panel, figure_size, placed_marks};
use super::figure::{Figure, Panel, STYLES};
use crate::typeset::mathml::HtmlText;

pub(crate) fn panel_svg(figure: &Figure, panel: &Panel) -> String {
    let (width, height) = figure.panel_size;
    let title = HtmlText(&panel.title);
    let marks = draw_panel(panel, figure.panel_size, &figure.x_label);
    let marks: String = marks.iter().map(spelled).collect();
    format!(
        "<svg class=\"plot\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\">{marks}</svg>"
    )
}

pub(crate) fn standalone_svg(figure: &Figure) -> String {
    let (width, height) = figure_size(figure);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\">\n<title>{}</title>\n<style>{}</style>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n",
        HtmlText(&figure.caption),
        style()
    );
    for marks in placed_marks(figure) {
        text.extend(marks.iter().map(spelled));
        text.push('\n');
    }
    text + "</svg>\n"
}

fn style() -> String {
    let mut text = format!(
        "text{{font:{FONT}px Helvetica,Arial,sans-serif;fill:#222}}\
         .axis{{stroke:#444;stroke-width:.7}}.grid{{stroke:#ddd;stroke-width:.5}}\
         .shade{{fill:#eee}}.heat{{fill:#1f5fa8}}polyline{{fill:none;stroke-width:1.2}}"
    );
    for (class, [r, g, b], dashes) in STYLES {
        let dashes = if dashes.is_empty() { "none" } else { dashes };
        let _ = write!(
            text,
            ".{class}{{stroke:#{r:02x}{g:02x}{b:02x};stroke-dasharray:{dashes}}}"
        );
    }
    text
}

fn spelled(mark: &Mark) -> String {
    match mark {
        Mark::Rectangle([x, y, width, height], paint) => {
            let opacity = match paint {
                Paint::Heat(share) => format!(" fill-opacity=\"{share:.3}\""),
                Paint::Axis | Paint::Grid | Paint::Shade => String::new(),
            };
            format!(
                "<rect class=\"{}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"{opacity}/>",
                class(*paint)
            )
        }
        Mark::Rule([x1, y1, x2, y2], paint) => format!(
            "<line class=\"{}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>",
            class(*paint)
        ),
        Mark::Line(points, role) => {
            let points = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}"));
            let (class, points) = (role.class(), points.collect::<Vec<_>>().join(" "));
            format!("<polyline class=\"{class}\" points=\"{points}\"/>")
        }
        Mark::Text(x, y, anchor, words) => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let words = HtmlText(words);
            format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>")
        }
    }
}

fn class(paint: Paint) -> &'static str {
    match paint {
        Paint::Axis => "axis",
        Paint::Grid => "grid",
        Paint::Shade => "shade",
        Paint::Heat(_) => "heat",
    }
}
