//! Names of the controller's choices on the command line; `online` itself goes to robots without clap.

use clap::ValueEnum;
use clap::builder::PossibleValue;

use super::{Lift, Solver};

impl ValueEnum for Lift {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Transpose, Self::Consistent]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Transpose => ("transpose", "`u = W_e^T u_lat`, the paper's"),
            Self::Consistent => (
                "consistent",
                "Torques whose own ground reaction forces reproduce the latent input",
            ),
        };
        Some(PossibleValue::new(name).help(help))
    }
}

impl ValueEnum for Solver {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Clarabel, Self::Riccati]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(match self {
            Self::Clarabel => PossibleValue::new("clarabel").help("General interior point"),
            Self::Riccati => PossibleValue::new("riccati").help(
                "Gains prepared ahead where no limit is active, else an interior point stage by stage",
            ),
        })
    }
}
