//! Latent inputs to torques and back.

use nalgebra::{DMatrix, DVector, SVector, Vector3};
use romc::model::{InputStatistics, ReducedModel};
use romc::mpc::{ConsistentLift, ControlModel, LiftFailure, MpcSettings, StanceState};
use romc::robot::{Actuators, InputRule, Leg, Robot, WrenchFrame};

use crate::random::Random;
use crate::synthetic::{D, Equations, STAND, model, model_with, unwatched};

const FOOTING: StanceState = StanceState {
    joints_rad: [
        0.0, 0.8, -1.6, 0.0, 0.8, -1.6, 0.0, 0.8, -1.6, 0.0, 0.8, -1.6,
    ],
    attitude_rad: [0.0; 3],
    feet: [true; 4],
    phase: 0,
    losses_nm: [0.0; 12],
    near_nm: None,
    keeps_swing: false,
};

fn go1() -> &'static Robot {
    romc::robot_file::by_name("go1").expect("known robot")
}

/// Torques with which the standing legs push the body with these forces, N.
fn torque_for(forces: [Vector3<f64>; 4]) -> [f64; 12] {
    let mut torque = [0.0; 12];
    for leg in Leg::ALL {
        let map = go1()
            .foot_force_map(leg, &[0.0, 0.8, -1.6])
            .expect("bent legs");
        let leg_torque = map.try_inverse().expect("bent legs") * forces[leg.index()];
        torque[3 * leg.index()..][..3].copy_from_slice(leg_torque.as_slice());
    }
    torque
}

/// Weight, share of the rear legs and forward push: three numbers determine all torques.
fn sample_torque(random: &mut Random) -> [f64; 12] {
    let (lift, tilt, push) = (
        30.0 + 8.0 * random.normal(),
        4.0 * random.normal(),
        2.0 * random.normal(),
    );
    torque_for([
        Vector3::new(push, 0.0, lift - tilt),
        Vector3::new(push, 0.0, lift - tilt),
        Vector3::new(push, 0.0, lift + tilt),
        Vector3::new(push, 0.0, lift + tilt),
    ])
}

fn with_wrench(torque: &[f64; 12]) -> DVector<f64> {
    let mut x = [0.0; 18];
    x[..12].copy_from_slice(&FOOTING.joints_rad);
    let wrench = InputRule::published(go1())
        .wrench(&x, torque, FOOTING.feet)
        .expect("bent legs");
    DVector::from_iterator(18, torque.iter().chain(wrench.iter()).copied())
}

/// The synthetic model with the statistics of [`sample_torque`].
fn informed_model() -> ReducedModel {
    let mut random = Random::new(4);
    let count = 500;
    let samples: Vec<DVector<f64>> = (0..count)
        .map(|_| with_wrench(&sample_torque(&mut random)))
        .collect();
    let mean = samples.iter().sum::<DVector<f64>>() / count as f64;
    let covariance = samples
        .iter()
        .map(|u| (u - &mean) * (u - &mean).transpose())
        .sum::<DMatrix<f64>>()
        / count as f64;
    // Products of sums round differently on both sides of the diagonal.
    let covariance = 0.5 * (&covariance + covariance.transpose());
    let statistics = InputStatistics {
        mean,
        covariance,
        given_state: None,
    };
    model_with(Equations::Linear, statistics)
}

fn projected(plant: &ControlModel, torque: &[f64; 12]) -> [f64; D] {
    let mut u_lat = [0.0; D];
    plant.project(&[0.0; 18], with_wrench(torque).as_slice(), &mut u_lat);
    u_lat
}

#[test]
fn projecting_a_lifted_input_returns_it() {
    let plant = romc::mpc::control_model(&model(Equations::Linear)).expect("complete");
    let mut random = Random::new(9);
    for _ in 0..50 {
        let u_lat: [f64; D] = std::array::from_fn(|_| random.normal());
        let mut back = [0.0; D];
        plant.project(&[0.0; 18], &plant.lift(&u_lat), &mut back);
        for (found, expected) in back.iter().zip(u_lat) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
}

#[test]
fn consistent_lift_recovers_torques_that_obey_the_ground() {
    let plant = romc::mpc::control_model(&informed_model()).expect("complete");
    let settings = MpcSettings {
        lift_prior_weight: 1e-6,
        ..unwatched()
    };
    let mut lift = ConsistentLift::new(&plant, &settings).expect("a sound program");
    let mut random = Random::new(31);
    let (mut error, mut size) = (0.0, 0.0);
    let mean = plant.phases()[0].torque_mean;
    for _ in 0..200 {
        let torque = sample_torque(&mut random);
        let found = lift
            .lift(&plant, &projected(&plant, &torque), &FOOTING)
            .expect("bent legs");
        for joint in 0..12 {
            error += (found[joint] - torque[joint]).powi(2);
            size += (torque[joint] - mean[joint]).powi(2);
        }
    }
    let r2 = 1.0 - error / size;
    assert!(r2 > 0.999, "R² {r2}");
}

fn cone_violation(torque: &[f64; 12], friction: f64) -> f64 {
    let mut worst = f64::NEG_INFINITY;
    for leg in Leg::ALL {
        let leg_torque = leg.of_joints(torque);
        let map = go1()
            .foot_force_map(leg, &leg.of_joints(&FOOTING.joints_rad))
            .expect("bent legs");
        let force = map * Vector3::from(leg_torque);
        worst = worst.max(force.x.hypot(force.y) - friction * force.z);
    }
    worst
}

/// The cost of the lift as documented.
fn cost(plant: &ControlModel, torque: &[f64; 12], u_lat: &[f64; D], weight: f64) -> f64 {
    let reached = projected(plant, torque);
    let phase = &plant.phases()[0];
    let off = SVector::<f64, 12>::from(*torque) - phase.torque_mean;
    let miss: f64 = reached
        .iter()
        .zip(u_lat)
        .map(|(a, b)| (a - b).powi(2))
        .sum();
    miss + weight * (off.transpose() * phase.torque_precision * off)[0]
}

#[test]
fn consistent_lift_of_a_slipping_push_stays_in_the_cones_and_nothing_near_is_better() {
    let plant = romc::mpc::control_model(&informed_model()).expect("complete");
    let settings = MpcSettings {
        foot_friction: 0.5,
        ..unwatched()
    };
    let mut lift = ConsistentLift::new(&plant, &settings).expect("a sound program");
    let mut random = Random::new(14);
    let push = Vector3::new(45.0, 0.0, 30.0);
    let wanted = projected(&plant, &torque_for([push; 4]));
    let found = lift.lift(&plant, &wanted, &FOOTING).expect("bent legs");
    assert!(lift.iterations() > 0, "no constraint was active");
    let violation = cone_violation(&found, 0.5);
    assert!(
        violation.abs() < 0.02,
        "an active cone is {violation} N away"
    );
    let best = cost(&plant, &found, &wanted, settings.lift_prior_weight);
    let mut tried = 0;
    // All four cones are active: neighbours are tried on the inner side.
    let inward = torque_for([Vector3::new(0.0, 0.0, 10.0); 4]);
    for _ in 0..20_000 {
        let size = 10f64.powf(2.0 * random.signed() - 2.0);
        let near = std::array::from_fn(|joint| {
            found[joint] + size * (random.normal() + random.signed().abs() * inward[joint])
        });
        let within = near
            .iter()
            .zip(go1().torque_limit_nm())
            .all(|(torque, limit)| torque.abs() <= *limit);
        if within && cone_violation(&near, 0.5) <= 0.0 {
            tried += 1;
            let other = cost(&plant, &near, &wanted, settings.lift_prior_weight);
            assert!(other > best * (1.0 - 3e-4), "{other} is better than {best}");
        }
    }
    assert!(tried > 100, "only {tried} neighbours are feasible");
}

#[test]
fn consistent_lift_of_a_giant_input_stays_within_the_torque_limits() {
    let plant = romc::mpc::control_model(&informed_model()).expect("complete");
    let mut lift = ConsistentLift::new(&plant, &unwatched()).expect("a sound program");
    let wanted = projected(&plant, &torque_for([Vector3::new(0.0, 0.0, 900.0); 4]));
    let found = lift.lift(&plant, &wanted, &FOOTING).expect("bent legs");
    let shares = found
        .iter()
        .zip(go1().torque_limit_nm())
        .map(|(torque, limit)| torque.abs() / limit);
    let largest = shares.fold(0.0, f64::max);
    assert!(
        (0.999..=1.0).contains(&largest),
        "largest share of a limit is {largest}"
    );
    assert!(cone_violation(&found, 0.6) < 0.05);
}

#[test]
fn feet_in_the_air_have_no_cone() {
    let plant = romc::mpc::control_model(&informed_model()).expect("complete");
    let mut lift = ConsistentLift::new(&plant, &unwatched()).expect("a sound program");
    let wanted = projected(&plant, &torque_for([Vector3::new(8.0, 0.0, -6.0); 4]));
    let flying = StanceState {
        feet: [false; 4],
        phase: 1,
        ..FOOTING
    };
    let found = lift
        .lift(&plant, &wanted, &flying)
        .expect("nothing to be singular");
    assert_eq!(lift.iterations(), 0);
    assert!(cone_violation(&found, 0.6) > 1.0);
}

#[test]
fn stretched_leg_is_a_failure_in_contact_only() {
    let plant = romc::mpc::control_model(&informed_model()).expect("complete");
    let mut lift = ConsistentLift::new(&plant, &unwatched()).expect("a sound program");
    let mut stretched = FOOTING;
    stretched.joints_rad[5] = 0.0;
    assert_eq!(
        lift.lift(&plant, &[0.1; D], &stretched),
        Err(LiftFailure::SingularLeg)
    );
    stretched.feet[1] = false;
    let found = lift
        .lift(&plant, &[0.1; D], &stretched)
        .expect("the stretched leg carries nothing");
    assert!(found.iter().all(|torque| torque.is_finite()), "{found:?}");
    assert_eq!(STAND[..12], FOOTING.joints_rad);
}

/// Viscous and dry friction, and inertia of the motors, of every leg.
fn losses() -> Actuators {
    Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3])
}

#[test]
fn consistent_lift_keeps_the_command_with_its_losses_within_the_limits() {
    let model = informed_model().into_builder().actuators(Some(losses()));
    let plant = romc::mpc::control_model(&model.build().expect("sound")).expect("complete");
    let mut lift = ConsistentLift::new(&plant, &unwatched()).expect("a sound program");
    let wanted = projected(&plant, &torque_for([Vector3::new(0.0, 0.0, 900.0); 4]));
    let limits = go1().torque_limit_nm();
    let at_rest = lift.lift(&plant, &wanted, &FOOTING).expect("bent legs");
    let mut moving = FOOTING;
    moving.losses_nm = std::array::from_fn(|joint| match joint % 3 {
        2 => -4.0,
        _ => 9.0 * at_rest[joint].signum(),
    });
    let found = lift.lift(&plant, &wanted, &moving).expect("bent legs");
    let command = |joint: usize| found[joint] + moving.losses_nm[joint];
    let shares = (0..12).map(|joint| command(joint).abs() / limits[joint]);
    let largest = shares.fold(0.0, f64::max);
    assert!(
        (0.999..=1.0 + 1e-12).contains(&largest),
        "{largest} of a limit"
    );
    // Joint losses reduce the torques at the links; hips and thighs are the joints at their limits.
    for joint in (0..12).filter(|joint| joint % 3 != 2) {
        assert!(
            (at_rest[joint].abs() - limits[joint]).abs() < 0.01,
            "{at_rest:?}"
        );
        assert!(
            (found[joint].abs() - (limits[joint] - 9.0)).abs() < 0.01,
            "{found:?}"
        );
    }
    assert!(cone_violation(&found, 0.6) < 0.05);
}

#[test]
fn consistent_lift_in_world_axes_recovers_the_torques_of_a_pitched_robot() {
    let rule = InputRule::new(go1(), None, WrenchFrame::World);
    let mut pitched = FOOTING;
    pitched.attitude_rad = [0.1, -0.3, 0.8];
    let input = |torque: &[f64; 12]| {
        let mut x = STAND;
        x[15..].copy_from_slice(&pitched.attitude_rad);
        let wrench = rule.wrench(&x, torque, pitched.feet).expect("finite");
        DVector::from_iterator(18, torque.iter().chain(wrench.iter()).copied())
    };
    let mut random = Random::new(7);
    let model = informed_model()
        .into_builder()
        .wrench_frame(WrenchFrame::World);
    let plant = romc::mpc::control_model(&model.build().expect("sound")).expect("complete");
    let settings = MpcSettings {
        lift_prior_weight: 1e-6,
        ..unwatched()
    };
    let mut lift = ConsistentLift::new(&plant, &settings).expect("a sound program");
    let (mut error, mut size) = (0.0, 0.0);
    for _ in 0..100 {
        let torque = sample_torque(&mut random);
        let mut u_lat = [0.0; D];
        plant.project(&STAND, input(&torque).as_slice(), &mut u_lat);
        let found = lift.lift(&plant, &u_lat, &pitched).expect("bent legs");
        let mean = plant.phases()[0].torque_mean;
        for joint in 0..12 {
            error += (found[joint] - torque[joint]).powi(2);
            size += (torque[joint] - mean[joint]).powi(2);
        }
    }
    let r2 = 1.0 - error / size;
    assert!(r2 > 0.99, "R^2 {r2}");
}

#[test]
fn losses_of_a_plan_are_those_at_its_mean_velocity_and_its_acceleration() {
    let model = informed_model().into_builder().actuators(Some(losses()));
    let plant = romc::mpc::control_model(&model.build().expect("sound")).expect("complete");
    let start = [0.1, -0.05, 0.02, 0.4, -0.3, 0.2];
    let end = [0.104, -0.052, 0.021, 0.43, -0.28, 0.15];
    let found = plant.planned_losses((0, [true; 4]), [&start, &end], 0.01);
    let velocity = |state: &[f64; 6]| plant.decode_joint_velocities(&state[..D], &state[D..]);
    let (before, after) = (velocity(&start), velocity(&end));
    for joint in 0..12 {
        let dq = 0.5 * (before[joint] + after[joint]);
        let ddq = (after[joint] - before[joint]) / 0.01;
        let viscous = [1.0, 0.6, 0.6][joint % 3];
        let expected = viscous * dq + 0.2 * (dq / 0.05).tanh() + 0.01 * ddq;
        assert!((found[joint] - expected).abs() < 1e-12, "{joint}");
    }
    assert!(found.iter().any(|loss| loss.abs() > 0.5), "{found:?}");
    let ideal = romc::mpc::control_model(&informed_model()).expect("complete");
    assert_eq!(
        ideal.planned_losses((0, [true; 4]), [&start, &end], 0.01),
        [0.0; 12]
    );
}
