//! Which functions with kinks choose one argument at one point and another at the next.

use crate::dag::{Dag, Node, NodeId};
use crate::operation::{self, BinaryOp, UnaryOp};
use isospline_geometry::Vec3;

/// Names of the functions under `root` that choose otherwise at `a` than at `b`, each once, in the
/// order of the graph.
pub(crate) fn between(dag: &Dag, root: NodeId, a: Vec3, b: Vec3) -> Vec<&'static str> {
    let needed = dag.reachable(&[root]);
    let (at_a, at_b) = (values(dag, &needed, a), values(dag, &needed, b));
    let mut names = Vec::new();
    for row in (0..needed.len()).filter(|&row| needed[row]) {
        let node = dag.node(NodeId(row as u32));
        let Some(name) = name(node) else { continue };
        if choice(node, &at_a) != choice(node, &at_b) && !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The value of every node that is needed.
fn values(dag: &Dag, needed: &[bool], at: Vec3) -> Vec<f64> {
    let mut values = vec![0.0; needed.len()];
    for row in (0..needed.len()).filter(|&row| needed[row]) {
        let id = NodeId(row as u32);
        let of = |child: NodeId| values[child.row()];
        values[row] = match dag.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Variable(axis) => at[usize::from(axis)],
            Node::Unary(op, a) => op.apply(of(a)),
            Node::Binary(op, a, b) => op.apply(of(a), of(b)),
            Node::Power(a, n) => operation::power(of(a), n),
            // As `Dag::blend` is defined: min(a, b) - k * gap((a - b) / k).
            Node::Blend([a, b, k]) => {
                let (a, b, k) = (of(a), of(b), of(k));
                operation::min(a, b) - k * operation::blend_gap((a - b) / k)
            }
            Node::Select([c, p, q]) => of(if operation::sign(of(c)).abs() > 0.5 { p } else { q }),
        };
    }
    values
}

fn name(node: Node) -> Option<&'static str> {
    match node {
        Node::Unary(UnaryOp::Abs, _) => Some("abs"),
        Node::Unary(UnaryOp::Sign, _) => Some("sign"),
        Node::Unary(UnaryOp::Floor, _) => Some("floor"),
        Node::Binary(BinaryOp::Min, ..) => Some("min"),
        Node::Binary(BinaryOp::Max, ..) => Some("max"),
        _ => None,
    }
}

/// A number that tells on which side of its kinks a function is.
fn choice(node: Node, values: &[f64]) -> i64 {
    match node {
        Node::Unary(UnaryOp::Floor, a) => values[a.row()].floor() as i64,
        // At 0 the slope of abs is 0: neither side's.
        Node::Unary(_, a) => operation::sign(values[a.row()]) as i64,
        // On a tie the first is chosen.
        Node::Binary(BinaryOp::Min, a, b) => i64::from(values[a.row()] <= values[b.row()]),
        Node::Binary(_, a, b) => i64::from(values[a.row()] >= values[b.row()]),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use crate::{Field as _, Formula};
    use isospline_geometry::Vec3;

    fn between(text: &str, a: [f64; 3], b: [f64; 3]) -> Vec<&'static str> {
        let formula = Formula::parse(text, &std::collections::BTreeMap::new()).unwrap();
        formula.kinks_between(Vec3::from(a), Vec3::from(b))
    }

    #[test]
    fn only_functions_that_choose_otherwise_are_named() {
        let cube = "max(abs(x), max(abs(y), abs(z))) - 1";
        assert_eq!(between(cube, [1.0, 0.9, 0.0], [0.9, 1.0, 0.0]), ["max"]);
        assert_eq!(between(cube, [1.0, 0.1, 0.2], [1.0, -0.1, 0.2]), ["abs"]);
        assert!(between(cube, [1.0, 0.1, 0.2], [1.0, 0.15, 0.2]).is_empty());
        assert!(between("x^2 + sqrt(y^2 + 1)", [1.0; 3], [-1.0; 3]).is_empty());
        assert_eq!(between("floor(x) + min(y, 0)", [0.5, 1.0, 0.0], [1.5, -1.0, 0.0]).len(), 2);
    }
}
