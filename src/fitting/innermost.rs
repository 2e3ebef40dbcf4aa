//! The three points of a patch that lie on no first inner row, from the patch before G1.
//!
//! The interior points of that patch are nearest to samples of the surface, so what it leaves of
//! their distance is orthogonal to all that its interior points can do, the innermost among them:
//! least squares of the distance to the samples is least squares of the distance to the patch, and
//! needs neither samples nor the field \[derived\].
//
// symbols: G the Gram matrix of the interior points over the samples, f the innermost slots, o the
// other ones, x points of the patch before G1, y points after it

use crate::patch_fit::interior_samples;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{INNERMOST_SLOTS, N_INTERIOR, interior_indices};
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// The map from moves of the other interior points to moves of the innermost ones.
#[derive(Clone, Debug)]
pub struct Innermost {
    /// `G_ff^-1 G_fo`, a column for each interior point; those of the innermost ones are not read.
    columns: [[f64; 3]; N_INTERIOR],
}

impl Innermost {
    /// The map that is least squares over the interior points of a grid with `steps` steps a side.
    ///
    /// # Panics
    /// If the samples do not determine the points: `steps` below
    /// [`MIN_GRID`](crate::patch_fit::MIN_GRID).
    pub fn new(steps: u32) -> Self {
        let interior = interior_indices();
        let rows: Vec<[f64; N_INTERIOR]> =
            interior_samples(steps).map(|row| interior.map(|i| row[i])).collect();
        let gram = |a: usize, b: usize| rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
        let factor = cholesky(&INNERMOST_SLOTS.map(|a| INNERMOST_SLOTS.map(|b| gram(a, b))))
            .expect("invariant: the grid determines the innermost points");
        let columns = std::array::from_fn(|slot| {
            let mut right = INNERMOST_SLOTS.map(|a| [gram(a, slot)]);
            cholesky_solve(&factor, &mut right);
            right.map(|[x]| x)
        });
        Self { columns }
    }

    /// Sets the innermost points of `net` so that the patch is as near as can be to that of
    /// `before`, `y_f = x_f + G_ff^-1 G_fo (x_o - y_o)`; both are interior points in storage order.
    pub fn place(&self, before: &[Vec3; N_INTERIOR], net: &mut [Vec3; N_INTERIOR]) {
        let mut innermost = INNERMOST_SLOTS.map(|slot| before[slot]);
        for (slot, column) in self.columns.iter().enumerate() {
            if INNERMOST_SLOTS.contains(&slot) {
                continue;
            }
            let moved = before[slot] - net[slot];
            for (point, weight) in innermost.iter_mut().zip(column) {
                *point += *weight * moved;
            }
        }
        for (slot, point) in INNERMOST_SLOTS.into_iter().zip(innermost) {
            net[slot] = point;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Vectors;
    use crate::patch_fit::{MIN_GRID, Nets, PatchFit, interior_fit};
    use isospline_geometry::bezier_triangle::{DEGREE, grid};

    /// Nets, and samples of no patch.
    fn nets_and_targets(fit: &PatchFit<N_INTERIOR>) -> (Nets, Vec<Vec3>) {
        let bent = |u: f64, v: f64, w: f64| Vec3::new(u, v, (3.0 * u + v * w).sin());
        let net: Vec<Vec3> = grid(DEGREE).map(|[u, v, w]| bent(u, v, w)).collect();
        let nets: Nets = std::array::from_fn(|i| Vectors::of(|_| net[i]));
        let mut targets = vec![Vec3::zeros(); fit.n_samples()];
        fit.sample(&[nets], &mut targets);
        for (k, target) in targets.iter_mut().enumerate() {
            let t = k as f64;
            *target += 0.05 * Vec3::new((5.0 * t).sin(), (7.0 * t).cos(), (11.0 * t).sin());
        }
        (nets, targets)
    }

    #[test]
    fn following_the_patch_before_is_fitting_to_its_samples() {
        let interior = interior_indices();
        let points = |nets: &[Nets]| interior.map(|i| nets[0][i].get(0));
        for steps in [MIN_GRID, 12] {
            let fit = interior_fit(steps);
            let (nets, targets) = nets_and_targets(&fit);
            let mut nets = [nets];
            fit.fit(&mut nets, &targets);
            let before = points(&nets);
            for (k, &i) in interior.iter().enumerate() {
                let t = k as f64;
                nets[0][i] = nets[0][i] + Vectors::of(|_| 0.1 * Vec3::new(t.sin(), t.cos(), 0.3));
            }
            let mut followed = points(&nets);
            Innermost::new(steps).place(&before, &mut followed);
            let innermost = INNERMOST_SLOTS.map(|slot| interior[slot]);
            PatchFit::new(steps, innermost).fit(&mut nets, &targets);
            for (followed, fitted) in followed.iter().zip(points(&nets)) {
                let apart = (followed - fitted).norm();
                assert!(apart < 1e-13, "{apart:e}, {steps} steps");
            }
        }
    }
}
