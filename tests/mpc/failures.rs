//! Commands of the controller under faults, and its recovery without help.

use romc::mpc::{
    Command, Controller, FallbackSettings, Lift, Measurement, MpcSettings, QpSettings, Solver,
    Source, Status,
};
use romc::robot::ContactFlags;

use crate::control::{assert_within_limits, measure};
use crate::random::Random;
use crate::synthetic::{Equations, Trajectory, model, trajectory, unwatched};

struct Bench {
    reference: Trajectory,
    controller: Controller,
}

impl Bench {
    fn new(settings: MpcSettings) -> Self {
        let model = model(Equations::Nonlinear);
        let reference = trajectory(&model);
        let mut controller =
            romc::mpc::controller(&model, settings).expect("the model is complete");
        controller
            .set_reference(reference.samples())
            .expect("the reference is sound");
        Self {
            reference,
            controller,
        }
    }

    fn nominal(&mut self, sample: usize) -> Command {
        let command = measure(&self.reference, sample, &mut self.controller);
        assert_within_limits(&command);
        command
    }

    fn changed(
        &mut self,
        sample: usize,
        change: impl Fn(&mut [f64; 18], &mut [f64; 18]),
    ) -> Command {
        let (mut x, mut dx) = self.reference.state(sample);
        change(&mut x, &mut dx);
        let feet = self.reference.feet[sample];
        let time_s = self.reference.time_s[sample];
        let command = self.controller.step(Measurement {
            time_s,
            x: &x,
            dx: &dx,
            feet,
        });
        assert_within_limits(&command);
        command
    }

    fn with_feet(&mut self, sample: usize, feet: ContactFlags) -> Command {
        let (x, dx) = self.reference.state(sample);
        let time_s = self.reference.time_s[sample];
        let command = self.controller.step(Measurement {
            time_s,
            x: &x,
            dx: &dx,
            feet,
        });
        assert_within_limits(&command);
        command
    }
}

#[test]
fn measurement_that_is_not_a_number_uses_the_plan_then_holds_then_recovers() {
    let mut bench = Bench::new(unwatched());
    let good = bench.nominal(100);
    let planned: Vec<f64> = bench.controller.plan().input(1).to_vec();
    for step in 1..12 {
        let command = bench.changed(100 + 5 * step, |x, _| x[3] = f64::NAN);
        assert_eq!(command.status, Status::NotFinite);
        let expected = if step < 5 {
            Source::ShiftedPlan
        } else {
            Source::Hold
        };
        assert_eq!(command.source, expected, "step {step}");
        if step == 1 {
            assert_eq!(command.u_lat, planned);
        }
        if step >= 5 {
            assert_eq!(command.joint_velocity_rad_s, [0.0; 12]);
        }
    }
    let back = bench.nominal(160);
    assert_eq!((back.status, back.source), (Status::Solved, Source::Plan));
    assert_ne!(back.torque_nm, good.torque_nm);
}

#[test]
fn hold_fades_its_torque_and_keeps_its_posture() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    let mut before: Option<Command> = None;
    for step in 5..60 {
        let command = bench.changed(100 + 5 * step, |_, dx| dx[0] = f64::INFINITY);
        assert_eq!(command.source, Source::Hold);
        if let Some(before) = before {
            assert_eq!(command.joint_position_rad, before.joint_position_rad);
            for (now, before) in command.torque_nm.iter().zip(before.torque_nm) {
                assert!(now.abs() <= before.abs(), "{now} after {before}");
            }
        }
        before = Some(command);
    }
    let last = before.expect("steps were made");
    assert!(
        last.torque_nm.iter().all(|torque| torque.abs() < 1e-3),
        "{:?}",
        last.torque_nm
    );
}

#[test]
fn hold_damps_measured_joint_velocities_without_piling_up() {
    let settings = MpcSettings {
        qp: QpSettings {
            max_iterations: 1,
            ..QpSettings::default()
        },
        fallback: FallbackSettings {
            damping_nm_s: 2.0,
            ..FallbackSettings::default()
        },
        ..unwatched()
    };
    let mut bench = Bench::new(settings);
    for step in 0..30 {
        let command = bench.changed(5 * step, |_, dx| dx[1] = 0.5);
        assert_eq!(
            (command.status, command.source),
            (Status::IterationCap, Source::Hold)
        );
        assert!(
            (command.torque_nm[1] + 1.0).abs() < 1e-12,
            "{}",
            command.torque_nm[1]
        );
        assert_eq!(command.iterations, 1);
    }
}

#[test]
fn time_that_is_not_a_number_is_refused_and_the_next_step_is_solved() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    let (x, dx) = bench.reference.state(105);
    let command = bench.controller.step(Measurement {
        time_s: f64::NAN,
        x: &x,
        dx: &dx,
        feet: [true; 4],
    });
    assert_eq!(
        (command.status, command.source),
        (Status::NotFinite, Source::ShiftedPlan)
    );
    assert_eq!(bench.nominal(110).status, Status::Solved);
}

#[test]
fn wrong_dimension_is_refused_and_the_next_step_is_solved() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    let (x, dx) = bench.reference.state(105);
    for (x, dx) in [(&x[..17], &dx[..]), (&x[..], &dx[..0])] {
        let command = bench.controller.step(Measurement {
            time_s: 0.21,
            x,
            dx,
            feet: [true; 4],
        });
        assert_eq!(
            (command.status, command.source),
            (Status::WrongDimension, Source::ShiftedPlan)
        );
        assert_within_limits(&command);
    }
    assert_eq!(bench.nominal(110).status, Status::Solved);
}

#[test]
fn without_a_reference_the_joints_are_damped_and_nothing_else() {
    let mut controller =
        romc::mpc::controller(&model(Equations::Linear), unwatched()).expect("complete");
    let mut dx = [0.0; 18];
    dx[4] = 3.0;
    let command = controller.step(Measurement {
        time_s: 0.0,
        x: &[0.0; 18],
        dx: &dx,
        feet: [true; 4],
    });
    assert_eq!(
        (command.status, command.source),
        (Status::NoReference, Source::Hold)
    );
    assert_eq!(command.torque_nm[4], -3.0);
    assert_within_limits(&command);
}

#[test]
fn without_a_reference_the_posture_measured_first_is_held() {
    let mut controller =
        romc::mpc::controller(&model(Equations::Linear), unwatched()).expect("complete");
    let standing: [f64; 18] = std::array::from_fn(|i| match i {
        0..12 => [0.1, 0.92, -1.75][i % 3],
        _ => 0.0,
    });
    let mut step = |time_s: f64, x: &[f64; 18]| {
        controller.step(Measurement {
            time_s,
            x,
            dx: &[0.0; 18],
            feet: [true; 4],
        })
    };
    assert_eq!(step(0.0, &[f64::NAN; 18]).status, Status::NotFinite);
    assert_eq!(step(0.01, &standing).joint_position_rad, standing[..12]);
    let moved = standing.map(|value| value + 0.05);
    assert_eq!(step(0.02, &moved).joint_position_rad, standing[..12]);
}

/// The largest torque after each of `times_s`, held after the stages of a plan have run out.
fn held_torques(times_s: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    let start_s = bench.reference.time_s[100];
    let mut torques = Vec::new();
    for time_s in times_s {
        let command = bench.controller.step(Measurement {
            time_s: start_s + time_s,
            x: &[f64::NAN; 18],
            dx: &[0.0; 18],
            feet: [true; 4],
        });
        if command.source == Source::Hold {
            let torques_nm = command.torque_nm.iter();
            torques.push(torques_nm.fold(0.0, |most: f64, torque| most.max(torque.abs())));
        }
    }
    torques
}

#[test]
fn hold_fades_by_time_and_by_calls_where_the_clock_says_nothing() {
    let fade = |torques: &[f64]| torques[torques.len() - 1] / torques[0];
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found}");
    let shifted = (1..5).map(|stage| 0.01 * f64::from(stage));
    // 100 calls of 1 ms and 10 of 10 ms fade equally; with a clock that stops or runs back, time is counted in stages.
    let often = held_torques(
        shifted
            .clone()
            .chain((0..=100).map(|k| 0.05 + 0.001 * f64::from(k))),
    );
    let seldom = held_torques(
        shifted
            .clone()
            .chain((0..=10).map(|k| 0.05 + 0.01 * f64::from(k))),
    );
    close(fade(&often), (-2.0_f64).exp());
    close(fade(&seldom), (-2.0_f64).exp());
    let still = held_torques(shifted.clone().chain([0.05; 11]));
    let back = held_torques(shifted.chain((0..=10).map(|k| 0.06 - 0.001 * f64::from(k))));
    close(fade(&still), (-2.0_f64).exp());
    assert!(fade(&back) < 0.5, "{back:?}");
    // Without a time, the plan's stages run out as well.
    let unknown = held_torques([f64::NAN; 20]);
    assert_eq!(unknown.len(), 16);
    close(fade(&unknown), (-3.0_f64).exp());
}

#[test]
fn jump_of_the_measurement_is_disbelieved_for_a_while_and_then_believed() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    for step in 1..=3 {
        let command = bench.changed(100 + 5 * step, |x, _| x[12] += 5.0);
        assert_eq!(
            (command.status, command.source),
            (Status::MeasurementJump, Source::ShiftedPlan)
        );
    }
    let believed = bench.changed(120, |x, _| x[12] += 5.0);
    assert!(believed.status.has_plan(), "{:?}", believed.status);
    // And back again, in the reverse order.
    let mut statuses = Vec::new();
    for step in 0..6 {
        statuses.push(bench.nominal(125 + 5 * step).status);
    }
    assert_eq!(statuses[0], Status::MeasurementJump);
    assert!(
        statuses[4].has_plan() && statuses[5].has_plan(),
        "{statuses:?}"
    );
}

#[test]
fn single_outlier_costs_one_step() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(100);
    assert_eq!(
        bench.changed(105, |x, _| x[14] -= 3.0).status,
        Status::MeasurementJump
    );
    assert_eq!(bench.nominal(110).status, Status::Solved);
}

#[test]
fn plan_that_fails_the_optimality_conditions_is_inaccurate_and_not_used() {
    let settings = MpcSettings {
        qp: QpSettings {
            accepted_residual: 1e-30,
            ..QpSettings::default()
        },
        ..unwatched()
    };
    let refused = Bench::new(settings).nominal(0);
    assert_eq!(
        (refused.status, refused.source),
        (Status::Inaccurate, Source::Hold)
    );
}

#[test]
fn reference_whose_deviations_overflow_is_a_numerical_failure_until_a_sane_one_comes() {
    let mut bench = Bench::new(unwatched());
    let mut huge = trajectory(&model(Equations::Nonlinear));
    huge.x.iter_mut().for_each(|value| *value *= 1e200);
    let set = bench.controller.set_reference(huge.samples());
    set.expect("finite");
    let refused = bench.nominal(0);
    assert_eq!(
        (refused.status, refused.source),
        (Status::NumericalFailure, Source::Hold)
    );
    let sane = trajectory(&model(Equations::Nonlinear));
    let set = bench.controller.set_reference(sane.samples());
    set.expect("sound");
    assert_eq!(bench.nominal(5).status, Status::Solved);
}

#[test]
fn contradicting_constraints_are_infeasible_and_solved_again_when_they_agree() {
    // Touchdown before schedule: the inputs of the flight, where friction is free, are outside the contact's friction
    // cone, and the rate limit is too small to bring them into it.
    for (solver, contradicted) in [
        (Solver::Clarabel, Status::Infeasible),
        (Solver::Riccati, Status::IterationCap),
    ] {
        let settings = MpcSettings {
            solver,
            torque_rate_nm_s: Some(5.0),
            body_friction: Some(0.3),
            horizon: 5,
            ..unwatched()
        };
        let mut bench = Bench::new(settings);
        for sample in (205..235).step_by(5) {
            assert_eq!(bench.nominal(sample).status, Status::Solved);
        }
        let early = bench.with_feet(235, [true; 4]);
        assert_eq!(
            (early.status, early.source),
            (contradicted, Source::ShiftedPlan)
        );
        assert_eq!(bench.nominal(240).status, Status::Solved);
    }
}

#[test]
fn touchdown_before_schedule_is_planned_in_contact_at_once() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(230);
    let early = bench.with_feet(235, [true; 4]);
    assert_eq!((early.status, early.phase), (Status::ContactEarly, Some(0)));
    let on_time = bench.nominal(250);
    assert_eq!((on_time.status, on_time.phase), (Status::Solved, Some(0)));
}

#[test]
fn takeoff_after_schedule_is_planned_in_contact_for_one_more_stage() {
    let mut bench = Bench::new(unwatched());
    bench.nominal(195);
    let late = bench.with_feet(205, [true, true, false, false]);
    assert_eq!((late.status, late.phase), (Status::ContactLate, Some(0)));
    let on_time = bench.nominal(210);
    assert_eq!((on_time.status, on_time.phase), (Status::Solved, Some(1)));
}

#[test]
fn flight_that_the_reference_is_not_near_is_told() {
    let mut bench = Bench::new(unwatched());
    let unknown = bench.with_feet(0, [false; 4]);
    assert_eq!(
        (unknown.status, unknown.phase),
        (Status::ContactUnknown, Some(1))
    );
    assert_eq!(bench.nominal(5).status, Status::Solved);
}

#[test]
fn posture_outside_the_joint_limits_softens_the_plan() {
    let mut bench = Bench::new(unwatched());
    let pseudo_knee = |x: &mut [f64; 18]| (0..4).for_each(|leg| x[3 * leg + 2] += 6.0);
    let command = bench.changed(100, |x, _| pseudo_knee(x));
    assert_eq!(command.status, Status::Softened);
    assert!(command.slack > 1e-3);
    bench.controller.reset();
    let back = bench.nominal(105);
    assert_eq!((back.status, back.slack < 1e-4), (Status::Solved, true));
}

#[test]
fn absurd_numbers_of_a_measurement_end_before_the_solver() {
    for bounds in [unwatched().bounds, MpcSettings::default().bounds] {
        for (value, place) in [1e30, -1e300, 2e6, f64::MAX]
            .into_iter()
            .flat_map(|value| (0..36).map(move |place| (value, place)))
        {
            let mut bench = Bench::new(MpcSettings {
                bounds,
                ..unwatched()
            });
            for sample in [100, 105, 110, 115] {
                let command = bench.changed(sample, |x, dx| match place {
                    0..18 => x[place] = value,
                    _ => dx[place - 18] = value,
                });
                let found = (command.status, command.iterations);
                assert_eq!(found, (Status::NotFinite, 0), "{value} at {place}");
            }
        }
    }
}

#[test]
fn huge_reference_never_leaves_the_limits_and_a_sane_one_is_followed_again() {
    for size in [1e3, 1e9, 1e30, 1e160] {
        let mut bench = Bench::new(unwatched());
        let mut huge = trajectory(&model(Equations::Nonlinear));
        huge.x.iter_mut().for_each(|value| *value *= size);
        huge.dx.iter_mut().for_each(|value| *value *= size);
        huge.u.iter_mut().for_each(|value| *value *= size);
        bench
            .controller
            .set_reference(huge.samples())
            .expect("finite");
        for sample in (0..100).step_by(5) {
            bench.nominal(sample);
        }
        let sane = trajectory(&model(Equations::Nonlinear));
        bench
            .controller
            .set_reference(sane.samples())
            .expect("sound");
        assert_eq!(
            bench.nominal(100).status,
            Status::Solved,
            "after a reference times {size}"
        );
    }
}

#[test]
fn stretched_leg_in_contact_fails_the_consistent_lift_only_as_long_as_it_is_stretched() {
    let believing = FallbackSettings {
        jump_deviations: 1e9,
        ..FallbackSettings::default()
    };
    let mut bench = Bench::new(MpcSettings {
        lift: Lift::Consistent,
        fallback: believing,
        ..unwatched()
    });
    assert_eq!(bench.nominal(100).status, Status::Solved);
    let stretched = bench.changed(105, |x, _| x[5] = 0.0);
    assert_eq!(
        (stretched.status, stretched.source),
        (Status::LiftFailed, Source::Hold)
    );
    assert_eq!(bench.nominal(110).status, Status::Solved);
}

#[test]
fn torques_stay_within_limits_under_any_measurement() {
    let mut random = Random::new(77);
    for lift in [Lift::Transpose, Lift::Consistent] {
        let mut bench = Bench::new(MpcSettings {
            lift,
            ..unwatched()
        });
        let mut plans = 0;
        for step in 0..400 {
            let sample = 5 * (step % 60);
            let size = 10f64.powf(5.0 * random.signed());
            let (mut x, mut dx) = bench.reference.state(sample);
            for value in x.iter_mut().chain(&mut dx) {
                *value += size * random.normal();
            }
            if step % 17 == 0 {
                x[step % 18] = f64::NAN;
            }
            let feet = std::array::from_fn(|_| random.signed() > 0.0);
            let time_s = bench.reference.time_s[sample] + 1e-3 * random.signed();
            let command = bench.controller.step(Measurement {
                time_s,
                x: &x,
                dx: &dx,
                feet,
            });
            assert_within_limits(&command);
            assert!(command.torque_nm.iter().all(|torque| torque.is_finite()));
            plans += usize::from(command.status.has_plan());
        }
        assert!(plans > 50, "{plans} plans with {lift:?}");
    }
}

#[test]
fn every_status_has_its_own_word_and_code() {
    let all = Status::ALL;
    for (index, status) in all.iter().enumerate() {
        for other in &all[..index] {
            assert_ne!(status.code(), other.code());
            assert_ne!(status.word(), other.word());
        }
    }
    assert_eq!(Status::Solved.code(), 0);
}
