//! Where the samples of a face start their way to the surface.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::edge_end::outgoing_curve;
use crate::lanes::{Lanes, Mask, N, Vectors};
use crate::patch_fit::Nets;
use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::bezier_curve::raise_quartic_to_septic;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, boundary_index, exponents, index};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_implicit::{Kernel, run_widest};
use std::ops::Range;

/// Cosine of the largest angle between a face and the normals at its corners for which samples
/// start on the flat triangle.
///
/// The curves were fitted to projections of their chords, so over nearly flat faces the flat
/// triangle gives the parametrisation that agrees with them (a sphere of 1280 patches is 3 times
/// nearer than from curved starts); over strongly turned ones it folds patches (double torus of
/// 1800 faces, deccube of 5000), and the start is filled from the curves. 25 degrees keep every
/// patch of those two meshes upright.
const FLAT_COSINE: f64 = 0.9;

/// Quartics of the three sides of eight faces, counter-clockwise.
type Sides = [[Vectors; 5]; 3];

/// The nets of `faces` with boundary curves in place, and the nets whose points start to project.
///
/// Both have the boundary raised to degree 7; inside, the first are filled from the curves.
pub fn start_nets(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    faces: Range<usize>,
) -> (Vec<Nets>, Vec<Nets>) {
    let n_groups = faces.len().div_ceil(N);
    let mut sides: Vec<Sides> = vec![[[Vectors::ZERO; 5]; 3]; n_groups];
    let mut is_flat = vec![Mask([false; N]); n_groups];
    for (at, face) in faces.enumerate() {
        is_flat[at / N].0[at % N] = is_nearly_flat(mesh, face);
        for (corner, side) in sides[at / N].iter_mut().enumerate() {
            let half_edge = HalfEdge::new(face as u32, corner as u32);
            for (lanes, q) in side.iter_mut().zip(outgoing_curve(mesh, network, half_edge)) {
                lanes.set(at % N, q);
            }
        }
    }
    run_widest(Start { sides: &sides, is_flat: &is_flat })
}

fn is_nearly_flat(mesh: &BaseMeshView<'_>, face: usize) -> bool {
    let [a, b, c] = mesh.face[face].map(|v| Vec3::from(mesh.position[v as usize]));
    let across = (b - a).cross(&(c - a));
    (3 * face..3 * face + 3).all(|h| {
        let normal = Vec3::from(mesh.frame[mesh.sector[h] as usize].normal);
        across.dot(&normal) >= FLAT_COSINE * across.norm()
    })
}

/// Nets from their sides, and those where samples start: flat triangles where `is_flat` says so.
struct Start<'a> {
    sides: &'a [Sides],
    is_flat: &'a [Mask],
}

impl Kernel for Start<'_> {
    type Output = (Vec<Nets>, Vec<Nets>);

    #[inline(always)]
    fn run(self) -> (Vec<Nets>, Vec<Nets>) {
        let all: Vec<[usize; 3]> = exponents(DEGREE).collect();
        let mut nets = vec![[Vectors::ZERO; N_CONTROL]; self.sides.len()];
        for (net, sides) in nets.iter_mut().zip(self.sides) {
            for (corner, side) in sides.iter().enumerate() {
                for (s, point) in raise_quartic_to_septic(side).into_iter().enumerate() {
                    net[boundary_index(DEGREE, corner, s)] = point;
                }
            }
            fill(net, &all);
        }
        let mut starts = nets.clone();
        for ((starts, net), is_flat) in starts.iter_mut().zip(&nets).zip(self.is_flat) {
            for (start, exponents) in starts.iter_mut().zip(&all) {
                *start = is_flat.pick_vectors(flat(net, *exponents), *start);
            }
        }
        (nets, starts)
    }
}

/// The point of the flat triangle with the corners of a net.
#[inline(always)]
fn flat(net: &Nets, exponents: [usize; 3]) -> Vectors {
    let [u, v, w] = exponents.map(|x| Lanes::all(x as f64 / DEGREE as f64));
    let corner = |e| net[index(e)];
    corner([DEGREE, 0, 0]).times(u)
        + corner([0, DEGREE, 0]).times(v)
        + corner([0, 0, DEGREE]).times(w)
}

/// Overwrites the interior of nets by discrete Coons patches of their boundaries: half the sum of
/// the three linear interpolations between opposite sides, less half the plane of the corners.
/// Quadratic patches are reproduced [derived]. `all` are the exponents of a net.
#[inline(always)]
fn fill(net: &mut Nets, all: &[[usize; 3]]) {
    const N: usize = DEGREE;
    for &[i, j, k] in all {
        if i == 0 || j == 0 || k == 0 {
            continue;
        }
        // Boundary points are read alone: the order in which the interior is written is free.
        let at = |i, j, k| net[index([i, j, k])];
        let [u, v, w] = [i, j, k].map(|x| x as f64);
        let between = |p: Vectors, q: Vectors, s: f64, t: f64| {
            p.times(Lanes::all(s / (s + t))) + q.times(Lanes::all(t / (s + t)))
        };
        let across = between(at(i, N - i, 0), at(i, 0, N - i), v, w)
            + between(at(N - j, j, 0), at(0, j, N - j), u, w)
            + between(at(N - k, 0, k), at(0, N - k, k), u, v);
        let plane = flat(net, [i, j, k]);
        net[index([i, j, k])] = (across - plane).times(Lanes::all(0.5));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::interior_indices;

    /// A net of degree 7 whose patch is a quadratic of the barycentrics.
    fn quadratic_net() -> [Vec3; N_CONTROL] {
        // The blossom of a quadratic, averaged over pairs: control points of the raised net.
        let value = |e: [usize; 3]| {
            let x = e.map(|k| k as f64);
            let pair = |i: usize, j: usize| {
                if i == j { x[i] * (x[i] - 1.0) / 42.0 } else { x[i] * x[j] / 42.0 }
            };
            let height = 3.0 * pair(0, 0) - 2.0 * pair(0, 1) + pair(2, 2) + 0.5 * pair(1, 2);
            Vec3::new(x[0] / 7.0, x[1] / 7.0, height)
        };
        let net: Vec<Vec3> = exponents(DEGREE).map(value).collect();
        net.try_into().unwrap()
    }

    #[test]
    fn filling_reproduces_quadratic_patches() {
        let exact = quadratic_net();
        let mut nets: Nets = std::array::from_fn(|i| Vectors::of(|k| (k + 1) as f64 * exact[i]));
        for i in interior_indices() {
            nets[i] = Vectors::of(|_| Vec3::new(9.0, 9.0, 9.0));
        }
        let all: Vec<_> = exponents(DEGREE).collect();
        fill(&mut nets, &all);
        for (points, exact) in nets.iter().zip(&exact) {
            for k in 0..N {
                let apart = (points.get(k) - (k + 1) as f64 * exact).norm();
                assert!(apart < 1e-13, "{apart:e}");
            }
        }
    }
}
