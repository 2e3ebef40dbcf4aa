//! The sample grid of a patch and the Bernstein values of its control points there.

use crate::degree::Degree;
use crate::functionals::{Functionals, LANES, Values};
use crate::roughness::Roughness;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    N_CONTROL, N_INTERIOR, bernstein, exponents, grid, index, interior_indices,
};
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// The 15 interior control points of a patch, in storage order.
pub(crate) type Interior = [Vec3; N_INTERIOR];

/// Every so many samples the patch is tested for folds: folds are wider than three samples.
const FOLD_STRIDE: usize = 3;
/// Cosine of the angle, 10 degrees, from which a patch may be folded between the samples.
const TILT: f64 = 0.985;

/// Values at the samples, the inner points of a barycentric grid.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Values of the interior points.
    pub(crate) inner: Vec<[f64; N_INTERIOR]>,
    /// Pairs `[i, j <= i]` of interior points, the slots in use, by rows; filled up to whole lanes
    /// with the last one.
    pub(crate) pairs: Vec<[usize; 2]>,
    /// Products of the values of each pair over the number of samples:
    /// `[pair / LANES][sample][pair % LANES]`.
    pub(crate) products: Vec<Vec<[f64; LANES]>>,
    /// Differences between samples.
    pub(crate) roughness: Roughness,
    /// The points at the samples, then two tangents, counter-clockwise, at every
    /// [`FOLD_STRIDE`]th of them.
    functionals: Functionals,
    /// Values of all points at the grid's places on the boundary but the corners; none without
    /// roughness.
    border: Vec<[f64; N_CONTROL]>,
    /// Row of each interior point: its weights of all points in [`Samples::even`].
    even: [[f64; N_CONTROL]; N_INTERIOR],
}

impl Samples {
    /// The inner points of a grid with `steps` steps a side; `smoothness` weighs squared differences
    /// of the distance between them.
    pub(crate) fn new(steps: u32, smoothness: f64, degree: Degree) -> Self {
        let places: Vec<[f64; 3]> = grid(steps as usize).collect();
        let is_inner = |p: &&[f64; 3]| p.iter().all(|&x| x > 0.0);
        let is_border = |p: &&[f64; 3]| p.contains(&0.0) && p.iter().all(|&x| x < 1.0);
        let values = |&p: &[f64; 3]| degree.bernstein(p);
        let full: Vec<[f64; N_CONTROL]> = places.iter().filter(is_inner).map(values).collect();
        let interior = interior_indices();
        let inner: Vec<_> = full.iter().map(|row| interior.map(|i| row[i])).collect();
        let tested = places.iter().filter(is_inner).step_by(FOLD_STRIDE);
        let tangents = tested.flat_map(|at| tangent_weights(degree, at));
        let functionals = full.iter().copied().chain(tangents).collect::<Vec<_>>();
        let roughness = Roughness::new(steps, smoothness);
        let n_border = if roughness.weight() > 0.0 { usize::MAX } else { 0 };
        let border = places.iter().filter(is_border).take(n_border).map(values).collect();
        let (pairs, functionals) = (pairs(degree), Functionals::new(&functionals));
        let products = products(&inner, &pairs);
        Self { inner, pairs, products, roughness, functionals, border, even: even(degree) }
    }

    /// Samples of a patch.
    pub(crate) fn len(&self) -> usize {
        self.inner.len()
    }

    /// What the boundary of a net, which does not move, adds to all that is sampled.
    pub(crate) fn of_boundary(&self, net: &[Vec3; N_CONTROL]) -> Values {
        self.functionals.of_boundary(net)
    }

    /// All that is sampled of a patch.
    pub(crate) fn of(&self, boundary: &Values, interior: &Interior) -> Values {
        self.functionals.of(boundary, interior)
    }

    /// Points of a patch at the samples.
    pub(crate) fn points<'a>(&self, values: &'a Values) -> impl Iterator<Item = Vec3> + 'a {
        (0..self.len()).map(|i| values.get(i))
    }

    /// Places on the boundary of a patch that differences between samples reach; they do not move.
    pub(crate) fn border(&self, net: &[Vec3; N_CONTROL]) -> impl Iterator<Item = Vec3> {
        self.border.iter().map(|weights| combine(weights, net))
    }

    /// Interior points of which each is the mean of its six neighbours in the net: a patch without
    /// folds wherever its boundary has none worth the name.
    pub(crate) fn even(&self, net: &[Vec3; N_CONTROL]) -> Interior {
        self.even.each_ref().map(|weights| combine(weights, net))
    }

    /// Samples whose patch normal points against `normal`, and those where it stands off from it by
    /// more than [`TILT`].
    pub(crate) fn folded(&self, values: &Values, normal: &[Vec3]) -> [usize; 2] {
        let mut counts = [0, 0];
        for (k, outward) in normal.iter().step_by(FOLD_STRIDE).enumerate() {
            let at = self.len() + 2 * k;
            let own = values.get(at).cross(&values.get(at + 1));
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

fn pairs(degree: Degree) -> Vec<[usize; 2]> {
    let slots = degree.slots();
    let used: Vec<usize> =
        (0..N_INTERIOR).filter(|&i| slots.contains(&interior_indices()[i])).collect();
    let rows = used.iter().enumerate();
    let mut pairs: Vec<[usize; 2]> =
        rows.flat_map(|(n, &i)| used[..=n].iter().map(move |&j| [i, j])).collect();
    let last = pairs[pairs.len() - 1];
    pairs.resize(pairs.len().next_multiple_of(LANES), last);
    pairs
}

fn products(inner: &[[f64; N_INTERIOR]], pairs: &[[usize; 2]]) -> Vec<Vec<[f64; LANES]>> {
    let scale = 1.0 / inner.len() as f64;
    let product = |b: &[f64; N_INTERIOR], chunk: &[[usize; 2]]| {
        std::array::from_fn(|lane| scale * b[chunk[lane][0]] * b[chunk[lane][1]])
    };
    let chunks = pairs.chunks_exact(LANES);
    chunks.map(|chunk| inner.iter().map(|b| product(b, chunk)).collect()).collect()
}

/// The interior points of a net, each the mean of its six neighbours, from the boundary points.
/// Slots without a point are zero.
fn even(degree: Degree) -> [[f64; N_CONTROL]; N_INTERIOR] {
    let (interior, slots) = (interior_indices(), degree.slots());
    let inner = |slot: usize| interior.iter().position(|&at| at == slot);
    let mut matrix = [[0.0; N_INTERIOR]; N_INTERIOR];
    (0..N_INTERIOR).for_each(|i| matrix[i][i] = 6.0);
    let mut weights = [[0.0; N_CONTROL]; N_INTERIOR];
    for (e, &slot) in exponents(degree.number()).zip(&slots) {
        let Some(row) = inner(slot) else { continue };
        for (from, to) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
            let mut neighbour = e;
            neighbour[from] -= 1;
            neighbour[to] += 1;
            let at = slots[index(neighbour)];
            match inner(at) {
                Some(column) => matrix[row][column] = -1.0,
                None => weights[row][at] += 1.0,
            }
        }
    }
    let factor = cholesky(&matrix).expect("invariant: a net is connected to its boundary");
    cholesky_solve(&factor, &mut weights);
    weights
}

/// Derivatives towards corner 1 and corner 2, away from corner 0.
fn tangent_weights(degree: Degree, at: &[f64; 3]) -> [[f64; N_CONTROL]; 2] {
    let lower = bernstein(degree.number() - 1, *at);
    let mut out = [[0.0; N_CONTROL]; 2];
    for (e, slot) in exponents(degree.number()).zip(degree.slots()) {
        let partial = |k: usize| {
            let mut below = e;
            below[k] = below[k].checked_sub(1)?;
            Some(lower[index(below)])
        };
        let from = partial(0).unwrap_or(0.0);
        for k in 0..2 {
            out[k][slot] = partial(k + 1).unwrap_or(0.0) - from;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_net_is_sampled_at_its_grid_and_seen_upright_from_above_alone() {
        for degree in [Degree::Six, Degree::Seven] {
            let samples = Samples::new(12, 0.0, degree);
            let net = degree.flat_net();
            let interior = interior_indices().map(|i| net[i]);
            let values = samples.of(&samples.of_boundary(&net), &interior);
            let inner = grid(12).filter(|p| p.iter().all(|&x| x > 0.0));
            for (p, [_, v, w]) in samples.points(&values).zip(inner) {
                assert!((p - Vec3::new(v, w, 0.0)).norm() < 1e-15);
            }
            let up = |n: usize, side: f64| vec![side * Vec3::z(); n];
            let folded = |side| samples.folded(&values, &up(55, side));
            assert_eq!([folded(1.0), folded(-1.0)], [[0; 2], [19; 2]], "{degree:?}");
        }
    }

    #[test]
    fn an_even_net_over_a_flat_boundary_is_flat_and_evenly_spaced() {
        for degree in [Degree::Six, Degree::Seven] {
            let (samples, net) = (Samples::new(12, 0.0, degree), degree.flat_net());
            let even = samples.even(&net);
            for (p, i) in even.iter().zip(interior_indices()) {
                assert!((p - net[i]).norm() < 1e-14, "{p} instead of {}", net[i]);
            }
        }
    }
}
