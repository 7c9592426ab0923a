//! The latent MPC: its solver, its problem, its lifts and what it does when things go wrong.

#[path = "mpc/qp.rs"]
mod qp;
#[path = "mpc/random.rs"]
mod random;
