//! The PDF spelling of marks: one page of the size of the figure, Helvetica, ASCII throughout.

use std::fmt::Write as _;

use super::draw::{Anchor, FONT, Mark, Paint, figure_size, placed_marks};
use super::figure::{Figure, STYLES};

/// A figure as a PDF file (version 1.4): the objects around a page's content, and the table of their places.
pub(crate) fn pdf(figure: &Figure) -> String {
    let (width, height) = figure_size(figure);
    let marks = placed_marks(figure).into_iter().flatten();
    let content: String = marks.map(|mark| spelled(&mark, height)).collect();
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

fn spelled(mark: &Mark, height: f64) -> String {
    match mark {
        Mark::Rectangle([x, y, w, h], paint) => {
            let ([r, g, b], y) = (colour(*paint), height - (y + h));
            format!("{r:.3} {g:.3} {b:.3} rg {x:.2} {y:.2} {w:.2} {h:.2} re f\n")
        }
        Mark::Rule([x1, y1, x2, y2], paint) => {
            let ([r, g, b], y1, y2) = (colour(*paint), height - y1, height - y2);
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
            let x = match anchor {
                Anchor::Start => *x,
                Anchor::Middle => x - 0.5 * width(words),
                Anchor::End => x - width(words),
            };
            let (y, words) = (height - y, escaped(words));
            format!("BT /F1 {FONT} Tf 0.13 0.13 0.13 rg {x:.2} {y:.2} Td ({words}) Tj ET\n")
        }
    }
}

fn colour(paint: Paint) -> [f64; 3] {
    match paint {
        Paint::Axis => [0.27; 3],
        Paint::Grid => [0.87; 3],
        Paint::Shade => [0.93; 3],
        Paint::Heat(share) => {
            [31.0, 95.0, 168.0].map(|part: f64| 1.0 - share * (1.0 - part / 255.0))
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

/// A text between parentheses; a minus becomes a dash of its width, indices stand on the line, and other letters
/// outside Latin-1 become question marks.
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
