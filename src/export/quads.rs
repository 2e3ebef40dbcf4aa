//! A Bézier triangle of degree n as tensor-product patches of bidegree (n, n): three quads, or one
//! with a collapsed side. Exact: `p` composed with a bilinear map of the square.
//!
//! Net of the composition: `c_ij = sum_k C(i,k) C(n-i,j-k) / C(n,j) * blossom(Q11^k, Q10^(i-k),
//! Q01^(j-k), Q00^(n-i-j+k))`, the blossom of the triangle at the corners of the quad \[derived\]; as
//! a matrix, of 64 x 36 numbers for degree 7, the same for every triangle.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::binomial;
use isospline_geometry::bezier_triangle::{exponents, index, n_control};

/// Corners of a quad in barycentric coordinates of the triangle: at (0,0), (1,0), (0,1), (1,1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corners {
    q00: [f64; 3],
    q10: [f64; 3],
    q01: [f64; 3],
    q11: [f64; 3],
}

impl Corners {
    /// The quad at a corner of the triangle: u runs along the edge that starts there to its
    /// middle, v to the middle of the edge that ends there; (1, 1) is the centre.
    pub(crate) fn at_corner(corner: usize) -> Self {
        let turned = |at: [f64; 3]| std::array::from_fn(|k| at[(k + 3 - corner) % 3]);
        Self {
            q00: turned([1.0, 0.0, 0.0]),
            q10: turned([0.5, 0.5, 0.0]),
            q01: turned([0.5, 0.0, 0.5]),
            q11: turned([1.0 / 3.0; 3]),
        }
    }

    /// The whole triangle, its side u = 0 collapsed into corner 0.
    pub(crate) fn collapsed() -> Self {
        let corner = [1.0, 0.0, 0.0];
        Self { q00: corner, q10: [0.0, 1.0, 0.0], q01: corner, q11: [0.0, 0.0, 1.0] }
    }
}

/// Weights of the control points of a triangle in those of a quad.
#[derive(Clone, Debug)]
pub(crate) struct QuadMap {
    degree: usize,
    /// Row `(degree + 1) i + j` belongs to `c_ij`.
    weights: Vec<Vec<f64>>,
}

impl QuadMap {
    pub(crate) fn new(degree: usize, corners: &Corners) -> Self {
        let places = (0..=degree).flat_map(|i| (0..=degree).map(move |j| [i, j]));
        Self { degree, weights: places.map(|at| entry(degree, corners, at)).collect() }
    }

    /// Control point `c_ij`: i counts along u, j along v.
    pub(crate) fn point(&self, net: &[Vec3], i: usize, j: usize) -> Vec3 {
        let weights = &self.weights[(self.degree + 1) * i + j];
        let terms = weights.iter().zip(net);
        terms.filter(|(w, _)| **w != 0.0).fold(Vec3::zeros(), |sum, (w, p)| sum + *w * p)
    }
}

fn entry(n: usize, corners: &Corners, [i, j]: [usize; 2]) -> Vec<f64> {
    let mut sum = vec![0.0; n_control(n)];
    for k in (i + j).saturating_sub(n)..=i.min(j) {
        let arguments = [
            (corners.q11, k),
            (corners.q10, i - k),
            (corners.q01, j - k),
            (corners.q00, n + k - i - j),
        ];
        let share = binomial(i, k) * binomial(n - i, j - k) / binomial(n, j);
        for (sum, weight) in sum.iter_mut().zip(blossom_weights(n, &arguments)) {
            *sum += share * weight;
        }
    }
    sum
}

/// Weights of the control points in the blossom at these points, each as often as it says.
fn blossom_weights(n: usize, arguments: &[([f64; 3], usize)]) -> Vec<f64> {
    // De Casteljau backwards: one argument a step spreads each weight to three exponents.
    let mut weights = vec![0.0; n_control(n)];
    weights[0] = 1.0;
    let mut degree = 0;
    for &(at, times) in arguments {
        for _ in 0..times {
            let mut next = vec![0.0; n_control(n)];
            for (weight, [i, j, k]) in weights.into_iter().zip(exponents(degree)) {
                next[index([i + 1, j, k])] += weight * at[0];
                next[index([i, j + 1, k])] += weight * at[1];
                next[index([i, j, k + 1])] += weight * at[2];
            }
            weights = next;
            degree += 1;
        }
    }
    weights
}

/// The two halves of a Bézier curve, each from its start.
pub(crate) fn halves(curve: &[Vec3]) -> [Vec<Vec3>; 2] {
    let degree = curve.len() - 1;
    let mut row = curve.to_vec();
    let mut halves = [row.clone(), row.clone()];
    for step in 0..=degree {
        halves[0][step] = row[0];
        halves[1][degree - step] = row[degree - step];
        for k in 0..degree - step {
            row[k] = 0.5 * (row[k] + row[k + 1]);
        }
    }
    halves
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_curve;
    use isospline_geometry::bezier_triangle::{boundary_index, evaluate};

    fn net(degree: usize) -> Vec<Vec3> {
        let point = |k: usize| {
            let x = k as f64;
            Vec3::new(x * 0.3 - 2.0, libm::sin(x), 0.01 * x * x)
        };
        (0..n_control(degree)).map(point).collect()
    }

    fn on_quad(degree: usize, corners: &Corners, u: f64, v: f64) -> Vec3 {
        let map = QuadMap::new(degree, corners);
        let row = |i: usize| {
            let column: Vec<Vec3> = (0..=degree).map(|j| map.point(&net(degree), i, j)).collect();
            bezier_curve::evaluate(&column, v)
        };
        bezier_curve::evaluate(&(0..=degree).map(row).collect::<Vec<_>>(), u)
    }

    #[test]
    fn quads_are_the_triangle_composed_with_a_bilinear_map() {
        let places = [(0.0, 0.0), (0.3, 0.8), (1.0, 0.4), (0.9, 1.0)];
        for (degree, (u, v)) in places.into_iter().flat_map(|at| [(6, at), (7, at)]) {
            for corner in 0..3 {
                let corners = Corners::at_corner(corner);
                let Corners { q00, q10, q01, q11 } = corners;
                let at = std::array::from_fn(|k| {
                    (1.0 - u) * ((1.0 - v) * q00[k] + v * q01[k])
                        + u * ((1.0 - v) * q10[k] + v * q11[k])
                });
                let found = on_quad(degree, &corners, u, v);
                assert!((found - evaluate(degree, &net(degree), at)).norm() < 1e-13);
            }
            let found = on_quad(degree, &Corners::collapsed(), u, v);
            let expected = evaluate(degree, &net(degree), [1.0 - u, u * (1.0 - v), u * v]);
            assert!((found - expected).norm() < 1e-13);
        }
    }

    #[test]
    fn the_first_row_of_a_quad_is_half_an_edge() {
        for (degree, corner) in (0..3).flat_map(|corner| [(6, corner), (7, corner)]) {
            let (map, net) = (QuadMap::new(degree, &Corners::at_corner(corner)), net(degree));
            let edge: Vec<Vec3> =
                (0..=degree).map(|s| net[boundary_index(degree, corner, s)]).collect();
            let [first, second] = halves(&edge);
            for (i, expected) in first.iter().enumerate() {
                assert!((map.point(&net, i, 0) - expected).norm() < 1e-14);
            }
            assert_eq!(first[degree], second[0]);
            assert_eq!((first[0], second[degree]), (edge[0], edge[degree]));
        }
    }
}
