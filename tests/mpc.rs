//! The latent MPC: its solver, its problem, its lifts and its behaviour under faults.

#[path = "mpc/control.rs"]
mod control;
#[path = "mpc/estimates.rs"]
mod estimates;
#[path = "mpc/failures.rs"]
mod failures;
#[path = "mpc/interface.rs"]
mod interface;
#[path = "mpc/lift_pyramids.rs"]
mod lift_pyramids;
#[path = "mpc/lifts.rs"]
mod lifts;
#[path = "mpc/nonlinear.rs"]
mod nonlinear;
mod outside;
#[path = "mpc/qp.rs"]
mod qp;
#[path = "mpc/random.rs"]
mod random;
#[path = "mpc/recordings.rs"]
mod recordings;
#[path = "mpc/riccati.rs"]
mod riccati;
#[path = "mpc/rows.rs"]
mod rows;
#[path = "mpc/supervisor.rs"]
mod supervisor;
#[path = "mpc/swing.rs"]
mod swing;
#[path = "mpc/synthetic.rs"]
mod synthetic;
mod tools;
