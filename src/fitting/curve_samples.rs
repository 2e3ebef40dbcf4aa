//! Sample parameters of an edge and the quartic Bernstein polynomials there.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::bernstein;

/// Equidistant inner samples of `[0, 1]`; the ends are interpolated and add nothing to a fit.
#[derive(Clone, Debug)]
pub struct Samples {
    parameters: Vec<f64>,
    weights: Vec<[f64; 5]>,
}

impl Samples {
    /// Samples for `n` equidistant points, ends included.
    pub fn new(n: u32) -> Self {
        let parameters: Vec<f64> = (1..n - 1).map(|j| f64::from(j) / f64::from(n - 1)).collect();
        let quartic = |t: &f64| bernstein(4, *t).try_into().expect("invariant: five polynomials");
        let weights = parameters.iter().map(quartic).collect();
        Self { parameters, weights }
    }

    /// Number of inner samples.
    #[expect(clippy::len_without_is_empty, reason = "there are always samples")]
    pub fn len(&self) -> usize {
        self.parameters.len()
    }

    /// The parameters, ascending.
    pub fn parameters(&self) -> impl Iterator<Item = f64> {
        self.parameters.iter().copied()
    }

    /// `[B_0 .. B_4]` at each sample.
    pub fn weights(&self) -> &[[f64; 5]] {
        &self.weights
    }

    /// Sums over the samples of the products of `B_1`, `B_2` and `B_3`.
    pub fn products(&self) -> [[f64; 3]; 3] {
        let product = |i: usize, j: usize| self.weights.iter().map(|w| w[i + 1] * w[j + 1]).sum();
        std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)))
    }

    /// Points of a quartic at the samples.
    pub fn curve_points(&self, q: &[Vec3; 5]) -> impl Iterator<Item = Vec3> {
        self.weights
            .iter()
            .map(move |w| w[0] * q[0] + w[1] * q[1] + w[2] * q[2] + w[3] * q[3] + w[4] * q[4])
    }
}
