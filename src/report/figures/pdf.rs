//! The PDF spelling of marks: one page of the size of the figure, Helvetica, ASCII throughout.

use std::fmt::Write as _;

use super::draw::{Anchor, FONT, Mark, Paint, figure_size, placed_marks};
use super::figure::{Figure, STYLES};

/// A figure as a PDF file (version 1.4).
pub(crate) fn pdf(figure: &Figure) -> String {
    let size = figure_size(figure);
    let mut content = String::from("1 J 1 j\n");
    for (marks, corner) in placed_marks(figure) {
        for mark in &marks {
            write_mark(&mut content, mark, corner, size.1);
        }
    }
    file(&content, size)
}

/// The objects around a page's content, and the table of their places.
fn file(content: &str, (width, height): (f64, f64)) -> String {
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
    let mut text = String::from("%PDF-1.4\n");
    let mut places = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        places.push(text.len());
        let _ = write!(text, "{} 0 obj\n{object}\nendobj\n", index + 1);
    }
    let table = text.len();
    let _ = write!(text, "xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
    for place in places {
        let _ = writeln!(text, "{place:010} 00000 n ");
    }
    let _ = write!(
        text,
        "trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{table}\n%%EOF\n",
        objects.len() + 1
    );
    text
}

fn write_mark(text: &mut String, mark: &Mark, (dx, dy): (f64, f64), height: f64) {
    let up = |y: f64| height - (y + dy);
    let written = match mark {
        Mark::Rectangle([x, y, w, h], paint) => {
            let [r, g, b] = colour(*paint);
            let (x, y) = (x + dx, up(y + h));
            writeln!(
                text,
                "{r:.3} {g:.3} {b:.3} rg {x:.2} {y:.2} {w:.2} {h:.2} re f"
            )
        }
        Mark::Rule([x1, y1, x2, y2], paint) => {
            let [r, g, b] = colour(*paint);
            let (x1, y1, x2, y2) = (x1 + dx, up(*y1), x2 + dx, up(*y2));
            writeln!(
                text,
                "[] 0 d 0.6 w {r:.3} {g:.3} {b:.3} RG {x1:.2} {y1:.2} m {x2:.2} {y2:.2} l S"
            )
        }
        Mark::Line(points, role) => {
            let (_, colour, dashes) = STYLES[*role as usize];
            let [r, g, b] = colour.map(|part| f64::from(part) / 255.0);
            let mut path = format!("[{dashes}] 0 d 1.1 w {r:.3} {g:.3} {b:.3} RG");
            for (place, (x, y)) in points.iter().enumerate() {
                let operator = if place == 0 { "m" } else { "l" };
                let _ = write!(path, " {:.2} {:.2} {operator}", x + dx, up(*y));
            }
            writeln!(text, "{path} S")
        }
        Mark::Text(x, y, anchor, words) => {
            let shift = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => 0.5 * width(words),
                Anchor::End => width(words),
            };
            let (x, y) = (x + dx - shift, up(*y));
            let words = escaped(words);
            writeln!(
                text,
                "BT /F1 {FONT} Tf 0.13 0.13 0.13 rg {x:.2} {y:.2} Td ({words}) Tj ET"
            )
        }
    };
    written.expect("writing to a string does not fail");
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

/// Width of a text in Helvetica, near enough to place it.
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

/// A text between parentheses; a minus becomes a dash of its width, indices stand on the line, and other letters outside
/// Latin-1 become question marks.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '(' | ')' | '\\' => out.extend(['\\', letter]),
            ' '..='~' => out.push(letter),
            '\u{2212}' => out.push_str("\\226"),
            '\u{2080}'..='\u{2089}' => {
                out.extend(char::from_digit(u32::from(letter) - 0x2080, 10));
            }
            _ => match u8::try_from(u32::from(letter)) {
                Ok(byte) if byte >= 0xA0 => {
                    let _ = write!(out, "\\{byte:03o}");
                }
                Ok(_) | Err(_) => out.push('?'),
            },
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_a_file_is_escaped() {
        assert_eq!(escaped("d²(z)\\"), "d\\262\\(z\\)\\\\");
        assert_eq!(escaped("\u{2212}1 z\u{2081}"), "\\2261 z1");
        assert_eq!(escaped("λ"), "?");
    }

    #[test]
    fn table_of_places_points_at_the_objects() {
        let text = file("0 0 m\n", (100.0, 50.0));
        let table = text.find("xref\n").expect("a table");
        let lines: Vec<&str> = text[table..].lines().collect();
        for object in 1..=5 {
            let place: usize = lines[2 + object][..10].parse().expect("a number");
            assert!(text[place..].starts_with(&format!("{object} 0 obj")));
        }
        assert!(text.ends_with(&format!("startxref\n{table}\n%%EOF\n")));
    }
}
