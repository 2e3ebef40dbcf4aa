//! Runs a tape over blocks of points.
//!
//! Registers are structures of arrays of a fixed length, so that an instruction is straight-line
//! vector code: 64 points while the registers fit the first-level cache, fewer for the rest of a
//! batch. The AVX2 build of the same code gives the same bits: no fused multiply-add, no
//! reassociation, transcendental functions by libm in both.
#![expect(
    clippy::inline_always,
    reason = "the interpreter must be compiled inside the function that enables AVX2"
)]

use crate::circular::{Circular, Cosine, Sine};
use crate::field::BLOCK;
use crate::instruction_set::InstructionSet;
use crate::operation::{self, BinaryOp, UnaryOp};
use crate::tape::{Instruction, Op, Tape};
use isospline_geometry::Vec3;
use std::cell::Cell;

/// Bytes of registers a block may take: half of a 48 KiB first-level cache, the rest is for
/// points and results.
const REGISTER_BYTES: usize = 24 << 10;

/// Floats a cache line.
const CACHE_LINE: usize = 8;

thread_local! {
    /// Register file of this thread, kept to spare an allocation a call.
    static SCRATCH: Cell<Vec<f64>> = const { Cell::new(Vec::new()) };
}

/// Evaluates `tape` at all `points`, writing `to_result(outputs)` of each to `out`.
pub(crate) fn evaluate<const K: usize, T>(
    tape: &Tape,
    points: &[Vec3],
    out: &mut [T],
    to_result: impl Fn([f64; K]) -> T,
) {
    assert_eq!(points.len(), out.len(), "one result a point");
    let mut take = |at: usize, outputs: [&[f64]; K]| {
        for (lane, out) in out[at..][..outputs[0].len()].iter_mut().enumerate() {
            *out = to_result(outputs.map(|output| output[lane]));
        }
    };
    let fill = |at: usize, axis: usize, lanes: &mut [f64]| {
        for (lane, point) in lanes.iter_mut().zip(&points[at..]) {
            *lane = point[axis];
        }
    };
    in_blocks(tape, points.len(), &fill, &mut take);
}

/// Evaluates `tape` at the first `n` points of a block, coordinates in and outputs out one after
/// another.
pub(crate) fn evaluate_block<const K: usize>(
    tape: &Tape,
    n: usize,
    points: &[[f64; BLOCK]; 3],
    out: &mut [[f64; BLOCK]; K],
) {
    let mut take = |at: usize, outputs: [&[f64]; K]| {
        for (out, lanes) in out.iter_mut().zip(outputs) {
            out[at..][..lanes.len()].copy_from_slice(lanes);
        }
    };
    let fill = |at: usize, axis: usize, lanes: &mut [f64]| {
        lanes.copy_from_slice(&points[axis][at..][..lanes.len()]);
    };
    in_blocks(tape, n, &fill, &mut take);
}

/// Runs `tape` on `n_points` points in blocks. Of those from a first one on `fill` writes one
/// coordinate and `take` is given the outputs.
fn in_blocks<const K: usize>(
    tape: &Tape,
    n_points: usize,
    fill: &impl Fn(usize, usize, &mut [f64]),
    take: &mut impl FnMut(usize, [&[f64]; K]),
) {
    let lanes_in_cache = REGISTER_BYTES / (tape.n_registers * size_of::<f64>());
    let most = [64, 32, 16].into_iter().find(|&lanes| lanes <= lanes_in_cache).unwrap_or(8);
    let mut scratch = SCRATCH.take();
    let n_lanes = tape.n_registers * most;
    if scratch.len() < n_lanes + CACHE_LINE {
        scratch.resize(n_lanes + CACHE_LINE, 0.0);
    }
    // Every second vector would straddle cache lines otherwise.
    let start = scratch.as_ptr().align_offset(CACHE_LINE * size_of::<f64>()).min(CACHE_LINE);
    let file = &mut scratch[start..][..n_lanes];
    let mut at = 0;
    while at < n_points {
        let left = n_points - at;
        let fill = |axis: usize, lanes: &mut [f64]| fill(at, axis, lanes);
        let mut take = |outputs: [&[f64]; K]| take(at, outputs);
        at += match left.next_power_of_two().clamp(8, most) {
            64 => block::<64, K>(tape, file, left, &fill, &mut take),
            32 => block::<32, K>(tape, file, left, &fill, &mut take),
            16 => block::<16, K>(tape, file, left, &fill, &mut take),
            _ => block::<8, K>(tape, file, left, &fill, &mut take),
        };
    }
    SCRATCH.set(scratch);
}

/// The first `N` of `left` points or fewer; returns how many.
fn block<const N: usize, const K: usize>(
    tape: &Tape,
    file: &mut [f64],
    left: usize,
    fill: &impl Fn(usize, &mut [f64]),
    take: &mut impl FnMut([&[f64]; K]),
) -> usize {
    let file = &mut file.as_chunks_mut::<N>().0[..tape.n_registers];
    let n = left.min(N);
    for &(axis, register) in &tape.inputs {
        let (used, spare) = file[register as usize].split_at_mut(n);
        fill(axis as usize, used);
        // Idle lanes hold a real point: values far off would cost time (subnormal numbers).
        spare.fill(used[n - 1]);
    }
    run(&tape.instructions, file, n);
    take(std::array::from_fn(|k| &file[tape.outputs[k] as usize][..n]));
    n
}

#[cfg(target_arch = "x86_64")]
fn run<const N: usize>(instructions: &[Instruction], file: &mut [[f64; N]], used: usize) {
    if InstructionSet::best() >= InstructionSet::Avx2 {
        #[expect(unsafe_code, reason = "calls code compiled for AVX2: half the time of SSE2")]
        // SAFETY: the processor has AVX2, as checked in the line above.
        unsafe {
            run_avx2(instructions, file, used);
        }
    } else {
        interpret(instructions, file, used);
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn run<const N: usize>(instructions: &[Instruction], file: &mut [[f64; N]], used: usize) {
    interpret(instructions, file, used);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<const N: usize>(instructions: &[Instruction], file: &mut [[f64; N]], used: usize) {
    interpret(instructions, file, used);
}

#[inline(always)]
fn interpret<const N: usize>(instructions: &[Instruction], file: &mut [[f64; N]], used: usize) {
    for instruction in instructions {
        let k = instruction.constant;
        let mut row = Row { instruction, file, used };
        match instruction.op {
            Op::Constant => row.constant(k),
            Op::AddConstant => row.one(|a| a + k),
            Op::ConstantSub => row.one(|a| k - a),
            Op::Scale => row.one(|a| k * a),
            Op::ScaleAdd => row.two(|a, b| k * a + b),
            Op::ConstantDiv => row.one(|a| k / a),
            Op::MulAdd => row.three(|a, b, c| a * b + c),
            Op::MulAddConstant => row.two(|a, b| a * b + k),
            Op::MulSub => row.three(|a, b, c| a * b - c),
            Op::SubMul => row.three(|a, b, c| c - a * b),
            Op::MulMulAdd => row.four(|a, b, c, d| a * b + c * d),
            Op::MulMulSub => row.four(|a, b, c, d| a * b - c * d),
            Op::Select => row.three(|c, p, q| if c == 0.0 { q } else { p }),
            Op::Unary(op) => unary(&mut row, op),
            Op::Binary(op) => binary(&mut row, op),
            Op::Power(_) | Op::Blend => unreachable!("invariant: lowered for points"),
        }
    }
}

#[inline(always)]
fn unary<const N: usize>(row: &mut Row<'_, N>, op: UnaryOp) {
    match op {
        UnaryOp::Neg => row.one(|a| -a),
        UnaryOp::Abs => row.one(f64::abs),
        UnaryOp::Sign => row.one(operation::sign),
        UnaryOp::Sqrt => row.one(f64::sqrt),
        UnaryOp::HalfInverse => row.one(|a| operation::unless_zero(a, 0.5 / a)),
        UnaryOp::GuardedInverse => row.one(|a| operation::unless_zero(a, 1.0 / a)),
        UnaryOp::Sin => row.circular::<Sine>(),
        UnaryOp::Cos => row.circular::<Cosine>(),
        UnaryOp::BlendGap => row.one(operation::blend_gap),
        UnaryOp::BlendSlope => row.one(operation::blend_slope),
        UnaryOp::BlendCurvature => row.one(operation::blend_curvature),
        _ => row.each(|[a]| op.apply(a)),
    }
}

#[inline(always)]
fn binary<const N: usize>(row: &mut Row<'_, N>, op: BinaryOp) {
    match op {
        BinaryOp::Add => row.two(|a, b| a + b),
        BinaryOp::Sub => row.two(|a, b| a - b),
        BinaryOp::Mul => row.two(|a, b| a * b),
        BinaryOp::Div => row.two(|a, b| a / b),
        BinaryOp::Min => row.two(operation::min),
        BinaryOp::Max => row.two(operation::max),
        BinaryOp::LessEqual => row.two(operation::less_equal),
        _ => row.each(|[a, b]| op.apply(a, b)),
    }
}

/// A register by fours. Loads of a four stand before its store, so that it becomes one vector
/// operation: a loop over single lanes is unrolled first and then not vectorised.
#[inline(always)]
fn chunks<const N: usize>(register: &[f64; N]) -> &[[f64; 4]] {
    register.as_chunks().0
}

/// The registers of one instruction. The result's is never one of the arguments', so that the
/// compiler needs no check for overlap.
struct Row<'a, const N: usize> {
    instruction: &'a Instruction,
    file: &'a mut [[f64; N]],
    /// Lanes that hold points of their own.
    used: usize,
}

impl<const N: usize> Row<'_, N> {
    /// The result's register and those of the first `A` arguments.
    #[inline(always)]
    fn registers<const A: usize>(&mut self) -> (&mut [f64; N], [&[f64; N]; A]) {
        let out = self.instruction.out as usize;
        let (before, rest) = self.file.split_at_mut(out);
        let (result, after) = rest.split_first_mut().expect("invariant: registers exist");
        let mut arguments = [&[0.0; N]; A];
        for (k, argument) in arguments.iter_mut().enumerate() {
            let at = self.instruction.args[k] as usize;
            *argument = if at < out { &before[at] } else { &after[at - out - 1] };
        }
        (result, arguments)
    }

    #[inline(always)]
    fn constant(&mut self, k: f64) {
        *self.registers::<0>().0 = [k; N];
    }

    /// For functions too large to be worth compiling twice a length, and dear enough not to be
    /// called for idle lanes: a point alone would cost as much as eight.
    #[inline(always)]
    fn each<const A: usize>(&mut self, f: impl Fn([f64; A]) -> f64) {
        let used = self.used;
        let (out, arguments) = self.registers::<A>();
        for i in 0..used {
            out[i] = f(arguments.map(|argument| argument[i]));
        }
        let last = out[used - 1];
        out[used..].fill(last);
    }

    /// Lane by lane: a body as long as this is not unrolled, so that the loop becomes vector code.
    #[inline(always)]
    fn circular<F: Circular>(&mut self) {
        let used = self.used;
        let (out, [argument]) = self.registers::<1>();
        for i in 0..N {
            out[i] = F::usual(argument[i]);
        }
        for i in 0..used {
            if out[i].is_nan() {
                out[i] = F::whole(argument[i]);
            }
        }
    }

    #[inline(always)]
    fn one(&mut self, f: impl Fn(f64) -> f64) {
        let (out, arguments) = self.registers::<1>();
        let [a] = arguments.map(chunks);
        for (i, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (a,) = (a[i],);
            *out = [f(a[0]), f(a[1]), f(a[2]), f(a[3])];
        }
    }

    #[inline(always)]
    fn two(&mut self, f: impl Fn(f64, f64) -> f64) {
        let (out, arguments) = self.registers::<2>();
        let [a, b] = arguments.map(chunks);
        for (i, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (a, b) = (a[i], b[i]);
            *out = [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])];
        }
    }

    #[inline(always)]
    fn three(&mut self, f: impl Fn(f64, f64, f64) -> f64) {
        let (out, arguments) = self.registers::<3>();
        let [a, b, c] = arguments.map(chunks);
        for (i, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (a, b, c) = (a[i], b[i], c[i]);
            *out = [
                f(a[0], b[0], c[0]),
                f(a[1], b[1], c[1]),
                f(a[2], b[2], c[2]),
                f(a[3], b[3], c[3]),
            ];
        }
    }

    #[inline(always)]
    fn four(&mut self, f: impl Fn(f64, f64, f64, f64) -> f64) {
        let (out, arguments) = self.registers::<4>();
        let [a, b, c, d] = arguments.map(chunks);
        for (i, out) in out.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (a, b, c, d) = (a[i], b[i], c[i], d[i]);
            *out = [
                f(a[0], b[0], c[0], d[0]),
                f(a[1], b[1], c[1], d[1]),
                f(a[2], b[2], c[2], d[2]),
                f(a[3], b[3], c[3], d[3]),
            ];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dag::NodeId;
    use crate::lowering::{Target, lower};

    /// A tape with every operation that has a kernel of its own.
    fn tape() -> Tape {
        let text = "a = 3*x + y*z - 2; b = x*y - z*x; c = 5 - a; d = 1/(b^2 + 1)
            s = smin(a, b, 0.5) + sqrt(abs(c)) + sign(x)*d - min(x, max(y, z))
            clamp(a*b - c, -1, 1) + s/a + floor(x)*sin(y) + x^3*atan2(y, x) - x^1.5*exp(-z)";
        let (mut dag, root) =
            crate::parser::parse(text, &std::collections::BTreeMap::new()).unwrap();
        let n_values = dag.n_nodes();
        let first = crate::derivative::gradient(&mut dag, root);
        let second = crate::derivative::hessian(&mut dag, first);
        let roots: Vec<NodeId> = [root].into_iter().chain(first).chain(second).collect();
        let (low, roots) = lower(&dag, &roots, n_values, Target::Points);
        Tape::new(&low, &roots, Target::Points)
    }

    fn points(n: usize) -> Vec<Vec3> {
        let at = |i: usize, step: f64| 4.0 * (i as f64 * step).fract() - 2.0;
        (0..n).map(|i| Vec3::new(at(i, 0.819), at(i, 0.671), at(i, 0.549))).collect()
    }

    fn results(tape: &Tape, points: &[Vec3]) -> Vec<[u64; 10]> {
        let mut out = vec![[0; 10]; points.len()];
        // NaN payloads may differ: they are not data.
        let bits = |f: f64| if f.is_nan() { u64::MAX } else { f.to_bits() };
        evaluate(tape, points, &mut out, |all: [f64; 10]| all.map(bits));
        out
    }

    #[test]
    fn results_do_not_depend_on_neighbours_in_the_batch() {
        let (tape, points) = (tape(), points(203));
        let together = results(&tape, &points);
        for (point, expected) in points.iter().zip(&together) {
            assert_eq!(results(&tape, &[*point])[0], *expected);
        }
        for n in [7, 15, 45, 100] {
            assert_eq!(results(&tape, &points[..n]), together[..n]);
        }
    }

    #[test]
    fn blocks_of_coordinates_give_the_bits_of_points() {
        let (tape, points) = (tape(), points(BLOCK));
        let together = results(&tape, &points);
        let axes = [0, 1, 2].map(|axis| std::array::from_fn(|i| points[i][axis]));
        for n in [1, 9, 40, BLOCK] {
            let mut out = [[0.0; BLOCK]; 10];
            evaluate_block(&tape, n, &axes, &mut out);
            for (i, expected) in together[..n].iter().enumerate() {
                let bits = |f: f64| if f.is_nan() { u64::MAX } else { f.to_bits() };
                assert_eq!(out.map(|lanes| bits(lanes[i])), *expected);
            }
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn avx2_and_plain_code_agree_in_all_bits() {
        if !std::arch::is_x86_feature_detected!("avx2") {
            return;
        }
        let tape = tape();
        let start: Vec<[f64; 32]> = (0..tape.n_registers)
            .map(|k| points(32 * (k + 1))[32 * k..].iter().map(|p| p.x).collect::<Vec<_>>())
            .map(|lanes| lanes.try_into().unwrap())
            .collect();
        let (mut plain, mut vector) = (start.clone(), start);
        interpret(&tape.instructions, &mut plain, 32);
        run(&tape.instructions, &mut vector, 32);
        for (a, b) in plain.as_flattened().iter().zip(vector.as_flattened()) {
            assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "{a:e} {b:e}");
        }
    }
}
