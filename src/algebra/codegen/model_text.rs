//! A model in the templates.

use super::code::Function;
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::{ModelFunctions, lanes};
use super::interface::{ModelInterface, PhaseInterface, computes_angles};
use super::printer::Printer;
use super::sines::SineCosine;

/// What the files of all languages say of a model; `F` is what they print of a function.
pub struct ModelText<'a, F> {
    /// What is generated.
    pub entries: &'a ModelInterface,
    /// Constant tables.
    pub tables: Vec<String>,
    /// Maps between robot and latent coordinates.
    pub maps: Vec<F>,
    /// Phases.
    pub phases: Vec<PhaseText<F>>,
}

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
    /// Accelerations, then with Jacobian, then a step.
    pub functions: Vec<F>,
    /// Body of the loop over the lanes of a batch.
    pub lanes: Option<String>,
    /// Whether that loop has sines, whose arguments may be beyond the kernel's limit.
    pub lanes_have_angles: bool,
}

/// Prints a function, with the phase it belongs to, if it belongs to one.
pub type PrintFunction<'a, F> =
    dyn Fn(&Function, Option<&PhaseInterface>) -> Result<F, CodegenError> + 'a;

impl<'a, F> ModelText<'a, F> {
    /// All of a model without lanes; `numbers` prints rows or columns of nonzeros, counted from 0.
    pub fn new(
        entries: &'a ModelInterface,
        functions: &ModelFunctions,
        tables: Vec<String>,
        print: &PrintFunction<'_, F>,
        numbers: fn(&[usize]) -> String,
    ) -> Result<Self, CodegenError> {
        let maps = functions.maps.iter().map(|map| print(map, None));
        let phases = entries.phases.iter().zip(&functions.phases);
        let phases = phases.map(|(phase, functions)| {
            let functions = functions
                .iter()
                .map(|function| print(function, Some(phase)));
            Ok(PhaseText {
                identifier: phase.identifier.clone(),
                upper: phase.identifier.to_ascii_uppercase(),
                nnz: phase.pattern.len(),
                rows: numbers(&phase.pattern.rows),
                cols: numbers(&phase.pattern.cols),
                functions: functions.collect::<Result<_, CodegenError>>()?,
                lanes: None,
                lanes_have_angles: phase.dynamics.program.has(computes_angles),
            })
        });
        Ok(Self {
            entries,
            tables,
            maps: maps.collect::<Result<_, CodegenError>>()?,
            phases: phases.collect::<Result<_, CodegenError>>()?,
        })
    }

    /// The same with the loops over the lanes of batches that run in blocks.
    pub fn with_lanes(mut self, dialect: &dyn Dialect, sines: SineCosine) -> Self {
        for (text, phase) in self.phases.iter_mut().zip(&self.entries.phases) {
            let lanes = lanes(&phase.dynamics.program, dialect, sines);
            text.lanes = lanes.map(|lanes| Printer::new(dialect).statements(&lanes, 3));
        }
        self
    }

    /// Whether a batch runs in blocks.
    pub fn has_lanes(&self) -> bool {
        self.phases.iter().any(|phase| phase.lanes.is_some())
    }

    /// Name of the first phase's accelerations, for an example of a call.
    pub fn example(&self) -> &str {
        let first = self.entries.phases.first();
        first.map_or("", |phase| &phase.dynamics.name)
    }
}
