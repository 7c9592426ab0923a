//! A model in the templates.

use super::code::Function;
use super::dialect::Dialect;
use super::error::CodegenError;
use super::functions::{function, lanes};
use super::ident::{Ident, Namer};
use super::interface::{FunctionSpec, ModelInterface, PhaseInterface, computes_angles};
use super::printer::Printer;
use super::sines::SineCosine;
use super::tables::Tables;

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

/// Prints a function, with the tables so far and the phase it belongs to, if it belongs to one.
pub type PrintFunction<'a, F> =
    dyn Fn(&Function, &Tables, Option<&PhaseInterface>) -> Result<F, CodegenError> + 'a;

impl<'a, F> ModelText<'a, F> {
    /// All of a model without lanes. `prefix` begins each name; `numbers` prints rows or columns of nonzeros,
    /// counted from 0.
    pub fn new(
        entries: &'a ModelInterface,
        dialect: &dyn Dialect,
        prefix: &str,
        print: &PrintFunction<'_, F>,
        numbers: fn(&[usize]) -> String,
    ) -> Result<Self, CodegenError> {
        let mut globals = Namer::new(dialect.reserved());
        let mut tables = Tables::new(Namer::new(dialect.reserved()), &dialect.table_base(prefix));
        let mut text = |entry: &FunctionSpec, callees: &[Ident], phase: Option<&PhaseInterface>| {
            let name = globals.mint(&format!("{prefix}{}", entry.name));
            let function = function(entry, name.clone(), dialect, callees, &mut tables);
            Ok::<_, CodegenError>((name, print(&function, &tables, phase)?))
        };
        let maps = entries.maps.iter();
        let maps = maps
            .map(|map| Ok(text(map, &[], None)?.1))
            .collect::<Result<_, CodegenError>>()?;
        let phases = entries.phases.iter().map(|phase| {
            let (name, dynamics) = text(&phase.dynamics, &[], Some(phase))?;
            let (_, jacobian) = text(&phase.jacobian, &[], Some(phase))?;
            let (_, step) = text(&phase.step, &[name], Some(phase))?;
            Ok(PhaseText {
                identifier: phase.identifier.clone(),
                upper: phase.identifier.to_ascii_uppercase(),
                nnz: phase.pattern.len(),
                rows: numbers(&phase.pattern.rows),
                cols: numbers(&phase.pattern.cols),
                functions: vec![dynamics, jacobian, step],
                lanes: None,
                lanes_have_angles: phase.dynamics.program.has(computes_angles),
            })
        });
        let phases = phases.collect::<Result<_, CodegenError>>()?;
        Ok(Self {
            entries,
            tables: tables
                .iter()
                .filter_map(|table| dialect.table(table))
                .collect(),
            maps,
            phases,
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
