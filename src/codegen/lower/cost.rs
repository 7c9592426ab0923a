//! Which form a function's code takes.

use super::combination::Combination;
use super::dense::distinct;

/// Form of the code that adds coefficients times candidate terms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// The form that is expected to run faster, see [`Form::Tables`].
    #[default]
    Automatic,
    /// One operation after the other: best for small and for sparse models.
    StraightLine,
    /// Tables of coefficients and loops over them, which compilers vectorise: best for
    /// dense models.
    Tables,
}

/// Least number of coefficients for which loops are worth their overhead.
const FEWEST_COEFFICIENTS: usize = 120;

/// Least share of a table that is not zero: a vectorised loop works on four numbers at once, so that even a half-empty
/// table is faster than straight-line code, which also has to be fetched and decoded.
const LEAST_FILL: f64 = 0.45;

impl Form {
    /// Whether the equations should become loops over tables.
    pub(super) fn uses_tables(self, equations: &[Combination]) -> bool {
        match self {
            Self::StraightLine => false,
            Self::Tables => true,
            Self::Automatic => {
                let active: usize = equations.iter().map(|e| e.items.len()).sum();
                let entries = equations.len() * distinct(equations).len();
                active >= FEWEST_COEFFICIENTS && active as f64 >= LEAST_FILL * entries as f64
            }
        }
    }
}
