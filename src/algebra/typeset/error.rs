//! How typesetting fails.

#![allow(missing_docs, reason = "each variant's message names its fields")]

/// Why the equations of a model could not be printed.
#[derive(Debug, thiserror::Error)]
pub enum TypesetError {
    /// A coefficient in robot coordinates is too large once folded with weights and scale factors.
    #[error("robot coordinates, {output}: the coefficient of {term:?} is {value} in SI units")]
    NotFinite {
        output: String,
        term: String,
        value: f64,
    },
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}

/// Why a table of new names was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenameError {
    /// The entry has no `=`.
    #[error("`{entry}`: expected `VARIABLE=NAME`, for example `z1=x`")]
    Form { entry: String },
    /// The left side is no variable that can have a new name.
    #[error("`{found}` cannot be renamed: expected z1, z2, ... or u1, u2, ... (dots follow z)")]
    Variable { found: String },
    /// The right side is no name.
    #[error(
        "`{variable}={found}`: expected a letter, a word or a Greek letter's name, with an \
         optional subscript of letters and digits after `_` (x, theta, p_x, F_lin,1)"
    )]
    Name { variable: String, found: String },
    /// The same variable is renamed twice.
    #[error("`{variable}` is renamed twice")]
    Twice { variable: String },
    /// Two variables would look the same in print.
    #[error("`{first}` and `{second}` would both be printed as `{name}`")]
    Collision {
        first: String,
        second: String,
        name: String,
    },
}
