//! The sample grid of a patch and the Bernstein values of its control points there.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, N_INTERIOR, bernstein, boundary_index, exponents, grid, index,
    interior_indices,
};
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// The 15 interior control points of a patch, in storage order.
pub(crate) type Interior = [Vec3; N_INTERIOR];
/// Pairs of interior points that one pass of [`Samples::pairs`] takes.
pub(crate) const LANES: usize = 4;

const N_BOUNDARY: usize = N_CONTROL - N_INTERIOR;
/// Every so many samples the patch is tested for folds: folds are wider than three samples.
const FOLD_STRIDE: usize = 3;
/// Cosine of the angle, 10 degrees, from which a patch may be folded between the samples.
const TILT: f64 = 0.985;
/// Steps a side between the places on the boundary that are tested: beside the long side of a
/// sliver, folds do not reach the samples.
const RIM_STEPS: usize = 12;

/// Values at the samples, the inner points of a barycentric grid.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Values of the interior points.
    pub(crate) inner: Vec<[f64; N_INTERIOR]>,
    /// Products of the values of pairs `(i, j <= i)` of interior points, by rows, over the number
    /// of samples: `[pair / LANES][sample][pair % LANES]`.
    pub(crate) pairs: Vec<Vec<[f64; LANES]>>,
    /// Values of all points.
    full: Vec<[f64; N_CONTROL]>,
    /// Weights of two tangents, counter-clockwise, at every [`FOLD_STRIDE`]th sample.
    tangents: Vec<[[f64; N_CONTROL]; 2]>,
    /// Values of all points at places on the boundary, and weights of the two tangents there.
    rim: Vec<([f64; N_CONTROL], [[f64; N_CONTROL]; 2])>,
    /// Row of each interior point: its weights of all points in [`Samples::even`].
    even: [[f64; N_CONTROL]; N_INTERIOR],
    boundary: [usize; N_BOUNDARY],
    interior: [usize; N_INTERIOR],
}

impl Samples {
    /// The inner points of a grid with `steps` steps a side.
    pub(crate) fn new(steps: u32) -> Self {
        let is_inner = |p: &[f64; 3]| p.iter().all(|&x| x > 0.0);
        let places: Vec<[f64; 3]> = grid(steps as usize).filter(is_inner).collect();
        let values = |&p: &[f64; 3]| bernstein(DEGREE, p).try_into().expect("invariant: 36 values");
        let full: Vec<[f64; N_CONTROL]> = places.iter().map(values).collect();
        let interior = interior_indices();
        let inner: Vec<_> = full.iter().map(|row| interior.map(|i| row[i])).collect();
        let boundary = std::array::from_fn(|i| boundary_index(DEGREE, i / DEGREE, i % DEGREE));
        let tangents = places.iter().step_by(FOLD_STRIDE).map(tangent_weights).collect();
        let is_rim = |p: &[f64; 3]| p.contains(&0.0) && p.iter().all(|&x| x < 1.0);
        let rim = grid(RIM_STEPS).filter(is_rim).map(|p| (values(&p), tangent_weights(&p)));
        let (pairs, rim, even) = (pairs(&inner), rim.collect(), even());
        Self { inner, pairs, full, tangents, rim, even, boundary, interior }
    }

    /// Samples of a patch.
    pub(crate) fn len(&self) -> usize {
        self.inner.len()
    }

    /// Points of a patch at the samples; `net` gives the boundary, `interior` the rest.
    pub(crate) fn points(&self, net: &[Vec3; N_CONTROL], interior: &Interior, out: &mut [Vec3]) {
        for ((full, inner), p) in self.full.iter().zip(&self.inner).zip(out) {
            let mut sum = Vec3::zeros();
            for &i in &self.boundary {
                sum += full[i] * net[i];
            }
            for (w, b) in inner.iter().zip(interior) {
                sum += *w * b;
            }
            *p = sum;
        }
    }

    /// Places on the boundary of a patch where [`Samples::folded`] looks; they do not move.
    pub(crate) fn rim(&self, net: &[Vec3; N_CONTROL]) -> impl Iterator<Item = Vec3> {
        self.rim.iter().map(|(weights, _)| combine(weights, net))
    }

    /// Interior points of which each is the mean of its six neighbours in the net: a patch without
    /// folds wherever its boundary has none worth the name.
    pub(crate) fn even(&self, net: &[Vec3; N_CONTROL]) -> Interior {
        self.even.each_ref().map(|weights| combine(weights, net))
    }

    /// Samples whose patch normal points against `normal`, and those where it stands off from it by
    /// more than [`TILT`]; with the places on the boundary and `rim_normal`.
    pub(crate) fn folded(
        &self,
        net: &[Vec3; N_CONTROL],
        interior: &Interior,
        normal: &[Vec3],
        rim_normal: &[Vec3],
    ) -> [usize; 2] {
        let mut net = *net;
        for (&i, &p) in self.interior.iter().zip(interior) {
            net[i] = p;
        }
        let inside = self.tangents.iter().zip(normal.iter().step_by(FOLD_STRIDE));
        let rim = self.rim.iter().map(|(_, tangents)| tangents).zip(rim_normal);
        let mut counts = [0, 0];
        for (weights, outward) in inside.chain(rim) {
            let [a, b] = weights.each_ref().map(|row| combine(row, &net));
            let own = a.cross(&b);
            let along = own.dot(outward);
            counts[0] += usize::from(along < 0.0);
            counts[1] += usize::from(along < TILT * own.norm());
        }
        counts
    }
}

fn combine(weights: &[f64; N_CONTROL], net: &[Vec3; N_CONTROL]) -> Vec3 {
    let mut sum = Vec3::zeros();
    for (w, p) in weights.iter().zip(net) {
        sum += *w * p;
    }
    sum
}

fn pairs(inner: &[[f64; N_INTERIOR]]) -> Vec<Vec<[f64; LANES]>> {
    let scale = 1.0 / inner.len() as f64;
    let all: Vec<[usize; 2]> = (0..N_INTERIOR).flat_map(|i| (0..=i).map(move |j| [i, j])).collect();
    let product = |b: &[f64; N_INTERIOR], chunk: &[[usize; 2]]| {
        std::array::from_fn(|lane| scale * b[chunk[lane][0]] * b[chunk[lane][1]])
    };
    all.chunks_exact(LANES).map(|chunk| inner.iter().map(|b| product(b, chunk)).collect()).collect()
}

/// The interior points of a net, each the mean of its six neighbours, from the boundary points.
fn even() -> [[f64; N_CONTROL]; N_INTERIOR] {
    let all: Vec<[usize; 3]> = exponents(DEGREE).collect();
    let interior = interior_indices();
    let slot = |i: usize| interior.iter().position(|&at| at == i);
    let mut matrix = [[0.0; N_INTERIOR]; N_INTERIOR];
    let mut weights = [[0.0; N_CONTROL]; N_INTERIOR];
    for (row, &i) in interior.iter().enumerate() {
        matrix[row][row] = 6.0;
        for (from, to) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
            let mut neighbour = all[i];
            neighbour[from] -= 1;
            neighbour[to] += 1;
            let j = index(neighbour);
            match slot(j) {
                Some(column) => matrix[row][column] = -1.0,
                None => weights[row][j] += 1.0,
            }
        }
    }
    let factor = cholesky(&matrix).expect("invariant: a net is connected to its boundary");
    cholesky_solve(&factor, &mut weights);
    weights
}

/// Derivatives towards corner 1 and corner 2, away from corner 0.
fn tangent_weights(at: &[f64; 3]) -> [[f64; N_CONTROL]; 2] {
    let lower = bernstein(DEGREE - 1, *at);
    let mut out = [[0.0; N_CONTROL]; 2];
    for e in exponents(DEGREE) {
        let partial = |k: usize| {
            let mut below = e;
            below[k] = below[k].checked_sub(1)?;
            Some(lower[index(below)])
        };
        let from = partial(0).unwrap_or(0.0);
        for k in 0..2 {
            out[k][index(e)] = partial(k + 1).unwrap_or(0.0) - from;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat_net() -> [Vec3; N_CONTROL] {
        let net: Vec<Vec3> = grid(DEGREE).map(|[_, v, w]| Vec3::new(v, w, 0.0)).collect();
        net.try_into().unwrap()
    }

    #[test]
    fn a_flat_net_is_sampled_at_its_grid_and_seen_upright_from_above_alone() {
        let samples = Samples::new(12);
        let net = flat_net();
        let interior = interior_indices().map(|i| net[i]);
        let mut points = vec![Vec3::zeros(); samples.len()];
        samples.points(&net, &interior, &mut points);
        let inner = grid(12).filter(|p| p.iter().all(|&x| x > 0.0));
        for (p, [_, v, w]) in points.iter().zip(inner) {
            assert!((p - Vec3::new(v, w, 0.0)).norm() < 1e-15);
        }
        let up = |n: usize, side: f64| vec![side * Vec3::z(); n];
        let folded = |side| samples.folded(&net, &interior, &up(55, side), &up(33, side));
        assert_eq!([folded(1.0), folded(-1.0)], [[0; 2], [19 + 33; 2]]);
    }

    #[test]
    fn an_even_net_over_a_flat_boundary_is_flat_and_evenly_spaced() {
        let (samples, net) = (Samples::new(12), flat_net());
        let even = samples.even(&net);
        for (p, i) in even.iter().zip(interior_indices()) {
            assert!((p - net[i]).norm() < 1e-14, "{p} instead of {}", net[i]);
        }
    }
}
