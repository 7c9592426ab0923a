//! The consistent lift with the structured solver against the one with clarabel.

use crate::synthetic::unwatched;
use romc::mpc::{
    Cone, ConeProgram, ConsistentLift, ControlModel, MpcSettings, Outcome, QpSettings, QpSolver,
    Solver, SolverProfile, StanceState, foot_forces, sparse,
};
use romc::robot::{JOINT_DIM, STATE_DIM};

use crate::random::Random;

const FRICTION: f64 = 0.6;
const PRIOR_WEIGHT: f64 = 1e-3;

fn plant(name: &str) -> ControlModel {
    let path = format!("{}/models/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let model = romc::artifact::read(std::path::Path::new(&path)).expect("shipped");
    romc::mpc::control_model(&model).expect("complete")
}

fn lift_by(plant: &ControlModel, solver: Solver) -> ConsistentLift {
    let settings = MpcSettings {
        solver,
        foot_friction: FRICTION,
        lift_prior_weight: PRIOR_WEIGHT,
        ..unwatched()
    };
    ConsistentLift::new(plant, &settings).expect("a sound program")
}

/// A posture near standing with some feet on the ground, and a latent input up to `size` standard
/// deviations from the phase's mean.
fn sample(plant: &ControlModel, size: f64, random: &mut Random) -> (StanceState, Vec<f64>) {
    let (feet, phase) = loop {
        let feet = std::array::from_fn(|_| random.signed() > -0.6);
        if let Some(phase) = plant.phase_for(feet) {
            break (feet, phase);
        }
    };
    let stance = StanceState {
        joints_rad: std::array::from_fn(|i| [0.0, 0.8, -1.6][i % 3] + 0.2 * random.normal()),
        attitude_rad: std::array::from_fn(|_| 0.2 * random.normal()),
        feet,
        phase,
        losses_nm: std::array::from_fn(|_| 2.0 * random.signed()),
        near_nm: None,
        keeps_swing: false,
    };
    let phase = &plant.phases()[phase];
    let d = plant.latent_dim();
    let off = nalgebra::DVector::from_fn(d, |_, _| size * random.normal());
    let u_lat = &phase.latent_mean + &phase.latent_root * off;
    (stance, u_lat.as_slice().to_vec())
}

/// The rows `(row, bound)` of the pyramids and torque limits, on torques.
fn rows(plant: &ControlModel, stance: &StanceState) -> Vec<([f64; JOINT_DIM], f64)> {
    let limits = plant.robot().torque_limit_nm();
    let mut rows = Vec::new();
    for (joint, limit) in limits.iter().enumerate() {
        for sign in [1.0, -1.0] {
            let mut row = [0.0; JOINT_DIM];
            row[joint] = sign / limit;
            rows.push((row, 1.0 - sign * stance.losses_nm[joint] / limit));
        }
    }
    let forces = foot_forces(plant, stance).expect("bent legs");
    for (leg, force) in forces.iter().enumerate() {
        let Some(force) = force else { continue };
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
            let mut row = [0.0; JOINT_DIM];
            for k in 0..3 {
                let within = FRICTION / 2f64.sqrt() * force[(2, k)];
                row[3 * leg + k] = (sign * force[(axis, k)] - within) / 100.0;
            }
            rows.push((row, 0.0));
        }
    }
    rows
}

/// `M`, and with it the Hessian and gradient of the documented cost at zero torque.
fn cost_of(
    plant: &ControlModel,
    stance: &StanceState,
    u_lat: &[f64],
) -> (Vec<Vec<f64>>, Vec<f64>, f64) {
    let map = plant
        .input_rule()
        .wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet)
        .expect("finite");
    let mut unit = |joint: usize| {
        let mut u = [0.0; STATE_DIM];
        u[joint] = 1.0;
        for axis in 0..6 {
            u[12 + axis] = map[(axis, joint)];
        }
        let mut column = vec![0.0; plant.latent_dim()];
        plant.project(&[0.0; STATE_DIM], &u, &mut column);
        column
    };
    let columns: Vec<Vec<f64>> = (0..JOINT_DIM).map(&mut unit).collect();
    let phase = &plant.phases()[stance.phase];
    let weighted = phase.torque_precision * PRIOR_WEIGHT;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let hessian = (0..JOINT_DIM)
        .map(|i| {
            let row = (0..JOINT_DIM).map(|j| dot(&columns[i], &columns[j]) + weighted[(i, j)]);
            row.collect()
        })
        .collect();
    let pull = weighted * phase.torque_mean;
    let gradient = (0..JOINT_DIM)
        .map(|i| -dot(&columns[i], u_lat) - pull[i])
        .collect();
    let constant = dot(u_lat, u_lat) + (phase.torque_mean.transpose() * pull)[0];
    (hessian, gradient, constant)
}

fn value(cost: &(Vec<Vec<f64>>, Vec<f64>, f64), torque: &[f64; JOINT_DIM]) -> f64 {
    let (hessian, gradient, constant) = cost;
    let mut sum = *constant;
    for i in 0..JOINT_DIM {
        sum += 2.0 * gradient[i] * torque[i];
        for j in 0..JOINT_DIM {
            sum += hessian[i][j] * torque[i] * torque[j];
        }
    }
    sum
}

/// The program with pyramids, solved by clarabel to the end of its precision.
fn by_clarabel(
    cost: &(Vec<Vec<f64>>, Vec<f64>, f64),
    rows: &[([f64; JOINT_DIM], f64)],
) -> [f64; JOINT_DIM] {
    let hessian = (0..JOINT_DIM).flat_map(|col| (0..=col).map(move |row| (row, col)));
    let hessian: Vec<_> = hessian
        .map(|(row, col)| (row, col, cost.0[row][col]))
        .collect();
    let all = (0..rows.len()).flat_map(|row| (0..JOINT_DIM).map(move |col| (row, col)));
    let all: Vec<_> = all.map(|(row, col)| (row, col, rows[row].0[col])).collect();
    let program = ConeProgram {
        p: sparse(JOINT_DIM, JOINT_DIM, &hessian),
        q: cost.1.clone(),
        a: sparse(rows.len(), JOINT_DIM, &all),
        b: rows.iter().map(|(_, bound)| *bound).collect(),
        cones: vec![Cone::Nonnegative(rows.len())],
    };
    let settings = QpSettings {
        profile: SolverProfile::Scaled,
        tolerance: 1e-12,
        max_iterations: 200,
        ..QpSettings::default()
    };
    let mut solver = QpSolver::new(program, settings).expect("sound");
    let outcome = solver.solve();
    assert!(
        matches!(outcome, Outcome::Solved | Outcome::Inaccurate),
        "{outcome:?}"
    );
    std::array::from_fn(|joint| solver.solution()[joint])
}

#[test]
fn structured_lift_solves_the_program_with_pyramids_and_is_clarabels_where_no_cone_is_active() {
    for name in ["go1-d2", "go1-d4", "go1-d6", "go2-async-d4"] {
        let plant = plant(name);
        let (mut cones, mut pyramids) = (
            lift_by(&plant, Solver::Clarabel),
            lift_by(&plant, Solver::Riccati),
        );
        let mut random = Random::new(77);
        let (mut free, mut active, mut most, mut dearer) = (0, 0, 0, 0);
        let (mut worst_free, mut worst) = (0.0_f64, 0.0_f64);
        for number in 0..1200 {
            let size = [0.5, 1.5, 5.0][number % 3];
            let (stance, u_lat) = sample(&plant, size, &mut random);
            let by_cones = cones.lift(&plant, &u_lat, &stance).expect("bent legs");
            let found = pyramids.lift(&plant, &u_lat, &stance).expect("bent legs");
            most = most.max(pyramids.iterations());
            let off = |other: &[f64; JOINT_DIM]| {
                let pairs = found.iter().zip(other);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let rows = rows(&plant, &stance);
            let room = rows.iter().map(|(row, bound)| {
                bound - row.iter().zip(&found).map(|(a, b)| a * b).sum::<f64>()
            });
            let least = room.fold(f64::INFINITY, f64::min);
            assert!(least > -1e-7, "{name} {number}: {least} of a row is left");
            let cost = cost_of(&plant, &stance, &u_lat);
            if pyramids.iterations() == 0 {
                free += 1;
                worst_free = worst_free.max(off(&by_cones));
            } else {
                active += 1;
                worst = worst.max(off(&by_clarabel(&cost, &rows)));
                let (inside, outside) = (value(&cost, &found), value(&cost, &by_cones));
                assert!(
                    inside > outside - 2e-4 * outside,
                    "{name} {number}: {inside} {outside}"
                );
                dearer += usize::from(inside > 1.001 * outside);
            }
        }
        println!(
            "{name}: {free} free, {worst_free:.1e} N m off; {active} active, {worst:.1e} N m off, \
             {dearer} dearer than with cones, at most {most} iterations"
        );
        assert!(free > 100 && active > 100 && dearer > 20);
        assert!(worst_free < 1e-7 && worst < 1e-4 && most <= 20);
    }
}
