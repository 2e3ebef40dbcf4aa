//! A graph as text that does not depend on how the formula was written.

use crate::dag::{Dag, Node, NodeId};
use crate::functions::VARIABLES;
use crate::operation::{BinaryOp, UnaryOp};
use std::fmt::Write as _;

/// One definition a node, in the formula language: read again, it gives the same text.
pub(crate) fn canonical(dag: &Dag, root: NodeId) -> String {
    let needed = dag.reachable(&[root]);
    let mut names = Names { dag, definitions: vec![0; needed.len()] };
    let mut text = String::new();
    let mut n_definitions = 0;
    for row in (0..needed.len()).filter(|&row| needed[row]) {
        let node = dag.node(NodeId(row as u32));
        if is_leaf(node) {
            continue;
        }
        let value = names.expression(node);
        writeln!(text, "t{n_definitions} = {value}").expect("invariant: strings take all text");
        names.definitions[row] = n_definitions;
        n_definitions += 1;
    }
    text.push_str(&names.name(root));
    text
}

/// How many definitions [`canonical`] writes.
pub(crate) fn n_definitions(dag: &Dag, root: NodeId) -> usize {
    let needed = dag.reachable(&[root]);
    let rows = (0..needed.len()).filter(|&row| needed[row]);
    rows.filter(|&row| !is_leaf(dag.node(NodeId(row as u32)))).count()
}

fn is_leaf(node: Node) -> bool {
    matches!(node, Node::Constant(_) | Node::Variable(_))
}

/// What nodes are called; not kept as text, of which a million terms would need too much.
struct Names<'a> {
    dag: &'a Dag,
    /// The number of each definition.
    definitions: Vec<u32>,
}

impl Names<'_> {
    fn name(&self, id: NodeId) -> String {
        match self.dag.node(id) {
            Node::Constant(bits) => constant(f64::from_bits(bits)),
            Node::Variable(axis) => VARIABLES[usize::from(axis)].into(),
            _ => format!("t{}", self.definitions[id.row()]),
        }
    }

    fn expression(&self, node: Node) -> String {
        let name = |id: NodeId| self.name(id);
        match node {
            Node::Constant(_) | Node::Variable(_) => {
                unreachable!("invariant: leaves have no definition")
            }
            Node::Unary(UnaryOp::Neg, a) => format!("-{}", name(a)),
            Node::Unary(op, a) => format!("{}({})", format!("{op:?}").to_lowercase(), name(a)),
            Node::Binary(op, a, b) => match symbol(op) {
                Some(symbol) => format!("{} {symbol} {}", name(a), name(b)),
                None => format!("{}({}, {})", format!("{op:?}").to_lowercase(), name(a), name(b)),
            },
            Node::Power(a, n) => format!("{}^{n}", name(a)),
            Node::Blend([a, b, k]) => format!("smin({}, {}, {})", name(a), name(b), name(k)),
            Node::Select([c, p, q]) => format!("select({}, {}, {})", name(c), name(p), name(q)),
        }
    }
}

fn symbol(op: BinaryOp) -> Option<char> {
    match op {
        BinaryOp::Add => Some('+'),
        BinaryOp::Sub => Some('-'),
        BinaryOp::Mul => Some('*'),
        BinaryOp::Div => Some('/'),
        _ => None,
    }
}

/// The shortest text that reads as the same bits.
fn constant(value: f64) -> String {
    match value {
        _ if value.is_nan() => "(0/0)".into(),
        f64::INFINITY => "(1/0)".into(),
        f64::NEG_INFINITY => "(-1/0)".into(),
        _ if value.is_sign_negative() => format!("({value:?})"),
        _ => format!("{value:?}"),
    }
}
