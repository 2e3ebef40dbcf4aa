//! The scalar operations of a formula and what each gives at one point.
//!
//! Constant folding and the evaluators share these definitions, so a folded constant has the bits
//! that evaluation would give. Transcendental functions come from the libm crate: the platform's
//! would differ in the last bit from machine to machine.

/// A function of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum UnaryOp {
    Neg,
    Abs,
    Sign,
    Floor,
    Sqrt,
    Exp,
    Ln,
    Log10,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    /// `1/(2a)`, 0 at 0: slope of the square root in terms of its value.
    HalfInverse,
    /// `1/a`, 0 at 0: the slopes of quotients that have no limit there.
    GuardedInverse,
    /// `ln a`, 0 at 0: slope of `0^p` with respect to p.
    GuardedLn,
    /// Slope of `sign`: 0 at every point, unbounded over an interval that holds the jump.
    SignSlope,
    /// Slope of `floor`, likewise.
    FloorSlope,
    /// `(1-|t|)^3/6` for |t| < 1, else 0: what the blend takes off the smaller argument.
    BlendGap,
    /// `sign(t) (1 - (1-|t|)^2)/2`: slope of `|t|/2 + BlendGap(t)`, C1 and within [-1/2, 1/2].
    BlendSlope,
    /// `1-|t|` for |t| < 1, else 0: slope of `BlendSlope`.
    BlendCurvature,
}

/// A function of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum BinaryOp {
    Add,
    Sub,
    Mul,
    Div,
    Min,
    Max,
    Pow,
    /// `a^b`, 0 where `a = 0` and `b < 0`: slopes of powers at a zero base.
    GuardedPow,
    Atan2,
    /// `1/(a^2+b^2)`, 0 at the origin: slope of `atan2`, unbounded over its branch cut.
    AngleSlope,
    /// Jump of `atan2`: 0 at every point, unbounded over boxes that hold its branch cut.
    AngleJump,
    /// Jump of `pow` in the exponent: 0 at every point, unbounded over boxes that hold a zero base
    /// with an exponent of 0 or less, where the power is 1 or infinite instead of 0.
    PowJump,
    /// 1 where `a <= b`, else 0.
    LessEqual,
}

impl UnaryOp {
    /// The value at one point.
    pub(crate) fn apply(self, a: f64) -> f64 {
        match self {
            Self::Neg => -a,
            Self::Abs => a.abs(),
            Self::Sign => sign(a),
            Self::Floor => a.floor(),
            Self::Sqrt => a.sqrt(),
            Self::Exp => libm::exp(a),
            Self::Ln => libm::log(a),
            Self::Log10 => libm::log10(a),
            Self::Sin => libm::sin(a),
            Self::Cos => libm::cos(a),
            Self::Tan => libm::tan(a),
            Self::Asin => libm::asin(a),
            Self::Acos => libm::acos(a),
            Self::Atan => libm::atan(a),
            Self::Sinh => libm::sinh(a),
            Self::Cosh => libm::cosh(a),
            Self::Tanh => libm::tanh(a),
            Self::HalfInverse => unless_zero(a, 0.5 / a),
            Self::GuardedInverse => unless_zero(a, 1.0 / a),
            Self::GuardedLn => unless_zero(a, libm::log(a)),
            Self::SignSlope | Self::FloorSlope => 0.0,
            Self::BlendGap => blend_gap(a),
            Self::BlendSlope => blend_slope(a),
            Self::BlendCurvature => blend_curvature(a),
        }
    }
}

impl BinaryOp {
    /// The value at one point.
    pub(crate) fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::Min => min(a, b),
            Self::Max => max(a, b),
            Self::Pow => libm::pow(a, b),
            Self::GuardedPow => guarded_pow(a, b),
            Self::Atan2 => libm::atan2(a, b),
            Self::AngleSlope => unless_zero(a * a + b * b, 1.0 / (a * a + b * b)),
            Self::AngleJump | Self::PowJump => 0.0,
            Self::LessEqual => less_equal(a, b),
        }
    }

    /// Whether the order of the arguments leaves value and derivatives alone.
    pub(crate) fn is_commutative(self) -> bool {
        matches!(self, Self::Add | Self::Mul)
    }
}

/// `-1`, `0` or `1`; NaN stays NaN.
#[inline]
pub(crate) fn sign(a: f64) -> f64 {
    let nonzero = if a > 0.0 { 1.0 } else { -1.0 };
    if a == 0.0 || a.is_nan() { a.abs() } else { nonzero }
}

#[inline]
pub(crate) fn unless_zero(a: f64, otherwise: f64) -> f64 {
    if a == 0.0 { 0.0 } else { otherwise }
}

/// The smaller value; NaN if either is NaN, the first on a tie.
#[inline]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    let smaller = if a <= b { a } else { b };
    if a.is_nan() { a } else { smaller }
}

/// The larger value; NaN if either is NaN, the first on a tie.
#[inline]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    let larger = if a >= b { a } else { b };
    if a.is_nan() { a } else { larger }
}

#[inline]
pub(crate) fn less_equal(a: f64, b: f64) -> f64 {
    if a <= b { 1.0 } else { 0.0 }
}

#[inline]
pub(crate) fn guarded_pow(a: f64, b: f64) -> f64 {
    if a == 0.0 && b < 0.0 { 0.0 } else { libm::pow(a, b) }
}

#[inline]
pub(crate) fn blend_curvature(t: f64) -> f64 {
    max(1.0 - t.abs(), 0.0)
}

#[inline]
pub(crate) fn blend_gap(t: f64) -> f64 {
    let h = blend_curvature(t);
    h * h * h / 6.0
}

#[inline]
pub(crate) fn blend_slope(t: f64) -> f64 {
    let h = blend_curvature(t);
    sign(t) * (0.5 - 0.5 * (h * h))
}

/// `a^n` by repeated squaring, in the order of multiplications that evaluation uses.
pub(crate) fn power(a: f64, n: i32) -> f64 {
    if n < 0 { 1.0 / positive_power(a, n.unsigned_abs()) } else { positive_power(a, n as u32) }
}

fn positive_power(a: f64, n: u32) -> f64 {
    match n {
        0 => 1.0,
        1 => a,
        _ if n.is_multiple_of(2) => {
            let root = positive_power(a, n / 2);
            root * root
        }
        _ => positive_power(a, n - 1) * a,
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use super::*;

    #[test]
    fn min_and_max_keep_not_a_number() {
        for (a, b) in [(f64::NAN, 1.0), (1.0, f64::NAN)] {
            assert!(min(a, b).is_nan() && max(a, b).is_nan());
        }
        assert_eq!((min(1.0, 2.0), max(1.0, 2.0)), (1.0, 2.0));
    }

    #[test]
    fn powers_agree_with_repeated_multiplication() {
        for n in -9_i32..=9 {
            let expected = 1.5_f64.powi(n);
            assert!((power(1.5, n) - expected).abs() <= 1e-14 * expected, "n = {n}");
        }
        assert_eq!(power(0.0, 0), 1.0);
    }

    #[test]
    fn sign_of_zero_is_zero_and_of_nan_is_nan() {
        assert_eq!([sign(-3.0), sign(-0.0), sign(0.0), sign(5.0)], [-1.0, 0.0, 0.0, 1.0]);
        assert!(sign(f64::NAN).is_nan());
    }
}
