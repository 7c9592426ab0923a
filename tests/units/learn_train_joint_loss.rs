//! Of `src/learn/train/joint/loss.rs`.

use super::*;
use crate::model::{Activation, Library};
use crate::train::joint::unroll::Integrator;
use crate::train::random::Random;

const WEIGHTS: LossWeights = LossWeights {
    ddz: 0.7,
    ddx: 0.4,
    l1: 0.3,
    lift: 0.9,
    bptt: 0.8,
};

/// A library of every function, and random parameters with layers of `widths`.
fn setup(widths: (&[usize], &[usize]), phi: Activation) -> (Features, Parameters) {
    let terms = [
        "1",
        "z1",
        "dz2",
        "u3",
        "z1*dz1*u2",
        "sin(z1 + 2*z2)",
        "cos(dz1)*z2",
        "exp(-z1^2)",
        "tanh(u1)/(2 + z2^2)",
        "sqrt(2 + z1^2)",
        "abs(z2)",
        "log(3 + dz2^2)",
        "tan(0.1*z3)",
        "(2 + z1^2)^z2",
        "dz3^3",
    ];
    let library = Library::from_terms(3, &terms.map(String::from));
    let features = Features::new(&library.expect("terms parse"));
    let mut random = Random::new(11);
    let shape = (features.library_dim(), 2, 0.1);
    let mut parameters = Parameters::random(widths, phi, shape, &mut random);
    for entry in all(&mut parameters).into_iter().flatten() {
        *entry += 0.3 * random.signed();
    }
    (features, parameters)
}

fn all(parameters: &mut Parameters) -> Vec<&mut [f64]> {
    let maps = (parameters.encoder.blocks_mut()).chain(parameters.decoder.blocks_mut());
    maps.chain(parameters.xi.iter_mut().map(|xi| xi.as_mut_slice()))
        .collect()
}

#[test]
fn gradient_agrees_with_finite_differences_for_all_maps() {
    let mut random = Random::new(13);
    let spread = DVector::from_fn(7, |_, _| 1.0 + 0.4 * random.signed());
    let mut factors = spread.map(f64::recip);
    factors[4] = 0.0;
    let frame = Frame {
        mean: DVector::from_fn(7, |_, _| 0.3 * random.signed()),
        spread,
        factors,
        latent: 0.6,
    };
    let integrators = [Integrator::Rk2, Integrator::Rk4, Integrator::Euler];
    for (phi, integrator) in Activation::ALL
        .into_iter()
        .zip(integrators.into_iter().cycle())
    {
        if phi == Activation::Relu {
            continue; // its Jacobian jumps, and the loss on velocities with it
        }
        let widths: (&[usize], &[usize]) = match phi {
            Activation::Linear => (&[7, 3], &[3, 7]),
            _ => (&[7, 5, 4, 3], &[3, 4, 7]),
        };
        let (features, parameters) = setup(widths, phi);
        let blocks = std::array::from_fn(|_| random.matrix(10, 7, 0.8));
        let batch = Batch::new(1, blocks, 0.002, &frame);
        let weights = DVector::from_fn(7, |i, _| 1.0 + i as f64);
        let unroll = Unroll {
            window: 3,
            stride: 2,
            decay: 0.9,
            integrator,
        };
        let maps = (frame.clone(), weights);
        let mut loss = JointLoss::new(&features, maps, (WEIGHTS, unroll), &parameters);
        loss.evaluate(&parameters, &batch, Moved::All, None);
        let mut gradient = loss.gradient.clone();
        let masked = gradient.encoder.layers[0].weights.row(4).amax() == 0.0;
        assert!(gradient.xi[0].amax() == 0.0 && masked);
        let count = all(&mut gradient).len();
        for block in 0..count {
            for entry in 0..all(&mut gradient)[block].len() {
                let mut at = |step: f64| {
                    let mut moved = parameters.clone();
                    all(&mut moved)[block][entry] += step;
                    loss.evaluate(&moved, &batch, Moved::All, None)
                        .total(&WEIGHTS)
                };
                // Of fourth order: the losses are large, and a smaller step would drown in their rounding.
                let (near, far) = (at(1e-5) - at(-1e-5), at(2e-5) - at(-2e-5));
                let difference = (8.0 * near - far) / 12e-5;
                let exact = all(&mut gradient)[block][entry];
                assert!(
                    (difference - exact).abs() < 2e-6 * exact.abs().max(1.0),
                    "{phi} {block} {entry}: {difference} {exact}"
                );
            }
        }
    }
}
