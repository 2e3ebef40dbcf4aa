//! Eight numbers at a time: what compilers turn into wide vectors.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use isospline_geometry::Vec3;
use std::ops::{Add, Div, Mul, Sub};

/// Numbers together.
pub const N: usize = 8;

/// A number of each of eight cases.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(pub [f64; N]);

impl Lanes {
    /// The same number for all.
    #[inline(always)]
    pub fn all(x: f64) -> Self {
        Self([x; N])
    }

    /// A function of each number.
    #[must_use]
    #[inline(always)]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for x in &mut out.0 {
            *x = f(*x);
        }
        out
    }

    /// A function of each number and that of the other.
    #[must_use]
    #[inline(always)]
    pub fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(&other.0) {
            *x = f(*x, *y);
        }
        out
    }

    /// Where both numbers stand in such an order.
    #[inline(always)]
    pub fn is(self, other: Self, f: impl Fn(f64, f64) -> bool) -> Mask {
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
pub struct Mask(pub [bool; N]);

impl Mask {
    /// Where both say yes.
    #[must_use]
    #[inline(always)]
    pub fn and(self, other: Self) -> Self {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(&other.0) {
            *x &= *y;
        }
        out
    }

    /// Where it says no.
    #[expect(clippy::should_implement_trait, reason = "reads as its neighbours do")]
    #[must_use]
    #[inline(always)]
    pub fn not(self) -> Self {
        Self(self.0.map(|x| !x))
    }

    /// Whether it says yes anywhere.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.contains(&true)
    }

    /// The first numbers where it says yes, the others elsewhere.
    #[inline(always)]
    pub fn pick(self, yes: Lanes, no: Lanes) -> Lanes {
        let mut out = no;
        for ((out, yes), mask) in out.0.iter_mut().zip(&yes.0).zip(&self.0) {
            *out = if *mask { *yes } else { *out };
        }
        out
    }

    /// The first vectors where it says yes, the others elsewhere.
    #[inline(always)]
    pub fn pick_vectors(self, yes: Vectors, no: Vectors) -> Vectors {
        yes.with(no, |yes, no| self.pick(yes, no))
    }
}

/// A vector of each of eight cases; sums of three run from x to z, as those of a [`Vec3`].
#[derive(Clone, Copy, Debug)]
pub struct Vectors(pub [Lanes; 3]);

impl Vectors {
    /// All zero.
    pub const ZERO: Self = Self([Lanes([0.0; N]); 3]);

    /// The vectors of all cases.
    #[inline(always)]
    pub fn of(vector: impl Fn(usize) -> Vec3) -> Self {
        let mut out = Self::ZERO;
        for k in 0..N {
            let v = vector(k);
            out.0[0].0[k] = v.x;
            out.0[1].0[k] = v.y;
            out.0[2].0[k] = v.z;
        }
        out
    }

    /// Sets that of a case.
    #[inline(always)]
    pub fn set(&mut self, k: usize, vector: Vec3) {
        for (lanes, x) in self.0.iter_mut().zip([vector.x, vector.y, vector.z]) {
            lanes.0[k] = x;
        }
    }

    /// That of a case.
    #[inline(always)]
    pub fn get(&self, k: usize) -> Vec3 {
        let [x, y, z] = &self.0;
        Vec3::new(x.0[k], y.0[k], z.0[k])
    }

    /// A function of each component and that of the other.
    #[must_use]
    #[inline(always)]
    pub fn with(self, other: Self, f: impl Fn(Lanes, Lanes) -> Lanes) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([f(x, a), f(y, b), f(z, c)])
    }

    /// Times a number for each case.
    #[must_use]
    #[inline(always)]
    pub fn times(self, factor: Lanes) -> Self {
        self.with(Self([factor; 3]), |x, factor| x * factor)
    }

    /// Divided by a number for each case.
    #[must_use]
    #[inline(always)]
    pub fn over(self, divisor: Lanes) -> Self {
        self.with(Self([divisor; 3]), |x, divisor| x / divisor)
    }

    /// The scalar products.
    #[inline(always)]
    pub fn dot(self, other: Self) -> Lanes {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        x * a + y * b + z * c
    }

    /// The lengths.
    #[inline(always)]
    pub fn norm(self) -> Lanes {
        self.dot(self).map(f64::sqrt)
    }

    /// The quadratic forms of symmetric matrices, given by their entries xx, xy, xz, yy, yz, zz.
    #[inline(always)]
    pub fn form(self, m: &[Lanes; 6]) -> Lanes {
        let [x, y, z] = self.0;
        let image = Self([
            m[0] * x + m[1] * y + m[2] * z,
            m[1] * x + m[3] * y + m[4] * z,
            m[2] * x + m[4] * y + m[5] * z,
        ]);
        self.dot(image)
    }
}

impl Add for Vectors {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |x, y| x + y)
    }
}

impl Mul<f64> for Vectors {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.times(Lanes::all(factor))
    }
}

impl Div<f64> for Vectors {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        self.over(Lanes::all(divisor))
    }
}

impl Sub for Vectors {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |x, y| x - y)
    }
}
