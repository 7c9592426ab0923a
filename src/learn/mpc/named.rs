//! Names of the controller's choices on the command line and in Python.

use crate::online::{Lift, Solver};

/// Names of [`Lift`] with their help.
pub const LIFTS: [(&str, &str, Lift); 2] = [
    (
        "transpose",
        "`u = W_e^T u_lat`, the paper's",
        Lift::Transpose,
    ),
    (
        "consistent",
        "Torques whose own ground reaction forces reproduce the latent input",
        Lift::Consistent,
    ),
];

/// Names of [`Solver`] with their help.
pub const SOLVERS: [(&str, &str, Solver); 2] = [
    ("clarabel", "General interior point", Solver::Clarabel),
    (
        "riccati",
        "Gains prepared ahead where no limit is active, else an interior point stage by stage",
        Solver::Riccati,
    ),
];
