//! From a graph as written to a graph of elementary operations in an order good to evaluate.

use crate::dag::{Dag, Node, NodeId};
use crate::operation::{BinaryOp, UnaryOp};

/// Which operations the target knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// Floats: powers become products, blends their parts, slopes of jumps zero.
    Points,
    /// Intervals keep powers and blends whole: their enclosures are tight, those of the parts not.
    Intervals,
}

/// The part of `dag` that `roots` need, for `target`. The first `n_values` nodes are the formula
/// as written, later ones derivatives: each of those moves up to the node it belongs to, so that
/// few registers are alive at a time (derivatives after all values would keep all values alive).
pub(crate) fn lower(
    dag: &Dag,
    roots: &[NodeId],
    n_values: usize,
    target: Target,
) -> (Dag, Vec<NodeId>) {
    let mut low = Dag::default();
    let mut ids = vec![NodeId(0); dag.n_nodes()];
    for row in schedule(dag, roots, n_values) {
        let node = dag.node(NodeId(row as u32));
        ids[row] = match target {
            Target::Points => lower_node(&mut low, node, &ids),
            Target::Intervals => low.intern(renamed(node, &ids)),
        };
    }
    let roots = roots.iter().map(|root| ids[root.row()]).collect();
    (low, roots)
}

fn schedule(dag: &Dag, roots: &[NodeId], n_values: usize) -> Vec<usize> {
    let needed = dag.reachable(roots);
    let mut stage = vec![0; dag.n_nodes()];
    for row in 0..dag.n_nodes() {
        let children = dag.node(NodeId(row as u32)).children();
        let latest = children.map(|child| stage[child.row()]).max().unwrap_or(0);
        stage[row] = if row < n_values { row } else { latest };
    }
    let mut order: Vec<usize> = (0..dag.n_nodes()).filter(|&row| needed[row]).collect();
    order.sort_by_key(|&row| (stage[row], row));
    order
}

fn renamed(node: Node, ids: &[NodeId]) -> Node {
    let of = |id: NodeId| ids[id.row()];
    match node {
        Node::Constant(_) | Node::Variable(_) => node,
        Node::Unary(op, a) => Node::Unary(op, of(a)),
        Node::Binary(op, a, b) => Node::Binary(op, of(a), of(b)),
        Node::Power(a, n) => Node::Power(of(a), n),
        Node::Blend(abc) => Node::Blend(abc.map(of)),
        Node::Select(cpq) => Node::Select(cpq.map(of)),
    }
}

fn lower_node(low: &mut Dag, node: Node, ids: &[NodeId]) -> NodeId {
    match renamed(node, ids) {
        Node::Unary(UnaryOp::SignSlope | UnaryOp::FloorSlope, _)
        | Node::Binary(BinaryOp::AngleJump | BinaryOp::PowJump, ..) => low.constant(0.0),
        Node::Unary(op, a) => low.unary(op, a),
        Node::Binary(BinaryOp::Mul, a, b) => multiply(low, a, b),
        Node::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) => low.binary(op, a, b),
        Node::Power(a, n) if n < 0 => {
            let one = low.constant(1.0);
            let below = power(low, a, n.unsigned_abs());
            low.intern(Node::Binary(BinaryOp::Div, one, below))
        }
        Node::Power(a, n) => power(low, a, n as u32),
        Node::Blend([a, b, k]) => low.blend_parts(a, b, k),
        Node::Select([c, p, q]) => low.select(c, p, q),
        node => low.intern(node),
    }
}

/// A square stays a product here: no powers are left after lowering.
fn multiply(low: &mut Dag, a: NodeId, b: NodeId) -> NodeId {
    if a == b {
        low.intern(Node::Binary(BinaryOp::Mul, a, a))
    } else {
        low.binary(BinaryOp::Mul, a, b)
    }
}

/// As [`crate::operation::power`]: equal order, equal bits.
fn power(low: &mut Dag, a: NodeId, n: u32) -> NodeId {
    match n {
        0 => low.constant(1.0),
        1 => a,
        _ if n.is_multiple_of(2) => {
            let root = power(low, a, n / 2);
            multiply(low, root, root)
        }
        _ => {
            let rest = power(low, a, n - 1);
            multiply(low, rest, a)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_share_their_squares() {
        let mut dag = Dag::default();
        let x = dag.variable(0);
        let (fourth, sixth) = (dag.power(x, 4), dag.power(x, 6));
        let sum = dag.binary(BinaryOp::Add, fourth, sixth);
        let (low, _) = lower(&dag, &[sum], dag.n_nodes(), Target::Points);
        // x, x^2, x^4, x^3, x^6 = (x^3)^2, the sum
        assert_eq!(low.n_nodes(), 6);
    }

    #[test]
    fn derivatives_are_scheduled_beside_their_values() {
        let mut dag = Dag::default();
        let x = dag.variable(0);
        let mut sum = x;
        for n in 1..50 {
            let constant = dag.constant(f64::from(n));
            let moved = dag.binary(BinaryOp::Add, x, constant);
            let sine = dag.unary(UnaryOp::Sin, moved);
            sum = dag.binary(BinaryOp::Add, sum, sine);
        }
        let n_values = dag.n_nodes();
        let [slope, ..] = crate::derivative::gradient(&mut dag, sum);
        let (low, roots) = lower(&dag, &[sum, slope], n_values, Target::Points);
        let tape = crate::tape::Tape::new(&low, &roots, Target::Points);
        assert!(tape.n_registers <= 8, "{} registers", tape.n_registers);
    }
}
