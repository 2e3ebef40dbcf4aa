//! Runs a tape over several boxes at once.
//!
//! As in [`crate::evaluator`] registers are structures of arrays, and sums, products and powers
//! are straight-line code that becomes vector instructions; signs are chosen, not branched on:
//! the branches of one box are mispredicted half the time. Bounds have the bits that
//! [`crate::interval_evaluator`] gives for each box alone.
#![expect(
    clippy::inline_always,
    reason = "the interpreter must be compiled inside the function that enables AVX2"
)]
#![expect(clippy::needless_bitwise_bool, reason = "lazy operators would be branches")]

use crate::instruction_set::{Kernel, run_widest};
use crate::interval::{Interval, add_down, mul_down, mul_up};
use crate::interval_evaluator::{enclose, step};
use crate::operation::{BinaryOp, UnaryOp};
use crate::tape::{Instruction, Op, Tape, others};
use std::cell::Cell;

/// Boxes a block: long enough that loops over them are not unrolled before they are vectorised.
const LANES: usize = 16;

/// Boxes from which a block, idle lanes included, is faster than one box after the other.
const LEAST_LANES: usize = 4;

/// A register: one interval for each box of a block.
#[derive(Clone, Copy)]
struct Lanes {
    lo: [f64; LANES],
    hi: [f64; LANES],
}

thread_local! {
    /// Register file of this thread, kept to spare an allocation a call.
    static SCRATCH: Cell<Vec<Lanes>> = const { Cell::new(Vec::new()) };
}

/// Enclosures of the outputs of `tape` over boxes, written to `out` by `to_result`.
pub(crate) fn enclose_all<const K: usize, T>(
    tape: &Tape,
    domains: &[[Interval; 3]],
    out: &mut [T],
    to_result: impl Fn([Interval; K]) -> T,
) {
    assert_eq!(domains.len(), out.len(), "one result a box");
    let mut file = SCRATCH.take();
    if file.len() < tape.n_registers {
        file.resize(tape.n_registers, Lanes { lo: [0.0; LANES], hi: [0.0; LANES] });
    }
    for (domains, out) in domains.chunks(LANES).zip(out.chunks_mut(LANES)) {
        if domains.len() < LEAST_LANES {
            for (out, &domain) in out.iter_mut().zip(domains) {
                *out = to_result(enclose(tape, domain));
            }
            continue;
        }
        for &(axis, register) in &tape.inputs {
            let register = &mut file[register as usize];
            for lane in 0..LANES {
                // Idle lanes hold a real box: values far off would cost time.
                let side = domains[lane.min(domains.len() - 1)][axis as usize];
                (register.lo[lane], register.hi[lane]) = (side.lo, side.hi);
            }
        }
        run(&tape.instructions, &mut file);
        let outputs: [&Lanes; K] = std::array::from_fn(|k| &file[tape.outputs[k] as usize]);
        for (lane, out) in out.iter_mut().enumerate() {
            *out = to_result(outputs.map(|output| output.get(lane)));
        }
    }
    SCRATCH.set(file);
}

impl Lanes {
    #[inline(always)]
    fn of(constant: f64) -> Self {
        Self { lo: [constant; LANES], hi: [constant; LANES] }
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Interval {
        Interval::new(self.lo[lane], self.hi[lane])
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, interval: Interval) {
        (self.lo[lane], self.hi[lane]) = (interval.lo, interval.hi);
    }
}

/// One pass of a tape over a block.
struct Pass<'a> {
    instructions: &'a [Instruction],
    file: &'a mut [Lanes],
}

impl Kernel for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        interpret(self.instructions, self.file);
    }
}

fn run(instructions: &[Instruction], file: &mut [Lanes]) {
    run_widest(Pass { instructions, file });
}

#[inline(always)]
fn interpret(instructions: &[Instruction], file: &mut [Lanes]) {
    for instruction in instructions {
        let (out, others) = others(file, instruction.out as usize);
        let argument = |k: usize| others(instruction.args[k] as usize);
        let constant = || Lanes::of(instruction.constant);
        match instruction.op {
            Op::Constant => *out = constant(),
            Op::AddConstant => add(argument(0), &constant(), out),
            Op::ConstantSub => subtract(&constant(), argument(0), out),
            Op::Scale => multiply(argument(0), &constant(), out),
            Op::Unary(UnaryOp::Neg) => negate(argument(0), out),
            Op::Binary(BinaryOp::Add) => add(argument(0), argument(1), out),
            Op::Binary(BinaryOp::Sub) => subtract(argument(0), argument(1), out),
            Op::Binary(BinaryOp::Mul) => multiply(argument(0), argument(1), out),
            Op::Power(n) if n > 0 && n % 2 == 0 => even_power(argument(0), n as u32, out),
            Op::Power(n) if n > 0 => odd_power(argument(0), n as u32, out),
            _ => {
                for lane in 0..LANES {
                    out.set(lane, step(instruction, |k| argument(k).get(lane)));
                }
            }
        }
    }
}

#[inline(always)]
fn negate(a: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        out.lo[i] = -a.hi[i];
        out.hi[i] = -a.lo[i];
    }
}

#[inline(always)]
fn add(a: &Lanes, b: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let lo = add_down(a.lo[i], b.lo[i]);
        let hi = -add_down(-a.hi[i], -b.hi[i]);
        (out.lo[i], out.hi[i]) = known(lo, hi, lo.is_nan() | hi.is_nan());
    }
}

#[inline(always)]
fn subtract(a: &Lanes, b: &Lanes, out: &mut Lanes) {
    let mut mirrored = Lanes::of(0.0);
    negate(b, &mut mirrored);
    add(a, &mirrored, out);
}

/// Both bounds NaN if nothing is known.
#[inline(always)]
fn known(lo: f64, hi: f64, is_unknown: bool) -> (f64, f64) {
    (if is_unknown { f64::NAN } else { lo }, if is_unknown { f64::NAN } else { hi })
}

/// By the signs of the factors as `Interval::mul`; where both have both signs, by that itself.
#[inline(always)]
fn multiply(a: &Lanes, b: &Lanes, out: &mut Lanes) {
    let mut any_mixed = false;
    for i in 0..LANES {
        let (a_lo, a_hi, b_lo, b_hi) = (a.lo[i], a.hi[i], b.lo[i], b.hi[i]);
        let is_unknown = a_lo.is_nan() | a_hi.is_nan() | b_lo.is_nan() | b_hi.is_nan();
        let (a_up, b_up, b_down) = (a_lo >= 0.0, b_lo >= 0.0, b_hi <= 0.0);
        let a_down = !a_up & (a_hi <= 0.0);
        let a_both = !a_up & !a_down;
        let low_by_a_lo = (a_up & b_up) | (a_down & !b_down) | (a_both & b_up);
        let low_by_b_lo = a_up | (a_both & !b_up);
        let high_by_a_lo = (a_up & b_down) | (a_down & !b_up) | (a_both & !b_up);
        let high_by_b_lo = a_down | (a_both & !b_up);
        let low =
            mul_down(if low_by_a_lo { a_lo } else { a_hi }, if low_by_b_lo { b_lo } else { b_hi });
        let high = -mul_down(
            -if high_by_a_lo { a_lo } else { a_hi },
            if high_by_b_lo { b_lo } else { b_hi },
        );
        (out.lo[i], out.hi[i]) = known(low, high, is_unknown);
        any_mixed |= a_both & !b_up & !b_down;
    }
    if !any_mixed {
        return;
    }
    for i in 0..LANES {
        if (a.lo[i] < 0.0) & (a.hi[i] > 0.0) & (b.lo[i] < 0.0) & (b.hi[i] > 0.0) {
            out.set(i, a.get(i) * b.get(i));
        }
    }
}

#[inline(always)]
fn even_power(a: &Lanes, n: u32, out: &mut Lanes) {
    let (mut least, mut most) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let (lo, hi) = (a.lo[i], a.hi[i]);
        let is_unknown = lo.is_nan() | hi.is_nan();
        let nearest = if hi <= 0.0 { -hi } else { 0.0 };
        let nearest = if lo >= 0.0 { lo } else { nearest };
        (least[i], most[i]) = known(nearest, if -lo > hi { -lo } else { hi }, is_unknown);
    }
    out.lo = power(&least, n, mul_down);
    out.hi = power(&most, n, mul_up);
}

#[inline(always)]
fn odd_power(a: &Lanes, n: u32, out: &mut Lanes) {
    let (lo, hi) = (a.lo.map(f64::abs), a.hi.map(f64::abs));
    let low = [power(&lo, n, mul_down), power(&lo, n, mul_up)];
    let high = [power(&hi, n, mul_down), power(&hi, n, mul_up)];
    for i in 0..LANES {
        let lower = if a.lo[i] >= 0.0 { low[0][i] } else { -low[1][i] };
        let upper = if a.hi[i] >= 0.0 { high[1][i] } else { -high[0][i] };
        (out.lo[i], out.hi[i]) = known(lower, upper, lower.is_nan() | upper.is_nan());
    }
}

/// As `interval::power_by`, lane by lane.
#[inline(always)]
fn power(a: &[f64; LANES], n: u32, multiply: impl Fn(f64, f64) -> f64) -> [f64; LANES] {
    let mut power = *a;
    for bit in (0..n.ilog2()).rev() {
        for lane in &mut power {
            *lane = multiply(*lane, *lane);
        }
        if n >> bit & 1 == 1 {
            for (lane, a) in power.iter_mut().zip(a) {
                *lane = multiply(*lane, *a);
            }
        }
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction_set::InstructionSet;
    #[cfg(target_arch = "x86_64")]
    use crate::instruction_set::run_avx2;
    use crate::lowering::{Target, lower};

    fn gradient_tape() -> Tape {
        let text = "a = 3*x + y*z - 2; b = x*y - z*x; c = (5 - a)^5; d = 1/(b^2 + 1)
            clamp(a*b - c, -1, 1) + sqrt(x - 1)*d + floor(x)*sin(y) + (x*b)^3*atan2(y, x) + b^-3";
        let (mut dag, root) =
            crate::parser::parse(text, &std::collections::BTreeMap::new()).unwrap();
        let n_values = dag.n_nodes();
        let [x, y, z] = crate::derivative::gradient(&mut dag, root);
        let (low, roots) = lower(&dag, &[root, x, y, z], n_values, Target::Intervals);
        Tape::new(&low, &roots, Target::Intervals)
    }

    fn boxes(n: u32) -> Vec<[Interval; 3]> {
        let at = |i: u32, step: f64| 4.0 * (f64::from(i) * step).fract() - 2.0;
        let side =
            |i: u32, step: f64| Interval::new(at(i, step), at(i, step) + 0.03 * f64::from(i));
        (0..n).map(|i| [side(i, 0.819), side(i, 0.671), side(i, 0.5)]).collect()
    }

    /// NaN payloads are not data.
    fn bits<const K: usize>(all: [Interval; K]) -> [[u64; 2]; K] {
        let bits = |f: f64| if f.is_nan() { u64::MAX } else { f.to_bits() };
        all.map(|i| [bits(i.lo), bits(i.hi)])
    }

    #[test]
    fn boxes_have_the_bits_together_that_they_have_alone() {
        let (tape, boxes) = (gradient_tape(), boxes(53));
        for n in [1, 3, 4, 16, 53] {
            let mut together = vec![[[0; 2]; 4]; n];
            enclose_all(&tape, &boxes[..n], &mut together, bits::<4>);
            for (domain, together) in boxes.iter().zip(&together) {
                assert_eq!(bits(enclose::<4>(&tape, *domain)), *together, "{domain:?}");
            }
        }
    }

    #[test]
    fn vector_and_plain_code_agree_in_all_bits() {
        let tape = gradient_tape();
        let mut plain = vec![Lanes { lo: [0.0; LANES], hi: [0.0; LANES] }; tape.n_registers];
        for (lane, domain) in boxes(LANES as u32).into_iter().enumerate() {
            for &(axis, register) in &tape.inputs {
                plain[register as usize].set(lane, domain[axis as usize]);
            }
        }
        let start = plain.clone();
        interpret(&tape.instructions, &mut plain);
        let agrees = |vector: &[Lanes]| {
            for (a, b) in plain.iter().zip(vector) {
                for lane in 0..LANES {
                    assert_eq!(bits([a.get(lane)]), bits([b.get(lane)]));
                }
            }
        };
        let mut widest = start.clone();
        run(&tape.instructions, &mut widest);
        agrees(&widest);
        #[cfg(target_arch = "x86_64")]
        if InstructionSet::Avx2.is_there() {
            let mut vector = start;
            #[expect(unsafe_code, reason = "the build that `run` would pass over here")]
            // SAFETY: the processor has AVX2, as checked in the line above.
            unsafe {
                run_avx2(Pass { instructions: &tape.instructions, file: &mut vector });
            }
            agrees(&vector);
        }
    }
}
