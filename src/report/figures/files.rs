//! A figure as files.

use super::{Figure, csv, pdf, standalone_svg};
use crate::files::EmittedFile;

/// A figure as SVG, PDF and CSV, named after it.
pub fn figure_files(figure: &Figure) -> [EmittedFile; 3] {
    let id = &figure.id;
    [
        EmittedFile::new(format!("{id}.svg"), standalone_svg(figure)),
        EmittedFile::new(format!("{id}.pdf"), pdf(figure)),
        EmittedFile::new(format!("{id}.csv"), csv(figure)),
    ]
}
