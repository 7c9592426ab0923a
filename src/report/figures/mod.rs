//! Figures: data that draws itself as SVG and PDF and lists itself as CSV.
//!
//! A [`Figure`] holds numbers and words. `draw.rs` turns its panels into a list of marks, once;
//! `svg.rs` and `pdf.rs` spell the same marks; `sticks.rs` turns states of a robot into lines. Start with
//! `figure.rs`.

mod csv;
mod draw;
mod figure;
mod film;
mod pdf;
mod sticks;
mod svg;
mod ticks;

pub use figure::Role;
pub(crate) use figure::{Drawing, Figure, HeatMap, Panel, Series};
pub(crate) use film::{Film, film};
pub(crate) use sticks::{Motion, film_strip, floor_m};
pub(crate) use svg::panel_svg;
pub(crate) use ticks::subscript;

use crate::files::EmittedFile;

pub(crate) fn figure_files(figure: &Figure) -> [EmittedFile; 3] {
    let file = |ending, contents| EmittedFile::new(format!("{}.{ending}", figure.id), contents);
    [
        file("svg", svg::standalone_svg(figure)),
        file("pdf", pdf::pdf(figure)),
        file("csv", csv::csv(figure)),
    ]
}
