//! Marks as SVG, panels for a page that has styles or a file of its own; and as PDF, one page in Helvetica, ASCII
//! throughout.

use std::fmt::Write as _;

use super::draw::{FONT, Mark, Paint, draw_panel, figure_size, placed_marks};
use super::figure::STYLES;
use super::*;

pub(crate) fn panel_svg(figure: &Figure, panel: &Panel) -> String {
    let (width, height) = figure.panel_size;
    let title = HtmlText(&panel.title);
    let marks = draw_panel(panel, figure.panel_size, &figure.x_label);
    let marks: String = marks.iter().map(in_svg).collect();
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
        text.extend(marks.iter().map(in_svg));
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

/// Names of [`Anchor`](super::draw::Anchor)s in SVG.
const ANCHORS: [&str; 3] = ["start", "middle", "end"];

fn in_svg(mark: &Mark) -> String {
    match mark {
        Mark::Rectangle([x, y, width, height], paint) => {
            let opacity = match paint {
                Paint::Heat(share) => format!(" fill-opacity=\"{share:.3}\""),
                Paint::Axis | Paint::Grid | Paint::Shade => String::new(),
            };
            format!(
                "<rect class=\"{}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"{opacity}/>",
                painted(*paint).0
            )
        }
        Mark::Rule([x1, y1, x2, y2], paint) => format!(
            "<line class=\"{}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>",
            painted(*paint).0
        ),
        Mark::Line(points, role) => {
            let points = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}"));
            let (class, points) = (role.class(), points.collect::<Vec<_>>().join(" "));
            format!("<polyline class=\"{class}\" points=\"{points}\"/>")
        }
        Mark::Text(x, y, anchor, words) => {
            let (anchor, words) = (ANCHORS[*anchor as usize], HtmlText(words));
            format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>")
        }
    }
}

/// A figure as a PDF file (version 1.4): the objects around a page's content, and the table of their places.
pub(crate) fn pdf(figure: &Figure) -> String {
    let (width, height) = figure_size(figure);
    let marks = placed_marks(figure).into_iter().flatten();
    let content: String = marks.map(|mark| in_pdf(&mark, height)).collect();
    let content = format!("1 J 1 j\n{content}");
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.2} {height:.2}] \
             /Resources << /Font << /F1 4 0 R >> >> /Contents 5 0 R >>"
        ),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>"
            .to_owned(),
        format!(
            "<< /Length {} >>\nstream\n{content}endstream",
            content.len()
        ),
    ];
    let (mut text, mut places) = (String::from("%PDF-1.4\n"), String::new());
    for (object, number) in objects.iter().zip(1..) {
        let _ = writeln!(places, "{:010} 00000 n ", text.len());
        let _ = write!(text, "{number} 0 obj\n{object}\nendobj\n");
    }
    let (table, size) = (text.len(), objects.len() + 1);
    text + &format!(
        "xref\n0 {size}\n0000000000 65535 f \n{places}\
         trailer\n<< /Size {size} /Root 1 0 R >>\nstartxref\n{table}\n%%EOF\n"
    )
}

fn in_pdf(mark: &Mark, height: f64) -> String {
    match mark {
        Mark::Rectangle([x, y, w, h], paint) => {
            let ([r, g, b], y) = (painted(*paint).1, height - (y + h));
            format!("{r:.3} {g:.3} {b:.3} rg {x:.2} {y:.2} {w:.2} {h:.2} re f\n")
        }
        Mark::Rule([x1, y1, x2, y2], paint) => {
            let ([r, g, b], y1, y2) = (painted(*paint).1, height - y1, height - y2);
            format!("[] 0 d 0.6 w {r:.3} {g:.3} {b:.3} RG {x1:.2} {y1:.2} m {x2:.2} {y2:.2} l S\n")
        }
        Mark::Line(points, role) => {
            let (_, colour, dashes) = STYLES[*role as usize];
            let [r, g, b] = colour.map(|part| f64::from(part) / 255.0);
            let mut path = format!("[{dashes}] 0 d 1.1 w {r:.3} {g:.3} {b:.3} RG");
            for (place, (x, y)) in points.iter().enumerate() {
                let operator = if place == 0 { "m" } else { "l" };
                let _ = write!(path, " {x:.2} {:.2} {operator}", height - y);
            }
            path + " S\n"
        }
        Mark::Text(x, y, anchor, words) => {
            let x = x - 0.5 * f64::from(*anchor as u8) * width(words);
            let (y, words) = (height - y, escaped(words));
            format!("BT /F1 {FONT} Tf 0.13 0.13 0.13 rg {x:.2} {y:.2} Td ({words}) Tj ET\n")
        }
    }
}

/// The class of a paint in SVG, and its colour on white.
fn painted(paint: Paint) -> (&'static str, [f64; 3]) {
    match paint {
        Paint::Axis => ("axis", [0.27; 3]),
        Paint::Grid => ("grid", [0.87; 3]),
        Paint::Shade => ("shade", [0.93; 3]),
        Paint::Heat(share) => {
            let part = |part: f64| 1.0 - share * (1.0 - part / 255.0);
            ("heat", [31.0, 95.0, 168.0].map(part))
        }
    }
}

fn width(text: &str) -> f64 {
    let of = |letter: char| match letter {
        '0'..='9' => 0.556,
        '.' | ',' | ' ' | 'i' | 'l' | 'j' | 't' | 'f' => 0.278,
        '-' | '(' | ')' | 'r' => 0.333,
        '\u{2212}' | '\u{2080}'..='\u{2089}' => 0.556,
        'm' | 'M' | 'W' => 0.85,
        'A'..='Z' => 0.68,
        _ => 0.53,
    };
    FONT * text.chars().map(of).sum::<f64>()
}

/// Indices stand on the line, a minus is a dash of its width, letters outside Latin-1 are question marks.
fn escaped(text: &str) -> String {
    let letter = |letter: char| match letter {
        '(' | ')' | '\\' => format!("\\{letter}"),
        ' '..='~' => letter.to_string(),
        '\u{2212}' => "\\226".to_owned(),
        '\u{2080}'..='\u{2089}' => (u32::from(letter) - 0x2080).to_string(),
        '\u{a0}'..='\u{ff}' => format!("\\{:03o}", u32::from(letter)),
        _ => "?".to_owned(),
    };
    text.chars().map(letter).collect()
}
