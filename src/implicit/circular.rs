//! Sine and cosine as straight-line code that becomes vector instructions, with the bits of libm.
//!
//! The steps are those of [`libm::sin`] and [`libm::cos`] (FreeBSD's msun): the argument less whole
//! quarter turns as a sum of two floats, then a polynomial for the quarter. What libm branches on
//! is chosen here: the branches of neighbouring points differ, and one vector of four costs a
//! quarter of four calls. Arguments that need more digits of pi (large ones, and next to a zero)
//! give NaN: the caller asks libm for those.
#![expect(
    clippy::inline_always,
    reason = "must be compiled inside the function that enables AVX2, as its callers are"
)]

/// Adding and taking it away again rounds to a whole number, whose low bits end its mantissa.
const TO_WHOLE: f64 = 1.5 / f64::EPSILON;
/// 53 bits of 2/pi.
const QUARTERS: f64 = f64::from_bits(0x3FE4_5F30_6DC9_C883);
/// The first 33 bits of pi/2: its products with numbers below 2^20 are exact.
const QUARTER: f64 = f64::from_bits(0x3FF9_21FB_5440_0000);
/// The rest of pi/2.
const QUARTER_REST: f64 = f64::from_bits(0x3DD0_B461_1A62_6331);

/// Where libm counts one quarter turn more, up to 9/4 pi; it compares high words.
const STEPS: [f64; 4] =
    [high(0x3fe9_21fc), high(0x4002_d97d), high(0x400f_6a7b), high(0x4015_fdbd)];
/// From here on quarter turns are rounded instead.
const ROUNDED_FROM: f64 = high(0x401c_463c);
/// From here on two floats of pi/2 do not do.
const LARGE: f64 = high(0x4139_21fb);
/// Below it the sine is its argument.
const TINY: f64 = high(0x3e50_0000);
/// Least part of the argument that two floats of pi/2 may leave: where libm sees less it takes a
/// third one. That is next to a zero; far from the origin, everywhere.
const LEAST_LEFT: f64 = 1.0 / 65_536.0;

const S: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];
const C: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

const fn high(word: u64) -> f64 {
    f64::from_bits(word << 32)
}

/// A function whose usual form becomes vector code where it stands in a loop.
pub(crate) trait Circular {
    /// Its value in all bits, or NaN where the usual form does not do.
    fn usual(x: f64) -> f64;

    /// Its value.
    fn whole(x: f64) -> f64;
}

/// [`libm::sin`].
pub(crate) enum Sine {}

/// [`libm::cos`].
pub(crate) enum Cosine {}

impl Circular for Sine {
    #[inline(always)]
    fn usual(x: f64) -> f64 {
        let angle = Angle::of(x);
        let (sine, cosine) = (sine_of_quarter(&angle), cosine_of_quarter(&angle));
        let sine = if x.abs() < TINY { x } else { sine };
        let of_quadrant = if angle.quadrant & 1 == 0 { sine } else { cosine };
        signed(of_quadrant, angle.quadrant >> 1, angle.is_told)
    }

    fn whole(x: f64) -> f64 {
        libm::sin(x)
    }
}

impl Circular for Cosine {
    #[inline(always)]
    fn usual(x: f64) -> f64 {
        let angle = Angle::of(x);
        let (sine, cosine) = (sine_of_quarter(&angle), cosine_of_quarter(&angle));
        let of_quadrant = if angle.quadrant & 1 == 0 { cosine } else { sine };
        signed(of_quadrant, (angle.quadrant + 1) >> 1, angle.is_told)
    }

    fn whole(x: f64) -> f64 {
        libm::cos(x)
    }
}

/// `quadrant * pi/2 + x + y`, modulo whole turns in the bits of `quadrant` above two.
struct Angle {
    x: f64,
    y: f64,
    quadrant: u64,
    /// Whether there was nothing to take away: libm leaves `y` out then.
    is_small: bool,
    is_told: bool,
}

impl Angle {
    #[inline(always)]
    fn of(x: f64) -> Self {
        let size = x.abs();
        let step = |k: usize| -> f64 { if size < STEPS[k] { 0.0 } else { 1.0 } };
        let few = ((step(0) + step(1)) + (step(2) + step(3))).copysign(x);
        let rounded = (x * QUARTERS + TO_WHOLE) - TO_WHOLE;
        let turns = if size < ROUNDED_FROM { few } else { rounded };
        let left = x - turns * QUARTER;
        let rest = turns * QUARTER_REST;
        let reduced = left - rest;
        Self {
            x: reduced,
            y: (left - reduced) - rest,
            quadrant: (turns + TO_WHOLE).to_bits(),
            is_small: size < STEPS[0],
            is_told: (size < LARGE) & (reduced.abs() >= LEAST_LEFT * size),
        }
    }
}

/// Turned if the lowest bit of `is_negative` is set.
#[inline(always)]
fn signed(value: f64, is_negative: u64, is_told: bool) -> f64 {
    let turned = f64::from_bits(value.to_bits() ^ (is_negative << 63));
    if is_told { turned } else { f64::NAN }
}

#[inline(always)]
fn sine_of_quarter(angle: &Angle) -> f64 {
    // symbols: as in msun's k_sin, z = x^2
    let (x, y) = (angle.x, angle.y);
    let z = x * x;
    let w = z * z;
    let r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    let v = z * x;
    let alone = x + v * (S[0] + z * r);
    let both = x - ((z * (0.5 * y - v * r) - y) - v * S[0]);
    if angle.is_small { alone } else { both }
}

#[inline(always)]
fn cosine_of_quarter(angle: &Angle) -> f64 {
    // symbols: as in msun's k_cos, z = x^2
    let (x, y) = (angle.x, angle.y);
    let z = x * x;
    let w = z * z;
    let r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    let half = 0.5 * z;
    let w = 1.0 - half;
    w + (((1.0 - w) - half) + (z * r - x * y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// How many of `arguments` are told; those that are have the bits of libm.
    #[track_caller]
    fn check(arguments: impl IntoIterator<Item = f64>) -> usize {
        let mut n_told = 0;
        for x in arguments {
            let (sine, cosine) = (Sine::usual(x), Cosine::usual(x));
            for (found, expected) in [(sine, libm::sin(x)), (cosine, libm::cos(x))] {
                if !found.is_nan() {
                    n_told += 1;
                    assert_eq!(
                        found.to_bits(),
                        expected.to_bits(),
                        "{x:e}: {found:e} {expected:e}"
                    );
                }
            }
        }
        n_told / 2
    }

    /// Numbers of both signs, evenly in their logarithm, between two sizes.
    fn spread(n: u32, least: f64, most: f64) -> impl Iterator<Item = f64> {
        let at = move |k: u32| {
            let part = (f64::from(k) * 0.618_033_988_749_894_9).fract();
            let size = least * libm::pow(most / least, part);
            if k.is_multiple_of(2) { size } else { -size }
        };
        (0..n).map(at)
    }

    #[test]
    fn sines_and_cosines_have_the_bits_of_libm() {
        assert!(check(spread(200_000, 1e-9, 100.0)) > 199_900);
        assert!(check(spread(200_000, 0.1, 30.0)) > 199_900);
        assert!(check(spread(100_000, 100.0, 1e4)) > 90_000);
        check(spread(100_000, 1e4, 1e7));
        check(spread(10_000, 1e-320, 1e-8));
        check(spread(10_000, 1e7, 1e300));
    }

    #[test]
    fn every_place_where_libm_branches_is_met_from_both_sides() {
        let around = |bound: f64| {
            let near = move |k: u64| f64::from_bits(bound.to_bits() - 50 + k);
            (0..100).flat_map(move |k| [near(k), -near(k)])
        };
        for bound in STEPS.into_iter().chain([ROUNDED_FROM, TINY, high(0x3e46_a09e)]) {
            assert_eq!(check(around(bound)), 200, "{bound}");
        }
        check(around(LARGE));
    }

    #[test]
    fn next_to_zeros_and_without_end_nothing_wrong_is_told() {
        for quarters in 0..100_000 {
            let x = f64::from(quarters) * FRAC_PI_2;
            check([x, x.next_up(), x.next_down(), -x, x + 1e-9, x - 1e-5, x * (1.0 + 1e-4)]);
        }
        check([0.0, -0.0, f64::MIN_POSITIVE, 1e22]);
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(Sine::usual(x).is_nan() && Cosine::usual(x).is_nan());
        }
    }
}
