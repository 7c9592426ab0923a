//! Parts of the recipe for named coordinates that a training can leave out; `docs/evaluation/training-choices.md` has the effect of each.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecipePart {
    MomentumWeights,
    LegRows,
    Abductions,
    Settling,
    Place,
    Positions,
    Height,
    KeptConstant,
    KeptVelocities,
    Braking,
    KeptInputs,
    RotationPositions,
    RotationLegs,
    KeptRotation,
    StancePrior,
    StillFeet,
    Stiffness,
    UnrefinedLegs,
    FreeFall,
    FlightRotation,
    FlightLoads,
    FlightLegs,
    FlightFit,
    WholeFlights,
    WholeJumps,
    RelativeErrors,
    Windows,
    Thresholds,
    Sweep,
    Thinning,
}
