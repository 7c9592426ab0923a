//! Figures: data that draws itself as SVG and PDF and lists itself as CSV.
//!
//! A [`Figure`] holds numbers and words. `draw.rs` turns its panels into a list of marks, once;
//! `svg.rs` and `pdf.rs` spell the same marks; `sticks.rs` turns states of a robot into lines. Start with
//! `figure.rs`.

mod draw;
mod figure;
mod film;
mod pdf;
mod sticks;
mod svg;

pub(crate) use draw::subscript;
pub use figure::Role;
pub(crate) use figure::{Drawing, Figure, HeatMap, Panel, Series};
pub(crate) use film::{Film, film};
pub(crate) use sticks::{Motion, film_strip, floor_m};
pub(crate) use svg::panel_svg;

use crate::files::EmittedFile;
use crate::typeset::Table;
use sticks::Sticks;

pub(crate) fn figure_files(figure: &Figure) -> [EmittedFile; 3] {
    let file = |ending, contents| EmittedFile::new(format!("{}.{ending}", figure.id), contents);
    [
        file("svg", svg::standalone_svg(figure)),
        file("pdf", pdf::pdf(figure)),
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
    for panel in &figure.panels {
        let title = panel.title.as_str();
        match &panel.drawing {
            Drawing::Lines { series, .. } => {
                for series in series {
                    let name = named(series.role);
                    for (x, y) in &series.points {
                        let y = y.map_or(String::new(), |y| y.to_string());
                        table.row([title, name, &x.to_string(), &y]);
                    }
                }
            }
            Drawing::Sticks(plot) => {
                for (role, sticks) in &plot.sticks {
                    let lines = sticks.lines.iter().zip(Sticks::NAMES);
                    for (line, part) in lines {
                        let name = format!("{}, {part}", named(*role));
                        for (x, y) in line {
                            table.row([title, &name, &x.to_string(), &y.to_string()]);
                        }
                    }
                }
            }
            Drawing::Heat(map) => {
                for (place, value) in map.values.iter().enumerate() {
                    let row = &map.rows[place / map.columns.len()];
                    let column = &map.columns[place % map.columns.len()];
                    table.row([title, row, column, &value.to_string()]);
                }
            }
        }
    }
    table.csv()
}
