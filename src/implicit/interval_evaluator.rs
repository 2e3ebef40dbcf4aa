//! Runs a tape over a box.

use crate::interval::Interval;
use crate::operation::BinaryOp;
use crate::tape::{Instruction, Op, Tape};
use std::cell::Cell;

thread_local! {
    /// Register file of this thread, kept to spare an allocation a call.
    static SCRATCH: Cell<Vec<Interval>> = const { Cell::new(Vec::new()) };
}

/// Enclosures of the outputs of `tape` over a box.
pub(crate) fn enclose<const K: usize>(tape: &Tape, domain: [Interval; 3]) -> [Interval; K] {
    let mut file = SCRATCH.take();
    if file.len() < tape.n_registers {
        file.resize(tape.n_registers, Interval::ZERO);
    }
    for &(axis, register) in &tape.inputs {
        file[register as usize] = domain[axis as usize];
    }
    for instruction in &tape.instructions {
        file[instruction.out as usize] = step(instruction, |k| file[instruction.args[k] as usize]);
    }
    let outputs = std::array::from_fn(|k| file[tape.outputs[k] as usize]);
    SCRATCH.set(file);
    outputs
}

/// The result of one instruction from its arguments.
pub(crate) fn step(instruction: &Instruction, argument: impl Fn(usize) -> Interval) -> Interval {
    let constant = || Interval::point(instruction.constant);
    match instruction.op {
        Op::Constant => constant(),
        Op::AddConstant => argument(0).binary(BinaryOp::Add, constant()),
        Op::ConstantSub => constant().binary(BinaryOp::Sub, argument(0)),
        Op::Scale => argument(0).binary(BinaryOp::Mul, constant()),
        Op::Unary(op) => argument(0).unary(op),
        Op::Binary(op) => argument(0).binary(op, argument(1)),
        Op::Power(n) => argument(0).power(n),
        Op::Blend => Interval::blend(argument(0), argument(1), argument(2)),
        Op::Select => Interval::select(argument(0), argument(1), argument(2)),
        _ => unreachable!("invariant: {:?} is fused for points only", instruction.op),
    }
}
