//! A Bézier triangle as tensor-product patches of bidegree (7, 7): three quads, or one with a
//! collapsed side. Exact: `p` composed with a bilinear map of the square.
//!
//! Net of the composition: `c_ij = sum_k C(i,k) C(n-i,j-k) / C(n,j) * blossom(Q11^k, Q10^(i-k),
//! Q01^(j-k), Q00^(n-i-j+k))`, the blossom of a degree-7 triangle at the corners of the quad
//! \[derived\]; as a matrix of 64 x 36 numbers, the same for every triangle.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::binomial;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, exponents, index};

/// Control points a side.
pub(crate) const SIDE: usize = DEGREE + 1;

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

/// Weights of the 36 control points of a triangle in the 64 of a quad.
#[derive(Clone, Debug)]
pub(crate) struct QuadMap {
    /// Row `SIDE * i + j` belongs to `c_ij`.
    weights: Vec<[f64; N_CONTROL]>,
}

impl QuadMap {
    pub(crate) fn new(corners: &Corners) -> Self {
        let entry = |i: usize, j: usize| entry(corners, i, j);
        let weights = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j)));
        Self { weights: weights.map(|(i, j)| entry(i, j)).collect() }
    }

    /// Control point `c_ij`: i counts along u, j along v.
    pub(crate) fn point(&self, net: &[Vec3; N_CONTROL], i: usize, j: usize) -> Vec3 {
        let weights = &self.weights[SIDE * i + j];
        let terms = weights.iter().zip(net);
        terms.filter(|(w, _)| **w != 0.0).fold(Vec3::zeros(), |sum, (w, p)| sum + *w * p)
    }
}

fn entry(corners: &Corners, i: usize, j: usize) -> [f64; N_CONTROL] {
    let n = DEGREE;
    let mut sum = [0.0; N_CONTROL];
    for k in (i + j).saturating_sub(n)..=i.min(j) {
        let arguments = [
            (corners.q11, k),
            (corners.q10, i - k),
            (corners.q01, j - k),
            (corners.q00, n + k - i - j),
        ];
        let share = binomial(i, k) * binomial(n - i, j - k) / binomial(n, j);
        for (sum, weight) in sum.iter_mut().zip(blossom_weights(&arguments)) {
            *sum += share * weight;
        }
    }
    sum
}

/// Weights of the control points in the blossom at these points, each as often as it says.
fn blossom_weights(arguments: &[([f64; 3], usize)]) -> [f64; N_CONTROL] {
    // De Casteljau backwards: one argument a step spreads each weight to three exponents.
    let mut weights = [0.0; N_CONTROL];
    weights[0] = 1.0;
    let mut degree = 0;
    for &(at, times) in arguments {
        for _ in 0..times {
            let mut next = [0.0; N_CONTROL];
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
pub(crate) fn halves(curve: &[Vec3; SIDE]) -> [[Vec3; SIDE]; 2] {
    let mut row = *curve;
    let mut halves = [*curve; 2];
    for step in 0..SIDE {
        halves[0][step] = row[0];
        halves[1][DEGREE - step] = row[DEGREE - step];
        for k in 0..DEGREE - step {
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

    fn net() -> [Vec3; N_CONTROL] {
        std::array::from_fn(|k| {
            let x = k as f64;
            Vec3::new(x * 0.3 - 2.0, libm::sin(x), 0.01 * x * x)
        })
    }

    fn on_quad(map: &QuadMap, u: f64, v: f64) -> Vec3 {
        let row = |i: usize| {
            let column: Vec<Vec3> = (0..SIDE).map(|j| map.point(&net(), i, j)).collect();
            bezier_curve::evaluate(&column, v)
        };
        bezier_curve::evaluate(&(0..SIDE).map(row).collect::<Vec<_>>(), u)
    }

    #[test]
    fn quads_are_the_triangle_composed_with_a_bilinear_map() {
        for (u, v) in [(0.0, 0.0), (0.3, 0.8), (1.0, 0.4), (0.9, 1.0)] {
            for corner in 0..3 {
                let corners = Corners::at_corner(corner);
                let Corners { q00, q10, q01, q11 } = corners;
                let at = std::array::from_fn(|k| {
                    (1.0 - u) * ((1.0 - v) * q00[k] + v * q01[k])
                        + u * ((1.0 - v) * q10[k] + v * q11[k])
                });
                let found = on_quad(&QuadMap::new(&corners), u, v);
                assert!((found - evaluate(DEGREE, &net(), at)).norm() < 1e-13);
            }
            let found = on_quad(&QuadMap::new(&Corners::collapsed()), u, v);
            let expected = evaluate(DEGREE, &net(), [1.0 - u, u * (1.0 - v), u * v]);
            assert!((found - expected).norm() < 1e-13);
        }
    }

    #[test]
    fn the_first_row_of_a_quad_is_half_an_edge() {
        for corner in 0..3 {
            let map = QuadMap::new(&Corners::at_corner(corner));
            let edge = std::array::from_fn(|s| net()[boundary_index(DEGREE, corner, s)]);
            let [first, second] = halves(&edge);
            for (i, expected) in first.iter().enumerate() {
                assert!((map.point(&net(), i, 0) - expected).norm() < 1e-14);
            }
            assert_eq!(first[DEGREE], second[0]);
            assert_eq!((first[0], second[DEGREE]), (edge[0], edge[DEGREE]));
        }
    }
}
