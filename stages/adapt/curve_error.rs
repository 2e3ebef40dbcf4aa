//! How far the curve of an edge will be from the surface, before it is fitted.

use crate::vertex::Vertex;
use isospline_fitting::normal_curve::slant::Slant;
use isospline_fitting::normal_curve::{NormalEdge, NormalFit, NormalOptions};
use isospline_fitting::paper_curve::Ends;
use isospline_fitting::shape::apply;
use isospline_geometry::Vec3;
use isospline_geometry::linear::solve;
use isospline_implicit::{Field, Jet1};
use isospline_stage::{Host, map};

/// Inner samples, at `t = 1/6 .. 5/6`: the network stage takes 15, five rank edges as well.
const N_SAMPLES: usize = 5;
/// Steps onto the curvature conditions; they converge by a digit or more a step.
const CONDITION_STEPS: u32 = 4;
/// Change of the unknowns, in chords, after which a further step would only polish.
const CONVERGED: f64 = 1e-7;
/// Tangent lengths, times the chord, that a sound curve has; as in the network stage.
const LENGTH_RANGE: [f64; 2] = [0.08, 0.75];
/// Error, times the chord, of an edge without a sound curve: worse than any other.
const UNSOUND: f64 = 0.1;
/// Edges judged together: 320 points fill the evaluator's blocks and stay in the nearest cache.
const BATCH: usize = 64;
/// Batches a task: fewer cost more to hand out than a second thread gains.
const BATCHES_A_TASK: usize = 2;

/// Eight iterations rank edges as thirty do.
const NORMAL: NormalOptions = NormalOptions { samples: 10, iterations: 8 };
/// Iterations for the few edges that have no sound curve after those: most come to one, and an
/// edge that is taken for hopeless draws faces that others need.
const PATIENT: NormalOptions = NormalOptions { iterations: 40, ..NORMAL };

/// An edge to be judged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JudgedEdge<'a> {
    /// Its two ends.
    pub(crate) ends: [&'a Vertex; 2],
    /// The vertices opposite to it in the face on its left and in that on its right; without them
    /// tangents turn freely.
    pub(crate) wings: Option<[&'a Vertex; 2]>,
}

/// Part of the error by [TK, Eq. (9)] that is added to the normal distance. Normal distance alone
/// lets the inside of patches become the worst place: dodecahedron of 1200 faces 2.7e-8 without
/// it, 7e-9 to 9e-9 with 1e-3 to 1e-2; torus of 600 1.2e-7, with 1e-2 4e-8.
const PARAMETRIC_PART: f64 = 1e-2;

/// How curves will be fitted.
#[derive(Clone, Debug)]
pub(crate) enum Measure {
    /// By [TK, Eq. (9)].
    Paper,
    /// By normal distance.
    Normal(NormalMeasure),
}

/// Fits by normal distance, short and long.
#[derive(Clone, Debug)]
pub(crate) struct NormalMeasure {
    quick: NormalFit,
    patient: NormalFit,
}

impl Measure {
    pub(crate) fn normal() -> Self {
        let (quick, patient) = (NormalFit::new(NORMAL), NormalFit::new(PATIENT));
        Self::Normal(NormalMeasure { quick, patient })
    }

    /// Distance from the surface of the curve between each pair of vertices, in model units; on
    /// the host's threads. An edge without a sound curve, or near which the field is not finite,
    /// has the error `0.1 * chord` at least.
    pub(crate) fn errors(
        &self,
        field: &dyn Field,
        host: &dyn Host,
        edges: &[JudgedEdge<'_>],
    ) -> Vec<f64> {
        let of_batch = |batch: &[JudgedEdge<'_>]| match self {
            Self::Paper => errors_of(field, &batch.iter().map(|e| e.ends).collect::<Vec<_>>()),
            Self::Normal(fit) => normal_errors_of(fit, field, batch),
        };
        let tasks: Vec<_> = edges.chunks(BATCH * BATCHES_A_TASK).collect();
        let judge = |k: usize| -> Vec<f64> { tasks[k].chunks(BATCH).flat_map(of_batch).collect() };
        map(host, tasks.len(), judge).concat()
    }
}

/// Largest normal distance of the curve of each edge, as the network stage will fit it, and
/// [`PARAMETRIC_PART`] of the distance of the curve of the paper.
fn normal_errors_of(fits: &NormalMeasure, field: &dyn Field, edges: &[JudgedEdge<'_>]) -> Vec<f64> {
    let edge = |JudgedEdge { ends, wings }: &JudgedEdge<'_>| NormalEdge {
        ends: Ends {
            points: ends.map(|v| v.position),
            normals: ends.map(|v| v.normal),
            shapes: ends.map(|v| v.shape),
        },
        slants: wings.map_or([Slant::free(); 2], |wings| slants(ends, &wings)),
    };
    let given: Vec<NormalEdge> = edges.iter().map(edge).collect();
    let fitted = |fit: &NormalFit, given: &[NormalEdge]| {
        fit.fit(field, given, &vec![None; given.len()]).into_iter().map(|c| c.map(|c| c.error))
    };
    let mut normal: Vec<Option<f64>> = fitted(&fits.quick, &given).collect();
    let hard: Vec<usize> = (0..given.len()).filter(|&i| normal[i].is_none()).collect();
    let again: Vec<NormalEdge> = hard.iter().map(|&i| given[i]).collect();
    for (i, error) in hard.into_iter().zip(fitted(&fits.patient, &again)) {
        normal[i] = error;
    }
    let parametric = errors_of(field, &edges.iter().map(|e| e.ends).collect::<Vec<_>>());
    // Without a curve that of the paper stays.
    let sum = |(normal, parametric): (Option<f64>, f64)| {
        normal.map_or(parametric, |normal| normal + PARAMETRIC_PART * parametric)
    };
    normal.into_iter().zip(parametric).map(sum).collect()
}

fn slants([a, b]: &[&Vertex; 2], [left, right]: &[&Vertex; 2]) -> [Slant; 2] {
    let at = |o: &Vertex, far: &Vertex, ccw: &Vertex, cw: &Vertex| {
        let from = |v: &Vertex| v.position - o.position;
        Slant::between(&from(far), &from(ccw), &from(cw), &o.normal)
    };
    [at(a, b, left, right), at(b, a, right, left)]
}

/// Largest distance from the surface of the quartic between each pair of vertices, in model units.
///
/// The quartic has position, tangent plane and normal curvature of the surface at both ends and is
/// the nearest such curve to the projected chord [TK, Eq. (9)]: what the network stage will fit,
/// from fewer samples. Fifteen gradient evaluations an edge.
fn errors_of(field: &dyn Field, edges: &[[&Vertex; 2]]) -> Vec<f64> {
    let samples = Samples::new();
    let chord_point = |[p, q]: &[&Vertex; 2], t: f64| p.position + t * (q.position - p.position);
    let mut points: Vec<Vec3> =
        edges.iter().flat_map(|e| samples.places.map(|t| chord_point(e, t))).collect();
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    for _ in 0..2 {
        field.gradients(&points, &mut jets);
        for (p, jet) in points.iter_mut().zip(&jets) {
            *p -= jet.value / jet.gradient.norm_squared() * jet.gradient;
        }
    }
    let mut sound = Vec::with_capacity(edges.len());
    for (ends, targets) in edges.iter().zip(points.as_chunks_mut::<N_SAMPLES>().0) {
        let curve = samples.quartic(ends, targets);
        sound.push(curve.is_some());
        let q = curve.unwrap_or([ends[0].position; 5]);
        *targets = samples.weights.map(|w| (0..5).map(|i| w[i] * q[i]).sum());
    }
    field.gradients(&points, &mut jets);
    let judged = edges.iter().zip(sound).zip(jets.as_chunks::<N_SAMPLES>().0);
    judged.map(|((ends, sound), jets)| error_of(ends, sound, jets)).collect()
}

fn error_of([p, q]: &[&Vertex; 2], sound: bool, jets: &[Jet1; N_SAMPLES]) -> f64 {
    let distance = jets.iter().fold(0.0, |worst: f64, jet| {
        let distance = jet.value.abs() / jet.gradient.norm();
        if distance.is_finite() { worst.max(distance) } else { f64::INFINITY }
    });
    let usable = sound && distance.is_finite();
    if usable { distance } else { UNSOUND * (q.position - p.position).norm() }
}

/// Where curves are sampled, and the sums over the samples that every least-squares fit shares.
struct Samples {
    places: [f64; N_SAMPLES],
    /// Quartic Bernstein polynomials at the places.
    weights: [[f64; 5]; N_SAMPLES],
    /// Sums of products of the polynomials 1, 2 and 3.
    products: [[f64; 3]; 3],
}

/// Unknowns of a curve in units of the chord: tangent lengths `l`, `m` and `q2 - q0`.
#[derive(Clone, Copy, Debug)]
struct Unknowns {
    l: f64,
    m: f64,
    q2: Vec3,
}

impl Unknowns {
    fn dot(&self, other: &Self) -> f64 {
        self.l * other.l + self.m * other.m + self.q2.dot(&other.q2)
    }

    fn minus(&self, factor: f64, other: &Self) -> Self {
        let (l, m) = (self.l - factor * other.l, self.m - factor * other.m);
        Self { l, m, q2: self.q2 - factor * other.q2 }
    }
}

impl Samples {
    fn new() -> Self {
        let places = std::array::from_fn(|k| (k + 1) as f64 / (N_SAMPLES + 1) as f64);
        let weights: [[f64; 5]; N_SAMPLES] = places.map(bernstein_4);
        let product = |i: usize, j: usize| weights.iter().map(|w| w[i + 1] * w[j + 1]).sum();
        let products = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
        Self { places, weights, products }
    }

    /// Control points of the quartic nearest to the targets; `None` if there is no sound one.
    fn quartic(&self, ends: &[&Vertex; 2], targets: &[Vec3; N_SAMPLES]) -> Option<[Vec3; 5]> {
        // symbols: q1 = l t0, q3 = q4 - m t1, k normal curvatures times the chord
        let [q0, q4] = ends.map(|v| v.position);
        let length = (q4 - q0).norm();
        let chord = (q4 - q0) / length;
        let tangent = |v: &Vertex| (chord - v.normal * v.normal.dot(&chord)).try_normalize(1e-6);
        let tangents = [tangent(ends[0])?, tangent(ends[1])?];
        let k = [0, 1].map(|i| length * apply(&ends[i].shape, &tangents[i], &tangents[i]));
        let fit = Fit::new(self, tangents)?;
        let free = fit.solve(&self.pull(&fit, &targets.map(|p| (p - q0) / length), &chord));
        let conditions = Conditions { k, normals: ends.map(|v| v.normal), chord };
        let x = conditions.nearest(&fit, &free)?;
        let in_range = |l: f64| (LENGTH_RANGE[0]..=LENGTH_RANGE[1]).contains(&l);
        let [t0, t1] = tangents;
        let curve = [q0, q0 + length * x.l * t0, q0 + length * x.q2, q4 - length * x.m * t1, q4];
        (in_range(x.l) && in_range(x.m)).then_some(curve)
    }

    /// Right-hand side of the normal equations, targets relative to `q0` in chords.
    fn pull(&self, fit: &Fit<'_>, targets: &[Vec3; N_SAMPLES], chord: &Vec3) -> Unknowns {
        let mut sums = [Vec3::zeros(); 3];
        for (w, target) in self.weights.iter().zip(targets) {
            let offset = target - (w[3] + w[4]) * chord;
            for (sum, weight) in sums.iter_mut().zip(&w[1..4]) {
                *sum += *weight * offset;
            }
        }
        let [t0, t1] = fit.tangents;
        Unknowns { l: t0.dot(&sums[0]), m: -t1.dot(&sums[2]), q2: sums[1] }
    }
}

fn bernstein_4(t: f64) -> [f64; 5] {
    let s = 1.0 - t;
    let (s2, t2) = (s * s, t * t);
    [s2 * s2, 4.0 * s2 * s * t, 6.0 * s2 * t2, 4.0 * s * t2 * t, t2 * t2]
}

/// The normal equations of the curve nearest to the targets, `q2` eliminated:
/// `[s11, -s13 t0 t1, s12 t0; ., s33, -s23 t1; ., ., s22 I]`, `s` the products of [`Samples`].
struct Fit<'a> {
    samples: &'a Samples,
    tangents: [Vec3; 2],
    /// Inverse of the Schur complement of `l` and `m`: diagonal, then the other entry.
    inverse: [f64; 3],
}

impl<'a> Fit<'a> {
    /// `None` if the equations are singular or not finite.
    fn new(samples: &'a Samples, tangents: [Vec3; 2]) -> Option<Self> {
        let [[s11, s12, s13], [_, s22, s23], [_, _, s33]] = samples.products;
        let (a, d) = (s11 - s12 * s12 / s22, s33 - s23 * s23 / s22);
        let b = -(s13 - s12 * s23 / s22) * tangents[0].dot(&tangents[1]);
        let det = a * d - b * b;
        let inverse = [d / det, a / det, -b / det];
        (det > 1e-12 * a * d).then_some(Self { samples, tangents, inverse })
    }

    fn solve(&self, right: &Unknowns) -> Unknowns {
        let [[_, s12, _], [_, s22, s23], _] = self.samples.products;
        let [t0, t1] = self.tangents;
        let (r0, r1) =
            (right.l - s12 / s22 * t0.dot(&right.q2), right.m + s23 / s22 * t1.dot(&right.q2));
        let [i00, i11, i01] = self.inverse;
        let (l, m) = (i00 * r0 + i01 * r1, i01 * r0 + i11 * r1);
        Unknowns { l, m, q2: (right.q2 - s12 * l * t0 + s23 * m * t1) / s22 }
    }
}

/// The curvature conditions `4 l^2 k0 = 3 q2 n0` and `4 m^2 k1 = 3 (q2 - q4) n1`.
struct Conditions {
    k: [f64; 2],
    normals: [Vec3; 2],
    chord: Vec3,
}

impl Conditions {
    /// The curve nearest to the `free` one that meets the conditions.
    fn nearest(&self, fit: &Fit<'_>, free: &Unknowns) -> Option<Unknowns> {
        let mut x = *free;
        for _ in 0..CONDITION_STEPS {
            let next = self.nearest_linearised(fit, free, &x)?;
            let change = next.minus(1.0, &x);
            x = next;
            if change.dot(&change) < CONVERGED * CONVERGED {
                break;
            }
        }
        Some(x)
    }

    /// The curve nearest to the free one that meets the conditions linearised at `x`.
    fn nearest_linearised(&self, fit: &Fit<'_>, free: &Unknowns, x: &Unknowns) -> Option<Unknowns> {
        let [k0, k1] = self.k;
        let [n0, n1] = self.normals;
        // Gradients g of the conditions.
        let g0 = Unknowns { l: 8.0 * x.l * k0, m: 0.0, q2: -3.0 * n0 };
        let g1 = Unknowns { l: 0.0, m: 8.0 * x.m * k1, q2: -3.0 * n1 };
        // Linearised at x: c(x) + g (y - x) with c = g x - 4 l^2 k0, so the value at `free` is:
        let at_free = [
            g0.dot(free) - 4.0 * x.l * x.l * k0,
            g1.dot(free) - 4.0 * x.m * x.m * k1 + 3.0 * self.chord.dot(&n1),
        ];
        let (r0, r1) = (fit.solve(&g0), fit.solve(&g1));
        // Raised a little where both conditions say the same: both then share the load.
        let (d0, d1, mixed) = (g0.dot(&r0), g1.dot(&r1), g0.dot(&r1));
        let y = solve([[d0 * (1.0 + 1e-12), mixed], [mixed, d1 * (1.0 + 1e-12)]], at_free)?;
        Some(free.minus(y[0], &r0).minus(y[1], &r1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex::vertices_at;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    fn between(v: &[Vertex]) -> JudgedEdge<'_> {
        JudgedEdge { ends: [&v[0], &v[1]], wings: None }
    }

    #[test]
    fn on_a_sphere_the_error_falls_with_the_sixth_power_of_the_angle() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let error = |angle: f64| {
            let ends = [Vec3::x(), Vec3::new(angle.cos(), angle.sin(), 0.0)];
            let v = vertices_at(&field, &Serial, &ends).unwrap();
            Measure::Paper.errors(&field, &Serial, &[between(&v)])[0]
        };
        let ratio = error(0.8) / error(0.4);
        assert!(error(0.4) < 1e-5 && error(0.4) > 1e-8, "{}", error(0.4));
        assert!((30.0..140.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn the_normal_distance_is_far_below_the_parametric_one() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let ends = [Vec3::x(), Vec3::new(0.8, 0.6, 0.0)];
        let v = vertices_at(&field, &Serial, &ends).unwrap();
        let error = |measure: Measure| measure.errors(&field, &Serial, &[between(&v)])[0];
        let (normal, paper) = (error(Measure::normal()), error(Measure::Paper));
        assert!(50.0 * normal < paper, "{normal:e} {paper:e}");
    }

    #[test]
    fn a_straight_edge_in_a_plane_has_no_error() {
        let field = ClosureField::new(1.0, |p: Vec3| p.z).with_gradient(|_| Vec3::z());
        let field = field.with_hessian(|_| [0.0; 6]);
        let v = vertices_at(&field, &Serial, &[Vec3::zeros(), Vec3::new(1.0, 2.0, 0.0)]).unwrap();
        assert!(Measure::Paper.errors(&field, &Serial, &[between(&v)])[0] < 1e-16);
    }
}
