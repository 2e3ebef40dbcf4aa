//! Bézier triangles: the order of control points, rows along edges, evaluation.
//!
//! Degree n, exponents `i + j + k = n`, `b_ijk` weighs `u^i v^j w^k`. Stored by rows from corner
//! 0: row `r = n - i`, place `k`, index `r (r + 1) / 2 + k`, so `i` descends, then `j`. Corners
//! 0, 1, 2 stand at 0, `n (n + 1) / 2`, `n (n + 3) / 2`. Only this file knows the order.

use crate::Vec3;
use crate::bezier_curve::binomial;

/// Degree of the patches of the G1 scheme.
pub const DEGREE: usize = 7;
/// Control points of a degree-7 triangle.
pub const N_CONTROL: usize = n_control(DEGREE);
/// Control points of a degree-7 triangle that lie on no edge.
pub const N_INTERIOR: usize = N_CONTROL - 3 * DEGREE;

/// Control points of a triangle of degree `n`.
pub const fn n_control(n: usize) -> usize {
    (n + 1) * (n + 2) / 2
}

/// Index of `b_ijk` in a triangle of degree `i + j + k`.
#[inline]
pub const fn index([i, j, k]: [usize; 3]) -> usize {
    let _ = i;
    let r = j + k;
    r * (r + 1) / 2 + k
}

/// Exponents `[i, j, k]` of all control points of degree `n`, in storage order.
pub fn exponents(n: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..=n).flat_map(move |r| (0..=r).map(move |k| [n - r, r - k, k]))
}

/// Indices in the degree-7 net of the 15 interior points, in storage order.
pub const fn interior_indices() -> [usize; N_INTERIOR] {
    let mut out = [0; N_INTERIOR];
    let (mut row, mut slot) = (2, 0);
    while row < DEGREE {
        let mut k = 1;
        while k < row {
            out[slot] = index([DEGREE - row, row - k, k]);
            slot += 1;
            k += 1;
        }
        row += 1;
    }
    out
}

/// Exponents in the frame of edge `corner -> corner + 1`: `along` steps from `corner`, `inward`
/// steps off the edge.
const fn edge_frame(n: usize, corner: usize, along: usize, inward: usize) -> [usize; 3] {
    let mut e = [0; 3];
    e[corner] = n - along - inward;
    e[(corner + 1) % 3] = along;
    e[(corner + 2) % 3] = inward;
    e
}

/// Index of step `s` (0..=n) of the boundary row from `corner` to `corner + 1`, degree `n`.
#[inline]
pub const fn boundary_index(n: usize, corner: usize, s: usize) -> usize {
    index(edge_frame(n, corner, s, 0))
}

/// A net of degree `N - 1` with these curves, counter-clockwise, as its boundary, zero inside; `M` is
/// [`n_control`] of the degree.
#[inline]
pub fn net_of_boundary<const N: usize, const M: usize>(curves: &[[Vec3; N]; 3]) -> [Vec3; M] {
    let mut net = [Vec3::zeros(); M];
    for (row, curve) in const { boundary_rows::<N>() }.iter().zip(curves) {
        for (&i, &p) in row.iter().zip(curve) {
            net[i] = p;
        }
    }
    net
}

/// Indices of the three boundary rows of a net of degree `N - 1`.
const fn boundary_rows<const N: usize>() -> [[usize; N]; 3] {
    let mut out = [[0; N]; 3];
    let mut at = 0;
    while at < 3 * N {
        out[at / N][at % N] = boundary_index(N - 1, at / N, at % N);
        at += 1;
    }
    out
}

/// Index of step `s` (0..n) of the first row inside the edge from `corner` to `corner + 1`.
///
/// Step 1 is the twist point of `corner`, step `n - 2` that of `corner + 1`.
#[inline]
pub const fn first_inner_index(n: usize, corner: usize, s: usize) -> usize {
    index(edge_frame(n, corner, s, 1))
}

/// Place among the interior points of step `s` (1..=5) of the first row inside an edge of a
/// degree-7 net: the interior of a degree-7 net is ordered like a net of degree 4.
#[inline]
pub const fn first_inner_slot(corner: usize, s: usize) -> usize {
    let [i, j, k] = edge_frame(DEGREE, corner, s, 1);
    index([i - 1, j - 1, k - 1])
}

/// Place among the interior points of the three points that lie on no first inner row.
pub const INNERMOST_SLOTS: [usize; 3] = [index([2, 1, 1]), index([1, 2, 1]), index([1, 1, 2])];

/// Values at (u, v, w) of the Bernstein polynomials of degree `n`, in storage order.
pub fn bernstein(n: usize, [u, v, w]: [f64; 3]) -> Vec<f64> {
    exponents(n)
        .map(|[i, j, k]| {
            let multinomial = binomial(n, i) * binomial(j + k, j);
            multinomial * u.powi(i as i32) * v.powi(j as i32) * w.powi(k as i32)
        })
        .collect()
}

/// Point at (u, v, w) of the triangle with these control points.
pub fn evaluate(n: usize, control: &[Vec3], at: [f64; 3]) -> Vec3 {
    bernstein(n, at).iter().zip(control).fold(Vec3::zeros(), |acc, (b, p)| acc + *b * p)
}

/// Barycentric grid with `n` steps a side, corners included, in storage order.
pub fn grid(n: usize) -> impl Iterator<Item = [f64; 3]> {
    exponents(n).map(move |e| e.map(|x| x as f64 / n as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn storage_order_counts_up() {
        for n in 0..=9 {
            for (at, e) in exponents(n).enumerate() {
                assert_eq!(index(e), at);
            }
            assert_eq!(exponents(n).count(), n_control(n));
        }
    }

    #[test]
    fn corners_and_twists_stand_where_the_convention_says() {
        assert_eq!(boundary_index(7, 0, 0), 0);
        assert_eq!(boundary_index(7, 1, 0), 28);
        assert_eq!(boundary_index(7, 2, 0), 35);
        assert_eq!(first_inner_index(7, 0, 1), index([5, 1, 1]));
        assert_eq!(first_inner_index(7, 1, 1), index([1, 5, 1]));
        assert_eq!(first_inner_index(7, 2, 5), index([5, 1, 1]));
    }

    #[test]
    fn interior_slots_agree_with_the_full_net() {
        let interior = interior_indices();
        let inner = exponents(DEGREE).filter(|e| e.iter().all(|&x| x > 0));
        assert!(inner.map(index).eq(interior));
        for corner in 0..3 {
            for s in 1..=5 {
                let slot = first_inner_slot(corner, s);
                assert_eq!(interior[slot], first_inner_index(7, corner, s));
            }
        }
        let innermost = INNERMOST_SLOTS.map(|slot| interior[slot]);
        assert_eq!(innermost, [index([3, 2, 2]), index([2, 3, 2]), index([2, 2, 3])]);
    }

    #[test]
    fn boundary_rows_run_the_same_way_around() {
        for corner in 0..3 {
            assert_eq!(boundary_index(7, corner, 7), boundary_index(7, (corner + 1) % 3, 0));
        }
    }

    #[test]
    fn evaluation_reproduces_linear_functions() {
        let corners = [Vec3::x(), 2.0 * Vec3::y(), Vec3::new(0.0, 1.0, 3.0)];
        let blend = |[u, v, w]: [f64; 3]| u * corners[0] + v * corners[1] + w * corners[2];
        let control: Vec<Vec3> = grid(7).map(blend).collect();
        let at = [0.2, 0.5, 0.3];
        assert!((evaluate(7, &control, at) - blend(at)).norm() < 1e-14);
    }
}
