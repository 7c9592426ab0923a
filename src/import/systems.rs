//! Equations of a file as text, for those who compare them.

use super::equations::{self, MAX_TEXT_BYTES};
use super::error::{ImportError, ImportFault};
use super::latex::{self, SymbolNames};
use super::options::Format;
use crate::symbolic::ExprPool;

/// The equations of a text or LaTeX file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadEquations {
    /// Number of latent coordinates.
    pub latent_dim: usize,
    /// One system per phase, in the file's order.
    pub systems: Vec<ReadSystem>,
}

/// The equations of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadSystem {
    /// The phase, if the file names it.
    pub phase: Option<String>,
    /// For each acceleration the line of its left side and its right side in the grammar of
    /// candidate terms, numbers as they are written.
    pub right_sides: Vec<(usize, String)>,
}

/// Reads the equations of a file in memory. `symbols` are LaTeX's names of variables, `known`
/// names of phases that its labels may end in.
///
/// # Errors
/// [`ImportError`] with the place of what cannot be read.
pub fn read_equations(
    file: &str,
    format: Format,
    bytes: &[u8],
    symbols: &SymbolNames,
    known: &[String],
) -> Result<ReadEquations, ImportError> {
    if bytes.len() as u64 > MAX_TEXT_BYTES {
        return Err(ImportFault::too_large(file, MAX_TEXT_BYTES, "bytes"));
    }
    let read = match format {
        Format::Latex => latex::read(file, bytes, symbols, known)?,
        Format::Equations | Format::Safetensors | Format::Npz => equations::read(file, bytes)?,
    };
    let mut systems = Vec::with_capacity(read.sections.len());
    for section in &read.sections {
        let mut right_sides = Vec::with_capacity(section.equations.len());
        for equation in &section.equations {
            // Each in a pool of its own: only faults are wanted.
            equation.parse(file, read.latent_dim, &mut ExprPool::new())?;
            right_sides.push((equation.line, equation.text()));
        }
        systems.push(ReadSystem {
            phase: section.phase.clone(),
            right_sides,
        });
    }
    Ok(ReadEquations {
        latent_dim: read.latent_dim,
        systems,
    })
}
