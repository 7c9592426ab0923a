//! Input and output vectors for self-tests of generated code, from the interpreter, at finite results where possible.

use super::*;
use crate::robot::{JOINT_DIM, LEG_JOINT_DIM};
use crate::typeset::rounded_up;

pub(crate) const N_POINTS: usize = 6;

/// Largest accepted difference, relative to one plus the largest magnitude of the expected vector: room for another
/// mathematics library and for fused operations, none for a wrong coefficient.
pub(crate) const TOLERANCE_F64: f64 = 1e-11;

/// Accepted share of one plus the largest value of an output in single precision.
const TOLERANCE_F32: f64 = 1e-4;

/// Accepted multiple of the interpreter's own error in single precision: other libraries and fused operations differ.
const ERROR_MARGIN: f64 = 16.0;

/// Points of the batch that self-tests run, which are those of single calls again and again.
pub(crate) const N_BATCH: usize = 21;

pub(crate) struct FunctionVectors<'a> {
    pub name: &'a str,
    pub parameters: Vec<ParameterVectors<'a>>,
    pub is_defined: bool,
    pub has_batch: bool,
}

impl FunctionVectors<'_> {
    pub(crate) fn arguments(&self, spell: impl Fn(&ParameterVectors<'_>) -> String) -> String {
        let arguments: Vec<String> = self.parameters.iter().map(spell).collect();
        arguments.join(", ")
    }
}

/// A row per point before the call, none for outputs; a row per point expected after it, none for inputs.
pub(crate) struct ParameterVectors<'a> {
    pub role: Role,
    pub name: &'a str,
    pub len: usize,
    pub before: Vec<Vec<f64>>,
    pub after: Vec<Vec<f64>>,
    tolerances: Vec<String>,
}

impl ParameterVectors<'_> {
    pub(crate) fn is_written(&self) -> bool {
        matches!(self.role, Role::Output | Role::InOut)
    }

    /// The tolerances of the points as a list, if they differ.
    pub(crate) fn differing_tolerances(&self) -> Option<String> {
        let differs = self.tolerances.windows(2).any(|pair| pair[0] != pair[1]);
        differs.then(|| self.tolerances.join(", "))
    }

    /// The tolerance of `point`: a number, or an element of the list, which is named after the parameter.
    pub(crate) fn tolerance(&self) -> String {
        match self.differing_tolerances() {
            None => self.tolerances[0].clone(),
            Some(_) => format!("{}_tolerance[point % {N_POINTS}]", self.name),
        }
    }
}

/// The bound of a self-test: relative in double precision, the given one rounded up to two digits in single.
fn spelled(bound: f64, precision: Precision) -> String {
    match precision {
        Precision::Double => format!("{TOLERANCE_F64:?}"),
        Precision::Single => format!("{:.1e}", rounded_up(bound, 2)),
    }
}

pub(crate) fn all(entries: &ModelInterface, precision: Precision) -> Vec<FunctionVectors<'_>> {
    let vectors = entries.all().map(|entry| {
        let mut phases = entries.phases.iter();
        let has_batch = phases.any(|phase| std::ptr::eq(&phase.dynamics, entry));
        vectors(entry, has_batch, precision)
    });
    vectors.collect()
}

/// The vectors of all parameters, in numbers of the precision, at points with finite results if such are found.
/// Functions of the state run last at rest, those with batches first at an angle beyond the limit of the inline sine.
fn vectors(entry: &FunctionSpec, has_batch: bool, precision: Precision) -> FunctionVectors<'_> {
    let mut random = Random::new();
    let points = (0..N_POINTS).map(|position| {
        let point = point(entry, precision, &mut random);
        match N_POINTS - position {
            N_POINTS if has_batch => point.far_away(entry, precision),
            1 => point.at_rest(entry, precision, &["z", "dz", "u_lat"]),
            2 => point.at_rest(entry, precision, &["dz", "u_lat"]),
            _ => point,
        }
    });
    let points: Vec<_> = points.collect();
    let accepted = points.iter();
    let accepted = accepted.map(|p| tolerances(entry, precision, &p.inputs, &p.outputs));
    let accepted: Vec<Vec<f64>> = accepted.collect();
    let place = |slots: &[Slot], name: &str| slots.iter().position(|slot| slot.name == name);
    let parameters = entry.parameters.iter().map(|parameter| {
        let read = place(&entry.program.inputs, &parameter.name);
        let written = place(&entry.program.outputs, &parameter.name);
        let before = read.map(|slot| points.iter().map(|p| p.inputs[slot].clone()).collect());
        let after = written.map(|slot| points.iter().map(|p| p.outputs[slot].clone()).collect());
        let tolerance =
            |point: &Vec<f64>| spelled(written.map_or(0.0, |slot| point[slot]), precision);
        ParameterVectors {
            role: parameter.role,
            name: &parameter.name,
            len: parameter.len,
            before: before.unwrap_or_default(),
            after: after.unwrap_or_default(),
            tolerances: accepted.iter().map(tolerance).collect(),
        }
    });
    FunctionVectors {
        name: &entry.name,
        parameters: parameters.collect(),
        is_defined: points.iter().any(TestPoint::is_defined),
        has_batch,
    }
}

/// Largest accepted difference of each output in single precision. It is a share of one plus its largest value, or a
/// multiple of the interpreter's own error there, which is larger where terms cancel. Zero in double precision.
fn tolerances(
    entry: &FunctionSpec,
    precision: Precision,
    inputs: &[Vec<f64>],
    outputs: &[Vec<f64>],
) -> Vec<f64> {
    if precision == Precision::Double {
        return vec![0.0; outputs.len()];
    }
    let nearest = |slot: &Vec<f64>| slot.iter().map(|&x| x as f32).collect();
    let inputs: Vec<Vec<f32>> = inputs.iter().map(nearest).collect();
    let single = Interpreter::<f32>::new(&entry.program).results(&inputs);
    let of_output = |(single, exact): (Vec<f32>, &Vec<f64>)| {
        let held = exact.iter().filter(|value| precision.holds(**value));
        let largest = held.fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let pairs = single.iter().zip(exact);
        let errors = pairs.map(|(single, exact)| (f64::from(*single) - exact).abs());
        let error = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        (TOLERANCE_F32 * (1.0 + largest)).max(ERROR_MARGIN * error)
    };
    single.into_iter().zip(outputs).map(of_output).collect()
}

const MAX_CHANGES: usize = 600;

const REACHES: [f64; 6] = [1.0, 3.0, 0.3, 10.0, 0.1, 0.01];

struct TestPoint {
    pub inputs: Vec<Vec<f64>>,
    pub outputs: Vec<Vec<f64>>,
    undefined: usize,
}

impl TestPoint {
    fn new(entry: &FunctionSpec, inputs: Vec<Vec<f64>>, precision: Precision) -> Self {
        let outputs = Interpreter::new(&entry.program).results(&inputs);
        let values = outputs.iter().flatten();
        Self {
            undefined: values.filter(|value| !precision.holds(**value)).count(),
            inputs,
            outputs,
        }
    }

    /// The point with some arrays at zero, if the function of the state has kinks and finite results there: a robot at
    /// rest. A NaN slope there with accelerations that are numbers counts as zero: the test fails.
    fn at_rest(self, entry: &FunctionSpec, precision: Precision, zero: &[&str]) -> Self {
        let is_of_state = entry.program.inputs.iter().any(|slot| slot.name == "dz");
        if !is_of_state || !entry.program.has(has_kink) {
            return self;
        }
        let mut inputs = self.inputs.clone();
        for (slot, values) in entry.program.inputs.iter().zip(&mut inputs) {
            if zero.contains(&slot.name.as_str()) {
                values.fill(0.0);
            }
        }
        let mut point = Self::new(entry, inputs, precision);
        if let [values, slopes] = &mut point.outputs[..]
            && values.iter().all(|value| value.is_finite())
        {
            let lost = slopes.iter_mut().filter(|slope| slope.is_nan());
            lost.for_each(|slope| *slope = 0.0);
        }
        let mut results = point.outputs.iter().flatten();
        match results.all(|value| precision.holds(*value)) {
            true => point,
            false => self,
        }
    }

    /// The point with far angles in place of the first coordinate and the last velocity, where nothing overflows there.
    fn far_away(self, entry: &FunctionSpec, precision: Precision) -> Self {
        let far = match precision {
            Precision::Double => 9000.125,
            Precision::Single => 160.125,
        };
        let mut inputs = self.inputs.clone();
        inputs[0][0] = far;
        inputs[1]
            .last_mut()
            .into_iter()
            .for_each(|rate| *rate = far);
        let point = Self::new(entry, inputs, precision);
        if point.is_defined() { point } else { self }
    }

    fn is_defined(&self) -> bool {
        self.undefined == 0
    }
}

fn has_kink(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::Unary(Unary::Sqrt | Unary::Abs | Unary::Sign, _)
            | Statement::Binary(Binary::Pow, ..)
            | Statement::Select(_)
    )
}

/// A point between -1 and 1. Where the function is not finite there, points around it are tried: all elements positive,
/// all drawn again, a few of the best point changed; the best is returned.
fn point(entry: &FunctionSpec, precision: Precision, random: &mut Random) -> TestPoint {
    let slots = entry.program.inputs.iter();
    let drawn = slots.map(|slot| match slot.name.as_str() {
        "h" => vec![precision.nearest(0.002)],
        name => (0..slot.len)
            .map(|k| precision.nearest(element(entry, name, k, random.next())))
            .collect(),
    });
    let mut best = TestPoint::new(entry, drawn.collect(), precision);
    let elements = free_elements(entry);
    for change in 0..MAX_CHANGES {
        if best.is_defined() || elements.is_empty() {
            break;
        }
        let reach = REACHES[change / 3 % REACHES.len()];
        let mut inputs = best.inputs.clone();
        let n_changed = match change % 3 {
            0 | 1 => elements.len(),
            _ => 1 + change % 4,
        };
        for position in 0..n_changed {
            let (slot, k) = match change % 3 {
                0 | 1 => elements[position],
                _ => elements[random.below(elements.len())],
            };
            let value = random.within(reach, precision);
            inputs[slot][k] = if change % 3 == 0 { value.abs() } else { value };
        }
        let changed = TestPoint::new(entry, inputs, precision);
        if changed.undefined <= best.undefined {
            best = changed;
        }
    }
    best
}

/// The elements of inputs that may be any number: slot and position.
fn free_elements(entry: &FunctionSpec) -> Vec<(usize, usize)> {
    let slots = entry.program.inputs.iter().enumerate();
    slots
        .filter(|(_, slot)| !matches!(slot.name.as_str(), "h" | "feet"))
        .flat_map(|(position, slot)| (0..slot.len).map(move |k| (position, k)))
        .collect()
}

/// Element `k` of an input from a number between -1 and 1: that number itself. For the function of the feet's forces,
/// knees are bent and feet are on the ground or in the air.
fn element(entry: &FunctionSpec, slot: &str, k: usize, random: f64) -> f64 {
    let has_feet = entry.parameters.iter().any(|p| p.name == "feet");
    match (slot, k % LEG_JOINT_DIM) {
        ("feet", _) => f64::from(u8::from(random > -0.4)),
        ("x", joint) if has_feet && k < JOINT_DIM => {
            let (middle, reach) = [(0.0, 0.4), (0.8, 0.4), (-1.6, 0.5)][joint];
            middle + reach * random
        }
        _ => random,
    }
}

/// Numbers between -1 and 1 with three decimals, the same in every run.
struct Random(u64);

impl Random {
    fn new() -> Self {
        Self(0x5eed)
    }

    fn next(&mut self) -> f64 {
        f64::from(self.bits() % 2001) / 1000.0 - 1.0
    }

    /// A short decimal up to a magnitude, never 0.
    fn within(&mut self, reach: f64, precision: Precision) -> f64 {
        precision.nearest((1e5 * reach * self.next()).round() / 1e5 + 5e-6)
    }

    fn below(&mut self, count: usize) -> usize {
        self.bits() as usize % count
    }

    fn bits(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32
    }
}
