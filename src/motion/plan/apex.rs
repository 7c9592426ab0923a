//! Where the body is to be highest.

use super::affine::Affine;
use super::transcribe::Task;
use crate::robot::{BODY_Z, GRAVITY_M_S2};

impl Task<'_> {
    /// Takes the apex at the node of the flight where the body is highest at an iterate.
    pub fn place_apex(&mut self, y: &[f64]) {
        let flight = self.flight();
        let height = |node: usize| self.x(flight, node, BODY_Z).at(y);
        let nodes = 0..=self.seed.parts[flight].intervals();
        let highest = nodes.max_by(|a, b| height(*a).total_cmp(&height(*b)));
        self.apex_node = highest.expect("invariant: a part has nodes");
    }

    /// The part in the air.
    pub fn flight(&self) -> usize {
        let mut parts = self.seed.parts.iter();
        let flight = parts.position(|part| !part.is_grounded());
        flight.expect("invariant: checked with the model")
    }

    /// The part at whose beginning feet of a part stand as they are to stay: the first, or that of the landing.
    pub fn anchor_part(&self, part: usize) -> usize {
        if part > self.flight() { part } else { 0 }
    }

    /// Height that the body reaches by its height and speed at the node of the apex, less the height
    /// that is wanted; linear about the iterate.
    pub(super) fn apex(&self, y: &[f64]) -> Affine {
        let flight = self.flight();
        let mut height = self.x(flight, self.apex_node, BODY_Z);
        height.constant -= self.start_x(BODY_Z) + self.seed.goal.apex_m();
        let speed = self.dx(flight, self.apex_node, BODY_Z);
        let now = speed.at(y);
        height.add_scaled(&speed, now.abs() / GRAVITY_M_S2);
        height.constant -= 0.5 * now * now.abs() / GRAVITY_M_S2;
        height
    }
}
