//! Columns that lag the motion, or are held: rates that are filtered, clipped or differences of held samples, and a
//! body position that arrives later than the joints. Angles of joints and body are assumed to be right.

use super::mismatch::foot_slip_m;
use super::preprocess::slopes;
use super::*;

const HALF_WINDOW_S: f64 = 0.015; // of the slopes that replace rates
const LONGEST_S: f64 = 0.03; // longest delay that is looked for
const LEAST_S: f64 = 0.004; // shortest that counts
/// Largest share of the disagreement that may remain after the correction of a delay: of rates (their unexplained
/// share), of feet (their slip).
const RATES_EXPLAINED: f64 = 0.75;
const UNEXPLAINED: f64 = 0.2; // share of rates above which they are noise rather than late
const SLIP_EXPLAINED: f64 = 0.75;
const LEAST_SLIP_M: f64 = 0.006; // feet that stay that well in place have no delay
const BEYOND_CLIP: f64 = 1.02; // slopes of the angles over a rate that clips
const CLIPPED_SAMPLES: usize = 5; // equal consecutive rates at an extreme
const HELD_SHARE: f64 = 0.05; // of samples that repeat the one before
const ARE_DIFFERENCES: f64 = 1e-3; // unexplained share of rates that are differences of the angles themselves
const PLACE: Range<usize> = JOINT_DIM..JOINT_DIM + 3;
pub(super) const BODY_RATES: &str = "angular rates of the body";
const GROUPS: [(Range<usize>, &str); 2] = [
    (0..JOINT_DIM, "joint rates"),
    (JOINT_DIM + 3..STATE_DIM, BODY_RATES),
];

/// Why rates are not those of the angles, with the number that the words need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RateFault {
    Clipped(f64), // at rad/s
    Held,
    Late(f64), // by ms
}

impl RateFault {
    /// The words with the range of the number over several segments.
    pub(super) fn words(self, least: f64, most: f64) -> String {
        let range = |digits: usize| match least == most {
            true => format!("{most:.digits$}"),
            false => format!("{least:.digits$} to {most:.digits$}"),
        };
        match self {
            Self::Clipped(_) => format!("clip at {} rad/s", range(1)),
            Self::Held => "are differences of held samples".to_owned(),
            Self::Late(_) => format!("are {} ms late", range(0)),
        }
    }

    pub(super) fn number(self) -> f64 {
        match self {
            Self::Clipped(number) | Self::Late(number) => number,
            Self::Held => 0.0,
        }
    }
}

/// Groups of rates that the angles contradict, by name, and why.
pub(super) fn faulty_rates(segment: &Segment) -> Vec<(&'static str, RateFault)> {
    if segment.mean_step_s() <= 0.0 || segment.duration_s() < 4.0 * LONGEST_S {
        return Vec::new();
    }
    let of_group = |(rows, name): (Range<usize>, &'static str)| {
        let of = |m: &DMatrix<f64>| m.rows(rows.start, rows.len()).into_owned();
        let (angles, rates) = (of(&segment.x), of(&segment.dx));
        let slopes = slopes(&segment.time_s, &angles, HALF_WINDOW_S);
        Some((name, fault(&segment.time_s, &angles, &rates, &slopes)?))
    };
    GROUPS.into_iter().filter_map(of_group).collect()
}

pub(super) fn replace_rates(segment: &mut Segment, groups: &[&'static str]) {
    if groups.is_empty() {
        return;
    }
    let slopes = slopes(&segment.time_s, &segment.x, HALF_WINDOW_S);
    for (rows, _) in GROUPS.into_iter().filter(|(_, name)| groups.contains(name)) {
        let own = slopes.rows(rows.start, rows.len());
        segment.dx.rows_mut(rows.start, rows.len()).copy_from(&own);
    }
    segment.ddx = differences(&segment.time_s, &segment.dx);
}

fn fault(
    time_s: &[f64],
    angles: &DMatrix<f64>,
    rates: &DMatrix<f64>,
    slopes: &DMatrix<f64>,
) -> Option<RateFault> {
    if let Some(extreme) = clipped(rates, slopes) {
        return Some(RateFault::Clipped(extreme));
    }
    let n = time_s.len();
    let held = (1..n)
        .filter(|&i| angles.column(i) == angles.column(i - 1))
        .count();
    let is_held = held as f64 > HELD_SHARE * n as f64;
    if is_held && unexplained(rates, &differences(time_s, angles), 0) < ARE_DIFFERENCES {
        return Some(RateFault::Held);
    }
    let step_s = (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
    let lags = 0..=(LONGEST_S / step_s) as usize;
    let each = lags.map(|lag| (lag, unexplained(rates, slopes, lag)));
    let (lag, least) = each.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let now = unexplained(rates, slopes, 0);
    let is_late = lag as f64 * step_s >= LEAST_S && least < UNEXPLAINED;
    (is_late && least < RATES_EXPLAINED * now).then_some(RateFault::Late(1e3 * lag as f64 * step_s))
}

/// The extreme at which a rate stays for [`CLIPPED_SAMPLES`] while the angle turns faster.
fn clipped(rates: &DMatrix<f64>, slopes: &DMatrix<f64>) -> Option<f64> {
    rates
        .row_iter()
        .zip(slopes.row_iter())
        .find_map(|(row, slopes)| {
            let values: Vec<f64> = row.iter().map(|rate| rate.abs()).collect();
            let slopes: Vec<f64> = slopes.iter().map(|slope| slope.abs()).collect();
            let extreme = row.amax();
            let mut runs = values
                .windows(CLIPPED_SAMPLES)
                .zip(slopes.windows(CLIPPED_SAMPLES));
            let stays = runs.any(|(run, slopes)| {
                let is_faster = |slope: &f64| *slope > BEYOND_CLIP * extreme;
                run.iter().all(|rate| *rate == extreme) && slopes.iter().all(is_faster)
            });
            (extreme > 0.0 && stays).then_some(extreme)
        })
}

/// Share of the squares of rates that the slopes of `lag` samples before do not explain, with the best factor.
fn unexplained(rates: &DMatrix<f64>, slopes: &DMatrix<f64>, lag: usize) -> f64 {
    let n = rates.ncols() - lag;
    let (late, early) = (rates.columns(lag, n), slopes.columns(0, n));
    let (product, of_late, of_early) =
        (late.dot(&early), late.norm_squared(), early.norm_squared());
    if of_late <= 0.0 || of_early <= 0.0 || product <= 0.0 {
        return 1.0;
    }
    1.0 - product * product / (of_late * of_early)
}

/// Advances the body's place by the delay that lets feet on the ground stay where they are, and gives it, in s.
pub(super) fn mend_place(segment: &mut Segment, robot: &Robot) -> Option<f64> {
    let step_s = segment.mean_step_s();
    if step_s <= 0.0 {
        return None;
    }
    let slip = |lag: usize| foot_slip_m(&advanced(segment, lag), robot);
    let now = slip(0).filter(|slip| *slip > LEAST_SLIP_M)?;
    let longest = ((LONGEST_S / step_s) as usize).min(segment.len() / 4);
    let each = (1..=longest).filter_map(|lag| Some((lag, slip(lag)?)));
    let (lag, least) = each.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let delay_s = lag as f64 * step_s;
    if lag == longest || delay_s < LEAST_S || least > SLIP_EXPLAINED * now {
        return None;
    }
    *segment = advanced(segment, lag);
    Some(delay_s)
}

/// The segment with the body's place `lag` samples earlier, without its last `lag` samples.
fn advanced(segment: &Segment, lag: usize) -> Segment {
    let n = segment.len() - lag;
    let mut out = segment.slice(0..n);
    let pairs = [
        (&mut out.x, &segment.x),
        (&mut out.dx, &segment.dx),
        (&mut out.ddx, &segment.ddx),
    ];
    for (to, from) in pairs {
        let place = from.view((PLACE.start, lag), (PLACE.len(), n));
        to.rows_mut(PLACE.start, PLACE.len()).copy_from(&place);
    }
    out
}
