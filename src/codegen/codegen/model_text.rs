//! A model in the templates.

use super::translate::{function, lanes};
use super::*;
use crate::ir::interpret::{double, single};

pub(crate) struct ModelText<'a> {
    pub entries: &'a ModelInterface,
    pub tables: Vec<(Ident, String)>,
    pub maps: Vec<Function>,
    pub phases: Vec<PhaseText<'a>>,
}

pub(crate) struct PhaseText<'a> {
    pub identifier: &'a str,
    /// The same in upper case, the beginning of its constants.
    pub upper: String,
    pub pattern: &'a JacobianPattern,
    /// Accelerations, then with Jacobian, then a step.
    pub functions: [Function; 3],
    pub lanes: Option<String>, // body of the loop over the lanes of a batch
    /// Whether the accelerations have sines, whose arguments may be beyond the kernel's limit.
    pub lanes_have_angles: bool,
}

impl<'a> ModelText<'a> {
    /// Prints all functions of a model; with blocks of lanes for batches, whose sines are given, or without.
    pub(crate) fn new(
        entries: &'a ModelInterface,
        dialect: &Dialect,
        batches: Option<SineCosine>,
    ) -> Self {
        let spelling = dialect.spelling;
        let [prefix, base] =
            [spelling.prefix, spelling.table_base].map(|pattern| dialect.fill(pattern, &[]));
        let mut globals = Namer::new(spelling.reserved);
        let mut tables = Tables::new(spelling.reserved, base);
        let mut printed = |entry: &FunctionSpec, callees: &[Ident]| {
            let name = globals.mint(&format!("{prefix}{}", entry.name));
            function(entry, name, dialect, callees, &mut tables)
        };
        let maps = entries.maps.iter().map(|map| printed(map, &[])).collect();
        let phases = entries.phases.iter().map(|phase| {
            let dynamics = printed(&phase.dynamics, &[]);
            let jacobian = printed(&phase.jacobian, &[]);
            let step = printed(&phase.step, std::slice::from_ref(&dynamics.name));
            let program = &phase.dynamics.program;
            PhaseText {
                identifier: &phase.identifier,
                upper: phase.identifier.to_ascii_uppercase(),
                pattern: &phase.pattern,
                functions: [dynamics, jacobian, step],
                lanes: batches.and_then(|sines| lanes(program, dialect, sines)),
                lanes_have_angles: program.has(computes_angles),
            }
        });
        let phases = phases.collect();
        let tables = tables.known.into_iter().map(|(name, table)| {
            let text = dialect.table(&name, &table);
            (name, text)
        });
        Self {
            entries,
            tables: tables.collect(),
            maps,
            phases,
        }
    }

    pub(crate) fn functions(&self) -> Vec<&Function> {
        let of_phases = self.phases.iter().flat_map(|phase| &phase.functions);
        self.maps.iter().chain(of_phases).collect()
    }

    pub(crate) fn has_lanes(&self) -> bool {
        self.phases.iter().any(|phase| phase.lanes.is_some())
    }

    pub(crate) fn example(&self) -> &str {
        let first = self.entries.phases.first();
        first.map_or("", |phase| &phase.dynamics.name)
    }
}

pub(crate) struct KernelText {
    pub limit: String,
    pub two_over_pi: String,
    pub round: String,
    pub pi_2: [String; 3],
    /// Polynomials of sine and cosine in `t`, with `t2` its square.
    pub sin: String,
    pub cos: String,
    pub to_sign: usize, // from bit 1 of a number to its sign
}

impl KernelText {
    pub(crate) fn new(dialect: &Dialect) -> Self {
        let [single, pi_2, sin, cos] = match dialect.precision {
            Precision::Double => double::constants(),
            Precision::Single => single::constants(),
        };
        let literal = |list: &[f64], k: usize| dialect.literal(list[k]);
        Self {
            limit: literal(&single, 0),
            two_over_pi: literal(&single, 1),
            round: literal(&single, 2),
            pi_2: [0, 1, 2].map(|k| literal(&pi_2, k)),
            sin: polynomial(dialect, &sin).text,
            cos: polynomial(dialect, &cos).text,
            to_sign: dialect.precision.bits() - 2,
        }
    }
}

/// `(c_0 + c_1 t) + t2 (...)`
fn polynomial(dialect: &Dialect, coefficients: &[f64]) -> Text {
    let [t, t2] = ["t", "t2"].map(|name| Text::atom(name.to_owned()));
    let [add, mul] = [Binary::Add, Binary::Mul]
        .map(|op| move |a: &Text, b: &Text| dialect.binary(op, a, b, true));
    match coefficients {
        [first, second, rest @ ..] => {
            let [first, second] = [first, second].map(|&value| dialect.constant(value));
            let linear = add(&first, &mul(&second, &t));
            match rest.is_empty() {
                true => linear,
                false => add(&linear, &mul(&t2, &polynomial(dialect, rest))),
            }
        }
        rest => dialect.constant(rest[0]),
    }
}
