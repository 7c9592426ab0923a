//! A made-up robot model that is random but stable, and trajectories that it follows exactly.

use nalgebra::{DMatrix, DVector};
use romc::lower::CompiledModel;
use romc::model::{AffineMap, FeetRule, InputStatistics, Library, Phase, ReducedModel, Scaling};
use romc::mpc::ReferenceSamples;
use romc::robot::ContactFlags;

use crate::random::Random;

pub const D: usize = 3;
pub const STAND: [f64; 18] = [
    0.0, 0.8, -1.6, 0.0, 0.8, -1.6, 0.0, 0.8, -1.6, 0.0, 0.8, -1.6, // joints
    0.0, 0.0, 0.3, 0.0, 0.0, 0.0, // body
];
const SCALE: f64 = 0.1;

/// Whether the latent equations have a sine in them.
#[derive(Clone, Copy, PartialEq)]
pub enum Equations {
    Linear,
    Nonlinear,
}

/// Three latents over the coordinates that move in a jump, contact and flight.
pub fn model(equations: Equations) -> ReducedModel {
    model_with(equations, statistics(4.0, 30.0))
}

/// The same with other inputs in contact.
pub fn model_with(equations: Equations, contact_inputs: InputStatistics) -> ReducedModel {
    let mut random = Random::new(20);
    let weights = DMatrix::from_fn(D, 18, |_, col| match col {
        0 | 3 | 6 | 9 | 13 | 15 | 17 => 0.0,
        _ => random.signed(),
    });
    let stand = DVector::from_column_slice(&STAND) * SCALE;
    let bias = -(&weights * &stand);
    let pseudo_inverse = weights.clone().pseudo_inverse(1e-9).expect("full rank");
    let names: Vec<String> = ["1"]
        .into_iter()
        .map(str::to_owned)
        .chain((1..=D).map(|i| format!("z{i}")))
        .chain((1..=D).map(|i| format!("dz{i}")))
        .chain((1..=D).map(|i| format!("sin(3*z{i})")))
        .chain((1..=D).map(|i| format!("u{i}")))
        .collect();
    let library = Library::from_terms(D, &names).expect("terms parse");
    let mut phase = |name: &str, feet, gain: f64| {
        let xi = DMatrix::from_fn(names.len(), D, |term, latent| match term {
            0 => 0.02 * random.signed(),
            t if t <= D => {
                if t - 1 == latent {
                    -30.0
                } else {
                    4.0 * random.signed()
                }
            }
            t if t <= 2 * D => {
                if t - 1 - D == latent {
                    -4.0
                } else {
                    0.5 * random.signed()
                }
            }
            t if t <= 3 * D => match equations {
                Equations::Linear => 0.0,
                Equations::Nonlinear => 2.0 * random.signed(),
            },
            t => {
                gain * (if t - 1 - 3 * D == latent {
                    1.0
                } else {
                    0.2 * random.signed()
                })
            }
        });
        Phase {
            name: name.to_owned(),
            feet,
            xi,
        }
    };
    let (contact, flight) = (
        phase("contact", FeetRule::Any, 1.0),
        phase("flight", FeetRule::None, 0.3),
    );
    ReducedModel::builder("synthetic", library)
        .phases(vec![contact, flight])
        .scaling(Scaling::uniform(SCALE))
        .encoder(AffineMap::new("encoder", weights, bias).expect("shapes fit"))
        .decoder(AffineMap::new("decoder", pseudo_inverse, stand).expect("shapes fit"))
        .input_statistics("contact", contact_inputs)
        .input_statistics("flight", statistics(2.0, 0.0))
        .robot(romc::robot_file::by_name("go1").expect("known robot"))
        .sample_time_s(0.002)
        .build()
        .expect("a valid model")
}

fn statistics(torque_nm: f64, force_n: f64) -> InputStatistics {
    InputStatistics {
        mean: DVector::zeros(18),
        covariance: DMatrix::from_fn(18, 18, |row, col| match (row == col, row < 12) {
            (false, _) => 0.0,
            (true, true) => torque_nm * torque_nm,
            (true, false) => force_n * force_n,
        }),
        given_state: None,
    }
}

/// A trajectory as its user has it.
pub struct Trajectory {
    pub time_s: Vec<f64>,
    pub x: Vec<f64>,
    pub dx: Vec<f64>,
    pub u: Vec<f64>,
    pub feet: Vec<ContactFlags>,
}

impl Trajectory {
    pub fn samples(&self) -> ReferenceSamples<'_> {
        ReferenceSamples {
            u: Some(&self.u),
            ..self.without_input()
        }
    }

    pub fn without_input(&self) -> ReferenceSamples<'_> {
        ReferenceSamples {
            time_s: &self.time_s,
            x: &self.x,
            dx: &self.dx,
            u: None,
            feet: &self.feet,
        }
    }

    pub fn state(&self, sample: usize) -> ([f64; 18], [f64; 18]) {
        let row = |values: &[f64]| std::array::from_fn(|i| values[sample * 18 + i]);
        (row(&self.x), row(&self.dx))
    }
}

/// State of the robot for a latent state, SI.
pub fn decoded(model: &ReducedModel, z: &[f64], dz: &[f64]) -> ([f64; 18], [f64; 18]) {
    let x = model
        .decode(&DVector::from_column_slice(z))
        .expect("has a decoder");
    let jacobian = model.decoder_jacobian(&DVector::from_column_slice(z));
    let dx = jacobian.expect("has a decoder") * DVector::from_column_slice(dz);
    (
        std::array::from_fn(|i| x[i]),
        std::array::from_fn(|i| dx[i]),
    )
}

/// 0.8 s at 2 ms driven by smooth inputs held for 10 ms, in flight from 0.4 s to 0.5 s.
pub fn trajectory(model: &ReducedModel) -> Trajectory {
    let mut dynamics = CompiledModel::new(model).expect("lowers");
    let lift = model
        .tangent(&DVector::zeros(18))
        .expect("has an encoder")
        .lift;
    let (mut z, mut dz) = ([0.0; D], [0.0; D]);
    let mut out = Trajectory {
        time_s: Vec::new(),
        x: Vec::new(),
        dx: Vec::new(),
        u: Vec::new(),
        feet: Vec::new(),
    };
    for sample in 0..=400 {
        let time_s = 0.002 * sample as f64;
        let held_s = 0.01 * (sample / 5) as f64;
        let feet = [!(200..250).contains(&sample); 4];
        let u_lat: [f64; D] =
            std::array::from_fn(|i| 0.3 * (held_s * (8.0 + 3.0 * i as f64) + i as f64).sin());
        let (x, dx) = decoded(model, &z, &dz);
        out.time_s.push(time_s);
        out.x.extend(x);
        out.dx.extend(dx);
        out.u
            .extend((&lift * DVector::from_column_slice(&u_lat)).iter());
        out.feet.push(feet);
        let phase = model.phase_for(feet).expect("has both phases");
        dynamics.rk4_step(phase, &mut z, &mut dz, &u_lat, 0.002);
    }
    out
}

/// The usual settings without a supervisor: a synthetic model is no robot that falls and stands.
pub fn unwatched() -> romc::mpc::MpcSettings {
    romc::mpc::MpcSettings {
        bounds: romc::mpc::Bounds::OFF,
        ..Default::default()
    }
}
