//! A graph as a list of instructions on few registers.

use crate::dag::{Dag, Node, NodeId};
use crate::lowering::Target;
use crate::operation::{BinaryOp, UnaryOp};

/// What an instruction does with its arguments a, b, c, d and its constant k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Op {
    /// `k`
    Constant,
    Unary(UnaryOp),
    Binary(BinaryOp),
    Power(i32),
    Blend,
    Select,
    /// `a + k`
    AddConstant,
    /// `k - a`
    ConstantSub,
    /// `k * a`
    Scale,
    /// `k * a + b`
    ScaleAdd,
    /// `k / a`
    ConstantDiv,
    /// `a * b + c`, both rounded: fused in memory traffic only, never in arithmetic.
    MulAdd,
    /// `a * b + k`
    MulAddConstant,
    /// `a * b - c`
    MulSub,
    /// `c - a * b`
    SubMul,
    /// `a * b + c * d`
    MulMulAdd,
    /// `a * b - c * d`
    MulMulSub,
}

/// One instruction; arguments that an operation lacks are 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instruction {
    pub(crate) op: Op,
    pub(crate) out: u32,
    pub(crate) args: [u32; 4],
    pub(crate) constant: f64,
}

/// The register `out` to write, and how to read the others: a result never takes the place of an
/// argument.
#[inline]
pub(crate) fn others<'a, T>(file: &'a mut [T], out: usize) -> (&'a mut T, impl Fn(usize) -> &'a T) {
    let (below, rest) = file.split_at_mut(out);
    let (out_register, above) = rest.split_first_mut().expect("invariant: a register a step");
    let (below, above) = (&*below, &*above);
    (out_register, move |k: usize| if k < out { &below[k] } else { &above[k - out - 1] })
}

/// A compiled graph.
#[derive(Clone, Debug)]
pub(crate) struct Tape {
    pub(crate) instructions: Vec<Instruction>,
    /// Register of each variable that occurs, as (axis, register).
    pub(crate) inputs: Vec<(u8, u32)>,
    /// Register of each root.
    pub(crate) outputs: Vec<u32>,
    pub(crate) n_registers: usize,
}

impl Tape {
    /// The tape of a lowered graph.
    pub(crate) fn new(dag: &Dag, roots: &[NodeId], target: Target) -> Self {
        let plan = Plan::new(dag, roots, target);
        let steps: Vec<Step> =
            (0..dag.n_nodes()).filter_map(|row| plan.step(NodeId(row as u32))).collect();
        Registers::new(dag, roots, &steps).assign(&steps)
    }
}

/// An instruction whose arguments are still nodes.
#[derive(Clone, Copy, Debug)]
struct Step {
    id: NodeId,
    op: Op,
    args: [NodeId; 4],
    n_args: usize,
    constant: f64,
}

/// Which nodes become steps of their own.
struct Plan<'a> {
    dag: &'a Dag,
    /// Products that the one sum using them takes in.
    absorbed: Vec<bool>,
    /// Nodes with a register: needed ones, without absorbed products and immediate constants.
    live: Vec<bool>,
    /// Whether the arithmetic of rounded numbers may be told in fewer steps.
    fuse: bool,
}

impl<'a> Plan<'a> {
    fn new(dag: &'a Dag, roots: &[NodeId], target: Target) -> Self {
        let fuse = target == Target::Points;
        let needed = dag.reachable(roots);
        let mut plan = Self {
            dag,
            absorbed: vec![false; dag.n_nodes()],
            live: vec![false; dag.n_nodes()],
            fuse,
        };
        if fuse {
            plan.absorb_products(roots, &needed);
        }
        for root in roots {
            plan.live[root.row()] = true;
        }
        for row in (0..dag.n_nodes()).rev() {
            if let Some(step) = plan.step(NodeId(row as u32)) {
                step.args[..step.n_args].iter().for_each(|arg| plan.live[arg.row()] = true);
            }
        }
        plan
    }

    fn absorb_products(&mut self, roots: &[NodeId], needed: &[bool]) {
        let mut uses = vec![0_u32; needed.len()];
        for root in roots {
            uses[root.row()] += 2;
        }
        let ids = || (0..needed.len()).filter(|&row| needed[row]).map(|row| NodeId(row as u32));
        for id in ids() {
            self.dag.node(id).children().for_each(|child| uses[child.row()] += 1);
        }
        for id in ids() {
            if let Node::Binary(BinaryOp::Add | BinaryOp::Sub, a, b) = self.dag.node(id) {
                for child in [a, b] {
                    let product = matches!(self.dag.node(child), Node::Binary(BinaryOp::Mul, ..));
                    self.absorbed[child.row()] = product && uses[child.row()] == 1;
                }
            }
        }
    }

    /// The factors of an absorbed product, split by whether one is constant.
    fn product(&self, id: NodeId) -> Option<Product> {
        let Node::Binary(BinaryOp::Mul, a, b) = self.dag.node(id) else { return None };
        if !self.absorbed[id.row()] {
            return None;
        }
        Some(match (self.dag.value_of(a), self.dag.value_of(b)) {
            (Some(k), _) => Product::Scaled(k, b),
            (_, Some(k)) => Product::Scaled(k, a),
            _ => Product::Of(a, b),
        })
    }

    fn step(&self, id: NodeId) -> Option<Step> {
        if !self.live[id.row()] {
            return None;
        }
        let with = |op, args: &[NodeId], constant| {
            let mut padded = [NodeId(0); 4];
            padded[..args.len()].copy_from_slice(args);
            Some(Step { id, op, args: padded, n_args: args.len(), constant })
        };
        match self.dag.node(id) {
            Node::Constant(bits) => with(Op::Constant, &[], f64::from_bits(bits)),
            Node::Variable(_) => None,
            Node::Unary(op, a) => with(Op::Unary(op), &[a], 0.0),
            Node::Power(a, n) => with(Op::Power(n), &[a], 0.0),
            Node::Blend(abk) => with(Op::Blend, &abk, 0.0),
            Node::Select(cpq) => with(Op::Select, &cpq, 0.0),
            Node::Binary(op, a, b) => {
                let (op, args, n_args, constant) = self.arithmetic(op, a, b);
                with(op, &args[..n_args], constant)
            }
        }
    }

    fn arithmetic(&self, op: BinaryOp, a: NodeId, b: NodeId) -> (Op, [NodeId; 4], usize, f64) {
        let none = NodeId(0);
        let plain = (Op::Binary(op), [a, b, none, none], 2, 0.0);
        match op {
            BinaryOp::Add => self.sum(a, b).or_else(|| self.sum(b, a)).unwrap_or(plain),
            BinaryOp::Sub => self.difference(a, b).unwrap_or(plain),
            BinaryOp::Mul => match (self.dag.value_of(a), self.dag.value_of(b)) {
                (Some(k), _) => (Op::Scale, [b, none, none, none], 1, k),
                (_, Some(k)) => (Op::Scale, [a, none, none, none], 1, k),
                _ => plain,
            },
            BinaryOp::Div if self.fuse => match self.dag.value_of(a) {
                Some(k) => (Op::ConstantDiv, [b, none, none, none], 1, k),
                None => plain,
            },
            _ => plain,
        }
    }

    /// `a + b` where `a` decides the form; `None` if only `b` can.
    fn sum(&self, a: NodeId, b: NodeId) -> Option<(Op, [NodeId; 4], usize, f64)> {
        let none = NodeId(0);
        match (self.product(a), self.product(b)) {
            (Some(Product::Of(p, q)), Some(Product::Of(r, s))) => {
                Some((Op::MulMulAdd, [p, q, r, s], 4, 0.0))
            }
            // Two scaled terms: the other one stays a step of its own.
            (Some(Product::Scaled(k, p)), _) => Some((Op::ScaleAdd, [p, b, none, none], 2, k)),
            (Some(Product::Of(p, q)), None) => Some(match self.dag.value_of(b) {
                Some(k) => (Op::MulAddConstant, [p, q, none, none], 2, k),
                None => (Op::MulAdd, [p, q, b, none], 3, 0.0),
            }),
            (None, None) => {
                self.dag.value_of(b).map(|k| (Op::AddConstant, [a, none, none, none], 1, k))
            }
            _ => None,
        }
    }

    /// `a - b`.
    fn difference(&self, a: NodeId, b: NodeId) -> Option<(Op, [NodeId; 4], usize, f64)> {
        let none = NodeId(0);
        let constants = (self.dag.value_of(a), self.dag.value_of(b));
        Some(match (self.product(a), self.product(b)) {
            (Some(Product::Of(p, q)), Some(Product::Of(r, s))) => {
                (Op::MulMulSub, [p, q, r, s], 4, 0.0)
            }
            (_, Some(Product::Scaled(k, r))) => (Op::ScaleAdd, [r, a, none, none], 2, -k),
            (Some(Product::Of(p, q)), _) => match constants.1 {
                Some(k) => (Op::MulAddConstant, [p, q, none, none], 2, -k),
                None => (Op::MulSub, [p, q, b, none], 3, 0.0),
            },
            (_, Some(Product::Of(r, s))) => (Op::SubMul, [r, s, a, none], 3, 0.0),
            _ => match constants {
                (_, Some(k)) => (Op::AddConstant, [a, none, none, none], 1, -k),
                (Some(k), _) => (Op::ConstantSub, [b, none, none, none], 1, k),
                _ => return None,
            },
        })
    }
}

/// An absorbed product.
enum Product {
    Scaled(f64, NodeId),
    Of(NodeId, NodeId),
}

/// Linear scan: a register is free again after the last step that reads it.
struct Registers {
    /// Index of the last step that reads a node; roots are read after the end.
    last_use: Vec<usize>,
    register: Vec<u32>,
    free: Vec<u32>,
    count: u32,
    inputs: Vec<(u8, u32)>,
    roots: Vec<NodeId>,
}

impl Registers {
    fn new(dag: &Dag, roots: &[NodeId], steps: &[Step]) -> Self {
        let mut last_use = vec![0; dag.n_nodes()];
        let mut occurs = vec![false; dag.n_nodes()];
        for (idx, step) in steps.iter().enumerate() {
            for arg in &step.args[..step.n_args] {
                last_use[arg.row()] = idx;
                occurs[arg.row()] = true;
            }
        }
        for root in roots {
            last_use[root.row()] = usize::MAX;
            occurs[root.row()] = true;
        }
        let mut register = vec![u32::MAX; dag.n_nodes()];
        let mut inputs = Vec::new();
        for row in (0..dag.n_nodes()).filter(|&row| occurs[row]) {
            if let Node::Variable(axis) = dag.node(NodeId(row as u32)) {
                register[row] = inputs.len() as u32;
                inputs.push((axis, register[row]));
            }
        }
        let count = inputs.len() as u32;
        Self { last_use, register, free: Vec::new(), count, inputs, roots: roots.to_vec() }
    }

    fn assign(mut self, steps: &[Step]) -> Tape {
        let instructions =
            steps.iter().enumerate().map(|(idx, step)| self.place(idx, step)).collect();
        Tape {
            instructions,
            outputs: self.roots.iter().map(|root| self.register[root.row()]).collect(),
            inputs: self.inputs,
            n_registers: self.count as usize,
        }
    }

    /// The result never takes the place of an argument: see [`crate::evaluator`].
    fn place(&mut self, idx: usize, step: &Step) -> Instruction {
        let out = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        });
        let mut args = [0; 4];
        let read = &step.args[..step.n_args];
        for (k, arg) in read.iter().enumerate() {
            args[k] = self.register[arg.row()];
            let again = read[..k].contains(arg);
            if self.last_use[arg.row()] == idx && !again {
                self.free.push(args[k]);
            }
        }
        self.register[step.id.row()] = out;
        Instruction { op: step.op, out, args, constant: step.constant }
    }
}
