//! The volume that patches enclose, from their points and normals.
//!
//! `V = 1/3 sum over patches of the integral of p . (p_v x p_w)` over the unit triangle, by Gauss
//! points of a square folded onto it: exact for plane patches, to some 1e-9 for curved ones.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::evaluate::Stencil;
use crate::lanes::{LANES, cross, dot, vector};
use crate::octet::Octet;
use crate::surface::Surface;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::DEGREE;
use isospline_implicit::{Kernel, run_widest};

/// Points and weights of Gauss and Legendre on \[0, 1\], five points.
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668_0, 0.118_463_442_528_094_54],
    [0.230_765_344_947_158_45, 0.239_314_335_249_683_23],
    [0.5, 0.284_444_444_444_444_44],
    [0.769_234_655_052_841_5, 0.239_314_335_249_683_23],
    [0.953_089_922_969_332, 0.118_463_442_528_094_54],
];

/// Integrals over one patch, from which follow those about any origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    /// Of `(p - corner 0 of the net) . (p_v x p_w)`.
    about_corner: f64,
    /// Of `p_v x p_w`.
    area: Vec3,
}

/// The points at which patches are integrated, and their weights.
pub(crate) struct Quadrature(Vec<(f64, Stencil)>);

impl Quadrature {
    pub(crate) fn new() -> Self {
        let pairs = GAUSS.iter().flat_map(|&s| GAUSS.iter().map(move |&t| (s, t)));
        // (s, t) goes to v = s, w = (1 - s) t, whose area shrinks by 1 - s.
        let folded = pairs.map(|([s, a], [t, b])| {
            let (v, w) = (s, (1.0 - s) * t);
            (a * b * (1.0 - s), Stencil::new([1.0 - v - w, v, w]))
        });
        Self(folded.collect())
    }

    /// The integrals over eight patches.
    pub(crate) fn moments(&self, octet: &Octet) -> [Moment; LANES] {
        run_widest(Integrate { quadrature: self, octet })
    }
}

/// Signed volume under the patches of `faces`, model units cubed; `moments` are those of all faces.
pub(crate) fn enclosed(surface: &Surface<'_>, faces: &[u32], moments: &[Moment]) -> f64 {
    // Near the surface: products of large coordinates would lose what is small in the sum.
    let corner = |face: u32| surface.corner(face as usize);
    let Some(origin) = faces.first().map(|&f| corner(f)) else { return 0.0 };
    let of_face = |&f: &u32| {
        let moment = &moments[f as usize];
        moment.about_corner + (corner(f) - origin).dot(&moment.area)
    };
    faces.iter().map(of_face).sum::<f64>() / 3.0
}

struct Integrate<'a> {
    quadrature: &'a Quadrature,
    octet: &'a Octet,
}

impl Kernel for Integrate<'_> {
    type Output = [Moment; LANES];

    #[inline(always)]
    fn run(self) -> [Moment; LANES] {
        let (mut about_corner, mut area) = ([0.0; LANES], [[0.0; LANES]; 3]);
        for (weight, stencil) in &self.quadrature.0 {
            let at = self.octet.at(stencil);
            for k in 0..LANES {
                let normal = cross(vector(&at.along, k), vector(&at.across, k));
                about_corner[k] += weight * dot(vector(&at.offset, k), normal);
                for c in 0..3 {
                    area[c][k] += weight * normal[c];
                }
            }
        }
        // The derivatives are seven times those that were put in.
        let scale = (DEGREE * DEGREE) as f64;
        std::array::from_fn(|k| Moment {
            about_corner: scale * about_corner[k],
            area: scale * Vec3::from(vector(&area, k)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Net;
    use isospline_geometry::bezier_triangle::grid;

    /// The flat patch over three corners.
    fn flat(corners: [Vec3; 3]) -> Net {
        let blend = |[u, v, w]: [f64; 3]| u * corners[0] + v * corners[1] + w * corners[2];
        grid(DEGREE).map(blend).collect::<Vec<_>>().try_into().unwrap()
    }

    #[test]
    fn a_tetrahedron_far_from_the_origin_has_the_volume_of_its_corners() {
        let far = Vec3::new(300.0, -500.0, 800.0);
        let vertices =
            [Vec3::zeros(), Vec3::x(), 2.0 * Vec3::y(), 3.0 * Vec3::z()].map(|p| p + far);
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let nets: Vec<Net> = faces.map(|f| flat(f.map(|v: u32| vertices[v as usize]))).into();
        let mut octet = Octet::new();
        octet.set(&nets);
        let moments = Quadrature::new().moments(&octet);
        let surface = Surface::new(vertices.into(), faces.into(), nets).unwrap();
        let found = enclosed(&surface, &[0, 1, 2, 3], &moments);
        assert!((found - 1.0).abs() < 1e-12, "{found}");
    }
}
