//! What a scalar field answers.

use crate::{AffineJet, Interval, IntervalJet};
use isospline_geometry::{Mat3, Vec3};
use std::sync::Arc;

/// Symmetric 3 by 3 matrix as `[xx, xy, xz, yy, yz, zz]`.
pub type SymMat3 = [f64; 6];

/// The full matrix of a [`SymMat3`].
pub fn full(s: &SymMat3) -> Mat3 {
    Mat3::new(s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5])
}

/// Value and gradient at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet1 {
    /// `f(p)`.
    pub value: f64,
    /// `grad f(p)`.
    pub gradient: Vec3,
}

/// Value, gradient and Hessian at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet2 {
    /// `f(p)`.
    pub value: f64,
    /// `grad f(p)`.
    pub gradient: Vec3,
    /// Second derivatives.
    pub hessian: SymMat3,
}

/// Points that [`Field::gradient_block`] takes at most.
pub const BLOCK: usize = 64;

/// A scalar field `f: R^3 -> R`; its zero set is the surface and `f < 0` inside.
///
/// Points are evaluated in bulk; `points` and `out` have equal lengths. NaN and infinite values
/// are data: callers test for them. Results depend on the point alone, not on its neighbours in
/// the call nor on the thread.
pub trait Field: Send + Sync {
    /// Values.
    fn values(&self, points: &[Vec3], out: &mut [f64]);

    /// Values and gradients.
    fn gradients(&self, points: &[Vec3], out: &mut [Jet1]);

    /// Values and gradients at `n` points, [`BLOCK`] at most: x, y and z of all points in, value and
    /// the three slopes out. The same bits as of [`Field::gradients`]; of formulas without the cost
    /// of putting coordinates in order.
    fn gradient_block(&self, n: usize, points: &[[f64; BLOCK]; 3], out: &mut [[f64; BLOCK]; 4]) {
        let [x, y, z] = points;
        let points: [Vec3; BLOCK] = std::array::from_fn(|i| Vec3::new(x[i], y[i], z[i]));
        let mut jets = [Jet1 { value: 0.0, gradient: Vec3::zeros() }; BLOCK];
        self.gradients(&points[..n], &mut jets[..n]);
        for (i, jet) in jets[..n].iter().enumerate() {
            let slopes = jet.gradient;
            for (out, x) in out.iter_mut().zip([jet.value, slopes.x, slopes.y, slopes.z]) {
                out[i] = x;
            }
        }
    }

    /// Values, gradients and Hessians.
    fn hessians(&self, points: &[Vec3], out: &mut [Jet2]);

    /// Enclosure of the value over a box given by an interval an axis; `None` if the field has
    /// no interval arithmetic (a user's closure).
    fn value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval>;

    /// Enclosures of value and gradient over a box.
    fn gradient_enclosure(&self, domain: [Interval; 3]) -> Option<IntervalJet>;

    /// [`Field::value_enclosure`] of many boxes, the same bits; for formulas several times as fast.
    fn value_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<Interval>]) {
        for (out, &domain) in out.iter_mut().zip(domains) {
            *out = self.value_enclosure(domain);
        }
    }

    /// [`Field::gradient_enclosure`] of many boxes, likewise.
    fn gradient_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<IntervalJet>]) {
        for (out, &domain) in out.iter_mut().zip(domains) {
            *out = self.gradient_enclosure(domain);
        }
    }

    /// Affine forms of value and gradient over many boxes, as [`Affine::middle_and_half`] counts
    /// their sides: like [`Field::gradient_enclosures`], but too wide by a part that falls with the
    /// square of the box. `None` where the field has no interval arithmetic.
    ///
    /// [`Affine::middle_and_half`]: crate::Affine::middle_and_half
    fn gradient_forms(&self, domains: &[[Interval; 3]], out: &mut [Option<AffineJet>]) {
        assert_eq!(domains.len(), out.len(), "one result a box");
        out.fill(None);
    }

    /// Names of the functions with kinks, such as `min`, that choose otherwise at `a` than at `b`:
    /// between them runs an edge along which the gradient may jump. Empty where that is not known.
    fn kinks_between(&self, a: Vec3, b: Vec3) -> Vec<&'static str> {
        let _ = (a, b);
        Vec::new()
    }

    /// Enclosure of the value over a box: the better of [`Field::value_enclosure`] and the mean
    /// value form `f(c) + grad f(box) . (box - c)`, whose excess falls with the square of the size
    /// of the box instead of the size. Three times as expensive.
    fn tight_value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval> {
        let value = self.value_enclosure(domain)?;
        let jet = self.gradient_enclosure(domain)?;
        let center = domain.map(|side| Interval::point(side.midpoint()));
        let mut mean = self.value_enclosure(center)?;
        for k in 0..3 {
            mean = mean + jet.gradient[k] * (domain[k] - center[k]);
        }
        Some(value.intersection(mean))
    }

    /// Value at one point.
    fn value(&self, point: Vec3) -> f64 {
        let mut out = [0.0];
        self.values(&[point], &mut out);
        out[0]
    }

    /// Value and gradient at one point.
    fn gradient(&self, point: Vec3) -> Jet1 {
        let mut out = [Jet1 { value: 0.0, gradient: Vec3::zeros() }];
        self.gradients(&[point], &mut out);
        out[0]
    }

    /// Value, gradient and Hessian at one point.
    fn hessian(&self, point: Vec3) -> Jet2 {
        let mut out = [Jet2 { value: 0.0, gradient: Vec3::zeros(), hessian: [0.0; 6] }];
        self.hessians(&[point], &mut out);
        out[0]
    }
}

/// `sign * (inner - level)`: moves a level set to zero and turns it so that `f < 0` inside.
#[derive(Clone, Copy, Debug)]
pub struct Oriented<F> {
    /// The field as the user wrote it.
    pub inner: F,
    /// The level whose set is the surface.
    pub level: f64,
    /// Whether the sign is turned.
    pub flipped: bool,
}

impl<F> Oriented<F> {
    fn sign(&self) -> f64 {
        if self.flipped { -1.0 } else { 1.0 }
    }
}

impl<F: Field> Field for Oriented<F> {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.inner.values(points, out);
        let sign = self.sign();
        for f in out {
            *f = sign * (*f - self.level);
        }
    }

    fn gradients(&self, points: &[Vec3], out: &mut [Jet1]) {
        self.inner.gradients(points, out);
        let sign = self.sign();
        for jet in out {
            *jet = Jet1 { value: sign * (jet.value - self.level), gradient: sign * jet.gradient };
        }
    }

    fn gradient_block(&self, n: usize, points: &[[f64; BLOCK]; 3], out: &mut [[f64; BLOCK]; 4]) {
        self.inner.gradient_block(n, points, out);
        let sign = self.sign();
        let [value, slopes @ ..] = out;
        for f in &mut value[..n] {
            *f = sign * (*f - self.level);
        }
        for slopes in slopes {
            slopes[..n].iter_mut().for_each(|slope| *slope *= sign);
        }
    }

    fn hessians(&self, points: &[Vec3], out: &mut [Jet2]) {
        self.inner.hessians(points, out);
        let sign = self.sign();
        for jet in out {
            *jet = Jet2 {
                value: sign * (jet.value - self.level),
                gradient: sign * jet.gradient,
                hessian: jet.hessian.map(|h| sign * h),
            };
        }
    }

    fn value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval> {
        self.inner.value_enclosure(domain).map(|f| self.turn(f.minus(self.level)))
    }

    fn gradient_enclosure(&self, domain: [Interval; 3]) -> Option<IntervalJet> {
        self.inner.gradient_enclosure(domain).map(|jet| self.turned(jet))
    }

    fn value_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<Interval>]) {
        self.inner.value_enclosures(domains, out);
        for f in out.iter_mut().flatten() {
            *f = self.turn(f.minus(self.level));
        }
    }

    fn gradient_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<IntervalJet>]) {
        self.inner.gradient_enclosures(domains, out);
        for jet in out.iter_mut().flatten() {
            *jet = self.turned(*jet);
        }
    }

    fn kinks_between(&self, a: Vec3, b: Vec3) -> Vec<&'static str> {
        self.inner.kinks_between(a, b)
    }

    fn gradient_forms(&self, domains: &[[Interval; 3]], out: &mut [Option<AffineJet>]) {
        self.inner.gradient_forms(domains, out);
        for jet in out.iter_mut().flatten() {
            jet.value = jet.value.minus(self.level);
            if self.flipped {
                jet.value = jet.value.negated();
                jet.gradient = jet.gradient.map(|slope| slope.negated());
            }
        }
    }
}

impl<F> Oriented<F> {
    fn turn(&self, i: Interval) -> Interval {
        if self.flipped { Interval { lo: -i.hi, hi: -i.lo } } else { i }
    }

    fn turned(&self, jet: IntervalJet) -> IntervalJet {
        IntervalJet {
            value: self.turn(jet.value.minus(self.level)),
            gradient: jet.gradient.map(|g| self.turn(g)),
        }
    }
}

/// A pointer to a field answers as the field does.
macro_rules! forward_field {
    ($($pointer:ty),*) => {$(
        impl<F: Field + ?Sized> Field for $pointer {
            fn values(&self, points: &[Vec3], out: &mut [f64]) {
                (**self).values(points, out);
            }
            fn gradients(&self, points: &[Vec3], out: &mut [Jet1]) {
                (**self).gradients(points, out);
            }
            fn gradient_block(
                &self,
                n: usize,
                points: &[[f64; BLOCK]; 3],
                out: &mut [[f64; BLOCK]; 4],
            ) {
                (**self).gradient_block(n, points, out);
            }
            fn hessians(&self, points: &[Vec3], out: &mut [Jet2]) {
                (**self).hessians(points, out);
            }
            fn value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval> {
                (**self).value_enclosure(domain)
            }
            fn gradient_enclosure(&self, domain: [Interval; 3]) -> Option<IntervalJet> {
                (**self).gradient_enclosure(domain)
            }
            fn value_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<Interval>]) {
                (**self).value_enclosures(domains, out);
            }
            fn gradient_enclosures(
                &self,
                domains: &[[Interval; 3]],
                out: &mut [Option<IntervalJet>],
            ) {
                (**self).gradient_enclosures(domains, out);
            }
            fn gradient_forms(&self, domains: &[[Interval; 3]], out: &mut [Option<AffineJet>]) {
                (**self).gradient_forms(domains, out);
            }
            fn kinks_between(&self, a: Vec3, b: Vec3) -> Vec<&'static str> {
                (**self).kinks_between(a, b)
            }
        }
    )*};
}

forward_field!(&F, Box<F>, Arc<F>);
