//! Enclosures of the elementary functions.
//!
//! libm's functions are within about one unit in the last place of the truth but need not be
//! monotone; bounds are therefore moved out by [`SLACK`] units.

use crate::interval::Interval;
use crate::operation::{self, BinaryOp, UnaryOp};
use std::f64::consts::PI;

/// Units in the last place between a computed bound and the enclosure: one for the error at the
/// bound, one for that of a computed member, two spare (libm documents < 1 for most, 1.5 for tan).
const SLACK: u32 = 4;

/// Arguments of circular functions beyond this are not reduced: the enclosure is the range.
const LARGEST_ANGLE: f64 = 1e5;

/// How near an extremum a bound may be before the extremum counts as inside, in turns: above the
/// rounding of `LARGEST_ANGLE / pi`, 3e-12.
const ANGLE_SLACK: f64 = 1e-10;

fn below(value: f64) -> f64 {
    (0..SLACK).fold(value, |value, _| value.next_down())
}

fn above(value: f64) -> f64 {
    (0..SLACK).fold(value, |value, _| value.next_up())
}

impl Interval {
    /// The part within `[lo, hi]`, the known range of a function.
    fn within(self, lo: f64, hi: f64) -> Self {
        Self { lo: self.lo.max(lo), hi: self.hi.min(hi) }
    }

    /// `{|a|}`.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.is_unknown() || self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Self { lo: 0.0, hi: self.hi.max(-self.lo) }
        }
    }

    /// `{sqrt(a)}`; unknown if a member is negative.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.is_unknown() || self.lo < 0.0 {
            return Self::UNKNOWN;
        }
        let exact = |root: f64, square: f64| {
            let p = Self::point(root) * Self::point(root);
            p.lo >= square && p.hi <= square
        };
        let (lo, hi) = (self.lo.sqrt(), self.hi.sqrt());
        Self {
            lo: if exact(lo, self.lo) { lo } else { lo.next_down() },
            hi: if exact(hi, self.hi) { hi } else { hi.next_up() },
        }
    }

    /// Enclosure of an operation.
    pub(crate) fn unary(self, op: UnaryOp) -> Self {
        if self.is_unknown() {
            return self;
        }
        match op {
            UnaryOp::Neg => -self,
            UnaryOp::Abs => self.abs(),
            UnaryOp::Sqrt => self.sqrt(),
            UnaryOp::Sign | UnaryOp::Floor => Self { lo: op.apply(self.lo), hi: op.apply(self.hi) },
            UnaryOp::Exp => self.increasing(op).within(0.0, f64::INFINITY),
            UnaryOp::Tanh => self.increasing(op).within(-1.0, 1.0),
            UnaryOp::Sinh | UnaryOp::Atan => self.increasing(op),
            UnaryOp::BlendSlope => self.increasing(op).within(-0.5, 0.5),
            UnaryOp::Ln | UnaryOp::Log10 if self.lo >= 0.0 => self.increasing(op),
            UnaryOp::Asin if self.is_within_one() => self.increasing(op),
            UnaryOp::Acos if self.is_within_one() => self.decreasing(op).within(0.0, 4.0),
            UnaryOp::Cosh => self.abs().increasing(op).within(1.0, f64::INFINITY),
            UnaryOp::BlendGap | UnaryOp::BlendCurvature => {
                self.abs().decreasing(op).within(0.0, 1.0)
            }
            UnaryOp::Sin => self.circular(op, 0.25),
            UnaryOp::Cos => self.circular(op, 0.0),
            UnaryOp::Tan => self.tan(),
            UnaryOp::Ln | UnaryOp::Log10 | UnaryOp::Asin | UnaryOp::Acos => Self::UNKNOWN,
            _ => self.slope(op),
        }
    }

    /// The operations that only derivatives use.
    fn slope(self, op: UnaryOp) -> Self {
        let jumps = match op {
            UnaryOp::SignSlope => self.lo < self.hi && self.may_be_zero(),
            UnaryOp::FloorSlope => self.lo.floor() < self.hi.floor(),
            UnaryOp::HalfInverse => return Self::point(0.5).guarded_quotient(self),
            UnaryOp::GuardedInverse => return Self::point(1.0).guarded_quotient(self),
            // Over a > 0 the logarithm; 0 is its value at a = 0.
            _ if self.lo < 0.0 => return Self::UNKNOWN,
            _ if self.lo > 0.0 => return self.increasing(UnaryOp::Ln),
            _ => return self.increasing(UnaryOp::Ln).hull(Self::ZERO),
        };
        if jumps { Self::ENTIRE } else { Self::ZERO }
    }

    /// `self / divisor` for a positive `self`, and 0 where the divisor is 0.
    fn guarded_quotient(self, divisor: Self) -> Self {
        if !divisor.may_be_zero() {
            return self / divisor;
        }
        if divisor.lo < 0.0 {
            return Self::ENTIRE;
        }
        Self { lo: 0.0, hi: if divisor.hi > 0.0 { f64::INFINITY } else { 0.0 } }
    }

    fn is_within_one(self) -> bool {
        self.lo >= -1.0 && self.hi <= 1.0
    }

    fn increasing(self, op: UnaryOp) -> Self {
        Self { lo: below(op.apply(self.lo)), hi: above(op.apply(self.hi)) }
    }

    fn decreasing(self, op: UnaryOp) -> Self {
        Self { lo: below(op.apply(self.hi)), hi: above(op.apply(self.lo)) }
    }

    /// Sine or cosine, with its maximum at `peak` turns.
    fn circular(self, op: UnaryOp, peak: f64) -> Self {
        let range = Self { lo: -1.0, hi: 1.0 };
        if self.lo < -LARGEST_ANGLE || self.hi > LARGEST_ANGLE {
            return range;
        }
        let turns = |angle: f64| angle / (2.0 * PI);
        let (from, to) = (turns(self.lo) - ANGLE_SLACK, turns(self.hi) + ANGLE_SLACK);
        let holds = |place: f64| (from - place).ceil() <= to - place;
        let ends = [op.apply(self.lo), op.apply(self.hi)];
        let lo = if holds(peak + 0.5) { -1.0 } else { below(ends[0].min(ends[1])) };
        let hi = if holds(peak) { 1.0 } else { above(ends[0].max(ends[1])) };
        Self { lo, hi }.within(-1.0, 1.0)
    }

    fn tan(self) -> Self {
        let half_turns = |angle: f64| angle / PI - 0.5;
        let (from, to) = (half_turns(self.lo) - ANGLE_SLACK, half_turns(self.hi) + ANGLE_SLACK);
        let bounded = self.lo >= -LARGEST_ANGLE && self.hi <= LARGEST_ANGLE;
        if bounded && from.ceil() > to { self.increasing(UnaryOp::Tan) } else { Self::ENTIRE }
    }

    /// Enclosure of an operation.
    pub(crate) fn binary(self, op: BinaryOp, other: Self) -> Self {
        let (a, b) = (self, other);
        if a.is_unknown() || b.is_unknown() {
            return if op == BinaryOp::LessEqual { Self::new(0.0, 1.0) } else { Self::UNKNOWN };
        }
        match op {
            BinaryOp::Add => a + b,
            BinaryOp::Sub => a - b,
            BinaryOp::Mul => a * b,
            BinaryOp::Div => a / b,
            BinaryOp::Min => Self { lo: a.lo.min(b.lo), hi: a.hi.min(b.hi) },
            BinaryOp::Max => Self { lo: a.lo.max(b.lo), hi: a.hi.max(b.hi) },
            BinaryOp::Pow => a.pow(b),
            BinaryOp::GuardedPow => {
                let power = a.pow(b);
                // The guard gives 0 at a zero base, whatever the power tends to.
                if a.may_be_zero() { power.hull(Self::ZERO) } else { power }
            }
            BinaryOp::Atan2 | BinaryOp::AngleSlope if crosses_cut(a, b) => match op {
                BinaryOp::Atan2 => Self { lo: below(-PI), hi: above(PI) },
                _ => Self::ENTIRE,
            },
            BinaryOp::Atan2 => corners(op, a, b),
            BinaryOp::AngleJump | BinaryOp::PowJump if crosses_cut(a, b) => Self::ENTIRE,
            BinaryOp::AngleJump | BinaryOp::PowJump => Self::ZERO,
            BinaryOp::AngleSlope => Self::point(1.0) / (a.power(2) + b.power(2)),
            BinaryOp::LessEqual => Self {
                lo: operation::less_equal(a.hi, b.lo),
                hi: operation::less_equal(a.lo, b.hi),
            },
        }
    }

    /// `{a^b}`.
    fn pow(self, b: Self) -> Self {
        let a = self;
        let exponent = (b.lo >= b.hi).then_some(b.lo);
        if a.lo > 0.0 || (a.lo == 0.0 && b.lo > 0.0) {
            // Monotone in each argument, so extreme in the corners.
            return corners(BinaryOp::Pow, a, b).within(0.0, f64::INFINITY);
        }
        match exponent {
            Some(n) if n.fract() == 0.0 && a.lo < 0.0 => a.integer_pow(n),
            // A negative zero to an odd negative power is -inf.
            _ if a.lo == 0.0 && b.lo < 0.0 => Self::ENTIRE,
            _ if a.lo == 0.0 => Self { lo: 0.0, hi: f64::INFINITY },
            _ => Self::UNKNOWN,
        }
    }

    /// `{a^n}` for a base with negative members and an integer too large for products.
    fn integer_pow(self, n: f64) -> Self {
        let even = n % 2.0 == 0.0;
        if n < 0.0 && self.may_be_zero() {
            return if even { Self { lo: 0.0, hi: f64::INFINITY } } else { Self::ENTIRE };
        }
        let base = if even { self.abs() } else { self };
        let power = corners(BinaryOp::Pow, base, Self::point(n));
        if even { power.within(0.0, f64::INFINITY) } else { power }
    }

    /// `smin(a, b, k)`: increasing in a and b, decreasing in k. Unknown unless k > 0.
    pub(crate) fn blend(a: Self, b: Self, k: Self) -> Self {
        if a.is_unknown() || b.is_unknown() || k.is_unknown() || k.lo <= 0.0 {
            return Self::UNKNOWN;
        }
        let lowest = Self::point_blend(a.lo, b.lo, k.hi);
        let highest = Self::point_blend(a.hi, b.hi, k.lo);
        if lowest.is_unknown() || highest.is_unknown() {
            return Self::UNKNOWN;
        }
        Self { lo: lowest.lo, hi: highest.hi }
    }

    /// The blend of numbers by the operations that point evaluation uses.
    fn point_blend(a: f64, b: f64, k: f64) -> Self {
        let [a, b, k] = [a, b, k].map(Self::point);
        let gap = ((a - b) / k).unary(UnaryOp::BlendGap);
        a.binary(BinaryOp::Min, b) - k * gap
    }

    /// `p` where the condition is not zero, else `q`; both where it is undecided.
    pub(crate) fn select(condition: Self, p: Self, q: Self) -> Self {
        if condition.is_unknown() || condition.lo < condition.hi {
            p.hull(q)
        } else if condition.lo == 0.0 {
            q
        } else {
            p
        }
    }
}

/// Whether `y = a`, `x = b` holds the origin or a point of the negative x-axis, where the angle
/// jumps by a turn (also by the sign of a zero y), and where the power `a^b` leaves 0.
fn crosses_cut(a: Interval, b: Interval) -> bool {
    a.may_be_zero() && b.lo <= 0.0
}

/// Hull of the values in the four corners, for operations that are extreme there.
fn corners(op: BinaryOp, a: Interval, b: Interval) -> Interval {
    let values =
        [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)].map(|(a, b)| op.apply(a, b));
    if values.iter().any(|value| value.is_nan()) {
        return Interval::UNKNOWN;
    }
    let lo = values.iter().copied().fold(f64::INFINITY, f64::min);
    let hi = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Interval { lo: below(lo), hi: above(hi) }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these bounds are exact")]
mod tests {
    use super::*;

    #[test]
    fn circular_functions_find_their_extrema() {
        let sine = |lo, hi| Interval::new(lo, hi).unary(UnaryOp::Sin);
        assert_eq!(sine(0.0, 2.0).hi, 1.0);
        assert!(sine(0.0, 2.0).lo <= 0.0 && sine(0.0, 2.0).lo > -1e-300);
        assert_eq!(sine(4.0, 5.0).lo, -1.0);
        assert!(sine(4.0, 5.0).hi < -0.7);
        assert_eq!(sine(-100.0, 100.0), Interval::new(-1.0, 1.0));
        assert_eq!(Interval::new(3.0, 4.0).unary(UnaryOp::Cos).lo, -1.0);
        assert_eq!(Interval::new(1.0, 2.0).unary(UnaryOp::Tan), Interval::ENTIRE);
        assert!(Interval::new(2.0, 3.0).unary(UnaryOp::Tan).hi < 0.0);
    }

    #[test]
    fn undefined_members_make_the_result_unknown() {
        assert!(Interval::new(-1.0, 4.0).sqrt().is_unknown());
        assert!(Interval::new(-1.0, 4.0).unary(UnaryOp::Ln).is_unknown());
        assert!(Interval::new(0.5, 1.5).unary(UnaryOp::Asin).is_unknown());
        assert_eq!(Interval::new(0.0, 4.0).sqrt(), Interval::new(0.0, 2.0));
    }

    #[test]
    fn slopes_of_jumps_are_unbounded_only_over_the_jump() {
        let floor_slope = |lo, hi| Interval::new(lo, hi).unary(UnaryOp::FloorSlope);
        assert_eq!(floor_slope(0.1, 0.9), Interval::ZERO);
        assert_eq!(floor_slope(0.1, 1.0), Interval::ENTIRE);
        let sign_slope = |lo, hi| Interval::new(lo, hi).unary(UnaryOp::SignSlope);
        assert_eq!(sign_slope(1.0, 2.0), Interval::ZERO);
        assert_eq!(sign_slope(0.0, 2.0), Interval::ENTIRE);
    }
}
