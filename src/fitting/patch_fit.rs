//! Least-squares fit of degree-7 patches on a fixed barycentric grid [TK, Eq. (12)].
//!
//! The grid is the same for every face, so the pseudo-inverse is one constant matrix and a fit is
//! a small matrix product, of eight faces at a time.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::lanes::{Lanes, N, Vectors};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, N_INTERIOR, bernstein, grid, interior_indices,
};
use isospline_geometry::linear::{cholesky, cholesky_solve};
use isospline_implicit::{Kernel, run_widest};

/// Coarsest grid whose interior samples determine 15 interior points; 6 has 10 samples only.
pub const MIN_GRID: u32 = 8;
/// Finest grid accepted; beyond 20 nothing is gained.
pub const MAX_GRID: u32 = 64;

/// Control points of eight nets; where there are fewer the last lanes hold any.
pub type Nets = [Vectors; N_CONTROL];

/// A constant fit of some control points of a net to samples at the interior grid points.
#[derive(Clone, Debug)]
pub struct PatchFit<const FREE: usize> {
    free: [usize; FREE],
    n_samples: usize,
    /// Bernstein values of all control points at each sample, `[samples][36]`.
    values: Vec<f64>,
    /// The pseudo-inverse, `[FREE][samples]`.
    inverse: Vec<f64>,
}

/// Distances between a patch and the targets of its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// The largest.
    pub max: f64,
    /// Root of the mean square.
    pub rms: f64,
}

impl<const FREE: usize> PatchFit<FREE> {
    /// The fit of the control points at indices `free` on a grid with `steps` steps a side.
    ///
    /// # Panics
    /// If the samples do not determine the free points: `steps` below [`MIN_GRID`].
    pub fn new(steps: u32, free: [usize; FREE]) -> Self {
        let rows: Vec<[f64; N_CONTROL]> = interior_samples(steps).collect();
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
        let columns: Vec<[f64; FREE]> = rows.iter().map(column).collect();
        let inverse = (0..FREE).flat_map(|i| columns.iter().map(move |c| c[i])).collect();
        Self { free, n_samples: rows.len(), values: rows.concat(), inverse }
    }

    /// Samples a face: the interior points of the grid.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Points at the samples of the patches with these nets, patch after patch, as many as `out` has
    /// room for.
    pub fn sample(&self, nets: &[Nets], out: &mut [Vec3]) {
        run_widest(Sample { fit: self, nets, out });
    }

    /// Moves the free points of each net so that the squared distances to its targets are least;
    /// the rest stays. The targets are as [`Self::sample`] writes points.
    pub fn fit(&self, nets: &mut [Nets], targets: &[Vec3]) -> Vec<Distance> {
        run_widest(Solve { fit: self, nets, targets })
    }
}

struct Sample<'a, const FREE: usize> {
    fit: &'a PatchFit<FREE>,
    nets: &'a [Nets],
    out: &'a mut [Vec3],
}

impl<const FREE: usize> Kernel for Sample<'_, FREE> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let n_samples = self.fit.n_samples;
        let mut points = vec![Vectors::ZERO; n_samples];
        for (nets, out) in self.nets.iter().zip(self.out.chunks_mut(N * n_samples)) {
            multiply(&self.fit.values, nets, &mut points);
            for (k, out) in out.chunks_exact_mut(n_samples).enumerate() {
                for (out, points) in out.iter_mut().zip(&points) {
                    *out = points.get(k);
                }
            }
        }
    }
}

struct Solve<'a, const FREE: usize> {
    fit: &'a PatchFit<FREE>,
    nets: &'a mut [Nets],
    targets: &'a [Vec3],
}

impl<const FREE: usize> Kernel for Solve<'_, FREE> {
    type Output = Vec<Distance>;

    #[inline(always)]
    fn run(self) -> Vec<Distance> {
        let fit = self.fit;
        let n_samples = fit.n_samples;
        let mut distances = Vec::with_capacity(N * self.nets.len());
        let mut goals = vec![Vectors::ZERO; n_samples];
        let mut points = goals.clone();
        let mut update = [Vectors::ZERO; FREE];
        for (nets, targets) in self.nets.iter_mut().zip(self.targets.chunks(N * n_samples)) {
            for (k, targets) in targets.chunks_exact(n_samples).enumerate() {
                for (goals, target) in goals.iter_mut().zip(targets) {
                    goals.set(k, *target);
                }
            }
            multiply(&fit.values, nets, &mut points);
            for (point, goal) in points.iter_mut().zip(&goals) {
                *point = *goal - *point;
            }
            multiply(&fit.inverse, &points, &mut update);
            for (&i, update) in fit.free.iter().zip(&update) {
                nets[i] = nets[i] + *update;
            }
            multiply(&fit.values, nets, &mut points);
            let (mut max, mut sum) = (Lanes::all(0.0), Lanes::all(0.0));
            for (point, goal) in points.iter().zip(&goals) {
                let apart = *point - *goal;
                let square = apart.dot(apart);
                max = max.with(square, |a, b| if b > a { b } else { a });
                sum = sum + square;
            }
            let (max, mean) = (max.map(f64::sqrt), sum / Lanes::all(n_samples as f64));
            let rms = mean.map(f64::sqrt);
            let here = targets.len() / n_samples;
            distances.extend((0..here).map(|k| Distance { max: max.0[k], rms: rms.0[k] }));
        }
        distances
    }
}

/// The product of a matrix, row after row, and a column of points; sums run in index order.
#[inline(always)]
fn multiply(matrix: &[f64], points: &[Vectors], out: &mut [Vectors]) {
    for (row, out) in matrix.chunks_exact(points.len()).zip(out) {
        // Plain loops over arrays of their own: of these the compiler makes registers.
        let (mut x, mut y, mut z) = ([0.0; N], [0.0; N], [0.0; N]);
        for (weight, point) in row.iter().zip(points) {
            let [px, py, pz] = &point.0;
            for k in 0..N {
                x[k] += *weight * px.0[k];
            }
            for k in 0..N {
                y[k] += *weight * py.0[k];
            }
            for k in 0..N {
                z[k] += *weight * pz.0[k];
            }
        }
        *out = Vectors([Lanes(x), Lanes(y), Lanes(z)]);
    }
}

/// Bernstein values of all control points at the interior points of a grid, in storage order.
pub fn interior_samples(steps: u32) -> impl Iterator<Item = [f64; N_CONTROL]> {
    let inner = |p: &[f64; 3]| p.iter().all(|&x| x > 0.0);
    grid(steps as usize)
        .filter(inner)
        .map(|p| bernstein(DEGREE, p).try_into().expect("invariant: 36 polynomials"))
}

/// The fit of all interior points.
pub fn interior_fit(steps: u32) -> PatchFit<N_INTERIOR> {
    PatchFit::new(steps, interior_indices())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy_net(k: f64) -> [Vec3; N_CONTROL] {
        let net: Vec<Vec3> =
            grid(DEGREE).map(|[u, v, w]| k * Vec3::new(u, v, 3.0 * u * u - v * w * w)).collect();
        net.try_into().unwrap()
    }

    #[test]
    fn fitting_recovers_nets_from_their_own_samples() {
        let n_faces = 11;
        let exact: Vec<Nets> = (0..2)
            .map(|group| {
                let nets: Vec<_> = (0..N).map(|k| wavy_net((N * group + k + 1) as f64)).collect();
                std::array::from_fn(|i| Vectors::of(|k| nets[k][i]))
            })
            .collect();
        for steps in [MIN_GRID, 12, 20] {
            let fit = interior_fit(steps);
            let mut targets = vec![Vec3::zeros(); n_faces * fit.n_samples()];
            fit.sample(&exact, &mut targets);
            let mut nets = exact.clone();
            for i in interior_indices() {
                for nets in &mut nets {
                    nets[i] = nets[i] + Vectors::of(|k| Vec3::new(0.1 * k as f64, -0.2, 0.3));
                }
            }
            let distances = fit.fit(&mut nets, &targets);
            assert_eq!(distances.len(), n_faces);
            for (face, distance) in distances.iter().enumerate() {
                let apart = |i: usize| {
                    let point = |nets: &[Nets]| nets[face / N][i].get(face % N);
                    (point(&nets) - point(&exact)).norm()
                };
                let worst = (0..N_CONTROL).map(apart).fold(0.0, f64::max);
                assert!(worst < 1e-9, "{worst:e} at {steps} steps");
                assert!(distance.rms <= distance.max && distance.max < 1e-9, "{distance:?}");
            }
        }
    }
}
