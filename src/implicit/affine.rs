//! Affine forms: what of a function is linear over a box, and how far it may be from that.
//!
//! Unlike [`crate::interval`] a form encloses exact values alone, not what rounding makes of the
//! formula at a point. \[derived\] Each operation keeps the linear part of its result and adds a
//! bound of all else to the rest: of a product the products of the linear parts, of a function
//! `g(a) = g(m) + s (a - m)`, s between the slopes that g has over the values of a.

use crate::interval::Interval;
use crate::operation::{BinaryOp, UnaryOp};
use crate::tape::{Instruction, Op};

/// Rounding of a product, of the product of the sizes of the factors: ten roundings of 2^-53 of
/// parts of it, and as much again.
pub(crate) const MUL_ROUNDING: f64 = 2e-15;
/// Rounding of a sum, of the size of the result: one of 2^-53 each part, and as much again.
pub(crate) const ADD_ROUNDING: f64 = 2.5e-16;
/// Covers the roundings of a rest itself, a dozen sums and products of positive numbers.
pub(crate) const REST_ROUNDING: f64 = 1.0 + 4e-15;
/// Covers what products below the least normal number lose.
pub(crate) const TINY: f64 = 1e-300;

/// `middle + slopes . e`, up to `rest` more or less, at the points of a box that lie `e` half sides
/// off its middle, `|e_k| <= 1`. Figures that are not finite mean "nothing known".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// The value in the middle, or near it.
    pub middle: f64,
    /// Change from the middle to each upper side.
    pub slopes: [f64; 3],
    /// How far the value may be from the linear one.
    pub rest: f64,
}

/// Forms of a value and its gradient over a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineJet {
    /// The value.
    pub value: Affine,
    /// Each partial derivative; where the gradient jumps, all between its limits.
    pub gradient: [Affine; 3],
}

impl Affine {
    const UNKNOWN: Self = Self { middle: f64::NAN, slopes: [0.0; 3], rest: f64::NAN };

    /// The middle of a side of a box and half its length, rounded up: the unit of forms over it.
    pub fn middle_and_half(side: Interval) -> [f64; 2] {
        let middle = side.midpoint();
        let half = (side.hi - middle).max(middle - side.lo);
        [middle, if half > 0.0 { half.next_up() } else { half }]
    }

    /// How far the value may be from that in the middle.
    pub fn reach(&self) -> f64 {
        self.linear_reach() + self.rest
    }

    /// All values that the form may have.
    pub fn interval(&self) -> Interval {
        let reach = self.reach() * REST_ROUNDING;
        // Exactly: a condition that is zero is decided.
        if reach == 0.0 {
            return Interval::point(self.middle);
        }
        let values =
            Interval::new((self.middle - reach).next_down(), (self.middle + reach).next_up());
        if values.lo.is_finite() && values.hi.is_finite() { values } else { Interval::UNKNOWN }
    }

    /// The coordinate along `axis` of a box with this side.
    pub(crate) fn coordinate(axis: usize, side: Interval) -> Self {
        let [middle, half] = Self::middle_and_half(side);
        let mut slopes = [0.0; 3];
        slopes[axis] = half;
        Self { middle, slopes, rest: 0.0 }
    }

    /// `{-a}`.
    pub(crate) fn negated(&self) -> Self {
        Self { middle: -self.middle, slopes: self.slopes.map(|s| -s), rest: self.rest }
    }

    /// `{a - shift}`.
    pub(crate) fn minus(&self, shift: f64) -> Self {
        let middle = self.middle - shift;
        let rest = (self.rest + ADD_ROUNDING * middle.abs()) * REST_ROUNDING;
        Self { middle, rest, ..*self }
    }

    fn linear_reach(&self) -> f64 {
        let [x, y, z] = self.slopes;
        (x.abs() + y.abs() + z.abs()) * REST_ROUNDING
    }

    /// Any values of an interval.
    fn any_of(values: Interval) -> Self {
        let [middle, rest] = Self::middle_and_half(values);
        let is_known = middle.is_finite() && rest.is_finite();
        if is_known { Self { middle, slopes: [0.0; 3], rest } } else { Self::UNKNOWN }
    }

    /// `a + sign * b`.
    fn plus(&self, b: &Self, sign: f64) -> Self {
        let slopes = std::array::from_fn(|k| self.slopes[k] + sign * b.slopes[k]);
        let sum = Self { middle: self.middle + sign * b.middle, slopes, rest: 0.0 };
        let size = sum.middle.abs() + sum.linear_reach();
        Self { rest: (self.rest + b.rest + ADD_ROUNDING * size) * REST_ROUNDING, ..sum }
    }

    /// `{a * b}` for the same point: of the products of the linear parts squares lie within
    /// `[0, 1]`, others within `[-1, 1]`.
    fn times(&self, b: &Self) -> Self {
        let a = self;
        let (mut sum, mut squares, mut mixed) = (0.0, 0.0, 0.0);
        for k in 0..3 {
            let j = (k + 1) % 3;
            let square = a.slopes[k] * b.slopes[k];
            sum += square;
            squares += square.abs();
            mixed += (a.slopes[k] * b.slopes[j] + a.slopes[j] * b.slopes[k]).abs();
        }
        let slopes = std::array::from_fn(|k| a.middle * b.slopes[k] + b.middle * a.slopes[k]);
        let (a_size, b_size) =
            (a.middle.abs() + a.linear_reach(), b.middle.abs() + b.linear_reach());
        let rest = 0.5 * squares + mixed + a.rest * (b_size + b.rest) + b.rest * a_size;
        let rest = (rest + MUL_ROUNDING * (a_size * b_size)) * REST_ROUNDING + TINY;
        Self { middle: a.middle * b.middle + 0.5 * sum, slopes, rest }
    }

    /// `g(a)` by its value in the middle and an enclosure of its slopes over all values of a; `plain`
    /// holds all its values and is taken where it is narrower.
    fn linearised(&self, at_middle: Interval, slope: Interval, plain: Interval) -> Self {
        let [factor, spread] = Self::middle_and_half(slope);
        let start = Self::any_of(at_middle);
        let slopes = self.slopes.map(|s| factor * s);
        let rounding = MUL_ROUNDING * (factor.abs() * self.reach());
        let rest = start.rest + spread * self.reach() + factor.abs() * self.rest + rounding;
        let form = Self { middle: start.middle, slopes, rest: rest * REST_ROUNDING + TINY };
        let plain = Self::any_of(plain);
        if form.rest < plain.rest || plain.rest.is_nan() { form } else { plain }
    }

    fn unary(&self, op: UnaryOp) -> Self {
        use UnaryOp as U;
        let direct = match op {
            U::Sin | U::Cos => Some(self.circular(op)),
            U::Sqrt => self.root(),
            U::HalfInverse => self.quotient(0.5),
            U::GuardedInverse => self.quotient(1.0),
            _ => None,
        };
        if let Some(direct) = direct {
            return direct;
        }
        let x = self.interval();
        let plain = x.unary(op);
        let one = Interval::point(1.0);
        let slope = match op {
            U::Neg => return self.negated(),
            U::Abs if x.lo >= 0.0 => return *self,
            U::Abs if x.hi <= 0.0 => return self.negated(),
            U::Abs => x.unary(U::Sign),
            U::Exp => plain,
            U::Ln if x.lo > 0.0 => one / x,
            U::Atan => one / (one + x.power(2)),
            U::Tanh => one - plain.power(2),
            U::Sinh => x.unary(U::Cosh),
            U::Cosh => x.unary(U::Sinh),
            U::HalfInverse if !x.may_be_zero() => Interval::point(-0.5) / x.power(2),
            U::GuardedInverse if !x.may_be_zero() => -one / x.power(2),
            U::BlendSlope => x.unary(U::BlendCurvature),
            _ => return Self::any_of(plain),
        };
        self.linearised(Interval::point(self.middle).unary(op), slope, plain)
    }

    /// Sine or cosine: `g(m) + g'(m) (a - m)`, and half the square of `a - m` times the largest
    /// second derivative, which is a value again. Two calls of libm where [`Self::linearised`] has six.
    fn circular(&self, op: UnaryOp) -> Self {
        let (sin, cos) = (libm::sin(self.middle), libm::cos(self.middle));
        let (value, slope) = if op == UnaryOp::Sin { (sin, cos) } else { (cos, -sin) };
        let reach = self.reach();
        let most = (value.abs() + reach).min(1.0);
        // libm is within a few units of 2^-53 of the truth: twice the rounding of a product.
        let form = self.along(value, slope, 0.5 * reach * reach * most + 2.0 * MUL_ROUNDING);
        if form.rest >= 1.0 { Self::any_of(Interval::new(-1.0, 1.0)) } else { form }
    }

    /// `sqrt(a)` by its tangent in the middle: the square of the distance from there over
    /// `2 sqrt(m)^3` is more than it bends. `None` near zero.
    fn root(&self) -> Option<Self> {
        let reach = self.reach() * REST_ROUNDING;
        // Also false for NaN.
        if !(self.middle > reach && reach.is_finite()) {
            return None;
        }
        let value = self.middle.sqrt();
        let slope = 0.5 / value;
        let bend = reach * reach * slope / self.middle;
        Some(self.along(value, slope, bend))
    }

    /// `k / a` by its tangent in the middle: `1/a = 1/m - d/m^2 + d^2/(m^2 a)`. `None` where plain
    /// enclosures are better, near zero.
    fn quotient(&self, k: f64) -> Option<Self> {
        const NEAR: f64 = 0.6;
        let reach = self.reach() * REST_ROUNDING;
        let size = self.middle.abs();
        // Also false for NaN.
        if !(reach < NEAR * size && size.is_finite()) {
            return None;
        }
        let value = k / self.middle;
        let slope = -value / self.middle;
        let bend = reach * reach * slope.abs() / (size - reach);
        Some(self.along(value, slope, bend))
    }

    /// The tangent in the middle, and how far the function bends away from it.
    fn along(&self, value: f64, slope: f64, bend: f64) -> Self {
        let rounding = MUL_ROUNDING * (value.abs() + slope.abs() * self.reach());
        let rest = bend + slope.abs() * self.rest + rounding;
        let slopes = self.slopes.map(|s| slope * s);
        Self { middle: value, slopes, rest: rest * REST_ROUNDING * REST_ROUNDING + TINY }
    }

    fn power(&self, n: i32) -> Self {
        if n == -1
            && let Some(quotient) = self.quotient(1.0)
        {
            return quotient;
        }
        let x = self.interval();
        let slope = Interval::point(f64::from(n)) * x.power(n - 1);
        self.linearised(Interval::point(self.middle).power(n), slope, x.power(n))
    }

    fn binary(&self, op: BinaryOp, b: &Self) -> Self {
        let (x, y) = (self.interval(), b.interval());
        // Which is smaller shows better in the difference: of 2 x and 5 x over [1, 9] say.
        let gap = self.plus(b, -1.0).interval();
        match op {
            BinaryOp::Div if !y.may_be_zero() => self.times(&b.power(-1)),
            BinaryOp::Min if gap.hi <= 0.0 => *self,
            BinaryOp::Min if gap.lo >= 0.0 => *b,
            BinaryOp::Max if gap.lo >= 0.0 => *self,
            BinaryOp::Max if gap.hi <= 0.0 => *b,
            BinaryOp::LessEqual if gap.hi <= 0.0 => Self::any_of(Interval::point(1.0)),
            BinaryOp::LessEqual if gap.lo > 0.0 => Self::any_of(Interval::ZERO),
            _ => Self::any_of(x.binary(op, y)),
        }
    }

    /// `smin(a, b, k) = (a + b)/2 - h(a - b)`: the mean is linear, and h has the slope that
    /// [`UnaryOp::BlendSlope`] gives.
    fn blend(a: &Self, b: &Self, k: &Self) -> Self {
        let plain = Interval::blend(a.interval(), b.interval(), k.interval());
        let is_constant = k.rest == 0.0 && k.linear_reach() == 0.0;
        if !is_constant || plain.is_unknown() {
            return Self::any_of(plain);
        }
        let (half, k) = (Interval::point(0.5), Interval::point(k.middle));
        let h = |gap: Interval| {
            let t = gap / k;
            k * (half * t.abs() + t.unary(UnaryOp::BlendGap))
        };
        let gap = a.plus(b, -1.0);
        let slope = (gap.interval() / k).unary(UnaryOp::BlendSlope);
        let lost = gap.linearised(h(Interval::point(gap.middle)), slope, h(gap.interval()));
        let mean = a.plus(b, 1.0).times(&Self::any_of(half));
        mean.plus(&lost, -1.0)
    }

    /// `p` where the condition is not zero, else `q`; any of both where it is undecided.
    fn select(condition: &Self, p: &Self, q: &Self) -> Self {
        let condition = condition.interval();
        if !condition.may_be_zero() {
            *p
        } else if condition.lo == 0.0 && condition.hi == 0.0 {
            *q
        } else {
            Self::any_of(p.interval().hull(q.interval()))
        }
    }
}

/// The result of one instruction from its arguments.
pub(crate) fn step(instruction: &Instruction, argument: impl Fn(usize) -> Affine) -> Affine {
    match instruction.op {
        Op::Constant => Affine::any_of(Interval::point(instruction.constant)),
        Op::Unary(op) => argument(0).unary(op),
        Op::Binary(BinaryOp::Add) => argument(0).plus(&argument(1), 1.0),
        Op::Binary(BinaryOp::Sub) => argument(0).plus(&argument(1), -1.0),
        Op::Binary(BinaryOp::Mul) => argument(0).times(&argument(1)),
        Op::Binary(op) => argument(0).binary(op, &argument(1)),
        Op::Power(0) => Affine::any_of(Interval::point(1.0)),
        Op::Power(n) => argument(0).power(n),
        Op::Blend => Affine::blend(&argument(0), &argument(1), &argument(2)),
        Op::Select => Affine::select(&argument(0), &argument(1), &argument(2)),
        _ => unreachable!("invariant: {:?} is fused for points only", instruction.op),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Affine, AffineJet, Field, Formula, Interval};
    use std::collections::BTreeMap;

    fn value(text: &str, domain: [Interval; 3]) -> Affine {
        let mut jets: [Option<AffineJet>; 1] = [None];
        Formula::parse(text, &BTreeMap::new()).unwrap().gradient_forms(&[domain], &mut jets);
        jets[0].unwrap().value
    }

    #[test]
    fn the_factors_of_a_product_move_together() {
        let unit = [Interval::new(0.0, 1.0); 3];
        let found = value("x*(1 - x)", unit).interval();
        assert!(found.lo > -1e-12 && found.hi < 0.25 + 1e-12, "{found:?}");
        let found = value("3*(x - y) + y - (x - y)*2 - x", unit).interval();
        assert!(found.hi - found.lo < 1e-12, "{found:?}");
    }

    #[test]
    fn the_rest_falls_with_the_square_of_the_box() {
        for text in [
            "x*y*z + x^5",
            "sin(x)*exp(y) + sqrt(z + 2)/(x + 3)",
            "ln(x) + atan(y) + tanh(z) + cosh(x) - sinh(y) + cos(z)",
            "smin(x, y, 0.7) + smax(x*y, z, 0.6)",
            "x^-3 + abs(y) + min(x, y + 9) - max(z, x - 9)",
        ] {
            let rest = |half: f64| {
                let side = |at: f64| Interval::new(at - half, at + half);
                value(text, [side(0.9), side(0.8), side(0.7)]).rest
            };
            let ratio = rest(1e-3) / rest(5e-4);
            assert!((3.5..=4.5).contains(&ratio), "{text}: {ratio}");
        }
    }

    #[test]
    fn both_sides_of_a_kink_are_linear_and_the_kink_holds_both() {
        let side = |lo: f64, hi: f64| [Interval::new(lo, hi); 3];
        let slope = |domain: [Interval; 3]| {
            let mut jets: [Option<AffineJet>; 1] = [None];
            let field = Formula::parse("min(2*x, 5*x)", &BTreeMap::new()).unwrap();
            field.gradient_forms(&[domain], &mut jets);
            jets[0].unwrap().gradient[0].interval()
        };
        assert!(slope(side(0.1, 1.0)).contains(2.0) && slope(side(0.1, 1.0)).width() < 1e-9);
        assert!(slope(side(-1.0, -0.1)).contains(5.0) && slope(side(-1.0, -0.1)).width() < 1e-9);
        let at_kink = slope(side(-1.0, 1.0));
        assert!(at_kink.contains(2.0) && at_kink.contains(5.0), "{at_kink:?}");
    }

    #[test]
    fn what_is_undefined_in_the_box_is_unknown() {
        let around_zero = [Interval::new(-1.0, 2.0); 3];
        for text in ["sqrt(x)", "1/x", "ln(y) + x", "tan(3*z)"] {
            assert!(value(text, around_zero).interval().is_unknown(), "{text}");
        }
    }
}
