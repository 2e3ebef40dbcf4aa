//! A graph as text that does not depend on how the formula was written.

use crate::dag::{Dag, Node, NodeId};
use crate::functions::VARIABLES;
use crate::operation::{BinaryOp, UnaryOp};
use std::fmt::Write as _;

/// One definition a node, in the formula language: read again, it gives the same text.
pub(crate) fn canonical(dag: &Dag, root: NodeId) -> String {
    let needed = dag.reachable(&[root]);
    let mut names: Vec<String> = vec![String::new(); needed.len()];
    let mut text = String::new();
    let mut n_definitions = 0;
    for row in (0..needed.len()).filter(|&row| needed[row]) {
        let node = dag.node(NodeId(row as u32));
        let value = expression(node, &names);
        if matches!(node, Node::Constant(_) | Node::Variable(_)) {
            names[row] = value;
        } else {
            names[row] = format!("t{n_definitions}");
            n_definitions += 1;
            writeln!(text, "{} = {value}", names[row]).expect("invariant: strings take all text");
        }
    }
    text.push_str(&names[root.row()]);
    text
}

fn expression(node: Node, names: &[String]) -> String {
    let name = |id: NodeId| names[id.row()].as_str();
    match node {
        Node::Constant(bits) => constant(f64::from_bits(bits)),
        Node::Variable(axis) => VARIABLES[axis as usize].into(),
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
