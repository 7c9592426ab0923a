//! The stride prior: strides of the training walks as stored in a model, from which other strides are planned. It
//! contains half a stride, from the touchdown of one diagonal pair of feet to that of the other, at nodes of equal
//! shares of its duration. The other half is its mirror image. With the features `phi = (1, f_1 .. f_6)` of a gait,
//! `f = (value - mean) / std`, a number at a node is `c . phi`.

use super::*;

/// Forward and sideways velocity (m/s), yaw rate (rad/s), strides per second, stance share of a foot in a stride,
/// height (m).
pub const GAIT_DIM: usize = 6;
const FREQUENCY: usize = 3;
const GAIT_FEATURES: usize = 1 + GAIT_DIM;
/// Numbers at a node: the state, the input, and for each foot how often it is down.
pub const STRIDE_WIDTH: usize = 2 * STATE_DIM + FOOT_DIM;
const MOST_NODES: usize = 200;
/// How far beyond the recorded range a walk is planned, as a share of that range.
const BEYOND: f64 = 0.15;

/// `strides` of a model file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StridePrior {
    pub gait: [GoalRange; GAIT_DIM],
    /// `n x (7 x 40)`: the columns of one feature after the other, in SI units. x, y and yaw are deviations from steady
    /// motion; roll, pitch and height are absolute.
    #[serde(with = "listed")]
    pub nodes: DMatrix<f64>,
}

impl StridePrior {
    /// Range in which a number of a gait may be planned: the recorded range, extended by 15 % of it at both ends.
    /// Velocities to the left and of yaw have a symmetric range, because they are used with both signs.
    pub fn reach(&self, number: usize) -> [f64; 2] {
        let GoalRange { least, most, .. } = self.gait[number];
        let margin = BEYOND * (most - least);
        let [least, most] = [least - margin, most + margin];
        let both = most.min(-least).max(0.0);
        match number {
            1 | 2 => [-both, both],
            _ => [least, most],
        }
    }

    /// Both halves of a stride, `2 (n - 1) x 40`, joined where they meet. The second is the mirror image of the gait
    /// that turns the other way.
    pub fn stride(&self, robot: &Robot, gait: &[f64; GAIT_DIM]) -> DMatrix<f64> {
        let [forward, sideways, yaw_rate, rest @ ..] = *gait;
        let [frequency, duty, height] = rest;
        let other_way = [forward, -sideways, -yaw_rate, frequency, duty, height];
        let mut first = self.half_stride(gait);
        let image = self.half_stride(&other_way);
        let mut second =
            DMatrix::from_fn(image.nrows(), STRIDE_WIDTH, |node, i| match i / STATE_DIM {
                2 => image[(node, 2 * STATE_DIM + ((i - 2 * STATE_DIM) ^ 1))],
                block => {
                    let (from, sign) = robot.mirrored(i % STATE_DIM);
                    sign * image[(node, block * STATE_DIM + from)]
                }
            });
        let last = first.nrows() - 1;
        let gaps = [
            (second.row(0) - first.row(last)) * 0.5,
            (first.row(0) - second.row(last)) * 0.5,
        ];
        for node in 0..=last {
            let share = node as f64 / last as f64;
            let towards = |end: usize| &gaps[end] * share - &gaps[1 - end] * (1.0 - share);
            let mut row = first.row_mut(node);
            row += towards(0);
            let mut row = second.row_mut(node);
            row += towards(1);
        }
        let mut both = DMatrix::zeros(2 * last, STRIDE_WIDTH);
        both.rows_mut(0, last).copy_from(&first.rows(0, last));
        both.rows_mut(last, last).copy_from(&second.rows(0, last));
        both
    }

    /// The nodes of half a stride of a gait, `n x 40`, which begins with the touchdown of the front right foot.
    fn half_stride(&self, gait: &[f64; GAIT_DIM]) -> DMatrix<f64> {
        let mut nodes = DMatrix::zeros(self.nodes.nrows(), STRIDE_WIDTH);
        for feature in 0..GAIT_FEATURES {
            let value = match feature.checked_sub(1) {
                None => 1.0,
                Some(i) => self.gait[i].normalised(gait[i]),
            };
            nodes += self.nodes.columns(feature * STRIDE_WIDTH, STRIDE_WIDTH) * value;
        }
        nodes
    }

    pub(super) fn check(&self) -> Result<()> {
        let place = "`strides.nodes`";
        check_count(place, self.nodes.nrows(), "nodes", 3..=MOST_NODES)?;
        let shape = (self.nodes.nrows(), GAIT_FEATURES * STRIDE_WIDTH);
        check_tensor("strides.nodes", &self.nodes, shape)?;
        for (index, range) in self.gait.iter().enumerate() {
            let GoalRange {
                mean,
                std,
                least,
                most,
            } = *range;
            let is_finite = [mean, std, least, most].iter().all(|v| v.is_finite());
            let fits = is_finite && std > 0.0 && least <= mean && mean <= most;
            let (place, found) = (format!("`strides.gait[{index}]`"), || format!("{range:?}"));
            let expected = "finite numbers, `std` positive, `mean` between `least` and `most`";
            check(fits, &place, found, expected)?;
        }
        let least = self.gait[FREQUENCY].least;
        check(
            least > 0.0,
            "`strides.gait[3].least`",
            || least,
            "positive strides a second",
        )
    }
}
