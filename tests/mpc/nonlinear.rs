//! The controller of models whose encoder and decoder are not the same map at every state.

use nalgebra::{DMatrix, DVector};
use romc::model::{Activation, AffineMap, Layer, ReducedModel, StateMap};
use romc::mpc::{Lift, Measurement, MpcSettings, RowSelection};

use crate::random::Random;
use crate::synthetic::{D, Equations, STAND, Trajectory, model, trajectory, unwatched};

fn layer(weights: DMatrix<f64>, bias: DVector<f64>, activation: Activation) -> Layer {
    let map = AffineMap::new("layer", weights, bias).expect("shapes fit");
    Layer { map, activation }
}

fn with_maps(model: &ReducedModel, encoder: Vec<Layer>, decoder: Vec<Layer>) -> ReducedModel {
    let chain = |name: &str, layers| StateMap::new(name, layers).expect("layers fit");
    let builder = model.clone().into_builder();
    let builder = builder.encoder(chain("encoder", encoder));
    let builder = builder.decoder(chain("decoder", decoder));
    builder.build().expect("a valid model")
}

/// The same maps behind a layer of elu units that stay where elu is the identity.
fn disguised(linear: &ReducedModel) -> ReducedModel {
    let (encoder, decoder) = (
        linear.encoder().expect("linear"),
        linear.decoder().expect("linear"),
    );
    let far = DVector::from_element(D, 20.0);
    let identity = DMatrix::identity(D, D);
    with_maps(
        linear,
        vec![
            layer(
                encoder.weights().clone(),
                encoder.bias() + &far,
                Activation::Elu,
            ),
            layer(identity.clone(), -&far, Activation::Linear),
        ],
        vec![
            layer(identity, far.clone(), Activation::Elu),
            layer(
                decoder.weights().clone(),
                decoder.bias() - decoder.weights() * far,
                Activation::Linear,
            ),
        ],
    )
}

/// Layers of tanh units over the coordinates that the synthetic model moves.
fn curved(linear: &ReducedModel) -> ReducedModel {
    let mut random = Random::new(77);
    let stand = DVector::from_column_slice(&STAND) * 0.1;
    let first = DMatrix::from_fn(6, 18, |_, col| match col {
        0 | 3 | 6 | 9 | 13 | 15 | 17 => 0.0,
        _ => 60.0 * random.signed(),
    });
    let mut matrix =
        |rows, cols, scale: f64| DMatrix::from_fn(rows, cols, |_, _| scale * random.signed());
    let (second, third, fourth) = (matrix(D, 6, 0.05), matrix(6, D, 20.0), matrix(18, 6, 0.02));
    let at_stand = -(&first * &stand);
    with_maps(
        linear,
        vec![
            layer(first, at_stand, Activation::Tanh),
            layer(second, DVector::zeros(D), Activation::Linear),
        ],
        vec![
            layer(third, DVector::zeros(6), Activation::Tanh),
            layer(fourth, stand, Activation::Linear),
        ],
    )
}

fn step_along<'a>(
    trajectory: &'a Trajectory,
    every: usize,
) -> impl Iterator<Item = (usize, [f64; 18], [f64; 18])> + 'a {
    (0..300).step_by(every).map(|sample| {
        let (x, dx) = trajectory.state(sample);
        (sample, x, dx)
    })
}

#[test]
fn maps_that_are_linear_in_disguise_give_the_commands_of_the_linear_model() {
    let linear = model(Equations::Nonlinear);
    let hidden = disguised(&linear);
    let trajectory = trajectory(&linear);
    for lift in [Lift::Transpose, Lift::Consistent] {
        let settings = MpcSettings {
            rows: RowSelection::All,
            body_friction: Some(0.7),
            torque_rate_nm_s: Some(400.0),
            lift,
            ..unwatched()
        };
        let mut controllers = [&linear, &hidden].map(|model| {
            let mut controller = romc::mpc::controller(model, settings).expect("complete");
            let samples = trajectory.samples();
            controller
                .set_reference(samples)
                .expect("a sound reference");
            controller
        });
        for (sample, mut x, dx) in step_along(&trajectory, 25) {
            x[14] += 0.005; // off the reference, so that there is something to do
            let [expected, found] = controllers.each_mut().map(|controller| {
                controller.step(Measurement {
                    time_s: trajectory.time_s[sample],
                    x: &x,
                    dx: &dx,
                    feet: trajectory.feet[sample],
                })
            });
            assert_eq!(found.status, expected.status, "{lift:?} {sample}");
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
            assert!(
                near(&found.torque_nm, &expected.torque_nm),
                "{lift:?} {sample}"
            );
            assert!(near(&found.u_lat, &expected.u_lat), "{lift:?} {sample}");
            assert!(near(
                &found.joint_position_rad,
                &expected.joint_position_rad
            ));
            assert!(near(
                &found.joint_velocity_rad_s,
                &expected.joint_velocity_rad_s
            ));
        }
    }
}

#[test]
fn torques_are_lifted_at_the_measured_state_and_limited_at_the_reference_of_each_stage() {
    let model = curved(&model(Equations::Nonlinear));
    let mut trajectory = trajectory(&crate::synthetic::model(Equations::Nonlinear));
    // Inputs that no motor gives: the limits have something to do.
    trajectory.u.iter_mut().for_each(|u| *u *= 40.0);
    let mut controller = romc::mpc::controller(&model, unwatched()).expect("complete");
    controller
        .set_reference(trajectory.samples())
        .expect("a sound reference");
    let limits = *model.robot().expect("go1").torque_limit_nm();
    let (mut largest, mut elsewhere) = (0.0_f64, 0.0_f64);
    for (sample, x, dx) in step_along(&trajectory, 10) {
        let command = controller.step(Measurement {
            time_s: trajectory.time_s[sample],
            x: &x,
            dx: &dx,
            feet: trajectory.feet[sample],
        });
        assert!(command.status.has_plan(), "{sample}: {:?}", command.status);
        let u_lat = DVector::from_column_slice(&command.u_lat);
        let tangent = model.tangent(&DVector::from_column_slice(&x));
        let lifted = tangent.expect("has an encoder").lift * u_lat;
        for joint in 0..12 {
            let expected = lifted[joint].clamp(-limits[joint], limits[joint]);
            assert!((command.torque_nm[joint] - expected).abs() < 1e-9);
        }
        for stage in 0..10 {
            let input = DVector::from_column_slice(controller.plan().input(stage));
            let share = |at: usize| {
                let (x, _) = trajectory.state(at);
                let tangent = model.tangent(&DVector::from_column_slice(&x));
                let lifted = tangent.expect("has an encoder").lift * &input;
                (0..12).fold(0.0, |m: f64, j| m.max(lifted[j].abs() / limits[j]))
            };
            largest = largest.max(share(sample + 5 * stage));
            elsewhere = elsewhere.max(share(0));
        }
    }
    assert!((0.99..1.001).contains(&largest), "{largest}");
    assert!(elsewhere > 1.02, "the maps hardly bend: {elsewhere}");
}
