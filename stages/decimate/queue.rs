//! Priority queue of edges with lazy removal.

use crate::heap::WordHeap;
use isospline_geometry::{EditMesh, HalfEdge};

/// Bits of the high word of a cost that count in large meshes: sign, exponent and 5 of the
/// mantissa, steps of 3 %. Edges of equal cost then come in the order of the mesh, where the loop
/// would otherwise miss the cache at every step.
const COARSE: u32 = !0x7fff;
/// Half-edges from which a mesh is large: smaller ones stay in the cache in any order.
const LARGE: usize = 600_000;

/// Edges by ascending cost, ties by half-edge.
///
/// Costs are kept to 20 bits of mantissa at most so that an entry is one word: finer differences
/// do not matter for the order, and the heap is what the loop waits for. An entry is current if
/// its cost is the one last set for its half-edge; others are skipped when met.
#[derive(Debug)]
pub(crate) struct EdgeQueue {
    heap: WordHeap,
    /// High word of the cost of each half-edge: non-negative floats sort like their bits.
    cost: Vec<u32>,
    /// The bits of it that count.
    bits: u32,
}

impl EdgeQueue {
    /// An empty queue for a mesh with `half_edges` rows.
    pub(crate) fn new(half_edges: usize) -> Self {
        let bits = if half_edges < LARGE { u32::MAX } else { COARSE };
        Self { heap: WordHeap::default(), cost: vec![0; half_edges], bits }
    }

    /// Sets the non-negative cost of the edge `h`, `opposite` without queueing it.
    pub(crate) fn set(&mut self, h: HalfEdge, opposite: HalfEdge, cost: f64) {
        let high = (cost.to_bits() >> 32) as u32 & self.bits;
        self.cost[h.row()] = high;
        self.cost[opposite.row()] = high;
    }

    /// Queues the edge `h`, `opposite` at a new cost in place of any older one.
    pub(crate) fn push(&mut self, h: HalfEdge, opposite: HalfEdge, cost: f64) {
        self.set(h, opposite, cost);
        self.heap.push(self.entry(h.min(opposite)));
    }

    /// Queues all edges of the mesh at the costs last set.
    pub(crate) fn refill(&mut self, mesh: &EditMesh) {
        self.heap = WordHeap::from_words(mesh.edges().map(|h| self.entry(h)).collect());
    }

    /// The cheapest edge that is still there.
    pub(crate) fn pop(&mut self, mesh: &EditMesh) -> Option<HalfEdge> {
        loop {
            let entry = self.heap.pop()?;
            let h = HalfEdge(entry as u32);
            if self.entry(h) == entry && mesh.is_face(h.face()) {
                return Some(h);
            }
        }
    }

    fn entry(&self, h: HalfEdge) -> u64 {
        u64::from(self.cost[h.row()]) << 32 | u64::from(h.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::{TriangleMesh, Vec3};

    #[test]
    fn edges_come_by_cost_and_a_newer_cost_replaces_the_older() {
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let mesh = EditMesh::new(TriangleMesh { positions, faces }).unwrap();
        let mut queue = EdgeQueue::new(12);
        let edges: Vec<HalfEdge> = mesh.edges().collect();
        for (cost, &h) in (1u32..).zip(&edges) {
            queue.set(h, mesh.opposite(h).unwrap(), f64::from(cost));
        }
        queue.refill(&mesh);
        queue.push(edges[0], mesh.opposite(edges[0]).unwrap(), 3.5);
        let order: Vec<HalfEdge> = std::iter::from_fn(|| queue.pop(&mesh)).collect();
        assert_eq!(order, [1, 2, 0, 3, 4, 5].map(|k: usize| edges[k]));
    }
}
