//! The numbers of a figure, all of them.

use super::figure::{Drawing, Figure, Role};
use super::sticks::Sticks;
use crate::typeset::Table;

/// A figure as CSV in long form: `panel,line,x,y`, or `panel,row,column,value` for shades.
pub(crate) fn csv(figure: &Figure) -> String {
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
