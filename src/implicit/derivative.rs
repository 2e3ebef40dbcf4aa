//! Derivatives of a formula as further nodes of its graph.
//!
//! Derivatives are formulas too: structural zeros (d/dx of y) vanish, common parts are shared,
//! and one evaluator serves values, gradients, Hessians and enclosures. Conventions at kinks
//! stand in [`crate::formula`].

use crate::dag::{Dag, Node, NodeId};
use crate::operation::{BinaryOp, UnaryOp};
use BinaryOp::{
    Add, AngleJump, AngleSlope, Atan2, Div, GuardedPow, LessEqual, Max, Min, Mul, Pow, PowJump, Sub,
};

/// The three first derivatives of `root`, appended to `dag`.
pub(crate) fn gradient(dag: &mut Dag, root: NodeId) -> [NodeId; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| differentiate(dag, &[root], axis)[0]);
    [x, y, z]
}

/// The six second derivatives `[xx, xy, xz, yy, yz, zz]`, from the first.
pub(crate) fn hessian(dag: &mut Dag, [x, y, z]: [NodeId; 3]) -> [NodeId; 6] {
    let xx = differentiate(dag, &[x], 0);
    let xy_yy = differentiate(dag, &[x, y], 1);
    let xz_yz_zz = differentiate(dag, &[x, y, z], 2);
    [xx[0], xy_yy[0], xz_yz_zz[0], xy_yy[1], xz_yz_zz[1], xz_yz_zz[2]]
}

/// d/d(axis) of every root: one pass over the arena, children first.
fn differentiate(dag: &mut Dag, roots: &[NodeId], axis: u8) -> Vec<NodeId> {
    let needed = dag.reachable(roots);
    let zero = dag.constant(0.0);
    let one = dag.constant(1.0);
    let mut slopes = vec![zero; needed.len()];
    for row in (0..needed.len()).filter(|&row| needed[row]) {
        let id = NodeId(row as u32);
        slopes[row] = match dag.node(id) {
            Node::Variable(v) if v == axis => one,
            node => Chain { dag, zero, slopes: &slopes }.slope(id, node),
        };
    }
    roots.iter().map(|root| slopes[root.row()]).collect()
}

/// The chain rule for one node; `slopes` are the derivatives of all earlier ones.
struct Chain<'a> {
    dag: &'a mut Dag,
    zero: NodeId,
    slopes: &'a [NodeId],
}

impl Chain<'_> {
    fn slope(&mut self, id: NodeId, node: Node) -> NodeId {
        if node.children().all(|child| self.slopes[child.row()] == self.zero) {
            return self.zero;
        }
        match node {
            Node::Constant(_) | Node::Variable(_) => self.zero,
            Node::Unary(op, a) => self.unary(id, op, a),
            Node::Binary(op, a, b) => self.binary(id, op, a, b),
            Node::Power(a, n) => {
                let factor = self.dag.power(a, n - 1);
                let factor = self.scale(f64::from(n), factor);
                self.mul(factor, self.slopes[a.row()])
            }
            Node::Blend([a, b, k]) => self.blend(a, b, k),
            Node::Select([c, p, q]) => {
                self.dag.select(c, self.slopes[p.row()], self.slopes[q.row()])
            }
        }
    }

    fn unary(&mut self, id: NodeId, op: UnaryOp, a: NodeId) -> NodeId {
        use UnaryOp as U;
        let factor = match op {
            U::Neg => return self.neg(self.slopes[a.row()]),
            U::Abs => self.dag.unary(U::Sign, a),
            U::Sign => self.dag.unary(U::SignSlope, a),
            U::Floor => self.dag.unary(U::FloorSlope, a),
            U::Sqrt => self.dag.unary(U::HalfInverse, id),
            U::Exp => id,
            U::Ln => self.inverse(a),
            U::GuardedLn => self.dag.unary(U::GuardedInverse, a),
            U::Log10 => {
                let inverse = self.inverse(a);
                self.scale(std::f64::consts::LOG10_E, inverse)
            }
            U::HalfInverse => {
                let square = self.dag.power(id, 2);
                self.scale(-2.0, square)
            }
            U::GuardedInverse => {
                let square = self.dag.power(id, 2);
                self.neg(square)
            }
            U::SignSlope | U::FloorSlope | U::BlendCurvature => self.zero,
            U::BlendGap => {
                let (slope, sign) = (self.dag.unary(U::BlendSlope, a), self.dag.unary(U::Sign, a));
                let half = self.scale(0.5, sign);
                self.sub(slope, half)
            }
            U::BlendSlope => self.dag.unary(U::BlendCurvature, a),
            _ => self.transcendental(id, op, a),
        };
        self.mul(factor, self.slopes[a.row()])
    }

    /// Outer slope of the circular and hyperbolic functions and their inverses.
    fn transcendental(&mut self, id: NodeId, op: UnaryOp, a: NodeId) -> NodeId {
        use UnaryOp as U;
        match op {
            U::Sin => self.dag.unary(U::Cos, a),
            U::Cos => {
                let sine = self.dag.unary(U::Sin, a);
                self.neg(sine)
            }
            U::Tan => self.one_plus_square(1.0, id),
            U::Tanh => self.one_plus_square(-1.0, id),
            U::Sinh => self.dag.unary(U::Cosh, a),
            U::Cosh => self.dag.unary(U::Sinh, a),
            U::Atan => {
                let below = self.one_plus_square(1.0, a);
                self.dag.unary(U::GuardedInverse, below)
            }
            U::Asin | U::Acos => {
                let radicand = self.one_plus_square(-1.0, a);
                let root = self.dag.unary(U::Sqrt, radicand);
                let half = self.dag.unary(U::HalfInverse, root);
                self.scale(if op == U::Asin { 2.0 } else { -2.0 }, half)
            }
            _ => unreachable!("invariant: {op:?} has its slope in `unary`"),
        }
    }

    /// `1 + sign * a^2`.
    fn one_plus_square(&mut self, sign: f64, a: NodeId) -> NodeId {
        let one = self.dag.constant(1.0);
        let square = self.dag.power(a, 2);
        if sign > 0.0 { self.add(one, square) } else { self.sub(one, square) }
    }

    fn binary(&mut self, id: NodeId, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
        let (da, db) = (self.slopes[a.row()], self.slopes[b.row()]);
        match op {
            Add => self.add(da, db),
            Sub => self.sub(da, db),
            Mul => {
                let (left, right) = (self.mul(da, b), self.mul(a, db));
                self.add(left, right)
            }
            // One division for all derivatives: the inverse is shared.
            Div => {
                let inverse = self.inverse(b);
                let moved = self.mul(id, db);
                let change = self.sub(da, moved);
                self.mul(change, inverse)
            }
            Min | Max => {
                let (low, high) = if op == Min { (a, b) } else { (b, a) };
                let first = self.dag.binary(LessEqual, low, high);
                self.dag.select(first, da, db)
            }
            Pow | GuardedPow => self.pow(id, a, b),
            Atan2 => {
                let slope = self.dag.binary(AngleSlope, a, b);
                let (left, right) = (self.mul(b, da), self.mul(a, db));
                let turn = self.sub(left, right);
                let smooth = self.mul(turn, slope);
                // The turn is 0 where a or b is, and yet the angle jumps as the other moves.
                let jump = self.dag.binary(AngleJump, a, b);
                let (by_a, by_b) = (self.mul(jump, da), self.mul(jump, db));
                let jumps = self.add(by_a, by_b);
                self.add(smooth, jumps)
            }
            AngleSlope => {
                let (left, right) = (self.mul(a, da), self.mul(b, db));
                let half = self.add(left, right);
                let square = self.dag.power(id, 2);
                let factor = self.scale(-2.0, square);
                self.mul(factor, half)
            }
            AngleJump | PowJump | LessEqual => self.zero,
        }
    }

    /// `d(a^b) = b a^(b-1) da + a^b ln(a) db`; a zero base gives 0 where the limit is infinite
    /// and the power itself is not.
    fn pow(&mut self, id: NodeId, a: NodeId, b: NodeId) -> NodeId {
        let (da, db) = (self.slopes[a.row()], self.slopes[b.row()]);
        let one = self.dag.constant(1.0);
        let reduced = self.dag.binary(Sub, b, one);
        let singular = self.dag.value_of(b).is_some_and(|exponent| exponent < 0.0)
            && matches!(self.dag.node(id), Node::Binary(Pow, ..));
        let factor = self.dag.binary(if singular { Pow } else { GuardedPow }, a, reduced);
        let factor = self.mul(b, factor);
        let by_base = self.mul(factor, da);
        let logarithm = self.dag.unary(UnaryOp::GuardedLn, a);
        let growth = self.mul(id, logarithm);
        let by_exponent = self.mul(growth, db);
        let smooth = self.add(by_base, by_exponent);
        let jump = self.dag.binary(PowJump, a, b);
        let jump = self.mul(jump, db);
        self.add(smooth, jump)
    }

    /// `smin = (a+b)/2 - k g(t)` with `t = (a-b)/k`, `g = |t|/2 + BlendGap(t)`; hence the weights
    /// `1/2 - g'` of da, `1/2 + g'` of db and `t g' - g` of dk [derived].
    fn blend(&mut self, a: NodeId, b: NodeId, k: NodeId) -> NodeId {
        let (da, db, dk) = (self.slopes[a.row()], self.slopes[b.row()], self.slopes[k.row()]);
        let t = self.dag.blend_argument(a, b, k);
        let slope = self.dag.unary(UnaryOp::BlendSlope, t);
        let half = self.dag.constant(0.5);
        let (weight_a, weight_b) = (self.sub(half, slope), self.add(half, slope));
        let (part_a, part_b) = (self.mul(weight_a, da), self.mul(weight_b, db));
        let both = self.add(part_a, part_b);
        if dk == self.zero {
            return both;
        }
        let (gap, size) = (self.dag.unary(UnaryOp::BlendGap, t), self.dag.unary(UnaryOp::Abs, t));
        let half_size = self.scale(0.5, size);
        let g = self.add(half_size, gap);
        let lever = self.mul(t, slope);
        let weight_k = self.sub(lever, g);
        let part_k = self.mul(weight_k, dk);
        self.add(both, part_k)
    }

    fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.dag.binary(Add, a, b)
    }

    fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.dag.binary(Sub, a, b)
    }

    fn neg(&mut self, a: NodeId) -> NodeId {
        self.dag.unary(UnaryOp::Neg, a)
    }

    fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.dag.binary(Mul, a, b)
    }

    fn inverse(&mut self, a: NodeId) -> NodeId {
        let one = self.dag.constant(1.0);
        self.dag.binary(Div, one, a)
    }

    fn scale(&mut self, factor: f64, a: NodeId) -> NodeId {
        let factor = self.dag.constant(factor);
        self.mul(factor, a)
    }
}
