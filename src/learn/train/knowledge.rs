//! Prior knowledge of the latent dynamics before a regression, in the coordinates of a [`Frame`].

use super::body::Y;
use super::frame::{LegRow, TURN};
use super::momentum::loads_on;
use super::recipe::RecipePart::{self, *};
use super::weak_form::{FLIGHT_WINDOW, flight_samples, windowed_samples};
use super::*;

const HEIGHT: usize = 1; // the momentum row upwards
const STANDING_DAMPING_PER_S: f64 = 70.0; // of feet that slip
const STANDING_STIFFNESS_PER_S2: f64 = 400.0; // of the ground
const FLIGHT_RIDGE: f64 = 1e-4; // on the normalised columns
const SHARED_RIDGE: f64 = 1e-5; // the same

/// Known coefficients of one phase, and those left to a regression; all `library_dim x latent_dim`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Knowledge {
    pub known: DMatrix<f64>,    // zero where nothing is known
    pub free: DMatrix<bool>,    // to be chosen by a regression
    pub kept: DMatrix<bool>,    // free, and never removed
    pub braking: DMatrix<bool>, // free, and at most 0 once refined
    shared: Vec<Vec<usize>>,    // terms of each momentum column that is the same in all phases
    affine: Range<usize>,       // columns of the joints, if there are such columns
    standing: Vec<Standing>,    // equations of the legs, if they stand in this phase
    swinging: Range<usize>,     // columns of the legs, if this phase is flight
    left_out: Vec<RecipePart>,
}

/// Prior of a leg on the ground. With the row `rho` of the pair and the momentum rows `b` and `t` its feet are at
/// `f = rho + b + arm t`, and `ddf = -damping df - stiffness (f - rest)`, with stiffness upwards only.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Standing {
    column: usize,
    row: LegRow,
    velocities: [usize; 3], // terms of rho, b and t
    /// Terms of their positions, and the constant; none forwards, because the floor is level.
    ground: Option<([usize; 3], usize)>,
}

impl Standing {
    /// None if the library lacks one of the terms.
    fn of(row: LegRow, column: usize, features: &Features) -> Option<Self> {
        let d = features.latent_dim;
        let terms = |first: usize| -> Option<[usize; 3]> {
            let [rho, b, t] = [column, row.body, TURN].map(|k| features.variable_term(first + k));
            Some([rho?, b?, t?])
        };
        let ground = match row.body {
            0 => None,
            _ => Some((terms(0)?, features.constant_term()?)),
        };
        Some(Self {
            column,
            row,
            velocities: terms(d)?,
            ground,
        })
    }

    /// The column for feet that stand still, given those of the momentum in `xi`.
    pub(super) fn still(&self, xi: &DMatrix<f64>) -> DVector<f64> {
        let LegRow { body, arm, rest } = self.row;
        let shares = [1.0, 1.0, arm];
        let mut still = -xi.column(body) - xi.column(TURN) * arm;
        for (velocity, share) in self.velocities.into_iter().zip(shares) {
            still[velocity] -= STANDING_DAMPING_PER_S * share;
        }
        if let Some((positions, one)) = self.ground {
            for (position, share) in positions.into_iter().zip(shares) {
                still[position] -= STANDING_STIFFNESS_PER_S2 * share;
            }
            still[one] += STANDING_STIFFNESS_PER_S2 * rest;
        }
        still
    }
}

impl Knowledge {
    pub(super) fn nothing(library_dim: usize, latent_dim: usize) -> Self {
        Self {
            known: DMatrix::zeros(library_dim, latent_dim),
            free: DMatrix::from_element(library_dim, latent_dim, true),
            kept: DMatrix::from_element(library_dim, latent_dim, false),
            braking: DMatrix::from_element(library_dim, latent_dim, false),
            shared: Vec::new(),
            affine: 0..0,
            standing: Vec::new(),
            swinging: 0..0,
            left_out: Vec::new(),
        }
    }

    pub(super) fn has(&self, part: RecipePart) -> bool {
        !self.left_out.contains(&part)
    }

    /// With the fitted equations of the legs in flight. They depend on inputs only, so positions are linear in their
    /// coefficients: least squares over windows and whole flights of the training.
    pub(super) fn with_flights(
        &self,
        set: EncodedSet<'_>,
        features: &Features,
        phase: usize,
    ) -> Self {
        let mut fitted = self.clone();
        if self.swinging.is_empty() || !self.has(FlightFit) {
            return fitted;
        }
        let (theta, target) = match self.has(WholeFlights) {
            true => flight_samples(set, features, phase),
            false => windowed_samples(set, features, phase, FLIGHT_WINDOW),
        };
        let regression = Regression::new(&theta, &target, self.clone());
        for column in self.swinging.clone() {
            let coefficients = regression.fit_column(column, &self.free, FLIGHT_RIDGE);
            fitted.known.set_column(column, &coefficients);
            fitted.free.column_mut(column).fill(false);
            fitted.kept.column_mut(column).fill(false);
        }
        fitted
    }

    pub(super) fn shares_body(&self) -> bool {
        !self.shared.is_empty()
    }

    /// With the fitted momentum columns of [`Self::share_body`]: ridge regression over windows of all motions, across
    /// phases. A velocity with a positive coefficient is omitted, because it would drive.
    pub(super) fn with_shared_body(
        &self,
        (theta, target): &(DMatrix<f64>, DMatrix<f64>),
        features: &Features,
    ) -> Self {
        let mut fitted = self.clone();
        let (p, d) = self.known.shape();
        let regression = Regression::new(theta, target, Self::nothing(p, d));
        for (column, terms) in self.shared.iter().enumerate() {
            let fit = |without: Option<usize>| {
                let is_term = |term: usize| terms.contains(&term) && Some(term) != without;
                let support = DMatrix::from_fn(p, d, |term, k| k == column && is_term(term));
                regression.fit_column(column, &support, SHARED_RIDGE)
            };
            let mut coefficients = fit(None);
            let velocity = features.variable_term(d + column);
            if velocity.is_some_and(|term| coefficients[term] > 0.0) {
                coefficients = fit(velocity);
            }
            fitted.known.set_column(column, &coefficients);
        }
        fitted
    }

    /// Marks the momentum columns as known and equal in all phases with feet on the ground. Their terms are forces and
    /// moments, a constant upwards and of pitch, and the own velocity of `x` and `y`. The forces represent contact, so
    /// one equation holds in every phase; in flight it is free fall.
    fn share_body(&mut self, features: &Features, frame: &Frame) {
        let d = features.latent_dim;
        for (k, &coordinate) in frame.body.iter().enumerate() {
            let loads: Vec<usize> = loads_on(coordinate).collect();
            let is_load = |v: usize| {
                let load = v.checked_sub(2 * d).and_then(|load| frame.body.get(load));
                load.is_some_and(|of| loads.contains(of))
            };
            let suits = |variables: &[usize]| match *variables {
                [] => !is_lateral(coordinate) && coordinate != BODY_X,
                [v] => is_load(v) || v == d + k && [BODY_X, Y].contains(&coordinate),
                _ => false,
            };
            let terms = features.variables();
            let terms = terms.filter(|(term, of)| features.affine[*term] && suits(of));
            self.shared.push(terms.map(|(term, _)| term).collect());
            self.free.column_mut(k).fill(false);
            self.kept.column_mut(k).fill(false);
        }
    }

    /// The equations of the joints are affine with all terms, and stay as the regression has them.
    fn move_joints(&mut self, features: &Features, frame: &Frame) {
        self.affine = frame.body.len()..features.latent_dim;
        for k in self.affine.clone() {
            for (term, is_affine) in features.affine.iter().enumerate() {
                self.free[(term, k)] &= is_affine;
                self.kept[(term, k)] = self.free[(term, k)];
            }
        }
    }

    /// Whether joints swing and stand in turn: their equations are affine in each phase.
    pub(super) fn has_swings(&self) -> bool {
        !self.affine.is_empty()
    }

    /// Whether refinement leaves a column as the regression has it.
    pub(super) fn is_settled(&self, column: usize) -> bool {
        let stands = self.has(UnrefinedLegs) && self.standing(column).is_some();
        stands || self.affine.contains(&column)
    }

    pub(super) fn standing(&self, column: usize) -> Option<&Standing> {
        self.standing.iter().find(|of| of.column == column)
    }

    /// Prior knowledge of each phase in a frame with momentum rows: the centre of mass as `z1` (forwards) and `z2`
    /// (upwards), the rotation about it as `z3`, then foot positions. The floor is the same everywhere: no term depends
    /// on `z1`. Forces accelerate a centre of mass and losses brake it, at any position of it and the legs. Therefore
    /// no term of `ddz1` and `ddz2` depends on a position, and each keeps its own velocity, braking.
    ///
    /// With feet on the ground `ddz2` depends on its own force and velocity alone, and keeps its constant (gravity
    /// minus the share of the legs' weight that the ground carries). `ddz3` depends on velocities, on force and moment,
    /// and on products of these with the height if the library has them. The equations of the legs are affine, start
    /// from [`Standing`] and keep all terms.
    ///
    /// In flight `ddz1 = 0`, `ddz2 = -g`, `ddz3 = 0`, no term depends on force or moment, and the legs depend on their
    /// own inputs only. Momentum rows that change sign in a mirror image depend on forces and moments (`y` on its own
    /// force alone). No term depends on place or heading.
    pub(super) fn of_phases(
        training: &Dataset,
        features: &Features,
        frame: &Frame,
        options: &RegressionOptions,
    ) -> Vec<Self> {
        let (p, d) = (features.library_dim(), features.latent_dim);
        let each = training.phases.patterns.iter();
        if frame.body.is_empty() {
            return each.map(|_| Self::nothing(p, d)).collect();
        }
        let gravity = -GRAVITY_M_S2 * training.scaling.state[BODY_Z];
        each.map(|phase| {
            let mut knowledge = Self {
                left_out: options.leave_out.clone(),
                ..Self::nothing(p, d)
            };
            let place = |v: &usize| frame.body.get(*v).is_some_and(|row| PLACE.contains(row));
            knowledge.forbid(Place, 0..d, features, |variables| {
                variables.iter().any(place)
            });
            knowledge.forbid(Positions, 0..2, features, |variables| {
                variables.iter().any(|v| *v < d)
            });
            if phase.feet == FeetRule::None {
                knowledge.fly(features, frame, gravity);
            } else {
                let own = [d + 1, 2 * d + 1];
                let others = |variables: &[usize]| variables.iter().any(|v| !own.contains(v));
                knowledge.forbid(Height, 1..2, features, others);
                if let Some(one) = features.constant_term() {
                    knowledge.kept[(one, 1)] = options.has(KeptConstant);
                }
                knowledge.turn(features, frame);
                knowledge.stand(features, frame);
            }
            knowledge.push_sideways(features, frame);
            if options.body_equations == BodyEquations::AllPhases {
                if phase.feet != FeetRule::None {
                    knowledge.share_body(features, frame);
                }
                if training.walks() {
                    knowledge.move_joints(features, frame);
                }
            }
            let inputs = (0..d).map(|k| (2 * d + k, k, KeptInputs));
            for (variable, k, part) in inputs.chain((0..2).map(|k| (d + k, k, KeptVelocities))) {
                if let Some(term) = features.variable_term(variable) {
                    let free = knowledge.free[(term, k)];
                    knowledge.kept[(term, k)] |= free && options.has(part);
                    knowledge.braking[(term, k)] =
                        free && k + d == variable && options.has(Braking);
                }
            }
            knowledge
        })
        .collect()
    }

    /// Terms of certain variables (counted over `z`, `dz`, `u_lat`) are not free in these columns with this part.
    fn forbid(
        &mut self,
        part: impl Into<Option<RecipePart>>,
        columns: Range<usize>,
        features: &Features,
        depends: impl Fn(&[usize]) -> bool,
    ) {
        if part.into().is_some_and(|part| !self.has(part)) {
            return;
        }
        for (term, variables) in features.variables() {
            if depends(&variables) {
                let mut row = self.free.row_mut(term);
                row.columns_range_mut(columns.clone()).fill(false);
            }
        }
    }

    /// Keeps the free terms of a column that are affine.
    fn keep(&mut self, column: usize, features: &Features) {
        for (term, is_affine) in features.affine.iter().enumerate() {
            self.kept[(term, column)] = self.free[(term, column)] && *is_affine;
        }
    }

    /// The rotation in the plane with feet on the ground.
    fn turn(&mut self, features: &Features, frame: &Frame) {
        let d = features.latent_dim;
        let loads = 2 * d..2 * d + frame.body.len();
        for k in (TURN..frame.body.len()).filter(|&k| !is_lateral(frame.body[k])) {
            self.forbid(RotationPositions, k..k + 1, features, |variables| {
                let is_arm = variables.iter().any(|v| loads.contains(v));
                let is_position = |v: &usize| *v < d && !(*v == HEIGHT && is_arm);
                variables.iter().any(is_position)
            });
            self.forbid(RotationLegs, k..k + 1, features, |variables| {
                variables.iter().any(|v| *v >= loads.end)
            });
            if self.has(KeptRotation) {
                self.keep(k, features);
            }
        }
    }

    /// The momentum rows that change sign in a mirror image: forces and moments, of `y` its own force.
    fn push_sideways(&mut self, features: &Features, frame: &Frame) {
        let inputs = 2 * features.latent_dim;
        for (k, &coordinate) in frame.body.iter().enumerate() {
            if !is_lateral(coordinate) {
                continue;
            }
            let loads = match coordinate {
                Y => k..k + 1,
                _ => 0..frame.body.len(),
            };
            self.forbid(None, k..k + 1, features, |variables| match *variables {
                [v] => v < inputs || !loads.contains(&(v - inputs)),
                _ => true,
            });
            self.keep(k, features);
        }
    }

    /// Without the terms that contradict mirror symmetry: each latent coordinate stays or changes sign in a mirror
    /// image (`parity` 1 or -1), and so do the terms of its equation. Terms of one variable that are not affine are
    /// left.
    pub(super) fn with_parity(&self, features: &Features, parity: &[f64]) -> Self {
        let (mut allowed, d) = (self.clone(), features.latent_dim);
        for (term, variables) in features.variables() {
            let sign: f64 = variables.iter().map(|v| parity[v % d]).product();
            let has_sign = features.affine[term] || variables.len() == 2;
            for k in (0..d).filter(|&k| has_sign && parity[k] != sign) {
                allowed.free[(term, k)] = false;
                allowed.kept[(term, k)] = false;
            }
        }
        allowed
    }

    /// The legs with feet on the ground, including a pair in the air while the other stands: its predictions of
    /// validation jumps are better with the prior than without.
    fn stand(&mut self, features: &Features, frame: &Frame) {
        let rows = frame.legs.iter().zip(frame.body.len()..);
        let standing = rows.filter_map(|(&row, k)| Standing::of(row, k, features));
        self.standing = standing.filter(|_| self.has(StancePrior)).collect();
        if !self.has(Stiffness) {
            self.standing.iter_mut().for_each(|of| of.ground = None);
        }
        for k in self.standing.iter().map(|standing| standing.column) {
            for (term, is_affine) in features.affine.iter().enumerate() {
                self.free[(term, k)] &= is_affine;
                self.kept[(term, k)] = self.free[(term, k)];
            }
        }
    }

    /// All coordinates in flight.
    fn fly(&mut self, features: &Features, frame: &Frame, gravity: f64) {
        let (d, momentum) = (features.latent_dim, frame.body.len());
        let (loads, legs) = (
            2 * d..2 * d + momentum,
            momentum..momentum + frame.legs.len(),
        );
        self.forbid(FlightLoads, 0..d, features, |variables| {
            variables.iter().any(|v| loads.contains(v))
        });
        self.forbid(FlightLegs, legs.clone(), features, |variables| {
            variables.iter().any(|v| *v < 2 * d)
        });
        if self.has(FreeFall) {
            self.free.column_mut(0).fill(false);
            if let Some(one) = features.constant_term() {
                self.known[(one, 1)] = gravity;
                self.free.column_mut(1).fill(false);
            }
        }
        if self.has(FlightRotation) {
            (self.free.columns_range_mut(TURN..momentum.max(TURN))).fill(false);
        }
        for k in legs.clone() {
            self.keep(k, features);
        }
        self.swinging = legs;
    }
}

/// Coefficients that would drive where they may only brake, set to 0.
pub(super) fn brake(knowledge: &[Knowledge], xi: &mut [DMatrix<f64>]) {
    for (knowledge, xi) in knowledge.iter().zip(xi) {
        for (coefficient, braking) in xi.iter_mut().zip(&knowledge.braking) {
            if *braking && *coefficient > 0.0 {
                *coefficient = 0.0;
            }
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_knowledge.rs"]
mod tests;
