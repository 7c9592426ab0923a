//! The numbers of a figure, all of them.

use std::fmt::Write as _;

use super::figure::{Figure, Panel};

/// A figure as CSV in long form: `panel,line,x,y`, or `panel,row,column,value` for shades.
pub fn csv(figure: &Figure) -> String {
    let is_heat = (figure.panels.iter()).all(|panel| matches!(panel, Panel::Heat(_)));
    let mut text = if is_heat {
        "panel,row,column,value\n".to_owned()
    } else {
        "panel,line,x,y\n".to_owned()
    };
    for panel in &figure.panels {
        let title = quoted(panel.title());
        match panel {
            Panel::Lines(plot) => {
                for series in &plot.series {
                    let words = figure.legend.iter().find(|entry| entry.0 == series.role);
                    let name = quoted(words.map_or(series.role.class(), |entry| &entry.1));
                    for (x, y) in &series.points {
                        let y = y.map_or(String::new(), |y| y.to_string());
                        let _ = writeln!(text, "{title},{name},{x},{y}");
                    }
                }
            }
            Panel::Heat(map) => {
                for (place, value) in map.values.iter().enumerate() {
                    let row = quoted(&map.rows[place / map.columns.len()]);
                    let column = quoted(&map.columns[place % map.columns.len()]);
                    let _ = writeln!(text, "{title},{row},{column},{value}");
                }
            }
        }
    }
    text
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}
