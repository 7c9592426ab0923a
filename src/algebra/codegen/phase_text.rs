//! A phase in the templates.

use super::code::Stmt;
use super::interface::PhaseInterface;
use super::printer::Printer;
use super::requirements::calls_kernel;

/// A phase in the templates; `F` is what they print of a function.
pub struct PhaseText<F> {
    /// Name of the phase as an identifier.
    pub identifier: String,
    /// The same in upper case, the beginning of its constants.
    pub upper: String,
    /// Number of structural nonzeros of the Jacobian.
    pub nnz: usize,
    /// Rows of the nonzeros.
    pub rows: String,
    /// Columns of the nonzeros.
    pub cols: String,
    /// Accelerations, then with Jacobian, then a step; of C's header also that of a batch.
    pub functions: Vec<F>,
    /// Body of the loop over the lanes of a batch.
    pub lanes: Option<String>,
    /// Whether that loop has sines, whose arguments may be beyond the kernel's limit.
    pub lanes_have_angles: bool,
}

impl<F> PhaseText<F> {
    /// A phase without lanes; `numbers` prints rows or columns of nonzeros, counted from 0.
    pub fn new(
        phase: &PhaseInterface,
        functions: Vec<F>,
        numbers: impl Fn(&[usize]) -> String,
    ) -> Self {
        Self {
            identifier: phase.identifier.clone(),
            upper: phase.identifier.to_ascii_uppercase(),
            nnz: phase.pattern.len(),
            rows: numbers(&phase.pattern.rows),
            cols: numbers(&phase.pattern.cols),
            functions,
            lanes: None,
            lanes_have_angles: false,
        }
    }

    /// The phase with the loop over the lanes of a batch, if it runs in blocks.
    pub fn with_lanes(self, lanes: Option<&[Stmt]>, printer: &Printer) -> Self {
        Self {
            lanes: lanes.map(|lanes| printer.statements(lanes, 3)),
            lanes_have_angles: lanes.is_some_and(calls_kernel),
            ..self
        }
    }
}
