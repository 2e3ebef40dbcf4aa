//! Whether f and linear interpolants L run alike in a box, by affine forms of f.
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

#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::interpolant::{Frame, LANES, Octet, ROUNDING, Rows, dot, set_of};
use isospline_implicit::AffineJet;

/// Forms of f over a box, and what all tetrahedra there share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxForms<'a> {
    jet: &'a AffineJet,
    frame: &'a Frame,
    /// How far f may be from its middle.
    reach: f64,
    /// Size of the terms of each partial derivative.
    sizes: [f64; 3],
    longest: f64,
}

/// What remains in doubt in a box.
#[derive(Clone, Debug)]
pub(crate) struct Doubts {
    /// Tetrahedra, as bits, on which f and L are not shown to run alike in the box.
    pub(crate) open: u64,
    /// How much each axis of the box adds to the doubt about each.
    pub(crate) spreads: Rows,
}

/// Values of L where f and L need not have one sign.
struct Slab {
    least: f64,
    most: f64,
    is_empty: bool,
}

impl<'a> BoxForms<'a> {
    /// Of a box; `None` if anything is not finite.
    #[inline(always)]
    pub(crate) fn new(jet: &'a AffineJet, frame: &'a Frame) -> Option<Self> {
        let sizes = [0, 1, 2].map(|k| jet.gradient[k].middle.abs() + jet.gradient[k].reach());
        let reach = jet.value.reach();
        let all = jet.value.middle + reach + sizes[0] + sizes[1] + sizes[2];
        let radius = &frame[1];
        let longest = radius[0].max(radius[1]).max(radius[2]);
        all.is_finite().then_some(Self { jet, frame, reach, sizes, longest })
    }

    /// Whether f and each L run alike on what the box shares with the tetrahedra.
    #[inline(always)]
    pub(crate) fn doubts(&self, octet: &Octet) -> Doubts {
        let mut is_open = [false; LANES];
        let mut spreads = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let (open, doubt) = self.doubt(octet, i);
            is_open[i] = open;
            for k in 0..3 {
                spreads[k][i] = doubt[k];
            }
        }
        Doubts { open: set_of(&is_open), spreads }
    }

    #[inline(always)]
    fn doubt(&self, octet: &Octet, i: usize) -> (bool, [f64; 3]) {
        // symbols: h change of L from the middle to each side
        let [middle, radius] = self.frame;
        let g = [0, 1, 2].map(|k| octet.gradient[k][i]);
        let h = [0, 1, 2].map(|k| g[k] * radius[k]);
        let l = octet.at(i, middle);
        let slab = self.slab([octet.least[i], octet.most[i]], l, &h);
        let [x, y, z] = &self.jet.gradient;
        let c = [0, 1, 2].map(|k| g[0] * x.slopes[k] + g[1] * y.slopes[k] + g[2] * z.slopes[k]);
        let rest = g[0].abs() * x.rest + g[1].abs() * y.rest + g[2].abs() * z.rest;
        let p = g[0] * x.middle + g[1] * y.middle + g[2] * z.middle - rest;
        let size = dot(&g.map(f64::abs), &self.sizes);
        let slab_size = l.abs() + slab.least.abs() + slab.most.abs();
        let mut is_open = !slab.is_empty;
        // A bound from below that is not positive, as a sum over the axes and the rest.
        let (mut best, mut best_spreads) = (f64::NEG_INFINITY, c.map(f64::abs));
        for w in [0.0, -c[0] / h[0], -c[1] / h[1], -c[2] / h[2]] {
            let spreads = [0, 1, 2].map(|k| (c[k] + w * h[k]).abs());
            let along = w * l - (w * slab.least).max(w * slab.most);
            let least = p + along - (spreads[0] + spreads[1] + spreads[2]);
            let size = size + w.abs() * slab_size;
            // Neither holds if w is not finite.
            is_open &= !(least > ROUNDING * size && size.is_finite());
            let is_best = least > best;
            best = if is_best { least } else { best };
            best_spreads = [0, 1, 2].map(|k| if is_best { spreads[k] } else { best_spreads[k] });
        }
        let rest = rest / self.longest;
        (is_open, [0, 1, 2].map(|k| best_spreads[k] + rest * radius[k]))
    }

    /// Where f and an L with these node values, `l` in the middle, need not have one sign.
    #[inline(always)]
    fn slab(&self, [least, most]: [f64; 2], l: f64, h: &[f64; 3]) -> Slab {
        let f = &self.jet.value;
        let reach = h[0].abs() + h[1].abs() + h[2].abs();
        let size = least.abs().max(most.abs()) + f.middle.abs() + self.reach + reach;
        let slack = ROUNDING * size;
        let [x, y, z] = [0, 1, 2].map(|k| (f.slopes[k] - h[k]).abs());
        let spread = x + y + z + f.rest + slack;
        // f L <= 0 < L means f <= 0, so L <= L - f; below zero likewise.
        let above = if f.middle - self.reach > slack { 0.0 } else { l - f.middle + spread };
        let below = if f.middle + self.reach < -slack { 0.0 } else { l - f.middle - spread };
        // L keeps to `lo ..= hi` on the tetrahedron.
        let (lo, hi) = ((l - reach - slack).max(least), (l + reach + slack).min(most));
        let (below, above) = (below.min(0.0), above.max(0.0));
        let is_empty = !(lo <= above && hi >= below);
        Slab { least: below.max(lo), most: above.min(hi), is_empty }
    }
}
