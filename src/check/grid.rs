//! The sample grid of a patch, row by row, as tables of weights.
//!
//! Along a row of the grid u is constant and a polynomial of degree 6 is a curve of degree 6 in
//! `t = w / (v + w)`: `sum_m B6_m(t) c_m`. Its control points are sums over the net,
//! `c_m = sum over i and j + k = 6 - i of C(6,i) u^i (1 - u)^(6-i) C(6-i,k) C(i,m-k) / C(6,m) b_ijk`,
//! each curve over `j, k` raised by `i` degrees, so that a point costs 7 products in place of 28.

use crate::evaluate::Stencil;
use isospline_geometry::bezier_triangle::{DEGREE, exponents, index};

/// Control points of a row's curve.
pub(crate) const N_CURVE: usize = DEGREE;

/// A barycentric grid, corners included.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    places: Vec<[f64; 3]>,
    rows: Vec<Row>,
}

/// The points of a grid that have the same u.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// For each control point of the curve the coefficients that it weighs: (index, weight).
    pub(crate) sums: [Vec<(usize, f64)>; N_CURVE],
    /// For each point its place and its weights of the curve's control points.
    pub(crate) points: Vec<([f64; 3], [f64; N_CURVE])>,
}

impl Grid {
    /// The grid with `n` steps a side.
    pub(crate) fn new(n: usize) -> Self {
        let place = |e: [usize; 3]| e.map(|x| x as f64 / n as f64);
        Self {
            places: exponents(n).map(place).collect(),
            rows: (0..=n).map(|r| Row::new(n, r)).collect(),
        }
    }

    /// All points, in order.
    pub(crate) fn places(&self) -> &[[f64; 3]] {
        &self.places
    }

    /// The points row after row, in the same order.
    pub(crate) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// All that is known of a point.
    pub(crate) fn stencil(&self, i: usize) -> Stencil {
        Stencil::new(self.places[i])
    }
}

impl Row {
    /// Row `r` steps from corner 0.
    fn new(n: usize, r: usize) -> Self {
        let u = (n - r) as f64 / n as f64;
        let point = |k: usize| {
            let place = [n - r, r - k, k].map(|x| x as f64 / n as f64);
            // At corner 0 the curve is a point and any t will do.
            (place, bernstein(k as f64 / r.max(1) as f64))
        };
        Self { sums: std::array::from_fn(|m| sum(u, m)), points: (0..=r).map(point).collect() }
    }
}

/// The coefficients of degree 6 that make up control point `m` of the curve at `u`.
fn sum(u: f64, m: usize) -> Vec<(usize, f64)> {
    let n = DEGREE - 1;
    let of_row: [f64; N_CURVE] = bernstein(u);
    let takes_part = |[i, _, k]: &[usize; 3]| *k <= m && m - k <= *i;
    exponents(n)
        .filter(takes_part)
        .map(|e| {
            let [i, j, k] = e;
            let raised = binomial(j + k, k) * binomial(i, m - k) / binomial(n, m);
            (index(e), of_row[i] * raised)
        })
        .collect()
}

/// The `N` Bernstein polynomials of degree `n = N - 1`, `C(n,s) t^s (1 - t)^(n-s)`, at `t`.
pub(crate) fn bernstein<const N: usize>(t: f64) -> [f64; N] {
    let n = N - 1;
    let power = |x: f64, k: usize| (0..k).fold(1.0, |acc, _| acc * x);
    std::array::from_fn(|s| binomial(n, s) * power(t, s) * power(1.0 - t, n - s))
}

/// Exact for the small numbers here.
fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |acc, i| acc * (n - i) as f64 / (i + 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_weighs_coefficients_as_the_polynomials_of_its_points_do() {
        for n in [1, 2, 7, 16] {
            let grid = Grid::new(n);
            let mut points = grid.places().iter();
            for row in grid.rows() {
                for (place, weights) in &row.points {
                    assert_eq!(Some(place), points.next());
                    let mut found = [0.0; 28];
                    for (sum, along) in row.sums.iter().zip(weights) {
                        for &(i, weight) in sum {
                            found[i] += along * weight;
                        }
                    }
                    for (found, weight) in found.iter().zip(Stencil::new(*place).weights) {
                        assert!((found - weight).abs() < 1e-15, "{found} {weight} at {place:?}");
                    }
                }
            }
            assert_eq!(points.next(), None);
        }
    }
}
