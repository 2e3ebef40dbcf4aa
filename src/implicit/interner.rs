//! Equal nodes get equal numbers: a table from nodes to their places in the arena.
//!
//! The table holds places alone, four bytes each, and looks at the arena for the rest: a formula of
//! a million terms takes 30 MB of it where an ordered map of the nodes takes 130. Numbers are
//! given in the order of first sight, so no result depends on the hash.

use crate::dag::{Node, NodeId};
use std::hash::{Hash, Hasher};

/// A place that is free; no graph has so many nodes.
const FREE: u32 = u32::MAX;

/// Open addressing, at most half full.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interner {
    slots: Vec<u32>,
}

impl Interner {
    /// The place of `node` in `arena`, to the end of which it is added if it is new.
    pub(crate) fn place(&mut self, arena: &mut Vec<Node>, node: Node) -> NodeId {
        if 2 * (arena.len() + 1) > self.slots.len() {
            self.grow(arena);
        }
        let slot = self.slot(arena, &node);
        if self.slots[slot] == FREE {
            self.slots[slot] = u32::try_from(arena.len())
                .ok()
                .filter(|&place| place != FREE)
                .expect("invariant: below 2^32 - 1 nodes");
            arena.push(node);
        }
        NodeId(self.slots[slot])
    }

    /// The slot that holds `node`, or the free one that it belongs to.
    fn slot(&self, arena: &[Node], node: &Node) -> usize {
        let mask = self.slots.len() - 1;
        let mut hash = Mixer(0);
        node.hash(&mut hash);
        let mut slot = hash.finish() as usize & mask;
        while self.slots[slot] != FREE && arena[self.slots[slot] as usize] != *node {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self, arena: &[Node]) {
        const LEAST: usize = 64;
        let n_slots = (2 * self.slots.len()).max(LEAST);
        self.slots = vec![FREE; n_slots];
        for (place, node) in arena.iter().enumerate() {
            let slot = self.slot(arena, node);
            self.slots[slot] = place as u32;
        }
    }
}

/// Multiplies and folds: nodes are a few small numbers, and their bits must reach the low ones.
struct Mixer(u64);

impl Mixer {
    fn mix(&mut self, word: u64) {
        // The golden ratio of 2^64, odd; the product's high half depends on all bits below it.
        const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
        let product = u128::from(self.0 ^ word ^ FACTOR) * u128::from(FACTOR);
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

impl Hasher for Mixer {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.mix(u64::from(byte));
        }
    }

    fn write_u8(&mut self, word: u8) {
        self.mix(u64::from(word));
    }

    fn write_u32(&mut self, word: u32) {
        self.mix(u64::from(word));
    }

    fn write_u64(&mut self, word: u64) {
        self.mix(word);
    }

    fn write_i32(&mut self, word: i32) {
        self.mix(u64::from(word.cast_unsigned()));
    }

    fn write_isize(&mut self, word: isize) {
        self.mix(word.cast_unsigned() as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operation::BinaryOp;

    #[test]
    fn equal_nodes_are_one_and_places_follow_first_sight() {
        let (mut interner, mut arena) = (Interner::default(), Vec::new());
        let constant = |k: u32| Node::Constant(f64::from(k).to_bits());
        let sum = |a, b| Node::Binary(BinaryOp::Add, NodeId(a), NodeId(b));
        let mut expected = Vec::new();
        for k in 0..400 {
            for node in [constant(k), sum(k, 2 * k), sum(2 * k, k), constant(k / 2)] {
                let place = expected.iter().position(|seen| *seen == node);
                let place = place.unwrap_or_else(|| {
                    expected.push(node);
                    expected.len() - 1
                });
                assert_eq!(interner.place(&mut arena, node), NodeId(place as u32));
            }
        }
        assert_eq!(arena, expected);
    }

    #[test]
    fn numbers_in_a_row_are_found_without_long_searches() {
        let (mut interner, mut arena) = (Interner::default(), Vec::new());
        for k in 0..20_000 {
            interner.place(&mut arena, Node::Constant(f64::from(k).to_bits()));
            interner.place(&mut arena, Node::Power(NodeId(k as u32), 2));
        }
        // Half full, random places would leave no run as long as this.
        let runs = interner.slots.split(|&slot| slot == FREE);
        let longest = runs.map(<[u32]>::len).max();
        assert!(longest < Some(100), "{longest:?}");
    }
}
