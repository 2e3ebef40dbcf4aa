//! Second differences of the distance over the sample grid: the Sobolev term of the cost.

use isospline_geometry::bezier_triangle::{exponents, index};

/// Steps a side of the grid that the weight refers to: finer grids have smaller differences.
const REFERENCE_STEPS: f64 = 12.0;

/// Differences in the three directions of the grid about each inner sample.
#[derive(Clone, Debug)]
pub(crate) struct Roughness {
    /// Of squared differences beside squared distances.
    weight: f64,
    /// Samples before, in and after the middle: the inner ones come first, then those on the
    /// boundary but the corners, then one for all corners, which lie on the surface.
    stencils: Vec<[usize; 3]>,
}

/// What the differences add to the cost of a patch.
#[derive(Clone, Debug)]
pub(crate) struct Rough {
    /// Derivative of half the whole cost by the distance at each inner sample.
    pub(crate) force: Vec<f64>,
    /// Weighted sum of the squared differences.
    pub(crate) sum_sq: f64,
}

impl Roughness {
    /// Differences over a grid with `steps` steps a side.
    pub(crate) fn new(steps: u32, smoothness: f64) -> Self {
        let steps = steps as usize;
        let coarser = steps as f64 / REFERENCE_STEPS;
        let weight = smoothness * coarser * coarser * coarser * coarser;
        let numbers = numbers(steps);
        let stencil = |e: [usize; 3], from: usize, to: usize| {
            let (mut before, mut after) = (e, e);
            (before[from], before[to]) = (e[from] + 1, e[to] - 1);
            (after[from], after[to]) = (e[from] - 1, e[to] + 1);
            [before, e, after].map(|e| numbers[index(e)])
        };
        let inner = exponents(steps).filter(|e| e.iter().all(|&x| x > 0));
        let about = |e| [(0, 1), (1, 2), (2, 0)].map(|(from, to)| stencil(e, from, to));
        let stencils = if weight > 0.0 { inner.flat_map(about).collect() } else { Vec::new() };
        Self { weight, stencils }
    }

    /// What is added for these distances at the inner samples and on the boundary.
    pub(crate) fn of(&self, distance: &[f64], rim: &[f64]) -> Rough {
        let at = |i: usize| {
            let rim = || rim.get(i - distance.len()).copied().unwrap_or(0.0);
            distance.get(i).copied().unwrap_or_else(rim)
        };
        let mut out = Rough { force: distance.to_vec(), sum_sq: 0.0 };
        for stencil in self.differences() {
            let difference: f64 = stencil.iter().map(|&(i, factor)| factor * at(i)).sum();
            let force = self.weight * difference;
            out.sum_sq += force * difference;
            for (i, factor) in stencil {
                if let Some(sum) = out.force.get_mut(i) {
                    *sum += factor * force;
                }
            }
        }
        out
    }

    /// Weight of squared differences beside squared distances.
    pub(crate) fn weight(&self) -> f64 {
        self.weight
    }

    /// Of each difference the samples and their factors; only the inner ones move.
    pub(crate) fn differences(&self) -> impl Iterator<Item = [(usize, f64); 3]> {
        let factors = [1.0, -2.0, 1.0];
        self.stencils.iter().map(move |stencil| std::array::from_fn(|k| (stencil[k], factors[k])))
    }
}

/// Number of each place of a grid: inner ones first, then the rim, the corners last with one for
/// all.
fn numbers(steps: usize) -> Vec<usize> {
    let zeros = |e: [usize; 3]| e.iter().filter(|&&x| x == 0).count();
    let counted = |n: usize| exponents(steps).filter(move |&e| zeros(e) == n).count();
    let mut next = [0, counted(0), counted(0) + counted(1)];
    exponents(steps)
        .map(|e| {
            let number = next[zeros(e)];
            next[zeros(e)] += usize::from(zeros(e) < 2);
            number
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::grid;

    /// Values of a function of the barycentric coordinates at the inner samples and on the rim.
    fn sampled(steps: usize, f: impl Fn([f64; 3]) -> f64) -> [Vec<f64>; 2] {
        let zeros = |p: &[f64; 3]| p.iter().filter(|&&x| x == 0.0).count();
        [0, 1].map(|n| grid(steps).filter(|p| zeros(p) == n).map(&f).collect())
    }

    #[test]
    fn only_what_bends_is_rough() {
        let roughness = Roughness::new(12, 0.5);
        let [inner, rim] = sampled(12, |_| 0.0);
        assert!(roughness.of(&inner, &rim).sum_sq <= 0.0);
        // u v w is bent by -2 w / 144 along u - v and so on, and vanishes on the boundary.
        let [inner, rim] = sampled(12, |[u, v, w]| u * v * w);
        let rough = roughness.of(&inner, &rim);
        let [squares, _] = sampled(12, |[u, v, w]| 2.0 / (144.0 * 144.0) * (u * u + v * v + w * w));
        let expected: f64 = squares.iter().sum();
        assert!((rough.sum_sq - expected).abs() < 1e-12 * expected, "{}", rough.sum_sq);
    }

    #[test]
    fn the_force_is_the_derivative_of_half_the_cost() {
        let roughness = Roughness::new(9, 0.3);
        let [inner, rim] = sampled(9, |[u, v, w]| (7.0 * u + v * v).sin() * (1.0 + w));
        let cost =
            |d: &[f64]| 0.5 * (d.iter().map(|d| d * d).sum::<f64>() + roughness.of(d, &rim).sum_sq);
        let force = roughness.of(&inner, &rim).force;
        for s in 0..inner.len() {
            let [mut lower, mut upper] = [inner.clone(), inner.clone()];
            lower[s] -= 1e-4;
            upper[s] += 1e-4;
            let slope = (cost(&upper) - cost(&lower)) / 2e-4;
            assert!((slope - force[s]).abs() < 1e-9, "{s}: {slope} {}", force[s]);
        }
    }
}
