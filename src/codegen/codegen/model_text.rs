//! A model in the templates.

use super::code::Function;
use super::dialect::Dialect;
use super::ident::{Ident, Namer};
use super::interface::{FunctionSpec, ModelInterface, computes_angles};
use super::options::SineCosine;
use super::tables::Tables;
use super::translate::{function, lanes};

/// What the files of all languages say of a model; `F` is what they print of a function.
pub(crate) struct ModelText<'a, F> {
    pub entries: &'a ModelInterface,
    pub tables: Vec<String>,
    /// Maps between robot and latent coordinates.
    pub maps: Vec<F>,
    pub phases: Vec<PhaseText<F>>,
}

/// A phase in the templates; `F` is what they print of a function.
pub(crate) struct PhaseText<F> {
    pub identifier: String,
    /// The same in upper case, the beginning of its constants.
    pub upper: String,
    pub nnz: usize,
    pub rows: String,
    pub cols: String,
    /// Accelerations, then with Jacobian, then a step.
    pub functions: [F; 3],
    /// Body of the loop over the lanes of a batch.
    pub lanes: Option<String>,
    /// Whether the accelerations have sines, whose arguments may be beyond the kernel's limit.
    pub lanes_have_angles: bool,
}

impl<'a, F> ModelText<'a, F> {
    /// Prints all of a model but lanes. `prefix` begins each name; `print` prints a function that reads some of
    /// the tables, `numbers` rows or columns of nonzeros, counted from 0.
    pub(crate) fn new(
        entries: &'a ModelInterface,
        dialect: &dyn Dialect,
        prefix: &str,
        print: impl Fn(Function, &Tables) -> F,
        numbers: fn(&[usize]) -> String,
    ) -> Self {
        let mut globals = Namer::new(dialect.spelling().reserved);
        let mut tables = Tables::new(
            Namer::new(dialect.spelling().reserved),
            &dialect.table_base(prefix),
        );
        let mut text = |entry: &FunctionSpec, callees: &[Ident]| {
            let name = globals.mint(&format!("{prefix}{}", entry.name));
            let function = function(entry, name.clone(), dialect, callees, &mut tables);
            (name, print(function, &tables))
        };
        let maps = entries.maps.iter().map(|map| text(map, &[]).1).collect();
        let phases = entries.phases.iter().map(|phase| {
            let (name, dynamics) = text(&phase.dynamics, &[]);
            let (_, jacobian) = text(&phase.jacobian, &[]);
            let (_, step) = text(&phase.step, &[name]);
            PhaseText {
                identifier: phase.identifier.clone(),
                upper: phase.identifier.to_ascii_uppercase(),
                nnz: phase.pattern.len(),
                rows: numbers(&phase.pattern.rows),
                cols: numbers(&phase.pattern.cols),
                functions: [dynamics, jacobian, step],
                lanes: None,
                lanes_have_angles: phase.dynamics.program.has(computes_angles),
            }
        });
        let phases = phases.collect();
        let tables = tables.known.iter();
        let tables = tables.map(|(name, table)| dialect.table(&name.to_string(), table));
        Self {
            entries,
            tables: tables.collect(),
            maps,
            phases,
        }
    }

    /// The same with the loops over the lanes of batches that run in blocks.
    pub(crate) fn with_lanes(mut self, dialect: &dyn Dialect, sines: SineCosine) -> Self {
        for (text, phase) in self.phases.iter_mut().zip(&self.entries.phases) {
            text.lanes = lanes(&phase.dynamics.program, dialect, sines);
        }
        self
    }

    pub(crate) fn has_lanes(&self) -> bool {
        self.phases.iter().any(|phase| phase.lanes.is_some())
    }

    /// Name of the first phase's accelerations, for an example of a call.
    pub(crate) fn example(&self) -> &str {
        let first = self.entries.phases.first();
        first.map_or("", |phase| &phase.dynamics.name)
    }
}
