//! Closed intervals with outward rounding.
//!
//! Every operation encloses the exact results *and* the rounded results of its members, so an
//! enclosure of a formula holds what the point evaluators return. Sums and products that are
//! exact stay exact (`0 * [1, 2]`, small integers, dyadic box corners): otherwise `sqrt(1 - x^2)`
//! on [-1, 1] would reach below zero by a rounding error and be unknown.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval `[lo, hi]`; NaN bounds mean "nothing known".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

/// Enclosures of a value and its gradient over a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalJet {
    /// Enclosure of the value.
    pub value: Interval,
    /// Enclosure of each partial derivative.
    pub gradient: [Interval; 3],
}

impl Interval {
    /// Every real number.
    pub const ENTIRE: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
    /// Nothing known: the formula is undefined somewhere in the box.
    pub const UNKNOWN: Self = Self { lo: f64::NAN, hi: f64::NAN };
    /// Zero.
    pub const ZERO: Self = Self { lo: 0.0, hi: 0.0 };

    /// The interval between two bounds.
    pub fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// The interval of one number.
    pub fn point(value: f64) -> Self {
        Self { lo: value, hi: value }
    }

    /// Whether zero may be a member; true where nothing is known.
    pub fn may_be_zero(&self) -> bool {
        !(self.lo > 0.0 || self.hi < 0.0)
    }

    /// Whether nothing is known.
    pub fn is_unknown(&self) -> bool {
        self.lo.is_nan() || self.hi.is_nan()
    }

    /// Whether `value` may be a member; true where nothing is known.
    pub fn contains(&self, value: f64) -> bool {
        self.is_unknown() || (self.lo <= value && value <= self.hi)
    }

    /// `hi - lo`.
    pub fn width(&self) -> f64 {
        self.hi - self.lo
    }

    /// The middle.
    pub fn midpoint(&self) -> f64 {
        self.lo.midpoint(self.hi)
    }

    /// The smallest interval around both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        if self.is_unknown() || other.is_unknown() {
            return Self::UNKNOWN;
        }
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The members of both; of the known one if the other is unknown.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        // `max` and `min` return the other argument if one is NaN.
        Self { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// The interval moved down by `shift`, rounded outward.
    #[must_use]
    pub fn minus(self, shift: f64) -> Self {
        self - Self::point(shift)
    }

    /// `{a^n}` for an integer; even powers do not reach below zero.
    #[must_use]
    pub fn power(self, n: i32) -> Self {
        if self.is_unknown() {
            return self;
        }
        if n < 0 {
            return Self::point(1.0) / self.positive_power(n.unsigned_abs());
        }
        self.positive_power(n as u32)
    }

    fn positive_power(self, n: u32) -> Self {
        if n == 0 {
            return Self::point(1.0);
        }
        if self.lo >= 0.0 {
            return Self { lo: power_down(self.lo, n), hi: power_up(self.hi, n) };
        }
        let even = n.is_multiple_of(2);
        if self.hi <= 0.0 {
            let mirrored = (-self).positive_power(n);
            return if even { mirrored } else { -mirrored };
        }
        if even {
            Self { lo: 0.0, hi: power_up(self.hi.max(-self.lo), n) }
        } else {
            Self { lo: -power_up(-self.lo, n), hi: power_up(self.hi, n) }
        }
    }

    /// Both bounds NaN if one is.
    fn checked(self) -> Self {
        if self.is_unknown() { Self::UNKNOWN } else { self }
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { lo: add_down(self.lo, other.lo), hi: -add_down(-self.hi, -other.hi) }.checked()
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;
    /// A zero factor gives zero even where the other is unbounded. By signs, so that two products
    /// suffice in eight of nine cases.
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self, other);
        if a.is_unknown() || b.is_unknown() {
            return Self::UNKNOWN;
        }
        let between = |lo: [f64; 2], hi: [f64; 2]| Self {
            lo: mul_down(lo[0], lo[1]),
            hi: -mul_down(-hi[0], hi[1]),
        };
        if a.lo >= 0.0 {
            let low = if b.lo >= 0.0 { a.lo } else { a.hi };
            let high = if b.hi <= 0.0 { a.lo } else { a.hi };
            between([low, b.lo], [high, b.hi])
        } else if a.hi <= 0.0 {
            let low = if b.hi <= 0.0 { a.hi } else { a.lo };
            let high = if b.lo >= 0.0 { a.hi } else { a.lo };
            between([low, b.hi], [high, b.lo])
        } else if b.lo >= 0.0 {
            between([a.lo, b.hi], [a.hi, b.hi])
        } else if b.hi <= 0.0 {
            between([a.hi, b.lo], [a.lo, b.lo])
        } else {
            between([a.lo, b.hi], [a.lo, b.lo]).hull(between([a.hi, b.lo], [a.hi, b.hi]))
        }
    }
}

impl Div for Interval {
    type Output = Self;
    /// Everything if the divisor holds zero.
    fn div(self, other: Self) -> Self {
        let (a, b) = (self, other);
        if a.is_unknown() || b.is_unknown() {
            return Self::UNKNOWN;
        }
        if b.may_be_zero() {
            return Self::ENTIRE;
        }
        if b.hi < 0.0 {
            return -a / -b;
        }
        let lo = div_down(a.lo, if a.lo >= 0.0 { b.hi } else { b.lo });
        let hi = -div_down(-a.hi, if a.hi >= 0.0 { b.lo } else { b.hi });
        Self { lo, hi }.checked()
    }
}

/// A lower bound of what rounds to `value`: the float before it, or a little less if it is near
/// the smallest normal number; the largest float for a positive overflow.
///
/// With u = 2^-53 the step `u (1 + 2 u) |value|` exceeds half the distance to the next float and
/// stays below it, so the rounded difference is that float \[derived\]. Arithmetic where
/// `next_down` works on bits with five cases: it becomes vector code.
#[inline]
pub(crate) fn down(value: f64) -> f64 {
    const STEP: f64 = (1.0 + f64::EPSILON) * (0.5 * f64::EPSILON);
    let lower = value - (STEP * value.abs() + f64::MIN_POSITIVE);
    if value == f64::INFINITY { f64::MAX } else { lower }
}

/// A lower bound of `a + b`, the sum itself if it is exact (by the error term of two-sum).
#[inline]
pub(crate) fn add_down(a: f64, b: f64) -> f64 {
    let sum = a + b;
    let b_part = sum - a;
    let error = (a - (sum - b_part)) + (b - b_part);
    // Infinite sums have a NaN error: exact if a term is infinite, else an overflow.
    let is_exact = (error >= 0.0) | is_infinite(a) | is_infinite(b);
    let lower = down(sum);
    if is_exact { sum } else { lower }
}

/// A lower bound of `a * b`, the product itself if it is exact.
#[inline]
#[expect(clippy::needless_bitwise_bool, reason = "lazy operators would be branches")]
pub(crate) fn mul_down(a: f64, b: f64) -> f64 {
    let product = a * b;
    let lower = down(product);
    let bound = if is_exact(a, b, product) { product } else { lower };
    // An underflow to zero hides the sign: a product of equal signs is not below zero.
    let is_tiny = (product == 0.0) & ((a > 0.0) == (b > 0.0));
    if (a == 0.0) | (b == 0.0) | is_tiny { 0.0 } else { bound }
}

/// An upper bound of `a * b`, likewise.
#[inline]
pub(crate) fn mul_up(a: f64, b: f64) -> f64 {
    -mul_down(-a, b)
}

#[inline]
fn is_infinite(a: f64) -> bool {
    a.abs() == f64::INFINITY
}

/// Whether `a * b` is not rounded: its factors have few enough significant bits together.
#[inline]
fn is_exact(a: f64, b: f64, product: f64) -> bool {
    let size = product.abs();
    let is_normal = (f64::MIN_POSITIVE..=f64::MAX).contains(&size);
    let is_short = lowest_bit(a) * lowest_bit(b) >= 9_007_199_254_740_992.0;
    (is_short & is_normal) | is_infinite(a) | is_infinite(b)
}

/// The lowest bit set in the significand, 1 to 2^52. Without counting or converting, for which
/// there are no vector instructions: the bit is added to those of the float 2^52.
#[inline]
fn lowest_bit(a: f64) -> f64 {
    const HIDDEN: u64 = 1 << 52;
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let bits = a.to_bits() | HIDDEN;
    let lowest = bits & bits.wrapping_neg();
    f64::from_bits(TWO_52.to_bits() + lowest) - TWO_52
}

/// A lower bound of `a / b` for `b > 0`.
#[inline]
#[expect(clippy::float_cmp, reason = "whether a quotient is exact is a question of bits")]
fn div_down(a: f64, b: f64) -> f64 {
    if a == 0.0 {
        return 0.0;
    }
    let quotient = a / b;
    let exact = quotient.is_normal() && is_exact(quotient, b, a) && quotient * b == a;
    if exact || a.is_infinite() {
        return quotient;
    }
    if quotient == 0.0 && a > 0.0 { 0.0 } else { down(quotient) }
}

/// `a^n` from below for `a >= 0` and `n >= 1`, with the multiplications of
/// [`crate::operation::power`].
#[inline]
fn power_down(a: f64, n: u32) -> f64 {
    power_by(a, n, mul_down)
}

/// `a^n` from above, likewise.
#[inline]
fn power_up(a: f64, n: u32) -> f64 {
    power_by(a, n, mul_up)
}

#[inline]
fn power_by(a: f64, n: u32, multiply: impl Fn(f64, f64) -> f64) -> f64 {
    let mut power = a;
    for bit in (0..n.ilog2()).rev() {
        power = multiply(power, power);
        if n >> bit & 1 == 1 {
            power = multiply(power, a);
        }
    }
    power
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these bounds are exact")]
mod tests {
    use super::*;

    #[test]
    fn exact_results_are_not_widened() {
        let a = Interval::new(-1.0, 2.0);
        assert_eq!(a + Interval::point(0.5), Interval::new(-0.5, 2.5));
        assert_eq!(a * Interval::point(3.0), Interval::new(-3.0, 6.0));
        assert_eq!(a.power(2), Interval::new(0.0, 4.0));
        assert_eq!(a.power(3), Interval::new(-1.0, 8.0));
        assert_eq!(a / Interval::point(4.0), Interval::new(-0.25, 0.5));
    }

    #[test]
    fn rounded_results_are_widened_to_both_sides_of_the_truth() {
        let tenth = Interval::point(0.1);
        let product = tenth * tenth;
        assert!(product.lo < 0.1 * 0.1 && 0.1 * 0.1 < product.hi);
        let third = Interval::point(1.0) / Interval::point(3.0);
        assert!(third.lo < 1.0 / 3.0 && 1.0 / 3.0 < third.hi);
        let tiny = Interval::point(1e-200);
        assert!((tiny * tiny).lo == 0.0 && (tiny * tiny).hi > 0.0);
        let large = Interval::point(1e200);
        assert_eq!(large * large, Interval::new(f64::MAX, f64::INFINITY));
        assert_eq!((Interval::point(f64::MAX) + Interval::point(f64::MAX)).lo, f64::MAX);
    }

    #[test]
    fn stepping_down_by_arithmetic_gives_the_float_before() {
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let some = f64::from_bits(bits);
            let power = f64::from_bits(bits & 0xfff0_0000_0000_0000);
            for value in [some, power, power.next_down(), power.next_up()] {
                if value.abs() > 1e-290 && value.is_finite() {
                    assert_eq!(down(value), value.next_down(), "{value:e}");
                } else if !value.is_nan() {
                    assert!(down(value) < value || value == f64::NEG_INFINITY, "{value:e}");
                }
            }
        }
    }

    #[test]
    fn division_by_an_interval_with_zero_knows_nothing() {
        assert_eq!(Interval::point(1.0) / Interval::new(-1.0, 1.0), Interval::ENTIRE);
        assert!((Interval::UNKNOWN * Interval::ZERO).may_be_zero());
        assert!((Interval::ENTIRE - Interval::ENTIRE).may_be_zero());
    }
}
