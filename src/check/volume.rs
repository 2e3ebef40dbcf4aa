//! The volume that patches enclose, from their points and normals.
//!
//! `V = 1/3 sum over patches of the integral of p . (p_v x p_w)` over the unit triangle, by Gauss
//! points of a square folded onto it: exact for plane patches, to some 1e-9 for curved ones.

use crate::evaluate::{PreparedPatch, Stencil};
use crate::surface::Surface;

/// Points and weights of Gauss and Legendre on \[0, 1\], five points.
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668_0, 0.118_463_442_528_094_54],
    [0.230_765_344_947_158_45, 0.239_314_335_249_683_23],
    [0.5, 0.284_444_444_444_444_44],
    [0.769_234_655_052_841_5, 0.239_314_335_249_683_23],
    [0.953_089_922_969_332, 0.118_463_442_528_094_54],
];

/// Signed volume under the patches of `faces`, model units cubed.
pub(crate) fn enclosed(surface: &Surface<'_>, faces: &[u32]) -> f64 {
    let points: Vec<(f64, Stencil)> = GAUSS
        .iter()
        .flat_map(|&s| GAUSS.iter().map(move |&t| (s, t)))
        // (s, t) goes to v = s, w = (1 - s) t, whose area shrinks by 1 - s.
        .map(|([s, a], [t, b])| {
            let (v, w) = (s, (1.0 - s) * t);
            (a * b * (1.0 - s), Stencil::new([1.0 - v - w, v, w]))
        })
        .collect();
    // Near the surface: products of large coordinates would lose what is small in the sum.
    let Some(origin) = faces.first().map(|&f| surface.net(f as usize)[0]) else { return 0.0 };
    let mut sum = 0.0;
    for &face in faces {
        let patch = PreparedPatch::new(&surface.net(face as usize));
        for (weight, stencil) in &points {
            let at = patch.evaluate(stencil);
            sum += weight * (at.point - origin).dot(&at.normal);
        }
    }
    sum / 3.0
}
