//! Commands of the controller without faults.

use nalgebra::{DVector, SVector};
use romc::lower::CompiledModel;
use romc::model::ReducedModel;
use romc::mpc::{
    Command, ControlError, ControlModel, Controller, Drift, Drives, Linearisation, Measurement,
    MissingInput, MpcError, MpcSettings, ReferenceSamples, Source, Status,
};
use romc::robot::ContactFlags;

use crate::synthetic::{D, Equations, STAND, Trajectory, decoded, model, trajectory, unwatched};

fn controller(
    model: &ReducedModel,
    settings: MpcSettings,
    reference: ReferenceSamples<'_>,
) -> Controller {
    let mut controller = romc::mpc::controller(model, settings).expect("the model is complete");
    controller
        .set_reference(reference)
        .expect("the reference is sound");
    controller
}

pub fn measure(trajectory: &Trajectory, sample: usize, controller: &mut Controller) -> Command {
    let (x, dx) = trajectory.state(sample);
    let feet = trajectory.feet[sample];
    controller.step(Measurement {
        time_s: trajectory.time_s[sample],
        x: &x,
        dx: &dx,
        feet,
    })
}

pub fn assert_within_limits(command: &Command) {
    let robot = romc::robot_file::by_name("go1").expect("known robot");
    for joint in 0..12 {
        assert!(
            command.torque_nm[joint].abs() <= robot.torque_limit_nm()[joint],
            "{command:?}"
        );
        let (lower, upper) = robot.joint_limit_rad()[joint];
        assert!(
            (lower..=upper).contains(&command.joint_position_rad[joint]),
            "{command:?}"
        );
    }
}

#[test]
fn on_a_reference_that_the_model_follows_the_reference_input_is_commanded() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    for drift in [Drift::Reference, Drift::Model] {
        let settings = MpcSettings {
            drift,
            ..unwatched()
        };
        let mut controller = controller(&model, settings, reference.samples());
        for sample in (0..300).step_by(5) {
            let command = measure(&reference, sample, &mut controller);
            assert_eq!(
                (command.status, command.source),
                (Status::Solved, Source::Plan),
                "sample {sample}"
            );
            for joint in 0..12 {
                // The reference's input over the hold is a mean over samples that are themselves held: its last
                // interval is a ramp to the next value.
                let expected = 0.9 * reference.u[sample * 18 + joint]
                    + 0.1 * reference.u[(sample + 5) * 18 + joint];
                let error = (command.torque_nm[joint] - expected).abs();
                assert!(
                    error < 0.15,
                    "sample {sample}, joint {joint}: {error} N m of {expected}"
                );
            }
        }
    }
}

/// Velocity weight with which position errors are corrected fast.
const STIFF: f64 = 0.02;

/// Motors that deliver a share of their torques, including those of their joint PD.
#[derive(Clone, Copy)]
struct Motors {
    share: f64,
    stiffness_nm_rad: f64,
    damping_nm_s_rad: f64,
}

const EXACT: Motors = Motors {
    share: 1.0,
    stiffness_nm_rad: 0.0,
    damping_nm_s_rad: 0.0,
};

impl Motors {
    /// Latent input that arrives for a command at a state.
    fn arrives(
        self,
        plant: &ControlModel,
        command: &Command,
        (x, dx): (&[f64; 18], &[f64; 18]),
        feet: ContactFlags,
    ) -> Vec<f64> {
        let torque = SVector::<f64, 12>::from_fn(|joint, _| {
            self.stiffness_nm_rad * (command.joint_position_rad[joint] - x[joint])
                + self.damping_nm_s_rad * (command.joint_velocity_rad_s[joint] - dx[joint])
        });
        let joints = std::array::from_fn(|joint| x[joint]);
        let map = plant
            .input_rule()
            .wrench_map(&joints, [x[15], x[16], x[17]], feet)
            .expect("legs far from stretched");
        let wrench = map * torque;
        let input: Vec<f64> = torque.iter().chain(wrench.iter()).copied().collect();
        let mut held = vec![0.0; D];
        plant.project(x, &input, &mut held);
        let entries = command.u_lat.iter().zip(&held);
        entries.map(|(u, held)| self.share * (u + held)).collect()
    }
}

/// Runs the model itself under the controller from an offset; returns the distance from the
/// reference, in latent units, at every step.
fn closed_loop(model: &ReducedModel, settings: MpcSettings, with_input: bool) -> Vec<f64> {
    let steps = run(model, settings, with_input, EXACT);
    steps.into_iter().map(|(off, _)| off).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Distance from the reference and latent coordinates at every step.
fn run(
    model: &ReducedModel,
    settings: MpcSettings,
    with_input: bool,
    motors: Motors,
) -> Vec<(f64, [f64; D])> {
    let reference = trajectory(model);
    let samples = if with_input {
        reference.samples()
    } else {
        reference.without_input()
    };
    let mut controller = controller(model, settings, samples);
    let mut dynamics = CompiledModel::new(model).expect("lowers");
    let (mut z, mut dz) = ([0.02, -0.02, 0.02], [0.1, 0.0, -0.1]);
    let mut steps = Vec::new();
    for sample in (0..350).step_by(5) {
        let (x, dx) = decoded(model, &z, &dz);
        let feet = reference.feet[sample];
        let time_s = reference.time_s[sample];
        let command = controller.step(Measurement {
            time_s,
            x: &x,
            dx: &dx,
            feet,
        });
        assert!(command.status.has_plan(), "{:?}", command.status);
        assert_within_limits(&command);
        let target = DVector::from_iterator(18, (0..18).map(|i| reference.x[sample * 18 + i]));
        let target = model.encode(&target).expect("has an encoder");
        steps.push((distance(&z, target.as_slice()), z));
        for held in sample..sample + 5 {
            let phase = model
                .phase_for(reference.feet[held])
                .expect("has both phases");
            let (x, dx) = decoded(model, &z, &dz);
            let arrives = motors.arrives(
                controller.plant(),
                &command,
                (&x, &dx),
                reference.feet[held],
            );
            dynamics.rk4_step(phase, &mut z, &mut dz, &arrives, 0.002);
        }
    }
    steps
}

#[test]
fn weak_and_strong_motors_are_made_up_for() {
    let model = model(Equations::Nonlinear);
    let trusting = MpcSettings {
        velocity_weight: STIFF,
        ..unwatched()
    };
    for stiffness_nm_rad in [0.0, 5.0] {
        let damping_nm_s_rad = 0.04 * stiffness_nm_rad;
        let estimating = MpcSettings {
            effectiveness: Some(1.0),
            drives: Drives {
                stiffness_nm_rad,
                damping_nm_s_rad,
            },
            ..trusting
        };
        let states = |settings, share| -> Vec<[f64; D]> {
            let motors = Motors {
                share,
                stiffness_nm_rad,
                damping_nm_s_rad,
            };
            let steps = run(&model, settings, true, motors);
            steps.into_iter().map(|(_, z)| z).collect()
        };
        let exact = states(trusting, 1.0);
        let off = |settings, share| -> f64 {
            let pairs = states(settings, share).into_iter().zip(&exact);
            pairs.map(|(z, exact)| distance(&z, exact)).sum()
        };
        for share in [0.8, 1.2] {
            let (trusted, made_up) = (off(trusting, share), off(estimating, share));
            assert!(made_up < 0.7 * trusted, "{share}: {made_up} of {trusted}");
            let noticed = off(estimating, 1.0);
            assert!(noticed < 0.1 * trusted, "{share}: {noticed} of {trusted}");
        }
    }
}

#[test]
fn feedback_brings_the_model_back_to_the_reference_faster_than_its_own_damping() {
    let model = model(Equations::Nonlinear);
    let strong = MpcSettings {
        input_weight: 1e-3,
        velocity_weight: STIFF,
        ..unwatched()
    };
    let weak = MpcSettings {
        input_weight: 1e6,
        velocity_weight: STIFF,
        ..unwatched()
    };
    let sum = |settings| {
        closed_loop(&model, settings, true)[5..30]
            .iter()
            .sum::<f64>()
    };
    let (with_feedback, without) = (sum(strong), sum(weak));
    assert!(
        with_feedback < 0.7 * without,
        "{with_feedback} against {without}"
    );
}

#[test]
fn without_a_recorded_input_the_reference_is_still_tracked() {
    let model = model(Equations::Nonlinear);
    for linearisation in [Linearisation::Reference, Linearisation::LastPlan] {
        for missing_input in [MissingInput::Estimate, MissingInput::Mean] {
            let settings = MpcSettings {
                input_weight: 1e-3,
                velocity_weight: STIFF,
                linearisation,
                missing_input,
                ..unwatched()
            };
            let distances = closed_loop(&model, settings, false);
            let late = distances[40..].iter().copied().fold(0.0, f64::max);
            let start = distances[0];
            assert!(late < 0.2 * start, "{late} of {start}: {missing_input:?}");
        }
    }
}

#[test]
fn input_of_a_reference_without_one_is_found_behind_its_accelerations() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    let mut controller = controller(&model, unwatched(), reference.without_input());
    let (mut error, mut size) = (0.0, 0.0);
    for sample in (0..350).step_by(5) {
        let command = measure(&reference, sample, &mut controller);
        assert_eq!(command.status, Status::Solved);
        for joint in 0..12 {
            error += (command.torque_nm[joint] - reference.u[sample * 18 + joint]).powi(2);
            size += reference.u[sample * 18 + joint].powi(2);
        }
    }
    assert!(
        error < 0.1 * size,
        "{} of the torques is missed",
        error / size
    );
}

#[test]
fn plan_of_a_linear_model_is_a_trajectory_of_its_runge_kutta_steps() {
    let model = model(Equations::Linear);
    let reference = trajectory(&model);
    let settings = MpcSettings {
        input_weight: 1e-2,
        ..unwatched()
    };
    let mut dynamics = CompiledModel::new(&model).expect("lowers");
    for linearisation in [Linearisation::Reference, Linearisation::LastPlan] {
        let settings = MpcSettings {
            linearisation,
            drift: Drift::Model,
            ..settings
        };
        let mut controller = controller(&model, settings, reference.without_input());
        for sample in [150, 155, 160] {
            let command = measure(&reference, sample, &mut controller);
            assert_eq!(command.status, Status::Solved);
        }
        let plan = controller.plan();
        let (x, dx) = reference.state(160);
        let z = model
            .encode(&DVector::from_column_slice(&x))
            .expect("has an encoder");
        let tangent = model.tangent(&DVector::from_column_slice(&x));
        let dz = tangent.expect("has an encoder").encode * DVector::from_column_slice(&dx);
        let (mut z, mut dz): ([f64; D], [f64; D]) = (
            std::array::from_fn(|i| z[i]),
            std::array::from_fn(|i| dz[i]),
        );
        for stage in 0..settings.horizon {
            // Stages 8 to 17 are in the flight from 0.4 s to 0.5 s.
            let phase = usize::from((8..18).contains(&stage));
            dynamics.rk4_step(phase, &mut z, &mut dz, plan.input(stage), 0.01);
            for (found, expected) in plan.end(stage).iter().zip(z.iter().chain(&dz)) {
                assert!(
                    (found - expected).abs() < 1e-5,
                    "stage {stage}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn torque_rate_is_kept_between_commands() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    let rate = 100.0;
    let settings = MpcSettings {
        torque_rate_nm_s: Some(rate),
        input_weight: 1e-4,
        ..unwatched()
    };
    let free = MpcSettings {
        torque_rate_nm_s: None,
        ..settings
    };
    let largest_change = |settings| {
        let mut controller = controller(&model, settings, reference.without_input());
        let mut before = [0.0; 12];
        let mut largest = 0.0_f64;
        for sample in (0..300).step_by(5) {
            let (mut x, dx) = reference.state(sample);
            x[14] += if sample >= 100 { 0.03 } else { 0.0 };
            let feet = reference.feet[sample];
            let command = controller.step(Measurement {
                time_s: reference.time_s[sample],
                x: &x,
                dx: &dx,
                feet,
            });
            assert!(command.status.has_plan(), "{:?}", command.status);
            for (torque, before) in command.torque_nm.iter().zip(&before) {
                largest = largest.max((torque - before).abs());
            }
            before = command.torque_nm;
        }
        largest
    };
    assert!(largest_change(free) > 1.5, "the limit would not be felt");
    let limited = largest_change(settings);
    assert!(limited < 1.0 + 1e-3, "{limited} N m in 10 ms");
}

#[test]
fn lifted_body_force_stays_in_its_friction_cone() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    let violations = |body_friction| {
        let settings = MpcSettings {
            body_friction,
            ..unwatched()
        };
        let mut controller = controller(&model, settings, reference.samples());
        let mut count = 0;
        for sample in (0..190).step_by(5) {
            let command = measure(&reference, sample, &mut controller);
            assert!(command.status.has_plan(), "{:?}", command.status);
            let force = controller.plant().lift(&command.u_lat);
            let pitch = reference.x[sample * 18 + 16];
            let (sin, cos) = pitch.sin_cos();
            let (along, up) = (
                cos * force[12] + sin * force[14],
                -sin * force[12] + cos * force[14],
            );
            count += usize::from(along.hypot(force[13]) > 0.6 * up + 0.1);
        }
        count
    };
    assert!(violations(None) > 5, "the cone would not be felt");
    assert_eq!(violations(Some(0.6)), 0);
}

#[test]
fn saturated_torques_reach_their_limit_and_never_pass_it() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    let settings = MpcSettings {
        input_weight: 1e-9,
        velocity_weight: STIFF,
        ..unwatched()
    };
    let mut controller = controller(&model, settings, reference.samples());
    let mut saturated = 0;
    for sample in (0..300).step_by(5) {
        let (mut x, dx) = reference.state(sample);
        x[12] += 0.1;
        controller.reset();
        let feet = reference.feet[sample];
        let command = controller.step(Measurement {
            time_s: reference.time_s[sample],
            x: &x,
            dx: &dx,
            feet,
        });
        assert!(command.status.has_plan(), "{:?}", command.status);
        assert_within_limits(&command);
        let limits = controller.plant().robot().torque_limit_nm();
        saturated += command
            .torque_nm
            .iter()
            .zip(limits)
            .filter(|(t, l)| t.abs() > 0.999 * **l)
            .count();
    }
    assert!(saturated > 20, "only {saturated} torques at their limit");
}

#[test]
fn same_measurements_give_the_same_bits() {
    let model = model(Equations::Nonlinear);
    let reference = trajectory(&model);
    let run = || {
        let mut controller = controller(&model, unwatched(), reference.samples());
        let bits = |command: Command| command.torque_nm.map(f64::to_bits);
        (0..300)
            .step_by(5)
            .map(|sample| bits(measure(&reference, sample, &mut controller)))
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn stage_rows_keep_only_what_can_be_active() {
    let controller =
        romc::mpc::controller(&model(Equations::Linear), unwatched()).expect("complete");
    let rows = romc::mpc::problem::StageRows::new(controller.plant(), &unwatched());
    assert!(
        !rows.input.is_empty() && rows.input.len() < 16,
        "{} of 16 torque rows",
        rows.input.len()
    );
    assert!(
        !rows.soft.is_empty() && rows.soft.len() < 16,
        "{} of 16 joint rows",
        rows.soft.len()
    );
    for row in rows.input.iter().chain(&rows.soft) {
        assert_ne!(row.joint % 3, 0, "hip abduction is not in the encoder");
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let model = model(Equations::Linear);
    let refused = |settings| match romc::mpc::controller(&model, settings) {
        Err(MpcError::Control(ControlError::Setting { name, .. })) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        refused(MpcSettings {
            horizon: 0,
            ..unwatched()
        }),
        "horizon"
    );
    let most = romc::limits::table::HORIZON.most as usize;
    let with = |horizon| MpcSettings {
        horizon,
        ..unwatched()
    };
    assert_eq!(refused(with(most + 1)), "horizon");
    assert!(romc::mpc::controller(&model, with(most)).is_ok());
    assert_eq!(
        refused(MpcSettings {
            step_s: f64::NAN,
            ..unwatched()
        }),
        "step_s"
    );
    assert_eq!(
        refused(MpcSettings {
            input_weight: -1.0,
            ..unwatched()
        }),
        "input_weight"
    );
    assert_eq!(
        refused(MpcSettings {
            body_friction: Some(0.0),
            ..unwatched()
        }),
        "body_friction"
    );
    assert_eq!(
        refused(MpcSettings {
            drives: Drives {
                stiffness_nm_rad: -1.0,
                damping_nm_s_rad: 0.0,
            },
            ..unwatched()
        }),
        "drive_stiffness_nm_rad"
    );
}

#[test]
fn references_that_do_not_fit_are_refused_and_the_old_one_stays() {
    let model = model(Equations::Linear);
    let good = trajectory(&model);
    let mut controller = controller(&model, unwatched(), good.samples());
    let mut bad_value = trajectory(&model);
    bad_value.dx[18 * 7 + 4] = f64::INFINITY;
    let error = controller
        .set_reference(bad_value.samples())
        .expect_err("infinite velocity");
    assert!(
        matches!(
            error,
            ControlError::ReferenceValue {
                name: "dx",
                sample: 7,
                coordinate: 4,
                ..
            }
        ),
        "{error}"
    );
    let mut bad_time = trajectory(&model);
    bad_time.time_s[10] = 0.0;
    let error = controller
        .set_reference(bad_time.samples())
        .expect_err("time jumps back");
    assert!(
        matches!(error, ControlError::ReferenceTime { sample: 9, .. }),
        "{error}"
    );
    let short = ReferenceSamples {
        x: &good.x[1..],
        ..good.samples()
    };
    let error = controller
        .set_reference(short)
        .expect_err("one value is missing");
    assert!(
        matches!(
            error,
            ControlError::ReferenceShape {
                name: "x",
                found: 7217,
                expected: 7218
            }
        ),
        "{error}"
    );
    let feet = ReferenceSamples {
        feet: &good.feet[1..],
        ..good.samples()
    };
    let error = controller
        .set_reference(feet)
        .expect_err("one sample of feet is missing");
    assert!(
        matches!(error, ControlError::ReferenceShape { name: "feet", .. }),
        "{error}"
    );
    let single = ReferenceSamples {
        time_s: &[0.0],
        x: &STAND,
        dx: &[0.0; 18],
        u: None,
        feet: &[[true; 4] as ContactFlags],
    };
    let error = controller.set_reference(single).expect_err("one sample");
    assert!(
        matches!(
            error,
            ControlError::ReferenceLen {
                found: 1,
                expected: 2
            }
        ),
        "{error}"
    );
    assert_eq!(measure(&good, 0, &mut controller).status, Status::Solved);
}
