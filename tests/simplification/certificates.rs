//! Random models and boxes: at no point of a box may the error exceed the certificate's bound.

use std::collections::BTreeMap;

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use nalgebra::{DMatrix, DVector};

use romc::equations::Equations;
use romc::model::{FeetRule, LatentVariable, Library, Phase, ReducedModel};
use romc::simplify::{Domain, Samples, Simplified, SimplifyError, Tolerance, simplify};
use romc::symbolic::Interval;
use serde_json::json;

const CASES: u64 = 150;
const POINTS: usize = 200;

/// Terms of every kind, over two latent coordinates; the last term has values at only some of the points.
const TERMS: &str = "1; z1; z2; dz1; dz2; u1; u2; sin(z1); cos(dz2); sin(z1 + 0.5*dz1); z1*dz2; z2^2; \
    tanh(u1); exp(z2); z1*sin(z2); 1/(3 + z1); u1*u2; cos(z1/3); 2*z1; log(2.5 + dz1)";

/// A model's equations, simplified over a domain without samples.
fn made_of(model: &ReducedModel, domain: &Domain, tolerance: f64) -> Simplified {
    let tolerance = Tolerance::Absolute(tolerance);
    simplify(&Equations::of(model), domain, None, tolerance).expect("certified")
}

/// A domain of one phase with one box.
fn boxed(model: &ReducedModel, ranges: [(f64, f64); 3]) -> Domain {
    let ranges = ranges.map(|(lo, hi)| Interval::new(lo, hi)).to_vec();
    Domain::new(model, vec![Some(ranges)]).expect("a box")
}

/// The box of a phase in the certificate.
fn ranges(made: &Simplified, phase: usize) -> Vec<Interval> {
    let domain = &made.certificate.phases[phase].domain;
    let ranges = domain.as_ref().expect("a box").iter();
    ranges.map(|(_, range)| *range).collect()
}

/// The terms of an equation and their coefficients.
fn terms_of(model: &ReducedModel, phase: usize, output: usize) -> Vec<(String, f64)> {
    let active = model.active_terms(phase, output).expect("in range");
    let active = active.into_iter();
    active.map(|(xi, term)| (term.text.clone(), xi)).collect()
}

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform from `lo` to `hi`.
    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        lo + (hi - lo) * unit
    }

    fn chance(&mut self, share: f64) -> bool {
        self.between(0.0, 1.0) < share
    }

    /// A coefficient of any size from 1e-4 to 10, or zero.
    fn coefficient(&mut self) -> f64 {
        if self.chance(0.4) {
            return 0.0;
        }
        let size = 10f64.powf(self.between(-4.0, 1.0));
        if self.chance(0.5) { size } else { -size }
    }

    fn model(&mut self) -> ReducedModel {
        let mut texts: Vec<String> = TERMS.split("; ").map(str::to_owned).collect();
        texts.retain(|_| self.chance(0.6));
        texts.push("3*dz1".to_owned());
        let library = Library::from_terms(2, &texts).expect("terms parse");
        let mut phase = |name: &str, feet| Phase {
            name: name.to_owned(),
            feet,
            xi: DMatrix::from_fn(texts.len(), 2, |_, _| self.coefficient()),
        };
        let phases = vec![
            phase("contact", FeetRule::Any),
            phase("flight", FeetRule::None),
        ];
        let builder = ReducedModel::builder("random", library);
        builder.phases(phases).build().expect("a model")
    }

    fn domain(&mut self, model: &ReducedModel) -> Domain {
        let boxes = (0..2).map(|_| {
            let ranges = (0..6).map(|_| {
                let centre = self.between(-0.6, 0.6);
                let half = 10f64.powf(self.between(-2.5, 0.0));
                Interval::new(centre - half, centre + half)
            });
            Some(ranges.collect())
        });
        let boxes = boxes.collect();
        Domain::new(model, boxes).expect("finite boxes")
    }

    /// A point of a box, often on its boundary.
    fn point(&mut self, ranges: &[Interval]) -> [DVector<f64>; 3] {
        let values: Vec<f64> = (ranges.iter())
            .map(|range| match self.between(0.0, 3.0) as usize {
                0 => range.lo(),
                1 => range.hi(),
                _ => self.between(range.lo(), range.hi()),
            })
            .collect();
        [0, 2, 4].map(|first| DVector::from_column_slice(&values[first..first + 2]))
    }
}

#[test]
fn no_point_of_a_random_box_is_off_by_more_than_certified() {
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    let mut tightest: f64 = 0.0;
    for seed in 0..CASES {
        let mut random = Random::new(seed);
        let model = random.model();
        let domain = random.domain(&model);
        let tolerance = 10f64.powf(random.between(-3.0, 0.5));
        let made = made_of(&model, &domain, tolerance);
        for (phase, certificate) in made.certificate.phases.iter().enumerate() {
            let ranges = ranges(&made, phase);
            for _ in 0..POINTS {
                let [z, dz, u] = random.point(&ranges);
                let before = model.ddz(phase, &z, &dz, &u).expect("dimensions fit");
                let after = made.model.ddz(phase, &z, &dz, &u).expect("dimensions fit");
                for equation in &certificate.equations {
                    let (full, simple) = (before[equation.output], after[equation.output]);
                    if full.is_nan() {
                        continue;
                    }
                    let error = full - simple;
                    // some thirty summands of at most 100 were rounded
                    let slack = 1e-12;
                    let enclosures = [equation.bound, equation.sum_of_bounds];
                    for bound in enclosures {
                        assert!(
                            bound.lo() - slack <= error && error <= bound.hi() + slack,
                            "seed {seed}, phase {phase}: {error:e} not in {bound}"
                        );
                    }
                    if equation.bound.magnitude() > 1e-6 {
                        tightest = tightest.max(error.abs() / equation.bound.magnitude());
                    }
                }
            }
            for equation in &certificate.equations {
                assert!(equation.bound.magnitude() <= tolerance, "seed {seed}");
                for change in &equation.changes {
                    let kind = json!(change)["kind"].to_string();
                    *kinds.entry(kind).or_default() += 1;
                }
            }
        }
    }
    assert!(
        kinds.len() == 4 && kinds.values().all(|&count| count > 10),
        "changes of each kind: {kinds:?}"
    );
    assert!(tightest > 0.9, "no bound was nearly reached: {tightest}");
}

#[test]
fn changes_of_the_certificate_replayed_give_the_simplified_coefficients() {
    for seed in 0..CASES {
        let mut random = Random::new(seed);
        let model = random.model();
        let domain = random.domain(&model);
        let tolerance = Tolerance::Absolute(10f64.powf(random.between(-3.0, 0.0)));
        let made =
            simplify(&Equations::as_learned(&model), &domain, None, tolerance).expect("certified");
        for (phase, certificate) in made.certificate.phases.iter().enumerate() {
            for equation in &certificate.equations {
                let coefficients = |model: &ReducedModel| -> BTreeMap<String, f64> {
                    terms_of(model, phase, equation.output)
                        .into_iter()
                        .collect()
                };
                let mut replayed = coefficients(&model);
                for change in &equation.changes {
                    for effect in change.coefficients() {
                        let term = &effect.term;
                        let now = replayed.insert(term.clone(), effect.after).unwrap_or(0.0);
                        assert_eq!(now, effect.before, "seed {seed}: {term}");
                    }
                }
                replayed.retain(|_, xi| *xi != 0.0);
                assert_eq!(replayed, coefficients(&made.model), "seed {seed}");
                assert_eq!(equation.terms.after, replayed.len());
            }
        }
    }
}

#[test]
fn simplification_is_deterministic_and_zero_tolerance_changes_nothing() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let model = random.model();
        let domain = random.domain(&model);
        let run = |tolerance| {
            simplify(&Equations::as_learned(&model), &domain, None, tolerance).expect("certified")
        };
        let tolerance = Tolerance::Absolute(0.05);
        assert_eq!(run(tolerance), run(tolerance));
        for zero in [Tolerance::Absolute(0.0), Tolerance::ShareOfRms(0.0)] {
            let kept = run(zero);
            assert_eq!(kept.model, model);
            assert_eq!(kept.certificate.n_changes(), 0);
        }
    }
}

/// One equation `ddz1 = sum xi_j theta_j` in a single phase, written `0.5 z1; -2 sin(z1)`.
fn single(sum: &str) -> ReducedModel {
    let terms = sum.split("; ").map(|part| part.split_once(' '));
    let terms = terms.map(|term| term.expect("coefficient and term"));
    let (coefficients, texts): (Vec<&str>, Vec<String>) =
        terms.map(|(xi, text)| (xi, text.to_owned())).unzip();
    let xi = |row: usize, _| coefficients[row].parse::<f64>().expect("a number");
    let phase = Phase {
        name: "contact".to_owned(),
        feet: FeetRule::Any,
        xi: DMatrix::from_fn(texts.len(), 1, xi),
    };
    let library = Library::from_terms(1, &texts).expect("terms parse");
    let builder = ReducedModel::builder("single", library);
    builder.phase(phase).build().expect("a model")
}

fn simplified(sum: &str, ranges: [(f64, f64); 3], tolerance: f64) -> Simplified {
    let model = single(sum);
    made_of(&model, &boxed(&model, ranges), tolerance)
}

/// The remaining equation, in the form of [`single`].
fn left(model: &ReducedModel) -> String {
    let terms = terms_of(model, 0, 0).into_iter();
    let terms: Vec<String> = terms.map(|(text, xi)| format!("{xi} {text}")).collect();
    terms.join("; ")
}

const UNIT: (f64, f64) = (-1.0, 1.0);

#[test]
fn sign_that_is_constant_on_the_domain_is_certified() {
    let sum = "0.9 z1*sign(z1); 1 sign(z1)";
    let narrow = [(-50.0, -49.99), (-1.0, 1.0), (-1.0, 1.0)];
    for tolerance in [1e-4, 1e-2, 1e-9] {
        let found = simplified(sum, narrow, tolerance);
        let equation = &found.certificate.phases[0].equations[0];
        assert!(equation.bound.magnitude() <= tolerance, "{equation:?}");
    }
    let shorter = left(&simplified(sum, narrow, 1e-4).model);
    assert!(
        !shorter.contains("abs") && !shorter.contains("sign"),
        "{shorter}"
    );
}

#[test]
fn near_linear_sine_becomes_its_argument_in_a_library_that_gains_the_term() {
    let made = simplified("-10 sin(z1); 1 u1", [(-0.1, 0.1), UNIT, UNIT], 0.01);
    let terms = terms_of(&made.model, 0, 0);
    assert_eq!(terms[1].0, "z1", "{terms:?}");
    assert_eq!(terms.len(), 2);
    assert!((terms[1].1 + 10.0).abs() < 0.1, "{terms:?}");
    let change = &made.certificate.phases[0].equations[0].changes[0];
    let change = json!(change);
    assert_eq!(
        (&change["kind"], &change["term"]),
        (&json!("linear"), &json!("sin(z1)"))
    );
}

#[test]
fn model_simplified_twice_keeps_the_first_bounds_in_its_provenance() {
    let once = simplified("1.234 z1; 2 u1", [UNIT; 3], 0.01).model;
    let twice = made_of(&once, &boxed(&once, [UNIT; 3]), 0.1);
    assert_eq!(left(&twice.model), "1.2 z1; 2 u1");
    let first = &once.provenance()["simplification"];
    assert_eq!(first["earlier"], serde_json::Value::Null);
    assert_eq!(
        &twice.model.provenance()["simplification"]["earlier"],
        first
    );
}

#[test]
fn term_off_centre_leaves_its_middle_in_the_constant() {
    let made = simplified("5 1; 1 z1", [(2.9, 3.1), UNIT, UNIT], 0.15);
    assert_eq!(left(&made.model), "8 1");
    let bound = made.certificate.phases[0].equations[0].bound;
    assert!(
        bound.magnitude() >= 0.1 - 1e-15 && bound.magnitude() < 0.1001,
        "{bound}"
    );
}

#[test]
fn term_without_finite_values_on_the_domain_is_never_touched() {
    let kept = "0.000000001 1/z1; 0.1234567 log(z1); 0.1 log(z1 - 2)";
    let made = simplified(&format!("{kept}; 0.001 u1"), [UNIT, UNIT, UNIT], 1.0);
    assert_eq!(left(&made.model), kept);
}

#[test]
fn rounding_spends_the_tolerance_where_it_saves_most_digits() {
    let sum = "3.2358 z1; 2.7137 dz1; 1.4137 u1";
    let made = simplified(sum, [UNIT, (-0.1, 0.1), UNIT], 0.06);
    let equation = &made.certificate.phases[0].equations[0];
    // 0.0137 for 1.4, 0.0286 for 3 and 0.0042 for 3.24 use up the tolerance; 3.2 would cost another 0.0358
    assert_eq!(left(&made.model), "3.24 z1; 3 dz1; 1.4 u1");
    assert_eq!(equation.digits.after, 6);
    assert!(equation.bound.magnitude() <= 0.06);
}

#[test]
fn bound_of_dropped_independent_terms_is_reached_at_a_corner() {
    let sum = "0.3 z1; -0.2 dz1; 7 u1";
    let made = simplified(sum, [(-1.0, 2.0), (-3.0, 1.0), UNIT], 2.0);
    let equation = &made.certificate.phases[0].equations[0];
    assert_eq!(left(&made.model), "7 u1");
    let lost = [LatentVariable::Z(0), LatentVariable::Dz(0)];
    assert_eq!(made.certificate.phases[0].lost, lost);
    // 0.3 * 2 + 0.2 * 3
    let bound = equation.bound;
    assert!((bound.hi() - 1.2).abs() < 1e-12, "{bound}");
    assert!((bound.lo() + 0.5).abs() < 1e-12, "{bound}");
}

#[test]
fn bound_of_dropped_terms_that_share_variables_is_sharper_than_their_sum() {
    let sum = "0.3 z1; -0.3 sin(z1); 0.2 z1*dz1; -0.7 dz1*cos(z1); 0.1 z1^2*dz1; 0.4 dz1^2; -0.9 cos(z1*dz1)";
    let made = simplified(sum, [(-1.0, 2.0), (-1.0, 2.0), UNIT], 100.0);
    let equation = &made.certificate.phases[0].equations[0];
    let (together, apart) = (equation.bound, equation.sum_of_bounds);
    assert_eq!(left(&made.model), "");
    assert!(apart.lo() < together.lo() && together.hi() < apart.hi());
    for (x, y) in [
        (-1.0, -1.0),
        (2.0, 2.0),
        (-1.0, 2.0),
        (2.0, -1.0),
        (0.7, 1.3),
    ] {
        let (sin, cos) = (f64::sin(x), f64::cos(x));
        let lines = 0.3 * x - 0.3 * sin + 0.2 * x * y - 0.7 * y * cos;
        let value = lines + 0.1 * x * x * y + 0.4 * y * y - 0.9 * (x * y).cos();
        assert!(together.contains(value), "{together} {value}");
    }
}

#[test]
fn domain_around_samples_has_their_extremes_and_margin() {
    let model = single("1 z1");
    let points = [1.0, 0.0, -1.0, 3.0, 0.0, 1.0, 2.0, 0.0, 0.0];
    let samples = Samples {
        phases: vec![DMatrix::from_column_slice(3, 3, &points)],
    };
    let domain = Domain::around(&model, &samples, 0.1).expect("a box");
    let ranges = ranges(&made_of(&model, &domain, 0.0), 0);
    assert_eq!((ranges[0].lo(), ranges[0].hi()), (0.8, 3.2));
    assert_eq!((ranges[1].lo(), ranges[1].hi()), (0.0, 0.0));
    let (equations, share) = (Equations::of(&model), Tolerance::ShareOfRms(0.01));
    let made = simplify(&equations, &domain, Some(&samples), share).expect("certified");
    let equation = &made.certificate.phases[0].equations[0];
    assert_eq!(equation.rms, Some((14.0f64 / 3.0).sqrt()));
    let wrong = Domain::around(&model, &Samples { phases: Vec::new() }, 0.1);
    let wrong = wrong.unwrap_err().to_string();
    assert_eq!(
        wrong,
        "the domain has 0 boxes, expected one for each of 1 phases"
    );
    let infinite = Interval::new(0.0, f64::INFINITY);
    let wrong = Domain::new(&model, vec![Some(vec![infinite; 3])]);
    assert!(matches!(wrong, Err(SimplifyError::Domain(_))));
    let refused = simplify(&equations, &domain, None, share);
    assert!(matches!(refused, Err(SimplifyError::NoSamples)));
}

#[test]
fn domain_file_needs_every_variable_and_no_other() {
    let model = single("1 z1");
    let read = |text: &str| Domain::from_toml(&model, std::path::Path::new("box.toml"), text);
    let whole = "[contact]\nz1 = [-1.0, 1.0]\ndz1 = [0, 2]\nu1 = [-3.5, 4]\n";
    let domain = read(whole).expect("complete");
    let made = made_of(&model, &domain, 0.0);
    let last = made.certificate.phases[0]
        .domain
        .as_ref()
        .expect("given")
        .last();
    assert_eq!(last, Some(&("u1".to_owned(), Interval::new(-3.5, 4.0))));
    for (text, told) in [
        ("[contact]\nz1 = [0, 1]\n", "no range of `dz1`"),
        (&format!("{whole}z2 = [0, 1]\n"), "range of `z2`"),
        (&format!("{whole}[flight]\n"), "[flight] is no phase"),
        (&whole.replace("[0, 2]", "[2, 0]"), "[contact] dz1 = [2, 0]"),
        (&whole.replace("[0, 2]", "[0, inf]"), "[0, inf]"),
        (&whole.replace("[0, 2]", "[nan, 1]"), "[NaN, 1]"),
        ("", "expected [contact]"),
    ] {
        let error = read(text).expect_err(text).to_string();
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn tolerance_reads_shares_and_numbers_and_prints_them_alike() {
    for (text, expected) in [
        ("1%", Tolerance::ShareOfRms(0.01)),
        ("0.3%", Tolerance::ShareOfRms(0.003)),
        ("0.05", Tolerance::Absolute(0.05)),
        ("0", Tolerance::Absolute(0.0)),
    ] {
        assert_eq!(text.parse(), Ok(expected));
        assert_eq!(expected.to_string(), text);
    }
    for text in ["", "%", "-1%", "nan", "inf", "1 percent"] {
        assert!(text.parse::<Tolerance>().is_err(), "{text}");
    }
}
