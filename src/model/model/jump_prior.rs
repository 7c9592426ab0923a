//! The jump prior: training jumps as stored in a model, from which other jumps are planned. A jump is divided at
//! landmarks into parts with nodes at equal shares of the duration. With the features `phi = (1, g_1, g_2, g_3)` of a
//! goal, `g = (goal - mean) / std`, a coordinate at a node is `c . phi`. Per part
//! `delta ddz = Xi^T (delta z, delta dz, delta u_lat)`.

use super::listed::Listed;
use super::*;

pub const GOAL_DIM: usize = 3;
pub const FEATURE_DIM: usize = 1 + GOAL_DIM;
const MAX_NODES: usize = 200;

pub(crate) type GoalFeatures = [f64; FEATURE_DIM];

/// One number of the training's goals: of jumps, or of the gaits of walks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalRange {
    pub mean: f64,
    pub std: f64,
    pub least: f64,
    pub most: f64,
}

/// A number that varies less does not determine how motions depend on it, SI units.
const LEAST_STD_M: f64 = 1e-3;

impl GoalRange {
    pub fn of<const N: usize>(jumps: &[[f64; N]]) -> [Self; N] {
        std::array::from_fn(|i| {
            let values = || jumps.iter().map(|jump| jump[i]);
            let n = jumps.len().max(1) as f64;
            let mean = values().sum::<f64>() / n;
            let square: f64 = values().map(|value| (value - mean).powi(2)).sum();
            Self {
                mean,
                std: (square / n).sqrt().max(LEAST_STD_M),
                least: values().fold(f64::INFINITY, f64::min),
                most: values().fold(f64::NEG_INFINITY, f64::max),
            }
        })
    }

    pub fn features(ranges: &[Self; GOAL_DIM], goal: &[f64; GOAL_DIM]) -> GoalFeatures {
        std::array::from_fn(|k| match k.checked_sub(1) {
            None => 1.0,
            Some(i) => ranges[i].normalised(goal[i]),
        })
    }

    pub fn normalised(&self, value: f64) -> f64 {
        (value - self.mean) / self.std
    }
}

/// Where jumps are cut, and the training jumps in numbers: `landmarks` of a model file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landmarks {
    /// Distance, rise at the apex and height at the start of each training jump, m.
    pub jumps: Vec<[f64; GOAL_DIM]>,
    /// Mean state at the start of the jumps, 18, SI units.
    #[serde(with = "listed")]
    pub start: DVector<f64>,
    /// Lowest and highest body height at the end of the jumps, m.
    pub end_height_m: [f64; 2],
    /// Lowest body height after touch-down; for jumps without a landing that at their end, m.
    pub landing_height_m: f64,
    pub parts: Vec<Landmark>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Landmark {
    /// Name: crouch, thrust, flight, landing, or the phase's.
    pub name: String,
    pub phase: String,
    #[serde(with = "listed")]
    pub feet: ContactFlags,
    /// Shortest and longest duration in the training jumps, s.
    pub duration_range_s: [f64; 2],
}

impl Landmark {
    pub fn is_grounded(&self) -> bool {
        self.feet.contains(&true)
    }
}

impl Listed for ContactFlags {
    type List = [u8; FOOT_DIM];

    fn to_list(&self) -> Self::List {
        self.map(u8::from)
    }

    fn of_list(flags: Self::List) -> Result<Self, String> {
        match flags.iter().find(|flag| **flag > 1) {
            Some(flag) => Err(format!("found a foot {flag}, expected 0 or 1 per foot")),
            None => Ok(flags.map(|flag| flag == 1)),
        }
    }
}

/// The prior of a part of a jump; `n` nodes, the first and last at its borders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JumpPart {
    /// Duration in s, one coefficient per feature.
    pub duration_s: GoalFeatures,
    /// Latent positions, `n x (FEATURE_DIM latent_dim)`: the columns of one feature after the other.
    #[serde(with = "listed")]
    pub z: DMatrix<f64>,
    #[serde(with = "listed")]
    pub dz: DMatrix<f64>,
    #[serde(with = "listed")]
    pub u_lat: DMatrix<f64>,
    /// Xi of deviations, `(3 latent_dim) x latent_dim`; none: the phase's own equations are used.
    #[serde(default, with = "listed", skip_serializing_if = "Option::is_none")]
    pub xi: Option<DMatrix<f64>>,
    /// Covariance of the training's latent inputs in the part, `latent_dim x latent_dim`.
    #[serde(with = "listed")]
    pub input_covariance: DMatrix<f64>,
    /// Over the jumps, of the mean acceleration that `xi` leaves unexplained in a jump that it was not fitted to.
    #[serde(with = "listed")]
    pub acceleration_std: DVector<f64>,
}

impl JumpPart {
    pub fn nodes(&self) -> usize {
        self.z.nrows()
    }

    /// A coordinate's row at a node for a goal: the sum over the features of `table`.
    pub fn at(table: &DMatrix<f64>, node: usize, features: &GoalFeatures) -> DVector<f64> {
        let d = table.ncols() / FEATURE_DIM;
        DVector::from_fn(d, |i, _| {
            let terms = features.iter().enumerate();
            terms.map(|(k, f)| f * table[(node, k * d + i)]).sum()
        })
    }

    pub fn duration(&self, features: &GoalFeatures) -> f64 {
        let terms = self.duration_s.iter().zip(features);
        terms.map(|(c, f)| c * f).sum()
    }

    fn check(&self, name: &str, d: usize, range_s: &[f64; 2]) -> Result<()> {
        let place = |key: &str| format!("`{name}{key}`");
        let nodes = self.nodes();
        check_count(&place(".z"), nodes, "nodes", 3..=MAX_NODES)?;
        let of_nodes = (nodes, FEATURE_DIM * d);
        let xi = self.xi.as_ref().map(|xi| ("xi", xi, (3 * d, d)));
        let tables = [
            ("z", &self.z, of_nodes),
            ("dz", &self.dz, of_nodes),
            ("u_lat", &self.u_lat, of_nodes),
            ("input_covariance", &self.input_covariance, (d, d)),
        ];
        for (key, table, shape) in tables.into_iter().chain(xi) {
            check_tensor(&format!("{name}.{key}"), table, shape)?;
        }
        let is_definite = self.input_covariance.clone().cholesky().is_some();
        let (covariance, expected) = (place(".input_covariance"), "a positive definite matrix");
        check(is_definite, &covariance, || "another", expected)?;
        let tensor = format!("{name}.acceleration_std");
        check_tensor(&tensor, &self.acceleration_std, (d, 1))?;
        let durations = &self.duration_s;
        let is_finite = durations.iter().chain(range_s).all(|v| v.is_finite());
        let fits = is_finite && 0.0 < range_s[0] && range_s[0] <= range_s[1];
        let found = || format!("{durations:?} within {range_s:?}");
        let expected = "finite durations, the range positive";
        check(fits, &place(".duration_s"), found, expected)
    }
}

/// Landmarks and prior of a model's training jumps; without the landmarks, `prior` of a model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JumpPrior {
    /// A key of its own in the model file.
    #[serde(skip)]
    pub landmarks: Landmarks,
    /// Standard deviations of `z`, then of `dz`, over all samples, `2 latent_dim`.
    #[serde(with = "listed")]
    pub state_std: DVector<f64>,
    pub parts: Vec<JumpPart>,
}

impl JumpPrior {
    pub fn ranges(&self) -> [GoalRange; GOAL_DIM] {
        GoalRange::of(&self.landmarks.jumps)
    }

    pub fn features(&self, goal: [f64; GOAL_DIM]) -> GoalFeatures {
        GoalRange::features(&self.ranges(), &goal)
    }

    pub(super) fn check(&self, d: usize, phases: &[Phase]) -> Result<()> {
        self.landmarks.check(phases)?;
        let (n_parts, n_landmarks) = (self.parts.len(), self.landmarks.parts.len());
        let (found, fits) = (|| format!("{n_parts} parts"), n_parts == n_landmarks);
        let expected = format!("{n_landmarks} as in `landmarks.parts`");
        check(fits, "`prior.parts`", found, expected)?;
        check_tensor("prior.state_std", &self.state_std, (2 * d, 1))?;
        let least = self.state_std.min();
        check(least > 0.0, "`prior.state_std`", || least, "positive")?;
        for (index, part) in self.parts.iter().enumerate() {
            let range_s = &self.landmarks.parts[index].duration_range_s;
            part.check(&format!("prior.parts[{index}]"), d, range_s)?;
        }
        Ok(())
    }
}

impl Landmarks {
    fn check(&self, phases: &[Phase]) -> Result<()> {
        let (n_jumps, n_parts) = (self.jumps.len(), self.parts.len());
        let mut numbers = self.jumps.iter().flatten();
        let fits = n_jumps >= 2 && numbers.all(|v| v.is_finite() && v.abs() < 1e3);
        let found = || format!("{n_jumps} jumps, or numbers that are none");
        let expected = "2 or more, all numbers below 1000 m";
        check(fits, "`landmarks.jumps`", found, expected)?;
        check_tensor("landmarks.start", &self.start, (STATE_DIM, 1))?;
        let [low, high] = self.end_height_m;
        let heights = [low, high, self.landing_height_m];
        let fits = heights.iter().all(|v| v.is_finite()) && low <= high;
        let place = "`landmarks`, heights at the end";
        check(fits, place, || format!("{heights:?}"), "ordered")?;
        let parts = "`landmarks.parts`";
        let found = || format!("{n_parts} parts");
        check(n_parts >= 2, parts, found, "2 or more")?;
        for (index, Landmark { phase, feet, .. }) in self.parts.iter().enumerate() {
            let place = format!("`landmarks.parts[{index}]`");
            let known = phases.iter().position(|known| known.name == *phase);
            let found = || format!("phase {phase:?}");
            check(known.is_some(), &place, found, "the name of a phase")?;
            let (fits, found) = (selected(phases, *feet) == known, || format!("{feet:?}"));
            check(fits, &place, found, format!("feet that select {phase}"))?;
        }
        let mut in_air = self.parts.iter().map(|part| !part.is_grounded());
        let fits = in_air.next() == Some(false) && in_air.filter(|in_air| *in_air).count() == 1;
        let expected = "exactly one part without a foot on the ground, not the first";
        check(fits, parts, || "others", expected)
    }
}
