//! Figures: data that draws itself as SVG and PDF and lists itself as CSV.
//!
//! A [`Figure`] holds numbers and words. `draw.rs` turns its panels into a list of marks, once; `spelling.rs`
//! spells them; `sticks.rs` turns states of a robot into lines. Start with `figure.rs`.

mod draw;
mod figure;
mod spelling;
mod sticks;

pub(crate) use draw::{range, subscript};
pub(crate) use figure::Role;
pub(crate) use figure::{Drawing, Figure, HeatMap, Panel, Series};
pub(crate) use spelling::panel_svg;
pub(crate) use sticks::{Film, Motion, film, film_strip, floor_m};

use figure::StickPlot;
use sticks::Sticks;

use super::*;
use crate::files::EmittedFile;

pub(crate) fn figure_files(figure: &Figure) -> [EmittedFile; 3] {
    let file = |ending, contents| EmittedFile::new(format!("{}.{ending}", figure.id), contents);
    [
        file("svg", spelling::standalone_svg(figure)),
        file("pdf", spelling::pdf(figure)),
        file("csv", csv(figure)),
    ]
}

/// A figure as CSV in long form: `panel,line,x,y`, or `panel,row,column,value` for shades.
fn csv(figure: &Figure) -> String {
    let is_heat = (figure.panels.iter()).all(|panel| matches!(panel.drawing, Drawing::Heat(_)));
    let mut table = Table::new(match is_heat {
        true => ["panel", "row", "column", "value"],
        false => ["panel", "line", "x", "y"],
    });
    let named = |role: Role| {
        let words = figure.legend.iter().find(|entry| entry.0 == role);
        words.map_or(role.class(), |entry| &entry.1)
    };
    let mut row = |cells: [&str; 4]| {
        table.row(cells);
    };
    for panel in &figure.panels {
        let title = panel.title.as_str();
        match &panel.drawing {
            Drawing::Lines { series, .. } => {
                for series in series {
                    for (x, y) in &series.points {
                        let y = y.map_or(String::new(), |y| y.to_string());
                        row([title, named(series.role), &x.to_string(), &y]);
                    }
                }
            }
            Drawing::Sticks(plot) => {
                for (role, sticks) in &plot.sticks {
                    for (line, part) in sticks.lines.iter().zip(Sticks::NAMES) {
                        let name = format!("{}, {part}", named(*role));
                        for (x, y) in line {
                            row([title, &name, &x.to_string(), &y.to_string()]);
                        }
                    }
                }
            }
            Drawing::Spans { rows, .. } => {
                for (name, spans) in rows {
                    for (from, to) in spans {
                        row([title, name, &from.to_string(), "1"]);
                        row([title, name, &to.to_string(), ""]);
                    }
                }
            }
            Drawing::Heat(map) => {
                let rows = map.values.chunks(map.columns.len().max(1));
                for (name, values) in map.rows.iter().zip(rows) {
                    for (column, value) in map.columns.iter().zip(values) {
                        row([title, name, column, &value.to_string()]);
                    }
                }
            }
        }
    }
    table.csv()
}
