//! Eight numbers at a time: what compilers turn into wide vectors.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use isospline_geometry::Vec3;
use std::ops::{Add, Div, Mul, Sub};

/// Numbers together.
pub(crate) const N: usize = 8;

/// A number of each of eight cases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes(pub(crate) [f64; N]);

impl Lanes {
    /// The same number for all.
    #[inline(always)]
    pub(crate) fn all(x: f64) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for x in &mut out.0 {
            *x = f(*x);
        }
        out
    }

    #[inline(always)]
    pub(crate) fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(&other.0) {
            *x = f(*x, *y);
        }
        out
    }

    /// Where both numbers stand in such an order.
    #[inline(always)]
    pub(crate) fn is(self, other: Self, f: impl Fn(f64, f64) -> bool) -> Mask {
        let mut out = Mask([false; N]);
        for ((out, x), y) in out.0.iter_mut().zip(&self.0).zip(&other.0) {
            *out = f(*x, *y);
        }
        out
    }
}

macro_rules! operator {
    ($operator:ident, $method:ident, $f:expr) => {
        impl $operator for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.with(other, $f)
            }
        }
    };
}

operator!(Add, add, |x, y| x + y);
operator!(Sub, sub, |x, y| x - y);
operator!(Mul, mul, |x, y| x * y);
operator!(Div, div, |x, y| x / y);

impl Mul<Lanes> for f64 {
    type Output = Lanes;

    #[inline(always)]
    fn mul(self, x: Lanes) -> Lanes {
        x.map(|x| self * x)
    }
}

/// A yes or no for each of eight cases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mask(pub(crate) [bool; N]);

impl Mask {
    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(&other.0) {
            *x &= *y;
        }
        out
    }

    #[inline(always)]
    pub(crate) fn not(self) -> Self {
        Self(self.0.map(|x| !x))
    }

    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.0.contains(&true)
    }

    /// The first numbers where it says yes, the others elsewhere.
    #[inline(always)]
    pub(crate) fn pick(self, yes: Lanes, no: Lanes) -> Lanes {
        let mut out = no;
        for ((out, yes), mask) in out.0.iter_mut().zip(&yes.0).zip(&self.0) {
            *out = if *mask { *yes } else { *out };
        }
        out
    }
}

/// A vector of each of eight cases; sums of three run from x to z, as those of a [`Vec3`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vectors(pub(crate) [Lanes; 3]);

impl Vectors {
    pub(crate) const ZERO: Self = Self([Lanes([0.0; N]); 3]);

    /// The vectors of all cases.
    #[inline(always)]
    pub(crate) fn of(vector: impl Fn(usize) -> Vec3) -> Self {
        let mut out = Self::ZERO;
        for k in 0..N {
            let v = vector(k);
            out.0[0].0[k] = v.x;
            out.0[1].0[k] = v.y;
            out.0[2].0[k] = v.z;
        }
        out
    }

    /// That of a case.
    #[inline(always)]
    pub(crate) fn get(&self, k: usize) -> Vec3 {
        let [x, y, z] = &self.0;
        Vec3::new(x.0[k], y.0[k], z.0[k])
    }

    #[inline(always)]
    pub(crate) fn with(self, other: Self, f: impl Fn(Lanes, Lanes) -> Lanes) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([f(x, a), f(y, b), f(z, c)])
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: Lanes) -> Self {
        self.with(Self([factor; 3]), |x, factor| x * factor)
    }

    #[inline(always)]
    pub(crate) fn over(self, divisor: Lanes) -> Self {
        self.with(Self([divisor; 3]), |x, divisor| x / divisor)
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        x * a + y * b + z * c
    }
}

impl Add for Vectors {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |x, y| x + y)
    }
}

impl Sub for Vectors {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |x, y| x - y)
    }
}
