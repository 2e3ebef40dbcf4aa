//! Least-squares fit of degree-7 patches on a fixed barycentric grid [TK, Eq. (12)].
//!
//! The grid is the same for every face, so the pseudo-inverse is one constant matrix and a fit is
//! a small matrix product.

use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, N_INTERIOR, bernstein, grid, interior_indices,
};
use isospline_geometry::linear::{cholesky, cholesky_solve};
use isospline_geometry::{Vec3, bezier_triangle};

/// Coarsest grid whose interior samples determine 15 interior points; 6 has 10 samples only.
pub const MIN_GRID: u32 = 8;
/// Finest grid accepted; beyond 20 nothing is gained.
pub const MAX_GRID: u32 = 64;

/// A constant fit of some control points of a net to samples at the interior grid points.
#[derive(Clone, Debug)]
pub struct PatchFit<const FREE: usize> {
    free: [usize; FREE],
    /// Bernstein values of all control points at each sample, `[samples][36]`.
    rows: Vec<[f64; N_CONTROL]>,
    /// `[samples][FREE]`: column `s` of the pseudo-inverse.
    inverse: Vec<[f64; FREE]>,
}

impl<const FREE: usize> PatchFit<FREE> {
    /// The fit of the control points at indices `free` on a grid with `steps` steps a side.
    ///
    /// # Panics
    /// If the samples do not determine the free points: `steps` below [`MIN_GRID`].
    pub fn new(steps: u32, free: [usize; FREE]) -> Self {
        let inner = |p: &[f64; 3]| p.iter().all(|&x| x > 0.0);
        let rows: Vec<[f64; N_CONTROL]> = grid(steps as usize)
            .filter(inner)
            .map(|p| bernstein(DEGREE, p).try_into().expect("invariant: 36 polynomials"))
            .collect();
        let mut normal = [[0.0; FREE]; FREE];
        for row in &rows {
            for (i, &a) in free.iter().enumerate() {
                for (j, &b) in free.iter().enumerate() {
                    normal[i][j] += row[a] * row[b];
                }
            }
        }
        let factor = cholesky(&normal).expect("invariant: the grid determines the free points");
        let column = |row: &[f64; N_CONTROL]| {
            let mut rhs = free.map(|i| [row[i]]);
            cholesky_solve(&factor, &mut rhs);
            rhs.map(|[x]| x)
        };
        let inverse = rows.iter().map(column).collect();
        Self { free, rows, inverse }
    }

    /// Samples a face: the interior points of the grid.
    pub fn n_samples(&self) -> usize {
        self.rows.len()
    }

    /// Points of the patch at the samples.
    pub fn sample(&self, net: &[Vec3; N_CONTROL], out: &mut [Vec3]) {
        for (row, point) in self.rows.iter().zip(out) {
            *point = combine(row, net);
        }
    }

    /// Moves the free points so that the squared distances to `targets` are least; the rest of
    /// the net stays.
    pub fn fit(&self, net: &mut [Vec3; N_CONTROL], targets: &[Vec3]) {
        let mut update = [Vec3::zeros(); FREE];
        for ((row, column), target) in self.rows.iter().zip(&self.inverse).zip(targets) {
            let residual = target - combine(row, net);
            for (u, weight) in update.iter_mut().zip(column) {
                *u += *weight * residual;
            }
        }
        for (&i, u) in self.free.iter().zip(&update) {
            net[i] += u;
        }
    }
}

#[inline]
fn combine(row: &[f64; N_CONTROL], net: &[Vec3; N_CONTROL]) -> Vec3 {
    let mut sum = Vec3::zeros();
    for (b, p) in row.iter().zip(net) {
        sum += *b * p;
    }
    sum
}

/// The fit of all interior points.
pub fn interior_fit(steps: u32) -> PatchFit<N_INTERIOR> {
    PatchFit::new(steps, interior_indices())
}

/// The fit of the three points that lie on no first inner row.
pub fn innermost_fit(steps: u32) -> PatchFit<3> {
    let interior = interior_indices();
    PatchFit::new(steps, bezier_triangle::INNERMOST_SLOTS.map(|slot| interior[slot]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy_net() -> [Vec3; N_CONTROL] {
        let net: Vec<Vec3> =
            grid(DEGREE).map(|[u, v, w]| Vec3::new(u, v, 3.0 * u * u - v * w * w)).collect();
        net.try_into().unwrap()
    }

    #[test]
    fn fitting_recovers_a_net_from_its_own_samples() {
        let exact = wavy_net();
        for steps in [MIN_GRID, 12, 20] {
            let fit = interior_fit(steps);
            let mut targets = vec![Vec3::zeros(); fit.n_samples()];
            fit.sample(&exact, &mut targets);
            let mut net = exact;
            for i in interior_indices() {
                net[i] += Vec3::new(0.1, -0.2, 0.3);
            }
            fit.fit(&mut net, &targets);
            let worst = net.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(worst < 1e-9, "{worst:e} at {steps} steps");
        }
    }
}
