//! Data for tests: a known system of two latents, a driven oscillator in contact and a falling body in flight; shipped
//! jumps.

use std::fmt::Display;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector, Vector2};

use super::dataset::{Dataset, Jump, ScaleOptions};
use super::features::Features;
use super::growth::Growth;
use super::judge::Judge;
use super::latent::{EncodedSet, Latent};
use super::options::TrainOptions;
use super::progress::{Monitor, Progress};
use super::refine::Refiner;
use super::sparse::Knowledge;
use super::task::{Fitted, Maps};
use crate::evaluate::shipped;
use crate::model::{AffineMap, Library, StandardLibrary};
use crate::recording::PhaseRule;
use crate::robot::{InputRule, STATE_DIM, WrenchFrame};

/// Samples between contact and flight.
const LIFT_OFF: usize = 120;
const STEP_S: f64 = 0.002;

pub(super) fn go1(names: impl IntoIterator<Item = impl Display>) -> Dataset {
    let names = names.into_iter().map(|name| format!("go1/{name}"));
    let jumps: Vec<_> = names.map(|name| shipped(&name)).collect();
    let options = TrainOptions::new("test", 4);
    let rule = InputRule::published(crate::robot_file::by_name("go1").expect("known"));
    let scaling = options.scaling.factors();
    Dataset::new(&jumps[..], &rule, &options.phases, &scaling, 11).expect("jumps")
}

pub(super) fn standard_library(latent_dim: usize, degree: u32, trigonometric: bool) -> Library {
    let standard = StandardLibrary {
        degree,
        trigonometric,
        inputs: true,
    };
    Library::standard(latent_dim, standard).expect("small library")
}

/// Library of the terms 1, z1, z2, dz1, dz2, u1, u2, and the known system's coefficients.
pub(super) fn known() -> (Features, Vec<DMatrix<f64>>) {
    let features = Features::new(&standard_library(2, 1, false));
    let mut contact = DMatrix::zeros(7, 2);
    let mut flight = contact.clone();
    (contact[(1, 0)], contact[(3, 0)], contact[(5, 0)]) = (-40.0, -3.0, 5.0);
    (contact[(6, 1)], contact[(1, 1)]) = (8.0, -2.0);
    (flight[(3, 0)], flight[(0, 1)]) = (-0.5, -0.981);
    (features, vec![contact, flight])
}

/// `n_jumps` jumps of the known system, integrated with fine steps, and their latent samples.
pub(super) fn jumps(n_jumps: usize) -> (Dataset, Vec<Latent>) {
    let latent: Vec<Latent> = (0..n_jumps).map(simulate).collect();
    let jumps = latent.iter().map(|samples| {
        let n = samples.z.ncols();
        let lift = |block: &DMatrix<f64>| {
            let mut full = DMatrix::zeros(STATE_DIM, n);
            full.set_row(12, &block.row(0));
            full.set_row(14, &block.row(1));
            full
        };
        Jump {
            path: PathBuf::from("oscillator.csv"),
            time_s: (0..n).map(|i| i as f64 * STEP_S).collect(),
            x: lift(&samples.z),
            u: lift(&samples.u_lat),
            dx: lift(&samples.dz),
            ddx: lift(&samples.ddz),
            losses: None,
            phase: (0..n).map(|i| usize::from(i >= LIFT_OFF)).collect(),
            spans: vec![(0, 0..LIFT_OFF), (1, LIFT_OFF..n)],
            implausible: Vec::new(),
        }
    });
    let robot = crate::robot_file::by_name("go1").expect("known");
    let dataset = Dataset {
        jumps: jumps.collect(),
        phases: PhaseRule::two_phase(),
        rule: InputRule::new(robot, None, WrenchFrame::World),
        scaling: ScaleOptions::uniform(1.0).factors(),
        smoothing: 1,
    };
    (dataset, latent)
}

/// Numbers with the linear encoder of these weights, and Xi of one phase.
pub(super) fn fitted(weights: DMatrix<f64>, xi: DMatrix<f64>) -> Fitted {
    let map = |w: DMatrix<f64>| {
        let bias = DVector::zeros(w.nrows());
        AffineMap::new("map", w, bias).expect("finite").into()
    };
    Fitted {
        maps: Maps {
            decoder: map(weights.transpose()),
            encoder: map(weights.clone()),
            weights,
            training: Vec::new(),
            validation: Vec::new(),
        },
        xi: vec![xi],
        choice: None,
        score: 0.0,
    }
}

/// What `work` makes of a refiner by three jumps of the known system, watched by nobody.
pub(super) fn with_refiner<T>(
    bound_per_s: Option<f64>,
    knowledge: &[Knowledge],
    work: impl FnOnce(&Refiner<'_>, &mut Monitor<'_>) -> T,
) -> T {
    let ((dataset, latent), (features, _)) = (jumps(3), known());
    let set = EncodedSet::new(&dataset, &latent);
    let judge = Judge::new(&features, set);
    let refiner = Refiner {
        knowledge,
        growth: &Growth::of_jumps(bound_per_s, set, &features),
        training: &judge,
        judge: &judge,
    };
    let (mut nothing, cancel) = (|_: Progress| {}, AtomicBool::new(false));
    work(&refiner, &mut Monitor::new(&mut nothing, &cancel))
}

fn simulate(seed: usize) -> Latent {
    let ((_, xi), number, n, fine) = (known(), seed as f64, 200, 50);
    let input = |time: f64| Vector2::new((9.0 * time + number).sin(), (5.0 * time).cos());
    let acceleration = |phase: usize, z: &Vector2<f64>, dz: &Vector2<f64>, time: f64| {
        let u = input(time);
        let theta = DVector::from_column_slice(&[1.0, z.x, z.y, dz.x, dz.y, u.x, u.y]);
        let ddz = xi[phase].tr_mul(&theta);
        Vector2::new(ddz[0], ddz[1])
    };
    let mut z = Vector2::new(0.1 + 0.02 * number, -0.05);
    let mut dz = Vector2::new(0.3, 0.2 - 0.1 * number);
    let blank = DMatrix::zeros(2, n);
    let mut latent = Latent {
        z: blank.clone(),
        dz: blank.clone(),
        ddz: blank.clone(),
        u_lat: blank,
    };
    for i in 0..n {
        let (phase, start) = (usize::from(i >= LIFT_OFF), i as f64 * STEP_S);
        latent.z.set_column(i, &z);
        latent.dz.set_column(i, &dz);
        latent
            .ddz
            .set_column(i, &acceleration(phase, &z, &dz, start));
        latent.u_lat.set_column(i, &input(start));
        let h = STEP_S / f64::from(fine);
        for k in 0..fine {
            let ddz = acceleration(phase, &z, &dz, start + f64::from(k) * h);
            z += dz * h + ddz * (0.5 * h * h);
            dz += ddz * h;
        }
    }
    latent
}
