//! Joint training of nonlinear encoders and decoders.
//!
//! Enters: what linear maps are trained from, and the widths of the layers. Leaves: networks and Xi a phase. Read
//! [`layers`] first (networks with their time derivatives and Jacobians, forwards and backwards), then [`projection`]
//! (`u_lat = pinv(J^T) u` at every sample), [`loss`] and [`stages`]. Batches, losses' names and weights, schedule and
//! Adam are those of the linear training beside it.

pub mod fold;
pub mod layers;
pub mod loss;
pub mod projection;
pub mod run;
pub mod stages;
