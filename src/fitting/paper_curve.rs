//! One edge: a quartic with given end points, tangent planes and normal curvatures.
//!
//! Everything happens in units of the chord, with the first end at the origin: slivers would
//! otherwise cost digits.
//
// symbols: x = (l, m, q2), q1 = l t0, q3 = q4 - m t1; k0, k1 normal curvatures times the chord

use crate::curve_samples::Samples;
use crate::shape::apply;
use isospline_artifact::kinds::CurveStatus;
use isospline_geometry::Vec3;
use isospline_geometry::linear::solve;
use isospline_implicit::SymMat3;

/// Newton-Lagrange steps at most; 2.4 are needed on average, 5 at most on sound edges.
const MAX_ITERATIONS: u32 = 30;
/// The paper's stop: change of unknowns and multipliers.
pub(crate) const STEP_TOLERANCE: f64 = 1e-6;
/// Scaled residual of the curvature conditions at the end; a residual `c` costs about `50 c`
/// degrees of G1 angle.
pub(crate) const CONDITION_TOLERANCE: f64 = 1e-13;
/// Tangent lengths outside this range, times the chord, come only from bad base edges.
pub(crate) const LENGTH_RANGE: [f64; 2] = [0.08, 0.75];
/// Lets conditions that coincide (equal normals on planes and along rulings) be solved: both
/// multipliers then share the load. Small beside the squared turn of normals that matter.
pub(crate) const COINCIDENT: f64 = 1e-13;
/// Farthest place of `q2` from where least squares without conditions puts it, times the chord;
/// sound edges stay below 0.1. Where curvature starts inside an edge, at the rim of a plane say,
/// the conditions may be met far to the side only.
pub(crate) const Q2_RANGE: f64 = 0.25;
/// The same for curves from the table: beyond it the edge has no curve.
const Q2_LIMIT: f64 = 1.0;
/// Chord in a tangent plane, of the chord, below which an edge has no direction there.
pub(crate) const SHORTEST_TANGENT: f64 = 1e-6;
/// Tangent lengths tried, at both ends, where the iteration finds no sound curve: short ones need
/// less room for `q2`.
const TABLE: [f64; 8] = [0.25, 0.18, 0.12, 0.08, 0.05, 0.03, 0.35, 0.5];

/// What a curve interpolates.
#[derive(Clone, Copy, Debug)]
pub struct Ends {
    /// End points.
    pub points: [Vec3; 2],
    /// Outward unit normals there.
    pub normals: [Vec3; 2],
    /// Second fundamental forms there, 1/length.
    pub shapes: [SymMat3; 2],
}

/// A fitted curve in model units.
#[derive(Clone, Copy, Debug)]
pub struct Solution {
    /// q1, q2, q3.
    pub inner: [Vec3; 3],
    /// Tangent lengths at both ends.
    pub tangent: [f64; 2],
    /// Largest scaled residual of the curvature conditions.
    pub residual: f64,
    /// Newton-Lagrange steps.
    pub iterations: u32,
    /// How it was found.
    pub status: CurveStatus,
}

/// Fits the curve to `targets`, one for each inner sample.
///
/// Minimises the squared distances subject to `4 l^2 k0 = 3 (q2 - q0) . N0` and
/// `4 m^2 k1 = 3 (q2 - q4) . N1` [TK, Eq. (9); Eq. (7) with `q3 = q4 - m t1`]. Where that leads to
/// lengths out of range or a `q2` far to the side, the best of a table of lengths is taken. `None`
/// where no sound curve meets the conditions.
pub fn fit_curve(ends: &Ends, samples: &Samples, targets: &[Vec3]) -> Option<Solution> {
    let edge = Edge::new(ends)?;
    let equations = NormalEquations::new(&edge, samples, targets);
    let free = solve(equations.a, equations.g.map(|g| -g))?;
    let (x, iterations) = newton_lagrange(&edge, &equations, free);
    let in_range = |l: f64| (LENGTH_RANGE[0]..=LENGTH_RANGE[1]).contains(&l);
    let sound = x
        .and_then(|x| edge.restore(x))
        .filter(|x| in_range(x[0]) && in_range(x[1]) && shift(x, &free) <= Q2_RANGE);
    let (x, status) = match sound {
        Some(x) => (x, CurveStatus::Converged),
        None => (from_table(&edge, &equations, &free)?, CurveStatus::Clamped),
    };
    Some(edge.solution(ends, &x, iterations, status))
}

/// Distance between the `q2` of two curves.
fn shift(x: &Unknowns, y: &Unknowns) -> f64 {
    norm(&[x[2] - y[2], x[3] - y[3], x[4] - y[4]])
}

/// Unknowns `[l, m, q2.x, q2.y, q2.z]`, times the chord.
type Unknowns = [f64; 5];

/// An edge in its own frame.
struct Edge {
    origin: Vec3,
    chord: f64,
    q4: Vec3,
    normals: [Vec3; 2],
    tangents: [Vec3; 2],
    curvatures: [f64; 2],
}

impl Edge {
    /// `None` if the chord is normal to a tangent plane or has no length.
    fn new(ends: &Ends) -> Option<Self> {
        let d = ends.points[1] - ends.points[0];
        let chord = d.norm();
        let q4 = d / chord;
        let tangent = |n: &Vec3| (q4 - q4.dot(n) * n).try_normalize(SHORTEST_TANGENT);
        let tangents = [tangent(&ends.normals[0])?, tangent(&ends.normals[1])?];
        let curvature = |k: usize| chord * apply(&ends.shapes[k], &tangents[k], &tangents[k]);
        Some(Self {
            origin: ends.points[0],
            chord,
            q4,
            normals: ends.normals,
            tangents,
            curvatures: [curvature(0), curvature(1)],
        })
    }

    fn local(&self, target: &Vec3) -> Vec3 {
        (target - self.origin) / self.chord
    }

    /// The two conditions, zero on a feasible curve.
    fn conditions(&self, x: &Unknowns) -> [f64; 2] {
        let q2 = Vec3::new(x[2], x[3], x[4]);
        [
            4.0 * x[0] * x[0] * self.curvatures[0] - 3.0 * q2.dot(&self.normals[0]),
            4.0 * x[1] * x[1] * self.curvatures[1] - 3.0 * (q2 - self.q4).dot(&self.normals[1]),
        ]
    }

    /// Gradients of the two conditions.
    fn condition_gradients(&self, x: &Unknowns) -> [Unknowns; 2] {
        let [n0, n1] = &self.normals;
        [
            [8.0 * x[0] * self.curvatures[0], 0.0, -3.0 * n0.x, -3.0 * n0.y, -3.0 * n0.z],
            [0.0, 8.0 * x[1] * self.curvatures[1], -3.0 * n1.x, -3.0 * n1.y, -3.0 * n1.z],
        ]
    }

    /// Least-norm Newton steps onto the conditions.
    fn restore(&self, mut x: Unknowns) -> Option<Unknowns> {
        const STEPS: u32 = 10;
        for _ in 0..STEPS {
            let c = self.conditions(&x);
            let g = self.condition_gradients(&x);
            let dot = |a: &Unknowns, b: &Unknowns| (0..5).map(|i| a[i] * b[i]).sum::<f64>();
            let mixed = dot(&g[0], &g[1]);
            let raised = |k: usize| dot(&g[k], &g[k]) * (1.0 + COINCIDENT);
            let y = solve([[raised(0), mixed], [mixed, raised(1)]], c)?;
            let next: Unknowns = std::array::from_fn(|i| x[i] - y[0] * g[0][i] - y[1] * g[1][i]);
            if largest(&self.conditions(&next)) >= largest(&c) {
                break;
            }
            x = next;
        }
        (largest(&self.conditions(&x)) <= CONDITION_TOLERANCE).then_some(x)
    }

    fn solution(
        &self,
        ends: &Ends,
        x: &Unknowns,
        iterations: u32,
        status: CurveStatus,
    ) -> Solution {
        let [a, b] = ends.points;
        let (l, m) = (self.chord * x[0], self.chord * x[1]);
        let q2 = a + self.chord * Vec3::new(x[2], x[3], x[4]);
        Solution {
            inner: [a + l * self.tangents[0], q2, b - m * self.tangents[1]],
            tangent: [l, m],
            residual: largest(&self.conditions(x)),
            iterations,
            status,
        }
    }
}

/// `A x + g = 0`: the least-squares problem without conditions [TK, Eq. (9a)].
struct NormalEquations {
    a: [[f64; 5]; 5],
    g: Unknowns,
}

impl NormalEquations {
    fn new(edge: &Edge, samples: &Samples, targets: &[Vec3]) -> Self {
        let [t0, t1] = &edge.tangents;
        let mut sums = [[0.0; 3]; 3];
        let mut moments = [Vec3::zeros(); 3];
        for (w, target) in samples.weights().iter().zip(targets) {
            let offset = (w[3] + w[4]) * edge.q4 - edge.local(target);
            for i in 0..3 {
                for j in 0..3 {
                    sums[i][j] += w[i + 1] * w[j + 1];
                }
                moments[i] += w[i + 1] * offset;
            }
        }
        let mut a = [[0.0; 5]; 5];
        a[0][0] = sums[0][0];
        a[1][1] = sums[2][2];
        a[0][1] = -sums[0][2] * t0.dot(t1);
        a[1][0] = a[0][1];
        for k in 0..3 {
            a[0][2 + k] = sums[0][1] * t0[k];
            a[1][2 + k] = -sums[2][1] * t1[k];
            a[2 + k][0] = a[0][2 + k];
            a[2 + k][1] = a[1][2 + k];
            a[2 + k][2 + k] = sums[1][1];
        }
        let q2 = moments[1];
        let g = [moments[0].dot(t0), -moments[2].dot(t1), q2.x, q2.y, q2.z];
        Self { a, g }
    }

    /// Squared distance of `x` beyond that of the least-squares solution `free`.
    fn excess(&self, x: &Unknowns, free: &Unknowns) -> f64 {
        let d: Unknowns = std::array::from_fn(|i| x[i] - free[i]);
        (0..5).map(|i| (0..5).map(|j| d[i] * self.a[i][j] * d[j]).sum::<f64>()).sum()
    }

    /// Half the gradient of the squared distance.
    fn gradient(&self, x: &Unknowns) -> Unknowns {
        std::array::from_fn(|i| self.g[i] + (0..5).map(|j| self.a[i][j] * x[j]).sum::<f64>())
    }
}

/// Newton's method on the optimality conditions [TK, Alg. 5.1]. Returns the last iterate, if all
/// solves succeeded, and the number of steps.
fn newton_lagrange(
    edge: &Edge,
    equations: &NormalEquations,
    start: Unknowns,
) -> (Option<Unknowns>, u32) {
    let mut x = start;
    let mut r = [0.0; 2];
    for iteration in 0..MAX_ITERATIONS {
        let Some((step, multipliers)) = kkt_step(edge, equations, &x, r) else {
            return (None, iteration);
        };
        let change = norm(&step) + norm(&[multipliers[0] - r[0], multipliers[1] - r[1]]);
        x = std::array::from_fn(|i| x[i] + step[i]);
        r = multipliers;
        if change < STEP_TOLERANCE {
            return (Some(x), iteration + 1);
        }
    }
    (Some(x), MAX_ITERATIONS)
}

/// Step of the unknowns and new multipliers [TK, Eq. (11)].
fn kkt_step(
    edge: &Edge,
    equations: &NormalEquations,
    x: &Unknowns,
    r: [f64; 2],
) -> Option<(Unknowns, [f64; 2])> {
    let gradients = edge.condition_gradients(x);
    let conditions = edge.conditions(x);
    let mut matrix = [[0.0; 7]; 7];
    let mut rhs = [0.0; 7];
    let gradient = equations.gradient(x);
    for i in 0..5 {
        for j in 0..5 {
            matrix[i][j] = 2.0 * equations.a[i][j];
        }
        for k in 0..2 {
            matrix[i][5 + k] = -gradients[k][i];
            matrix[5 + k][i] = gradients[k][i];
        }
        rhs[i] = -2.0 * gradient[i];
    }
    for k in 0..2 {
        matrix[k][k] -= 8.0 * r[k] * edge.curvatures[k];
        matrix[5 + k][5 + k] = COINCIDENT;
        rhs[5 + k] = -conditions[k];
    }
    let s = solve(matrix, rhs)?;
    Some(([s[0], s[1], s[2], s[3], s[4]], [s[5], s[6]]))
}

/// The curve with lengths from the table that is best in distance and in the place of `q2`.
fn from_table(edge: &Edge, equations: &NormalEquations, free: &Unknowns) -> Option<Unknowns> {
    let pairs = TABLE.iter().flat_map(|&l| TABLE.iter().map(move |&m| (l, m)));
    let curves = pairs.filter_map(|(l, m)| with_lengths(edge, equations, l, m));
    let near = curves.filter(|x| shift(x, free) <= Q2_LIMIT);
    let cost = |x: &Unknowns| equations.excess(x, free) + shift(x, free) * shift(x, free);
    near.min_by(|x, y| cost(x).total_cmp(&cost(y)))
}

/// The best `q2` for these lengths: the two conditions are linear in it.
fn with_lengths(edge: &Edge, equations: &NormalEquations, l: f64, m: f64) -> Option<Unknowns> {
    let [n0, n1] = &edge.normals;
    let mut matrix = [[0.0; 5]; 5];
    let mut rhs = [0.0; 5];
    let fixed = equations.gradient(&[l, m, 0.0, 0.0, 0.0]);
    for k in 0..3 {
        matrix[k][k] = equations.a[2][2];
        rhs[k] = -fixed[2 + k];
        matrix[k][3] = n0[k];
        matrix[k][4] = n1[k];
        matrix[3][k] = n0[k];
        matrix[4][k] = n1[k];
    }
    rhs[3] = 4.0 / 3.0 * l * l * edge.curvatures[0];
    rhs[4] = 4.0 / 3.0 * m * m * edge.curvatures[1] + edge.q4.dot(n1);
    matrix[3][3] = -COINCIDENT;
    matrix[4][4] = -COINCIDENT;
    let s = solve(matrix, rhs)?;
    edge.restore([l, m, s[0], s[1], s[2]])
}

fn largest(c: &[f64; 2]) -> f64 {
    c[0].abs().max(c[1].abs())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere_edge(turn: f64) -> (Ends, Vec<Vec3>, Samples) {
        let samples = Samples::new(17);
        let points = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(turn.cos(), turn.sin(), 0.0)];
        let shape = |n: &Vec3| {
            [n.x * n.x - 1.0, n.x * n.y, n.x * n.z, n.y * n.y - 1.0, n.y * n.z, n.z * n.z - 1.0]
        };
        let ends = Ends { points, normals: points, shapes: [shape(&points[0]), shape(&points[1])] };
        let on_sphere = |t: f64| (points[0] + t * (points[1] - points[0])).normalize();
        let targets = samples.parameters().map(on_sphere).collect();
        (ends, targets, samples)
    }

    fn distance(ends: &Ends, solution: &Solution, samples: &Samples) -> f64 {
        let [q1, q2, q3] = solution.inner;
        let q = [ends.points[0], q1, q2, q3, ends.points[1]];
        samples.curve_points(&q).map(|p| (p.norm() - 1.0).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn arcs_of_a_sphere_are_fitted_with_order_six_and_their_curvature_is_met() {
        let error = |turn| {
            let (ends, targets, samples) = sphere_edge(turn);
            let solution = fit_curve(&ends, &samples, &targets).unwrap();
            assert_eq!(solution.status, CurveStatus::Converged);
            assert!(solution.residual <= 1e-15);
            distance(&ends, &solution, &samples)
        };
        let (coarse, fine) = (error(0.4), error(0.2));
        assert!(coarse < 1e-5, "{coarse:e}");
        assert!((coarse / fine).log2() > 5.5, "{coarse:e} {fine:e}");
    }

    #[test]
    fn a_curve_does_not_depend_on_the_unit_of_length_or_the_origin() {
        let (mut ends, mut targets, samples) = sphere_edge(0.4);
        let here = fit_curve(&ends, &samples, &targets).unwrap();
        let offset = Vec3::new(3.0, -2.0, 0.5);
        let there = |p: &Vec3| 1e3 * (p + offset);
        targets = targets.iter().map(there).collect();
        ends.points = [there(&ends.points[0]), there(&ends.points[1])];
        ends.shapes = ends.shapes.map(|m| m.map(|x| x / 1e3));
        let scaled = fit_curve(&ends, &samples, &targets).unwrap();
        for (a, b) in here.inner.iter().zip(&scaled.inner) {
            assert!((there(a) - b).norm() < 1e-9);
        }
    }

    #[test]
    fn opposite_curvatures_under_parallel_normals_have_no_curve() {
        let samples = Samples::new(17);
        let ends = Ends {
            points: [Vec3::zeros(), Vec3::x()],
            normals: [Vec3::z(), Vec3::z()],
            shapes: [[2.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-2.0, 0.0, 0.0, 0.0, 0.0, 0.0]],
        };
        let targets: Vec<Vec3> = samples.parameters().map(|t| t * Vec3::x()).collect();
        assert!(fit_curve(&ends, &samples, &targets).is_none());
    }

    #[test]
    fn a_straight_edge_on_a_plane_stays_straight() {
        let samples = Samples::new(17);
        let ends = Ends {
            points: [Vec3::zeros(), 2.0 * Vec3::x()],
            normals: [Vec3::z(), Vec3::z()],
            shapes: [[0.0; 6]; 2],
        };
        let targets: Vec<Vec3> = samples.parameters().map(|t| 2.0 * t * Vec3::x()).collect();
        let solution = fit_curve(&ends, &samples, &targets).unwrap();
        for (k, q) in solution.inner.iter().enumerate() {
            assert!((q - 0.5 * (k as f64 + 1.0) * Vec3::x()).norm() < 1e-14);
        }
    }
}
