//! Plans of a model that is trained on the shipped recordings.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use nalgebra::DVector;
use romc::artifact;
use romc::model::{FEATURE_DIM, JumpPart, ReducedModel};
use romc::plan::{Goal, Plan, PlanError, PlanSettings, Verdict, plan};
use romc::recording::{self, Recording};
use romc::robot::{BODY_Z, GRAVITY_M_S2};
use romc::train::{Method, Monitor, Origin, Progress, Recordings, TrainOptions};

fn shipped_model(name: &str) -> ReducedModel {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    artifact::read(&root.join(format!("models/{name}.json"))).expect("shipped")
}

fn recordings(split: &str, count: usize) -> Vec<Recording> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1");
    let paths = (1..=count).map(|k| folder.join(format!("{split}_{k:02}.csv.gz")));
    paths
        .map(|path| recording::read(&path).expect("shipped"))
        .collect()
}

fn model() -> &'static ReducedModel {
    static MODEL: OnceLock<ReducedModel> = OnceLock::new();
    MODEL.get_or_init(|| learned(&recordings("train", 14), &recordings("validation", 3), 6))
}

fn learned(training: &[Recording], validation: &[Recording], latent_dim: usize) -> ReducedModel {
    let sets = Recordings::new(training, validation);
    let robot = romc::robot_file::by_name("go1").unwrap();
    let options = TrainOptions::new("planner", latent_dim);
    let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
    let mut monitor = Monitor::new(&mut listener, &cancel);
    let origin = Origin::default();
    let trained = Method::ClosedForm.learn(sets, robot, &options, &origin, &mut monitor);
    trained.expect("a model").model
}

fn planned(distance_m: f64, apex_m: f64) -> Result<Plan, PlanError> {
    let goal = Goal::new(distance_m, apex_m)?;
    plan(model(), &goal, &PlanSettings::default())
}

#[test]
fn plan_inside_the_recorded_range_reaches_its_goal_within_its_bounds() {
    for (distance, apex) in [(0.25, 0.115), (0.33, 0.125), (0.38, 0.13)] {
        let plan = planned(distance, apex).expect("a plan");
        let [reached, rise] = plan.reached_m;
        assert!((reached - distance).abs() < 2e-3, "{reached} {distance}");
        assert!((rise - apex).abs() < 1e-3, "{rise} {apex}");
        assert_eq!(plan.verdict, Verdict::Trusted, "{plan:?}");
        assert!(plan.margins.torque_share <= 1.0);
        assert!(plan.margins.beyond_joint_limit_rad <= 2e-3);
        assert!(plan.input_deviation < 1.5, "{}", plan.input_deviation);
    }
    // The body is highest there however legs swing in flight.
    let [_, rise] = planned(0.3, 0.16).expect("a plan").reached_m;
    assert!((rise - 0.16).abs() < 1e-3, "{rise}");
}

#[test]
fn motion_of_a_plan_is_its_own_integral_and_falls_freely_in_flight() {
    let plan = planned(0.3, 0.12).expect("a plan");
    let motion = &plan.motion;
    let step = motion.time_s[1] - motion.time_s[0];
    for sample in 1..motion.len() {
        for row in 0..18 {
            let moved = motion.x[(row, sample)] - motion.x[(row, sample - 1)];
            let mean = 0.5 * (motion.dx[(row, sample)] + motion.dx[(row, sample - 1)]);
            assert!((moved - mean * step).abs() < 2e-3, "{row} at {sample}");
        }
    }
    let flight: Vec<usize> = (0..motion.len())
        .filter(|&sample| motion.feet[sample] == [false; 4])
        .collect();
    let (first, last) = (flight[0], flight[flight.len() - 1]);
    let height = |sample: usize| {
        let dx = DVector::from_column_slice(motion.dx.column(sample).as_slice());
        (model().tangent(&dx).unwrap().encode * dx)[1] / 0.1
    };
    let fall = (height(last) - height(first)) / (step * (last - first) as f64);
    // By the mean of the training jumps, in which feet leave and land within a sample of the flags.
    assert!((fall + GRAVITY_M_S2).abs() < 5e-3 * GRAVITY_M_S2, "{fall}");
}

#[test]
fn plan_read_as_a_recording_has_the_planned_torques_inside_their_limits() {
    let plan = planned(0.3, 0.12).expect("a plan");
    let recording = Recording::from(plan.motion.clone());
    let mut bytes = Vec::new();
    let options = recording::WriteOptions::default();
    recording::write_to(&mut bytes, &recording, None, &options).unwrap();
    let read = recording::read_from_bytes("plan.csv", &bytes).unwrap();
    assert_eq!(read.segments[0].torque_nm, plan.motion.torque_nm);
    let limits = romc::robot_file::by_name("go1").unwrap().torque_limit_nm();
    for column in read.segments[0].torque_nm.column_iter() {
        let mut each = column.iter().zip(limits);
        assert!(each.all(|(t, limit)| t.abs() <= *limit), "{column}");
    }
}

/// The start of a jump, rolled so far from how it is recorded, and a plan from there.
fn rolled_start(roll_rad: f64) -> (DVector<f64>, Plan) {
    let first = &recordings("test", 1)[0].segments[0];
    let [mut x, dx] = [&first.x, &first.dx].map(|rows| rows.column(0).into_owned());
    x[15] += roll_rad;
    let goal = Goal::new(0.3, 0.12).unwrap().from_start(x.clone(), dx);
    let plan = plan(model(), &goal, &PlanSettings::default());
    (x, plan.expect("a plan"))
}

#[test]
fn plan_starts_from_the_state_it_is_given() {
    let (x, plan) = rolled_start(0.0);
    let z = model().encode(&x).unwrap();
    let started = model()
        .encode(&plan.motion.x.column(0).into_owned())
        .unwrap();
    assert!((z - started).amax() < 1e-4);
    assert!(!format!("{:?}", plan.verdict).contains("begin at the recorded start"));
}

#[test]
fn start_that_the_latent_coordinates_drop_is_told() {
    let (_, plan) = rolled_start(0.3);
    let Verdict::Extrapolates(reasons) = &plan.verdict else {
        panic!("{:?}", plan.verdict)
    };
    let told = reasons.iter().find(|reason| reason.contains("begin"));
    assert!(told.is_some_and(|reason| reason.contains("body.roll")));
}

#[test]
fn plan_whose_feet_do_not_stand_is_not_trusted() {
    let farthest = |name: &str, distance: f64, apex: f64| {
        let goal = Goal::new(distance, apex).unwrap();
        let plan = plan(&shipped_model(name), &goal, &PlanSettings::default()).expect("a plan");
        let told = format!("{:?}", plan.verdict).contains("feet on the ground move");
        (plan.margins.foot_drift_m, told)
    };
    let ([along, below], told) = farthest("go1-d4", 0.3, 0.12);
    assert!(along < 0.03 && below < 0.015 && !told);
    let ([along, below], told) = farthest("go2-async-d4", 0.4, 0.14);
    assert!(along > 0.05 && below > 0.025 && told);
}

#[test]
fn absurd_goals_have_reasons_and_no_plan() {
    for (distance, apex) in [
        (0.0, 0.12),
        (5.0, 0.12),
        (-0.3, 0.12),
        (0.3, 1.0),
        (0.3, 1e-9),
        (0.7, 0.12),
    ] {
        match planned(distance, apex) {
            Err(error) => assert!(!error.to_string().is_empty()),
            Ok(plan) => assert!(
                matches!(&plan.verdict, Verdict::Refused(reasons) if !reasons.is_empty()),
                "{distance} {apex}: {:?}",
                plan.verdict
            ),
        }
    }
    for wrong in [f64::NAN, f64::INFINITY, 0.0] {
        for goal in [Goal::new(wrong, 0.1), Goal::new(0.3, wrong)] {
            assert!(matches!(goal, Err(PlanError::Goal { .. })), "{wrong}");
        }
    }
}

#[test]
fn deviations_of_a_plan_grow_with_the_distance_of_the_goal() {
    let [near, beyond] = [0.33, 0.48].map(|distance| planned(distance, 0.125));
    let (near, beyond) = (near.expect("a plan"), beyond.expect("a plan"));
    assert!(beyond.input_deviation > 1.3 * near.input_deviation);
    assert!(beyond.cost > near.cost);
    assert_ne!(beyond.verdict, Verdict::Trusted);
}

#[test]
fn prior_survives_the_model_file_and_a_fault_in_it_is_named() {
    let text = artifact::to_text(model());
    let again = artifact::read_from_bytes("again", text.as_bytes()).expect("a model");
    assert_eq!(&again, model());
    let mut file: serde_json::Value = serde_json::from_str(&text).unwrap();
    file["prior"]["parts"][1]["z"].as_array_mut().unwrap().pop();
    let error = artifact::read_from_bytes("m", file.to_string().as_bytes()).unwrap_err();
    assert!(
        artifact::describe(&error).contains("prior.parts[1]"),
        "{error}"
    );
    file.as_object_mut().unwrap().remove("prior");
    let error = artifact::read_from_bytes("m", file.to_string().as_bytes()).unwrap_err();
    assert!(artifact::describe(&error).contains("`landmarks` needs `prior`"));
}

#[test]
fn jumps_recorded_up_to_touch_down_are_planned_up_to_it() {
    let mut training = recordings("train", 8);
    for segment in training.iter_mut().flat_map(|jump| &mut jump.segments) {
        let in_air = segment.feet.iter().rposition(|feet| *feet == [false; 4]);
        *segment = segment.slice(0..in_air.expect("a flight") + 12);
    }
    let model = learned(&training, &[], 4);
    let prior = model.jump_prior().expect("a prior without landings");
    let names: Vec<&str> = prior
        .landmarks
        .parts
        .iter()
        .map(|part| part.name.as_str())
        .collect();
    assert_eq!(names, ["crouch", "thrust", "flight"]);
    let [distance, apex, _] = prior.ranges();
    let goal = Goal::new(distance.mean, apex.mean).unwrap();
    let plan = plan(&model, &goal, &PlanSettings::default()).expect("a plan");
    let last = plan.motion.len() - 1;
    assert_eq!(plan.motion.feet[last], [false; 4]);
    assert!(plan.motion.dx[(BODY_Z, last)] < -0.3, "still falling");
    assert!((plan.reached_m[0] - distance.mean).abs() < 3e-3);
    assert!((plan.reached_m[1] - apex.mean).abs() < 3e-3);
}

#[test]
fn prior_cuts_jumps_by_contacts_and_is_nearer_to_a_jump_at_its_goal_than_the_mean_jump() {
    let training = recordings("train", 8);
    let model = learned(&training, &[], 4);
    let prior = model.jump_prior().expect("jumps of one kind");
    let landmarks = &prior.landmarks.parts;
    let names: Vec<&str> = landmarks.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["crouch", "thrust", "flight", "landing"]);
    assert_eq!(
        (prior.landmarks.jumps.len(), landmarks[2].feet),
        (8, [false; 4])
    );
    for (part, landmark) in prior.parts.iter().zip(landmarks) {
        let [least, most] = landmark.duration_range_s;
        assert!(least <= part.duration_s[0] && part.duration_s[0] <= most);
    }
    // Where the flight begins the body rises, where it ends it falls.
    let flight = &prior.parts[2];
    let rate = |node: usize| JumpPart::at(&flight.dz, node, &[1.0, 0.0, 0.0, 0.0])[1];
    assert!(rate(0) > 0.05 && rate(flight.nodes() - 1) < -0.05);
    let last = prior.parts.last().unwrap();
    let error = |features: &dyn Fn(usize) -> [f64; FEATURE_DIM]| -> f64 {
        let ends = training.iter().enumerate().map(|(jump, recording)| {
            let segment = &recording.segments[0];
            let x = segment.x.column(segment.len() - 1).into_owned();
            let end = JumpPart::at(&last.z, last.nodes() - 1, &features(jump));
            (end[0] - model.encode(&x).expect("complete")[0]).powi(2)
        });
        ends.sum()
    };
    let at_goal = error(&|jump| prior.features(prior.landmarks.jumps[jump]));
    let at_mean = error(&|_| [1.0, 0.0, 0.0, 0.0]);
    assert!(at_goal < 0.2 * at_mean, "{at_goal} {at_mean}");
}
