//! The generated functions of a model, and their results by the interpreter.

use romc::equations::Equations;
use romc::ir::{Interpreter, Program};
use romc::lower::{self, Form, JacobianPattern, Map};
use romc::model::{ModelError, ReducedModel, StateMap};

/// A generated function: its name after the model's name, and the program it must equal.
pub struct Function {
    pub model: String,
    pub name: String,
    pub program: Program,
    pub kind: Kind,
    /// Number of points at which it is compared.
    pub n_points: usize,
}

/// Kind of a function; phases by their index in the model.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A map whose outputs are sums of weights times inputs.
    Affine,
    /// A map through nonlinear layers.
    Curved,
    /// Generalised inputs from torques and contacts, and torques from them.
    Wrench,
    Dynamics(usize),
    Jacobian(usize, JacobianPattern),
    Step(usize),
    /// As [`Kind::Dynamics`], all points in one call.
    Batch(usize),
}

/// Points of a batch: blocks of eight and a rest.
const BATCH_POINTS: usize = 21;

impl Function {
    pub fn is_step(&self) -> bool {
        matches!(self.kind, Kind::Step(_))
    }

    pub fn is_batch(&self) -> bool {
        matches!(self.kind, Kind::Batch(_))
    }

    /// Count of inputs, all slots in sequence.
    pub fn input_len(&self) -> usize {
        self.program.inputs.iter().map(|slot| slot.len).sum()
    }

    /// Count of outputs, all slots in sequence.
    pub fn output_len(&self) -> usize {
        self.program.outputs.iter().map(|slot| slot.len).sum()
    }

    /// Random points, one after the other.
    pub fn points(&self, random: &mut Random) -> Vec<f64> {
        let mut points = Vec::with_capacity(self.n_points * self.input_len());
        for _ in 0..self.n_points {
            for slot in &self.program.inputs {
                for k in 0..slot.len {
                    points.push(match (slot.name.as_str(), k % 3) {
                        ("h", _) => random.between(1e-4, 1e-2),
                        ("feet", _) => random.below(2) as f64,
                        // Slow joints, where dry friction changes sign; bent knees.
                        ("dx", 0) => random.between(-0.1, 0.1),
                        ("x", 1) if self.kind == Kind::Wrench => random.between(0.0, 1.2),
                        ("x", 2) if self.kind == Kind::Wrench => random.between(-2.2, -1.0),
                        ("x", 0) if self.kind == Kind::Wrench => random.between(-0.8, 0.8),
                        _ => random.between(-2.0, 2.0),
                    });
                }
            }
        }
        points
    }

    /// The interpreter's results at the points.
    pub fn interpret(&self, points: &[f64]) -> Vec<f64> {
        let mut interpreter = Interpreter::new(&self.program);
        let mut results = Vec::with_capacity(self.n_points * self.output_len());
        for point in points.chunks(self.input_len()) {
            let mut outputs: Vec<Vec<f64>> = self
                .program
                .outputs
                .iter()
                .map(|slot| vec![f64::NAN; slot.len])
                .collect();
            let mut rest = point;
            let mut inputs = Vec::new();
            for slot in &self.program.inputs {
                let (these, others) = rest.split_at(slot.len);
                inputs.push(these);
                rest = others;
            }
            let mut written: Vec<&mut [f64]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
            interpreter.run(&inputs, &mut written);
            results.extend(outputs.into_iter().flatten());
        }
        results
    }
}

/// All functions generated for a model.
pub fn functions(model: &ReducedModel, n_points: usize, form: Form) -> Vec<Function> {
    let name = model.identifier().as_str();
    let function = |name_of: String, program: Program, kind: Kind, n_points: usize| Function {
        model: name.to_owned(),
        name: name_of,
        program,
        kind,
        n_points,
    };
    let mut list = Vec::new();
    let kind_of = |map: Result<&StateMap, ModelError>| match map {
        Ok(map) if map.as_affine().is_none() => Kind::Curved,
        Ok(_) | Err(_) => Kind::Affine,
    };
    let (encoder, decoder) = (kind_of(model.encoder_map()), kind_of(model.decoder_map()));
    for map in Map::ALL {
        let kind = match map {
            Map::Decode | Map::DecodeVelocity => &decoder,
            Map::Encode | Map::EncodeVelocity | Map::ProjectInput | Map::LiftInput => &encoder,
        };
        if let Ok(program) = map.lower(model) {
            let name = program.name.clone();
            list.push(function(name, program, kind.clone(), n_points.min(100)));
        }
    }
    let of_robot = [
        lower::generalised_input(model),
        lower::actuator_torque(model),
    ];
    for program in of_robot {
        if let Some(program) = program.expect("lowers") {
            let name = program.name.clone();
            list.push(function(name, program, Kind::Wrench, n_points.min(100)));
        }
    }
    for phase in 0..model.phases().len() {
        let phase_name = model.phase_identifier(phase);
        let named = |what: &str| format!("{phase_name}_{what}");
        let program = lower::dynamics(&Equations::of(model), phase, form).expect("lowers");
        let batch = (named("dynamics_batch"), program.clone());
        list.push(function(
            named("dynamics"),
            program,
            Kind::Dynamics(phase),
            n_points,
        ));
        list.push(function(batch.0, batch.1, Kind::Batch(phase), BATCH_POINTS));
        let (program, pattern) =
            lower::dynamics_jacobian(&Equations::of(model), phase, form).expect("lowers");
        let kind = Kind::Jacobian(phase, pattern);
        list.push(function(
            named("dynamics_jacobian"),
            program,
            kind,
            n_points,
        ));
        let program = lower::rk4_step(&Equations::of(model), phase, form).expect("lowers");
        list.push(function(
            named("step"),
            program,
            Kind::Step(phase),
            n_points.min(200),
        ));
    }
    list
}

/// A small, fixed generator: every run compares the same points.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}
