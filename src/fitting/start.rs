//! Where the samples of a face start their way to the surface.

use crate::net::boundary_net;
use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, exponents, grid, index};

/// Cosine of the largest angle between a face and the normals at its corners for which samples
/// start on the flat triangle.
///
/// The curves were fitted to projections of their chords, so over nearly flat faces the flat
/// triangle gives the parametrisation that agrees with them (a sphere of 1280 patches is 3 times
/// nearer than from curved starts); over strongly turned ones it folds patches (double torus of
/// 1800 faces, deccube of 5000), and the start is filled from the curves. 25 degrees keep every
/// patch of those two meshes upright.
const FLAT_COSINE: f64 = 0.9;

/// The net of `face` with boundary curves in place, and the net whose points start to project.
///
/// Both have the raised boundary; inside, the first is filled from the curves.
pub fn start_nets(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    face: usize,
) -> ([Vec3; N_CONTROL], [Vec3; N_CONTROL]) {
    let mut net = boundary_net(mesh, network, face);
    fill(&mut net);
    let start = if is_nearly_flat(mesh, face) { flat(mesh, face) } else { net };
    (net, start)
}

fn is_nearly_flat(mesh: &BaseMeshView<'_>, face: usize) -> bool {
    let [a, b, c] = mesh.face[face].map(|v| Vec3::from(mesh.position[v as usize]));
    let across = (b - a).cross(&(c - a));
    (3 * face..3 * face + 3).all(|h| {
        let normal = Vec3::from(mesh.frame[mesh.sector[h] as usize].normal);
        across.dot(&normal) >= FLAT_COSINE * across.norm()
    })
}

/// The net of the flat triangle.
fn flat(mesh: &BaseMeshView<'_>, face: usize) -> [Vec3; N_CONTROL] {
    let [a, b, c] = mesh.face[face].map(|v| Vec3::from(mesh.position[v as usize]));
    let mut net = [Vec3::zeros(); N_CONTROL];
    for (point, [u, v, w]) in net.iter_mut().zip(grid(DEGREE)) {
        *point = u * a + v * b + w * c;
    }
    net
}

/// Overwrites the interior of a net by a discrete Coons patch of its boundary: half the sum of
/// the three linear interpolations between opposite sides, less half the plane of the corners.
/// Quadratic patches are reproduced [derived].
fn fill(net: &mut [Vec3; N_CONTROL]) {
    const N: usize = DEGREE;
    let boundary = *net;
    let at = |i, j, k| boundary[index([i, j, k])];
    for [i, j, k] in exponents(N).filter(|e| e.iter().all(|&x| x > 0)) {
        let [u, v, w] = [i, j, k].map(|x| x as f64);
        let between = |p: Vec3, q: Vec3, s: f64, t: f64| (s * p + t * q) / (s + t);
        let across = between(at(i, N - i, 0), at(i, 0, N - i), v, w)
            + between(at(N - j, j, 0), at(0, j, N - j), u, w)
            + between(at(N - k, 0, k), at(0, N - k, k), u, v);
        let plane = (u * at(N, 0, 0) + v * at(0, N, 0) + w * at(0, 0, N)) / N as f64;
        net[index([i, j, k])] = 0.5 * (across - plane);
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
        let mut net = exact;
        for i in interior_indices() {
            net[i] = Vec3::new(9.0, 9.0, 9.0);
        }
        fill(&mut net);
        for (a, b) in net.iter().zip(&exact) {
            assert!((a - b).norm() < 1e-14, "{:e}", (a - b).norm());
        }
    }
}
