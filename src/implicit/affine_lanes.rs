//! Runs a tape over several boxes at once, in affine forms.
//!
//! An interval forgets that both factors of `x * (1 - x)` move with the same x. An affine form
//! keeps the part that is linear over the box, so what it is too wide by falls with the square
//! of the box, and a box shows a sign that intervals show on its eighths or not at all. As in
//! [`crate::interval_lanes`] registers are structures of arrays, and sums and products, which
//! most formulas are made of, are straight-line code that becomes vector instructions.
#![expect(
    clippy::inline_always,
    reason = "the interpreter must be compiled inside the function that enables AVX2"
)]

use crate::affine::{ADD_ROUNDING, Affine, MUL_ROUNDING, REST_ROUNDING, TINY, step};
use crate::instruction_set::{Kernel, run_widest};
use crate::interval::Interval;
use crate::operation::{BinaryOp, UnaryOp};
use crate::tape::{Instruction, Op, Tape, others};
use std::cell::Cell;

/// Boxes a block: two vectors of the widest kind.
const LANES: usize = 16;

/// A register: a form for each box of a block.
#[derive(Clone, Copy)]
struct Lanes {
    middle: [f64; LANES],
    slopes: [[f64; LANES]; 3],
    rest: [f64; LANES],
}

const ZERO: Lanes = Lanes { middle: [0.0; LANES], slopes: [[0.0; LANES]; 3], rest: [0.0; LANES] };

thread_local! {
    /// Register file of this thread, kept to spare an allocation a call.
    static SCRATCH: Cell<Vec<Lanes>> = const { Cell::new(Vec::new()) };
}

/// Forms of the outputs of `tape` over boxes, written to `out` by `to_result`.
pub(crate) fn enclose_all<const K: usize, T>(
    tape: &Tape,
    domains: &[[Interval; 3]],
    out: &mut [T],
    to_result: impl Fn([Affine; K]) -> T,
) {
    assert_eq!(domains.len(), out.len(), "one result a box");
    let mut file = SCRATCH.take();
    if file.len() < tape.n_registers {
        file.resize(tape.n_registers, ZERO);
    }
    for (domains, out) in domains.chunks(LANES).zip(out.chunks_mut(LANES)) {
        for &(axis, register) in &tape.inputs {
            let register = &mut file[register as usize];
            *register = ZERO;
            for lane in 0..LANES {
                // Idle lanes hold a real box: values far off would cost time.
                let side = domains[lane.min(domains.len() - 1)][axis as usize];
                register.set(lane, &Affine::coordinate(axis as usize, side));
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
    fn get(&self, lane: usize) -> Affine {
        Affine {
            middle: self.middle[lane],
            slopes: [self.slopes[0][lane], self.slopes[1][lane], self.slopes[2][lane]],
            rest: self.rest[lane],
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, form: &Affine) {
        self.middle[lane] = form.middle;
        for (slopes, slope) in self.slopes.iter_mut().zip(form.slopes) {
            slopes[lane] = slope;
        }
        self.rest[lane] = form.rest;
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
        let constant = instruction.constant;
        match instruction.op {
            Op::Constant => *out = Lanes { middle: [constant; LANES], ..ZERO },
            Op::AddConstant => add_constant(constant, 1.0, argument(0), out),
            Op::ConstantSub => add_constant(constant, -1.0, argument(0), out),
            Op::Scale => scale(constant, argument(0), out),
            Op::Unary(UnaryOp::Neg) => negate(argument(0), out),
            Op::Binary(BinaryOp::Add) => add(argument(0), argument(1), 1.0, out),
            Op::Binary(BinaryOp::Sub) => add(argument(0), argument(1), -1.0, out),
            Op::Binary(BinaryOp::Mul) => multiply(argument(0), argument(1), out),
            Op::Power(n) if n > 0 => power(argument(0), n as u32, out),
            _ => {
                for lane in 0..LANES {
                    out.set(lane, &step(instruction, |k| argument(k).get(lane)));
                }
            }
        }
    }
}

#[inline(always)]
fn negate(a: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        out.middle[i] = -a.middle[i];
        for k in 0..3 {
            out.slopes[k][i] = -a.slopes[k][i];
        }
        out.rest[i] = a.rest[i];
    }
}

/// `a + sign * b`.
#[inline(always)]
fn add(a: &Lanes, b: &Lanes, sign: f64, out: &mut Lanes) {
    for i in 0..LANES {
        let middle = a.middle[i] + sign * b.middle[i];
        let x = a.slopes[0][i] + sign * b.slopes[0][i];
        let y = a.slopes[1][i] + sign * b.slopes[1][i];
        let z = a.slopes[2][i] + sign * b.slopes[2][i];
        let size = middle.abs() + x.abs() + (y.abs() + z.abs());
        out.middle[i] = middle;
        out.slopes[0][i] = x;
        out.slopes[1][i] = y;
        out.slopes[2][i] = z;
        out.rest[i] = (a.rest[i] + b.rest[i] + ADD_ROUNDING * size) * REST_ROUNDING;
    }
}

/// `k + sign * a`.
#[inline(always)]
fn add_constant(k: f64, sign: f64, a: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let (x, y, z) = (a.slopes[0][i], a.slopes[1][i], a.slopes[2][i]);
        let middle = k + sign * a.middle[i];
        let size = middle.abs() + x.abs() + (y.abs() + z.abs());
        out.middle[i] = middle;
        out.slopes[0][i] = sign * x;
        out.slopes[1][i] = sign * y;
        out.slopes[2][i] = sign * z;
        out.rest[i] = (a.rest[i] + ADD_ROUNDING * size) * REST_ROUNDING;
    }
}

/// `k * a`.
#[inline(always)]
fn scale(k: f64, a: &Lanes, out: &mut Lanes) {
    let size = k.abs();
    for i in 0..LANES {
        let (a0, ax, ay, az) = (a.middle[i], a.slopes[0][i], a.slopes[1][i], a.slopes[2][i]);
        let a_size = a0.abs() + ax.abs() + (ay.abs() + az.abs());
        out.middle[i] = k * a0;
        out.slopes[0][i] = k * ax;
        out.slopes[1][i] = k * ay;
        out.slopes[2][i] = k * az;
        out.rest[i] = (a.rest[i] * size + MUL_ROUNDING * (a_size * size)) * REST_ROUNDING + TINY;
    }
}

/// As `Affine::times`.
#[inline(always)]
fn multiply(a: &Lanes, b: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let (a0, b0, a_rest, b_rest) = (a.middle[i], b.middle[i], a.rest[i], b.rest[i]);
        let (ax, ay, az) = (a.slopes[0][i], a.slopes[1][i], a.slopes[2][i]);
        let (bx, by, bz) = (b.slopes[0][i], b.slopes[1][i], b.slopes[2][i]);
        let (xx, yy, zz) = (ax * bx, ay * by, az * bz);
        let mixed =
            (ax * by + ay * bx).abs() + (ax * bz + az * bx).abs() + (ay * bz + az * by).abs();
        let squares = xx.abs() + yy.abs() + zz.abs();
        let a_size = a0.abs() + ax.abs() + (ay.abs() + az.abs());
        let b_size = b0.abs() + bx.abs() + (by.abs() + bz.abs());
        let rest = 0.5 * squares + mixed + a_rest * (b_size + b_rest) + b_rest * a_size;
        out.middle[i] = a0 * b0 + 0.5 * (xx + yy + zz);
        out.slopes[0][i] = a0 * bx + b0 * ax;
        out.slopes[1][i] = a0 * by + b0 * ay;
        out.slopes[2][i] = a0 * bz + b0 * az;
        out.rest[i] = (rest + MUL_ROUNDING * (a_size * b_size)) * REST_ROUNDING + TINY;
    }
}

#[inline(always)]
fn power(a: &Lanes, n: u32, out: &mut Lanes) {
    *out = *a;
    for bit in (0..n.ilog2()).rev() {
        let root = *out;
        multiply(&root, &root, out);
        if n >> bit & 1 == 1 {
            let even = *out;
            multiply(&even, a, out);
        }
    }
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
            clamp(a*b - c, -1, 1) + sqrt(x - 1)*d + floor(x)*sin(y) + (x*b)^3*atan2(y, x)";
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
    fn bits<const K: usize>(all: [Affine; K]) -> [[u64; 5]; K] {
        let bits = |f: f64| if f.is_nan() { u64::MAX } else { f.to_bits() };
        all.map(|form| {
            let [x, y, z] = form.slopes.map(bits);
            [bits(form.middle), x, y, z, bits(form.rest)]
        })
    }

    #[test]
    fn forms_do_not_depend_on_the_other_boxes_of_a_call() {
        let (tape, boxes) = (gradient_tape(), boxes(53));
        let of = |boxes: &[[Interval; 3]]| {
            let mut forms = vec![[[0; 5]; 4]; boxes.len()];
            enclose_all(&tape, boxes, &mut forms, bits::<4>);
            forms
        };
        let together = of(&boxes);
        for (domain, together) in boxes.iter().zip(&together) {
            assert_eq!(of(&[*domain])[0], *together, "{domain:?}");
        }
    }

    #[test]
    fn vector_and_plain_code_agree_in_all_bits() {
        let tape = gradient_tape();
        let mut start = vec![ZERO; tape.n_registers];
        for (lane, domain) in boxes(LANES as u32).into_iter().enumerate() {
            for &(axis, register) in &tape.inputs {
                let side = domain[axis as usize];
                start[register as usize].set(lane, &Affine::coordinate(axis as usize, side));
            }
        }
        let mut plain = start.clone();
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
