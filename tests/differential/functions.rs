//! The generated functions of a model, as the interpreter knows them.

use romc::ir::{Interpreter, Program};
use romc::lower::{self, LowerOptions};
use romc::model::ReducedModel;

/// A generated function: its name after the model's, and the program it must equal.
pub struct Function {
    pub model: String,
    pub name: String,
    pub program: Program,
    /// Points at which it is compared.
    pub n_points: usize,
}

impl Function {
    pub fn is_step(&self) -> bool {
        self.program.inputs().iter().any(|slot| slot.name == "h")
    }

    /// Numbers that enter, all slots one after the other.
    pub fn input_len(&self) -> usize {
        self.program.inputs().iter().map(|slot| slot.len).sum()
    }

    /// Numbers that leave, all slots one after the other.
    pub fn output_len(&self) -> usize {
        self.program.outputs().iter().map(|slot| slot.len).sum()
    }

    /// Random points, one after the other.
    pub fn points(&self, random: &mut Random) -> Vec<f64> {
        let mut points = Vec::with_capacity(self.n_points * self.input_len());
        for _ in 0..self.n_points {
            for slot in self.program.inputs() {
                for _ in 0..slot.len {
                    points.push(match slot.name.as_str() {
                        "h" => random.between(1e-4, 1e-2),
                        _ => random.between(-2.0, 2.0),
                    });
                }
            }
        }
        points
    }

    /// What the interpreter makes of the points.
    pub fn interpret(&self, points: &[f64]) -> Vec<f64> {
        let mut interpreter = Interpreter::new(&self.program);
        let mut results = Vec::with_capacity(self.n_points * self.output_len());
        for point in points.chunks(self.input_len()) {
            let mut outputs: Vec<Vec<f64>> = self
                .program
                .outputs()
                .iter()
                .map(|slot| vec![f64::NAN; slot.len])
                .collect();
            let mut rest = point;
            let mut inputs = Vec::new();
            for slot in self.program.inputs() {
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

/// All functions that are generated for a model.
pub fn functions(model: &ReducedModel, n_points: usize, options: &LowerOptions) -> Vec<Function> {
    let name = model.identifier().as_str();
    let function = |name_of: String, program: Program, n_points: usize| Function {
        model: name.to_owned(),
        name: name_of,
        program,
        n_points,
    };
    let mut list = Vec::new();
    let maps = [
        lower::encode(model),
        lower::encode_velocity(model),
        lower::decode(model),
        lower::decode_velocity(model),
        lower::project_input(model),
        lower::lift_input(model),
    ];
    for program in maps.into_iter().flatten() {
        list.push(function(program.name().to_owned(), program, 100));
    }
    for phase in 0..model.phases().len() {
        let phase_name = model.phase_identifier(phase);
        let program = lower::dynamics(model, phase, options).expect("lowers");
        list.push(function(
            format!("{phase_name}_dynamics"),
            program,
            n_points,
        ));
        let (program, _) = lower::dynamics_jacobian(model, phase, options).expect("lowers");
        let name_of = format!("{phase_name}_dynamics_jacobian");
        list.push(function(name_of, program, n_points));
        let program = lower::rk4_step(model, phase, options).expect("lowers");
        list.push(function(format!("{phase_name}_step"), program, 200));
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
