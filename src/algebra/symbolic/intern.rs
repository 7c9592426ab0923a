//! Hash consing: one id per distinct node.

use std::hash::{BuildHasherDefault, Hash, Hasher};

use super::node::{ExprId, Node};

/// A multiplicative hasher for short keys of small integers (ids, numbers): such keys are the
/// pool's own, so resistance to chosen collisions is not needed, only speed.
#[derive(Clone, Copy, Default)]
pub(super) struct IdHasher(u64);

/// Builds [`IdHasher`]s for the standard maps.
pub(super) type BuildIdHasher = BuildHasherDefault<IdHasher>;

/// Odd constant with well mixed bits (the golden ratio in fixed point).
const MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

impl Hasher for IdHasher {
    fn finish(&self) -> u64 {
        // The low bits of a product know only the low bits of its factors: fold the high half in.
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(26) ^ word).wrapping_mul(MULTIPLIER);
    }

    fn write_u8(&mut self, word: u8) {
        self.write_u64(u64::from(word));
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }

    fn write_i64(&mut self, word: i64) {
        self.write_u64(word as u64);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }

    fn write_isize(&mut self, word: isize) {
        self.write_u64(word as u64);
    }
}

/// Open-addressing index into the pool's nodes; the nodes themselves are stored once, outside.
#[derive(Clone, Debug)]
pub(super) struct InternTable {
    /// Half of the node's hash and its id, or [`EMPTY`]; the length is a power of two.
    ///
    /// Comparing hashes first spares a look at most nodes that are not the one sought.
    slots: Vec<(u32, u32)>,
    used: usize,
}

const EMPTY: (u32, u32) = (0, u32::MAX);

impl InternTable {
    pub(super) fn new() -> InternTable {
        InternTable {
            slots: vec![EMPTY; 64],
            used: 0,
        }
    }

    /// The id of a node equal to `node`, or the free slot where it belongs.
    pub(super) fn find(&self, nodes: &[Node], node: &Node) -> Result<ExprId, usize> {
        let mask = self.slots.len() - 1;
        let sought = hash(node);
        let mut slot = sought as usize & mask;
        loop {
            match self.slots[slot] {
                EMPTY => return Err(slot),
                (found, id) if found == sought && nodes[id as usize] == *node => {
                    return Ok(ExprId(id));
                }
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// Records `id`, whose node was just looked up, in the free slot `slot`.
    pub(super) fn fill(&mut self, slot: usize, id: ExprId, nodes: &[Node]) {
        self.slots[slot] = (hash(&nodes[id.index()]), id.0);
        self.used += 1;
        if self.used * 2 > self.slots.len() {
            self.grow();
        }
    }

    fn grow(&mut self) {
        let size = self.slots.len() * 2;
        let entries = std::mem::replace(&mut self.slots, vec![EMPTY; size]);
        for entry in entries.into_iter().filter(|entry| *entry != EMPTY) {
            let mut slot = entry.0 as usize & (size - 1);
            while self.slots[slot] != EMPTY {
                slot = (slot + 1) & (size - 1);
            }
            self.slots[slot] = entry;
        }
    }
}

fn hash(node: &Node) -> u32 {
    let mut hasher = IdHasher::default();
    node.hash(&mut hasher);
    hasher.finish() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbolic::Number;

    #[test]
    fn table_finds_every_node_after_growing() {
        let nodes: Vec<Node> = (0..5_000)
            .map(|n| Node::Number(Number::integer(n)))
            .collect();
        let mut table = InternTable::new();
        for (index, node) in nodes.iter().enumerate() {
            let slot = table
                .find(&nodes[..index], node)
                .expect_err("node is not in the table yet");
            table.fill(slot, ExprId(index as u32), &nodes[..=index]);
        }
        for (index, node) in nodes.iter().enumerate() {
            assert_eq!(table.find(&nodes, node), Ok(ExprId(index as u32)));
        }
    }
}
