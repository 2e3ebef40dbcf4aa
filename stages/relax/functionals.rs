//! Linear functionals of control nets, eight at a time.

#![expect(clippy::inline_always, reason = "kernels are compiled for several processors")]

use crate::samples::Interior;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, N_INTERIOR, boundary_index, interior_indices,
};
use isospline_implicit::{Kernel, run_widest};

/// Functionals that are evaluated together.
pub(crate) const LANES: usize = 8;

const N_BOUNDARY: usize = N_CONTROL - N_INTERIOR;

/// Points and derivatives of patches: weighted sums of control points.
#[derive(Clone, Debug)]
pub(crate) struct Functionals {
    boundary_at: [usize; N_BOUNDARY],
    /// Weights of the boundary points, of [`LANES`] functionals each.
    boundary: Vec<[[f64; LANES]; N_BOUNDARY]>,
    /// Weights of the interior points.
    interior: Vec<[[f64; LANES]; N_INTERIOR]>,
}

/// Values of all functionals, [`LANES`] together: x, y and z.
#[derive(Clone, Debug)]
pub(crate) struct Values(Vec<[[f64; LANES]; 3]>);

impl Functionals {
    /// Functionals with these weights of the 36 points.
    pub(crate) fn new(rows: &[[f64; N_CONTROL]]) -> Self {
        let boundary_at = std::array::from_fn(|i| boundary_index(DEGREE, i / DEGREE, i % DEGREE));
        Self {
            boundary: by_lanes(rows, &boundary_at),
            interior: by_lanes(rows, &interior_indices()),
            boundary_at,
        }
    }

    /// What the boundary of a net adds to all values.
    pub(crate) fn of_boundary(&self, net: &[Vec3; N_CONTROL]) -> Values {
        let points = self.boundary_at.map(|i| net[i]);
        let zero = Values(vec![[[0.0; LANES]; 3]; self.boundary.len()]);
        run_widest(Sum { weights: &self.boundary, points: &points, start: &zero })
    }

    /// Values on the net of this boundary and interior.
    pub(crate) fn of(&self, boundary: &Values, interior: &Interior) -> Values {
        run_widest(Sum { weights: &self.interior, points: interior, start: boundary })
    }
}

impl Values {
    /// Value of functional `i`.
    #[inline]
    pub(crate) fn get(&self, i: usize) -> Vec3 {
        let [x, y, z] = &self.0[i / LANES];
        Vec3::new(x[i % LANES], y[i % LANES], z[i % LANES])
    }
}

/// The weights of the points `at`; lanes beyond the last functional weigh nothing.
fn by_lanes<const N: usize>(rows: &[[f64; N_CONTROL]], at: &[usize; N]) -> Vec<[[f64; LANES]; N]> {
    let weight = |chunk: &[[f64; N_CONTROL]], i: usize| {
        std::array::from_fn(|lane| chunk.get(lane).map_or(0.0, |row| row[i]))
    };
    rows.chunks(LANES).map(|chunk| at.map(|i| weight(chunk, i))).collect()
}

/// `start` and the weighted sums of the points.
struct Sum<'a, const N: usize> {
    weights: &'a [[[f64; LANES]; N]],
    points: &'a [Vec3; N],
    start: &'a Values,
}

impl<const N: usize> Kernel for Sum<'_, N> {
    type Output = Values;

    #[inline(always)]
    fn run(self) -> Values {
        let mut out = self.start.clone();
        for (sums, weights) in out.0.iter_mut().zip(self.weights) {
            for (w, p) in weights.iter().zip(self.points) {
                for x in 0..3 {
                    for lane in 0..LANES {
                        sums[x][lane] += w[lane] * p[x];
                    }
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functionals_are_the_weighted_sums_of_their_rows() {
        let row = |r: usize| std::array::from_fn(|i| ((7 * r + 3 * i) % 11) as f64 - 5.0);
        let rows: Vec<[f64; N_CONTROL]> = (0..11).map(row).collect();
        let net: [Vec3; N_CONTROL] =
            std::array::from_fn(|i| Vec3::new(i as f64, (i * i % 7) as f64, -1.0));
        let functionals = Functionals::new(&rows);
        let boundary = functionals.of_boundary(&net);
        let values = functionals.of(&boundary, &interior_indices().map(|i| net[i]));
        for (i, row) in rows.iter().enumerate() {
            let expected: Vec3 = row.iter().zip(&net).map(|(w, p)| *w * p).sum();
            assert!((values.get(i) - expected).norm() < 1e-10, "{i}");
        }
    }
}
