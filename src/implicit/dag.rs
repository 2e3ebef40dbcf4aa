//! A formula as a directed acyclic graph without equal nodes.
//!
//! Nodes live in one arena, children before parents, so that every pass is a loop: formulas of a
//! million terms neither overflow the stack nor need a recursive drop. Constants are folded when
//! a node is made, and `0*a` is 0 whatever a is: zeros of derivatives then vanish by themselves.

use crate::interner::Interner;
use crate::operation::{self, BinaryOp, UnaryOp};

/// Place of a node in its graph; children have smaller ids than parents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct NodeId(pub(crate) u32);

impl NodeId {
    pub(crate) fn row(self) -> usize {
        self.0 as usize
    }
}

/// One operation on earlier nodes. Constants are stored by bits, to be comparable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    Constant(u64),
    /// 0, 1, 2 for x, y, z.
    Variable(u8),
    Unary(UnaryOp, NodeId),
    Binary(BinaryOp, NodeId, NodeId),
    /// `a^n`, 2 <= |n| <= `LARGEST_POWER` or n = -1.
    Power(NodeId, i32),
    /// `smin(a, b, k)`.
    Blend([NodeId; 3]),
    /// The second where the first is not zero, else the third.
    Select([NodeId; 3]),
}

impl Node {
    /// The children, in order.
    pub(crate) fn children(&self) -> impl Iterator<Item = NodeId> + use<> {
        let (children, n) = match *self {
            Self::Constant(_) | Self::Variable(_) => ([NodeId(0); 3], 0),
            Self::Unary(_, a) | Self::Power(a, _) => ([a; 3], 1),
            Self::Binary(_, a, b) => ([a, b, b], 2),
            Self::Blend(abc) | Self::Select(abc) => (abc, 3),
        };
        children.into_iter().take(n)
    }
}

/// Larger powers go through the logarithm: beyond this, multiplications lose to `pow`.
const LARGEST_POWER: f64 = 64.0;

/// The arena.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dag {
    nodes: Vec<Node>,
    ids: Interner,
}

impl Dag {
    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.nodes[id.row()]
    }

    pub(crate) fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// The value of a constant node.
    pub(crate) fn value_of(&self, id: NodeId) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Whether the node is the constant `value`, bit for bit up to the sign of zero.
    #[expect(clippy::float_cmp, reason = "identities hold for the exact constants only")]
    pub(crate) fn is(&self, id: NodeId, value: f64) -> bool {
        self.value_of(id).is_some_and(|v| v == value)
    }

    /// Which nodes the roots need.
    pub(crate) fn reachable(&self, roots: &[NodeId]) -> Vec<bool> {
        let mut needed = vec![false; self.n_nodes()];
        for root in roots {
            needed[root.row()] = true;
        }
        for row in (0..self.n_nodes()).rev() {
            if needed[row] {
                self.nodes[row].children().for_each(|child| needed[child.row()] = true);
            }
        }
        needed
    }

    /// The node itself, found or appended, without simplification.
    pub(crate) fn intern(&mut self, node: Node) -> NodeId {
        self.ids.place(&mut self.nodes, node)
    }

    pub(crate) fn constant(&mut self, value: f64) -> NodeId {
        self.intern(Node::Constant(value.to_bits()))
    }

    pub(crate) fn variable(&mut self, axis: u8) -> NodeId {
        self.intern(Node::Variable(axis))
    }

    pub(crate) fn unary(&mut self, op: UnaryOp, a: NodeId) -> NodeId {
        match (op, self.node(a)) {
            (_, Node::Constant(bits)) => self.constant(op.apply(f64::from_bits(bits))),
            (UnaryOp::Neg, Node::Unary(UnaryOp::Neg, inner)) => inner,
            _ => self.intern(Node::Unary(op, a)),
        }
    }

    pub(crate) fn binary(&mut self, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
        if let (Some(x), Some(y)) = (self.value_of(a), self.value_of(b)) {
            return self.constant(op.apply(x, y));
        }
        match op {
            BinaryOp::Add => self.sum(a, b),
            BinaryOp::Sub => self.difference(a, b),
            BinaryOp::Mul => self.product(a, b),
            BinaryOp::Div => self.quotient(a, b),
            BinaryOp::Pow => self.general_power(a, b),
            BinaryOp::GuardedPow if self.value_of(b).is_some_and(|e| e >= 0.0) => {
                self.general_power(a, b)
            }
            _ => self.intern(Node::Binary(op, a, b)),
        }
    }

    fn sum(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        match (self.node(a), self.node(b)) {
            (_, Node::Unary(UnaryOp::Neg, b)) => self.difference(a, b),
            (Node::Unary(UnaryOp::Neg, a), _) => self.difference(b, a),
            _ => self.commutative(BinaryOp::Add, a, b),
        }
    }

    fn difference(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.unary(UnaryOp::Neg, b);
        }
        match self.node(b) {
            Node::Unary(UnaryOp::Neg, b) => self.sum(a, b),
            _ => self.intern(Node::Binary(BinaryOp::Sub, a, b)),
        }
    }

    fn product(&mut self, a: NodeId, b: NodeId) -> NodeId {
        if a == b {
            return self.power(a, 2);
        }
        for (factor, other) in [(a, b), (b, a)] {
            if self.is(factor, 0.0) {
                return factor;
            }
            if self.is(factor, 1.0) {
                return other;
            }
            if self.is(factor, -1.0) {
                return self.unary(UnaryOp::Neg, other);
            }
        }
        self.commutative(BinaryOp::Mul, a, b)
    }

    /// Dividing by a power of two is exact as a product, and a product is eight times faster.
    fn quotient(&mut self, a: NodeId, b: NodeId) -> NodeId {
        const MANTISSA: u64 = (1 << 52) - 1;
        match self.value_of(b) {
            Some(d) if d.is_normal() && d.recip().is_normal() && d.to_bits() & MANTISSA == 0 => {
                let inverse = self.constant(d.recip());
                self.product(a, inverse)
            }
            _ => self.intern(Node::Binary(BinaryOp::Div, a, b)),
        }
    }

    fn general_power(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match self.value_of(b) {
            Some(0.5) => self.unary(UnaryOp::Sqrt, a),
            Some(n) if n.fract() == 0.0 && n.abs() <= LARGEST_POWER => self.power(a, n as i32),
            _ => self.intern(Node::Binary(BinaryOp::Pow, a, b)),
        }
    }

    /// Arguments in the order of [`Self::rank`]: one node for both orders, and the same one
    /// whenever the leaves were first seen, so that canonical text reads as itself.
    fn commutative(&mut self, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
        debug_assert!(op.is_commutative());
        let (first, second) = if self.rank(a) <= self.rank(b) { (a, b) } else { (b, a) };
        self.intern(Node::Binary(op, first, second))
    }

    /// Constants by bits, variables by axis, then the other nodes in the order they were made.
    fn rank(&self, id: NodeId) -> (u8, u64) {
        match self.node(id) {
            Node::Constant(bits) => (0, bits),
            Node::Variable(axis) => (1, axis.into()),
            _ => (2, id.0.into()),
        }
    }

    /// `a^n` for a constant integer.
    pub(crate) fn power(&mut self, a: NodeId, n: i32) -> NodeId {
        match (n, self.value_of(a)) {
            (0, _) => self.constant(1.0),
            (1, _) => a,
            (_, Some(value)) => self.constant(operation::power(value, n)),
            _ if f64::from(n).abs() > LARGEST_POWER => {
                let exponent = self.constant(f64::from(n));
                self.intern(Node::Binary(BinaryOp::Pow, a, exponent))
            }
            _ => self.intern(Node::Power(a, n)),
        }
    }

    /// `smin(a, b, k) = min(a, b) - k * BlendGap((a-b)/k)`.
    pub(crate) fn blend(&mut self, a: NodeId, b: NodeId, k: NodeId) -> NodeId {
        let all_constant = [a, b, k].iter().all(|&id| self.value_of(id).is_some());
        if all_constant { self.blend_parts(a, b, k) } else { self.intern(Node::Blend([a, b, k])) }
    }

    /// The blend in terms of other nodes.
    pub(crate) fn blend_parts(&mut self, a: NodeId, b: NodeId, k: NodeId) -> NodeId {
        let smaller = self.binary(BinaryOp::Min, a, b);
        let t = self.blend_argument(a, b, k);
        let gap = self.unary(UnaryOp::BlendGap, t);
        let taken = self.binary(BinaryOp::Mul, k, gap);
        self.binary(BinaryOp::Sub, smaller, taken)
    }

    /// `(a-b)/k`.
    pub(crate) fn blend_argument(&mut self, a: NodeId, b: NodeId, k: NodeId) -> NodeId {
        let apart = self.binary(BinaryOp::Sub, a, b);
        self.binary(BinaryOp::Div, apart, k)
    }

    /// `p` where `condition` is not zero, else `q`.
    pub(crate) fn select(&mut self, condition: NodeId, p: NodeId, q: NodeId) -> NodeId {
        match self.value_of(condition) {
            _ if p == q => p,
            Some(c) if c != 0.0 => p,
            Some(_) => q,
            None => self.intern(Node::Select([condition, p, q])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_expressions_are_one_node() {
        let mut dag = Dag::default();
        let (x, y) = (dag.variable(0), dag.variable(1));
        let a = dag.binary(BinaryOp::Add, x, y);
        let b = dag.binary(BinaryOp::Add, y, x);
        let square = dag.binary(BinaryOp::Mul, a, b);
        assert_eq!(a, b);
        assert_eq!(dag.node(square), Node::Power(a, 2));
        assert_eq!(dag.n_nodes(), 4);
    }

    #[test]
    fn constants_fold_and_neutral_elements_vanish() {
        let mut dag = Dag::default();
        let x = dag.variable(0);
        let (zero, one, two) = (dag.constant(0.0), dag.constant(1.0), dag.constant(2.0));
        assert_eq!(dag.binary(BinaryOp::Add, x, zero), x);
        assert_eq!(dag.binary(BinaryOp::Mul, one, x), x);
        assert_eq!(dag.binary(BinaryOp::Pow, x, zero), one);
        let four = dag.binary(BinaryOp::Pow, two, two);
        assert_eq!(dag.value_of(four), Some(4.0));
        let halved = dag.binary(BinaryOp::Div, x, two);
        assert!(matches!(dag.node(halved), Node::Binary(BinaryOp::Mul, ..)));
    }
}
