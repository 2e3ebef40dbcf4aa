//! Surfaces with closed forms, to be looked at in tests.

use crate::Surface;
use isospline_artifact::kinds::{PatchMeta, Patches};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, exponents, index, interior_indices};

/// Degree-7 net of a polynomial of degree 2 in the plane coordinates, by its polar form: the mean
/// over all pairs of arguments.
fn quadratic_net(
    corners: [[f64; 2]; 3],
    lift: impl Fn([f64; 2], [f64; 2]) -> f64,
) -> [Vec3; N_CONTROL] {
    let mut net = [Vec3::zeros(); N_CONTROL];
    for e in exponents(DEGREE) {
        let mut p = Vec3::zeros();
        for i in 0..3 {
            let share = e[i] as f64 / DEGREE as f64;
            p.x += share * corners[i][0];
            p.y += share * corners[i][1];
            for j in 0..3 {
                let pairs = if i == j { e[i] * e[i].saturating_sub(1) } else { e[i] * e[j] };
                p.z += pairs as f64 / 42.0 * lift(corners[i], corners[j]);
            }
        }
        net[index(e)] = p;
    }
    net
}

/// The graph of `(a x^2 + b y^2) / 2` over a triangle about the origin, counter-clockwise from
/// above.
pub(crate) fn bowl_net(a: f64, b: f64) -> [Vec3; N_CONTROL] {
    quadratic_net(CORNERS, |p, q| 0.5 * (a * p[0] * q[0] + b * p[1] * q[1]))
}

const CORNERS: [[f64; 2]; 3] = [[-1.0, -0.8], [1.1, -0.6], [0.1, 1.2]];

/// `(u^2 w, v w, u)` in degree 7: a monomial has control points equal to its value in falling
/// factorials.
pub(crate) fn polynomial_net() -> [Vec3; N_CONTROL] {
    let mut net = [Vec3::zeros(); N_CONTROL];
    for e in exponents(DEGREE) {
        let [i, j, k] = e.map(|x| x as f64);
        net[index(e)] = Vec3::new(i * (i - 1.0) * k / 210.0, j * k / 42.0, i / 7.0);
    }
    net
}

/// Two graphs over the square of side 2 about the origin, joined along the diagonal
/// from (-1, -1) to (1, 1): `z = (x^2 + y^2) / 2` below, `c (x - y)^2` more above.
///
/// With c = 0 one polynomial; else the tangent planes agree along the diagonal and the curvature
/// across it jumps by 4 c at the origin.
pub(crate) fn two_bowls(c: f64) -> Patches {
    folded(move |p, q| c * (p[0] - p[1]) * (q[0] - q[1]))
}

/// The same with `c (y - x)` more above the diagonal: a crease.
pub(crate) fn creased(c: f64) -> Patches {
    folded(move |p, q| 0.5 * c * (p[1] - p[0] + q[1] - q[0]))
}

fn folded(more: impl Fn([f64; 2], [f64; 2]) -> f64) -> Patches {
    let bowl = |p: [f64; 2], q: [f64; 2]| 0.5 * (p[0] * q[0] + p[1] * q[1]);
    let corner = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let below = quadratic_net([corner[0], corner[1], corner[2]], bowl);
    let above = quadratic_net([corner[0], corner[2], corner[3]], |p, q| bowl(p, q) + more(p, q));
    patches(&[below, above], vec![[0, 1, 2], [0, 2, 3]])
}

/// Rows of patches whose boundaries are of degree 4 or less; an edge's curve is that of the first
/// face that has it.
pub(crate) fn patches(nets: &[[Vec3; N_CONTROL]], face: Vec<[u32; 3]>) -> Patches {
    let n_vertices = face.iter().flatten().max().map_or(0, |&v| v as usize + 1);
    let mut out = Patches {
        meta: vec![PatchMeta { scheme: 0, degree: 7, boundary_degree: 4, rational: 0 }],
        position: vec![[0.0; 3]; n_vertices],
        ..Patches::default()
    };
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for (net, corners) in nets.iter().zip(&face) {
        for (k, &v) in corners.iter().enumerate() {
            let mut e = [0; 3];
            e[k] = DEGREE;
            out.position[v as usize] = net[index(e)].into();
            let w = corners[(k + 1) % 3];
            let ends = [v.min(w), v.max(w)];
            let known = edges.iter().position(|&e| e == ends);
            out.edge_of.push(known.unwrap_or(edges.len()) as u32);
            if known.is_none() {
                edges.push(ends);
                let to_high = if v < w { [k, (k + 1) % 3] } else { [(k + 1) % 3, k] };
                out.boundary.push(quartic(net, to_high));
            }
        }
        let inner = interior_indices().map(|i| net[i]);
        out.interior.push(std::array::from_fn(|i| inner[i / 3][i % 3]));
    }
    Patches { face, ..out }
}

/// Inner control points of a boundary curve as a quartic, by lowering the degree from the lower
/// end, which is exact where the curve is a quartic.
fn quartic(net: &[Vec3; N_CONTROL], [low, high]: [usize; 2]) -> [f64; 9] {
    let mut row: Vec<Vec3> = (0..=DEGREE)
        .map(|s| {
            let mut e = [0; 3];
            (e[low], e[high]) = (DEGREE - s, s);
            net[index(e)]
        })
        .collect();
    for n in (5..=DEGREE).rev() {
        // symbols: b_s of degree n is s/n c_(s-1) + (n-s)/n c_s
        let mut lower = vec![row[0]];
        for s in 1..n {
            let c = (n as f64 * row[s] - s as f64 * lower[s - 1]) / (n - s) as f64;
            lower.push(c);
        }
        row = lower;
    }
    std::array::from_fn(|i| row[1 + i / 3][i % 3])
}

/// A closed mesh of the unit sphere, octahedron edges cut into `n`.
pub(crate) fn ball(n: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let axes = [Vec3::x(), Vec3::y(), -Vec3::x(), -Vec3::y()];
    let (mut position, mut face) = (Vec::new(), Vec::new());
    for (pole, flip) in [(Vec3::z(), false), (-Vec3::z(), true)] {
        for k in 0..4 {
            let (a, b) = (axes[k], axes[(k + 1) % 4]);
            let at = |i: usize, j: usize| {
                let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
                (x * a + y * b + (1.0 - x - y) * pole).normalize()
            };
            for i in 0..n {
                for j in 0..n - i {
                    let mut triangles = vec![[at(i, j), at(i + 1, j), at(i, j + 1)]];
                    if i + j + 1 < n {
                        triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    }
                    for mut triangle in triangles {
                        if flip {
                            triangle.swap(1, 2);
                        }
                        let first = position.len() as u32;
                        position.extend(triangle.map(<[f64; 3]>::from));
                        face.push([first, first + 1, first + 2]);
                    }
                }
            }
        }
    }
    (position, face)
}

/// The surface of rows that are known to be sound.
pub(crate) fn surface(patches: &Patches) -> Surface<'_> {
    Surface::from_patches(&patches.view()).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_give_back_the_nets_they_were_made_of() {
        let net = bowl_net(1.0, 2.0);
        let rows = patches(&[net], vec![[0, 1, 2]]);
        let back = surface(&rows).net(0);
        for (a, b) in net.iter().zip(&back) {
            assert!((a - b).norm() < 1e-14, "{a} {b}");
        }
    }

    #[test]
    fn the_two_bowls_share_their_diagonal() {
        for rows in [two_bowls(0.8), creased(0.5)] {
            let surface = surface(&rows);
            let (below, above) = (surface.net(0), surface.net(1));
            for s in 0..=7 {
                let gap = below[index([7 - s, 0, s])] - above[index([7 - s, s, 0])];
                assert!(gap.norm() < 1e-14, "{gap}");
            }
        }
    }
}
