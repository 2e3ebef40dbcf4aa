//! Whether f and a linear interpolant L run alike in a box, by affine forms of f.
//!
//! Only places with `f L <= 0` matter: where f and L have one sign, so has every mix of them. From
//! forms of f and of `f - L` follows a slab `least <= L <= most` that holds all such places. In
//! the slab `grad L . grad f` must be positive. Its form `p + c . e - rest` over the box falls by
//! `|c|` in the worst corner, but most of that along the normal, and there the slab is thin: with
//! the linear part `h . e` of L any weight w gives
//!
//! `p + c . e = p + (c + w h) . e - w (L - L(m)) >= p - sum |c + w h| + w L(m) - max(w least, w most)`
//!
//! on the slab \[derived\]. The best w makes a component of `c + w h` zero, or is zero: the bound is
//! concave in w and linear between these.

use crate::interpolant::{Interpolant, ROUNDING};
use isospline_geometry::Vec3;
use isospline_implicit::AffineJet;

/// Forms of f over a box, and what all tetrahedra there share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxForms<'a> {
    jet: &'a AffineJet,
    middle: Vec3,
    radius: Vec3,
    /// How far f may be from its middle.
    reach: f64,
    /// Size of the terms of each partial derivative.
    sizes: Vec3,
}

/// Values of L where f and L need not have one sign.
#[derive(Clone, Copy, Debug)]
struct Slab {
    least: f64,
    most: f64,
}

/// A bound from below that is not positive, as a sum over the axes and the rest.
#[derive(Clone, Copy, Debug)]
struct Bound {
    least: f64,
    spreads: Vec3,
}

impl<'a> BoxForms<'a> {
    /// Of a box with this middle and these half sides; `None` if anything is not finite.
    pub(crate) fn new(jet: &'a AffineJet, middle: Vec3, radius: Vec3) -> Option<Self> {
        let size = |k: usize| jet.gradient[k].middle.abs() + jet.gradient[k].reach();
        let sizes = Vec3::new(size(0), size(1), size(2));
        let reach = jet.value.reach();
        let all = jet.value.middle + reach + sizes.x + sizes.y + sizes.z;
        all.is_finite().then_some(Self { jet, middle, radius, reach, sizes })
    }

    /// How much each axis of the box adds to the doubt whether f and L run alike on what it shares
    /// with the tetrahedron; `None` if they do.
    pub(crate) fn doubt(&self, linear: &Interpolant) -> Option<Vec3> {
        // symbols: h change of L from the middle to each side
        let h = linear.gradient.component_mul(&self.radius);
        let l = linear.at(self.middle);
        let slab = self.slab(linear, l, &h)?;
        let [x, y, z] = &self.jet.gradient;
        let g = linear.gradient;
        let change = |k: usize| g.x * x.slopes[k] + g.y * y.slopes[k] + g.z * z.slopes[k];
        let c = Vec3::new(change(0), change(1), change(2));
        let rest = g.x.abs() * x.rest + g.y.abs() * y.rest + g.z.abs() * z.rest;
        let p = g.x * x.middle + g.y * y.middle + g.z * z.middle - rest;
        let size = g.abs().dot(&self.sizes);
        let mut best = Bound { least: f64::NEG_INFINITY, spreads: c.abs() };
        for w in [0.0, -c.x / h.x, -c.y / h.y, -c.z / h.z] {
            let spreads = (c + w * h).abs();
            let along = w * l - (w * slab.least).max(w * slab.most);
            let least = p + along - (spreads.x + spreads.y + spreads.z);
            let size = size + w.abs() * (l.abs() + slab.least.abs() + slab.most.abs());
            // Neither holds if w is not finite.
            if least > ROUNDING * size && size.is_finite() {
                return None;
            }
            if least > best.least {
                best = Bound { least, spreads };
            }
        }
        Some(best.spreads + rest / self.radius.max() * self.radius)
    }

    /// Where f and L need not have one sign; `None` if nowhere.
    fn slab(&self, linear: &Interpolant, l: f64, h: &Vec3) -> Option<Slab> {
        let f = &self.jet.value;
        let reach = h.x.abs() + h.y.abs() + h.z.abs();
        let size = linear.least.abs().max(linear.most.abs()) + f.middle.abs() + self.reach + reach;
        let slack = ROUNDING * size;
        let spread = (0..3).map(|k| (f.slopes[k] - h[k]).abs()).sum::<f64>() + f.rest + slack;
        // f L <= 0 < L means f <= 0, so L <= L - f; below zero likewise.
        let above = if f.middle - self.reach > slack { 0.0 } else { l - f.middle + spread };
        let below = if f.middle + self.reach < -slack { 0.0 } else { l - f.middle - spread };
        let (lo, hi) =
            ((l - reach - slack).max(linear.least), (l + reach + slack).min(linear.most));
        let slab = Slab { least: below.min(0.0), most: above.max(0.0) };
        // L keeps to `lo ..= hi` on the tetrahedron.
        (lo <= slab.most && hi >= slab.least)
            .then(|| Slab { least: slab.least.max(lo), most: slab.most.min(hi) })
    }
}
