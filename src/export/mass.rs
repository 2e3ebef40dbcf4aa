//! Volume, area and centroid of a surface, by Gauss integration of the patches themselves.

use isospline_artifact::kinds::PatchesView;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, bernstein, exponents, index, n_control,
};

/// Points a direction: volume and centroid are exact, polynomials of degree 26 at most over the
/// triangle, and one more over the square; area is an integral of roots, near rounding.
const POINTS: usize = 14;

/// Integrals over a closed surface, in model units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Mass {
    /// Enclosed volume, negative if the normals point into the bounded side.
    pub(crate) volume: f64,
    /// Area.
    pub(crate) area: f64,
    /// Integral of the position over the volume.
    pub(crate) moment: Vec3,
}

impl Mass {
    /// Centre of the volume.
    pub(crate) fn centroid(&self) -> Vec3 {
        self.moment / self.volume
    }

    pub(crate) fn sum(parts: impl IntoIterator<Item = Self>) -> Self {
        parts.into_iter().fold(Self::default(), |a, b| Self {
            volume: a.volume + b.volume,
            area: a.area + b.area,
            moment: a.moment + b.moment,
        })
    }
}

/// Integrates faces of one surface.
#[derive(Clone, Debug)]
pub(crate) struct Integrator {
    nodes: Vec<Node>,
}

/// A point of the triangle: its weight, and the values of the basis there.
#[derive(Clone, Debug)]
struct Node {
    weight: f64,
    values: Vec<f64>,
    /// Of the degree-6 triangles of derivatives.
    slopes: Vec<f64>,
}

impl Integrator {
    pub(crate) fn new() -> Self {
        let rule = gauss_legendre(POINTS);
        let mut nodes = Vec::with_capacity(POINTS * POINTS);
        for &(a, weight_a) in &rule {
            for &(b, weight_b) in &rule {
                // The square collapsed into the triangle; its Jacobian is 1 - a.
                let at = [a, (1.0 - a) * (1.0 - b), (1.0 - a) * b];
                nodes.push(Node {
                    weight: weight_a * weight_b * (1.0 - a),
                    values: bernstein(DEGREE, at),
                    slopes: bernstein(DEGREE - 1, at),
                });
            }
        }
        Self { nodes }
    }

    /// Integrals over `faces`; positions are taken from `origin` on, which should be near.
    pub(crate) fn integrate(
        &self,
        patches: &PatchesView<'_>,
        faces: impl Iterator<Item = usize>,
        origin: Vec3,
    ) -> Mass {
        let mut mass = Mass::sum(faces.map(|face| {
            let net = patches.net(face).map(|p| p - origin);
            self.over_patch(&net)
        }));
        mass.moment += mass.volume * origin;
        mass
    }

    fn over_patch(&self, net: &[Vec3; N_CONTROL]) -> Mass {
        let [along, across] = [1, 2].map(|k| derivative(net, k));
        let mut mass = Mass::default();
        for node in &self.nodes {
            let p = combine(&node.values, net);
            let normal = combine(&node.slopes, &along).cross(&combine(&node.slopes, &across));
            let flux = p.dot(&normal);
            mass.area += node.weight * normal.norm();
            mass.volume += node.weight * flux / 3.0;
            // The divergence of p (p . e) is 4 p . e.
            mass.moment += node.weight * flux / 4.0 * p;
        }
        mass
    }
}

/// Net of the derivative from corner 0 towards `corner`.
fn derivative(net: &[Vec3; N_CONTROL], corner: usize) -> [Vec3; n_control(DEGREE - 1)] {
    let mut out = [Vec3::zeros(); n_control(DEGREE - 1)];
    for (slot, e) in exponents(DEGREE - 1).enumerate() {
        let raised = |k: usize| {
            let mut e = e;
            e[k] += 1;
            net[index(e)]
        };
        out[slot] = DEGREE as f64 * (raised(corner) - raised(0));
    }
    out
}

fn combine(weights: &[f64], points: &[Vec3]) -> Vec3 {
    weights.iter().zip(points).fold(Vec3::zeros(), |sum, (w, p)| sum + *w * p)
}

/// Nodes and weights of Gauss and Legendre on [0, 1], by Newton's method.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    let node = |k: usize| {
        let mut x = libm::cos(std::f64::consts::PI * (k as f64 + 0.75) / (count + 0.5));
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, below) = legendre(n, x);
            slope = count * (x * value - below) / (x * x - 1.0);
            let step = value / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// Legendre polynomials of degree `n` and `n - 1` at `x`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut below, mut value) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (below, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * below) / k);
    }
    (value, below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn the_rule_is_exact_to_its_degree() {
        let rule = gauss_legendre(POINTS);
        for degree in [0, 1, 7, 2 * POINTS - 1] {
            let power = |x: f64| (0..degree).fold(1.0, |product, _| product * x);
            let sum: f64 = rule.iter().map(|&(x, weight)| weight * power(x)).sum();
            assert!((sum - 1.0 / (degree as f64 + 1.0)).abs() < 1e-15, "{degree}: {sum}");
        }
    }

    #[test]
    fn volume_and_centroid_do_not_depend_on_the_origin() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let integrator = Integrator::new();
        let ball = integrator.integrate(&view, 0..8, Vec3::zeros());
        let moved = integrator.integrate(&view, 0..8, Vec3::new(1.0, -2.0, 0.5));
        assert!(ball.volume > 1.0 && ball.area > 6.0);
        assert!((ball.volume - moved.volume).abs() < 1e-13 * ball.area);
        assert!((ball.centroid() - moved.centroid()).norm() < 1e-13);
        assert!((ball.area - moved.area).abs() < 1e-13);
    }

    #[test]
    fn a_flat_tetrahedron_has_its_volume_and_centroid() {
        let corners = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let integrator = Integrator::new();
        let mass = Mass::sum(faces.map(|face: [usize; 3]| {
            let net: Vec<Vec3> = isospline_geometry::bezier_triangle::grid(DEGREE)
                .map(|at| (0..3).map(|k| at[k] * corners[face[k]]).sum())
                .collect();
            integrator.over_patch(&net.try_into().unwrap())
        }));
        assert!((mass.volume - 1.0 / 6.0).abs() < 1e-15, "{}", mass.volume);
        assert!((mass.area - 1.5 - 0.75_f64.sqrt()).abs() < 1e-14, "{}", mass.area);
        assert!((mass.centroid() - Vec3::from_element(0.25)).norm() < 1e-14);
    }
}
