//! The curves of [`paper_curve`](crate::paper_curve), eight edges at a time.
//!
//! The steps are those of [`fit_curve`], with the equations solved by their structure: the samples
//! weigh all three coordinates of `q2` alike, which leaves two unknowns and two multipliers. What
//! does not come to a sound curve that way is left to [`fit_curve`], which pivots and has a table.
//
// symbols: x = (l, m, q), q for q2, in chords with the first end at the origin; n, t normals and
// tangents, k curvatures; s sums of products of the polynomials 1, 2, 3; r multipliers
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::curve_samples::Samples;
use crate::lanes::{Lanes, Mask, N, Vectors};
use crate::paper_curve::{
    COINCIDENT, CONDITION_TOLERANCE, Ends, LENGTH_RANGE, Q2_RANGE, SHORTEST_TANGENT,
    STEP_TOLERANCE, Solution, fit_curve,
};
use isospline_artifact::kinds::CurveStatus;
use isospline_geometry::Vec3;
use isospline_implicit::{Kernel, run_widest};

/// Newton-Lagrange steps at most; sound edges need 5.
const MAX_ITERATIONS: u32 = 10;
/// Steps onto the conditions at most; the second or third finds only rounding.
const RESTORING_STEPS: u32 = 6;

/// The curve of each edge, to as many targets an edge as there are samples; `None` where no sound
/// curve meets the conditions. See [`fit_curve`].
pub fn fit_curves(edges: &[Ends], samples: &Samples, targets: &[Vec3]) -> Vec<Option<Solution>> {
    let mut curves = run_widest(Fit { edges, samples, targets });
    let each = edges.iter().zip(targets.chunks_exact(samples.len()));
    for (curve, (ends, targets)) in curves.iter_mut().zip(each) {
        if curve.is_none() {
            *curve = fit_curve(ends, samples, targets);
        }
    }
    curves
}

struct Fit<'a> {
    edges: &'a [Ends],
    samples: &'a Samples,
    targets: &'a [Vec3],
}

impl Kernel for Fit<'_> {
    type Output = Vec<Option<Solution>>;

    #[inline(always)]
    fn run(self) -> Vec<Option<Solution>> {
        let n_samples = self.samples.len();
        let mut curves = Vec::with_capacity(self.edges.len());
        for (edges, targets) in self.edges.chunks(N).zip(self.targets.chunks(N * n_samples)) {
            // Idle lanes hold the last edge.
            let lane = |k: usize| k.min(edges.len() - 1);
            let (frame, is_framed) = Frame::new(|k| &edges[lane(k)]);
            let moments = moments(&frame, self.samples, |k, s| targets[lane(k) * n_samples + s]);
            let (curve, is_sound) = Problem::new(&frame, self.samples, &moments).solve();
            let is_sound = is_sound.and(is_framed);
            curves.extend(
                edges
                    .iter()
                    .enumerate()
                    .map(|(k, ends)| is_sound.0[k].then(|| curve.solution(k, &frame, ends))),
            );
        }
        curves
    }
}

/// Eight edges in their own frames.
struct Frame {
    origin: Vectors,
    chord: Lanes,
    q4: Vectors,
    normals: [Vectors; 2],
    tangents: [Vectors; 2],
    curvatures: [Lanes; 2],
}

impl Frame {
    /// And where the chord has a direction in both tangent planes.
    #[inline(always)]
    fn new<'e>(edge: impl Fn(usize) -> &'e Ends) -> (Self, Mask) {
        let [origin, end] = [0, 1].map(|end| Vectors::of(|k| edge(k).points[end]));
        let normals = [0, 1].map(|end| Vectors::of(|k| edge(k).normals[end]));
        let chord = (end - origin).norm();
        let q4 = (end - origin).over(chord);
        let mut is_framed = Mask([true; N]);
        let mut tangents = [Vectors::ZERO; 2];
        let mut curvatures = [Lanes::all(0.0); 2];
        for end in 0..2 {
            let along = q4 - normals[end].times(q4.dot(normals[end]));
            let size = along.norm();
            is_framed = is_framed.and(size.is(chord, |size, _| size > SHORTEST_TANGENT));
            tangents[end] = along.over(size);
            let mut shape = [Lanes::all(0.0); 6];
            for k in 0..N {
                for (lanes, m) in shape.iter_mut().zip(edge(k).shapes[end]) {
                    lanes.0[k] = m;
                }
            }
            curvatures[end] = chord * tangents[end].form(&shape);
        }
        (Self { origin, chord, q4, normals, tangents, curvatures }, is_framed)
    }

    /// The two conditions, zero on feasible curves.
    #[inline(always)]
    fn conditions(&self, x: &Unknowns) -> [Lanes; 2] {
        let [k0, k1] = self.curvatures;
        [
            4.0 * x.l * x.l * k0 - 3.0 * x.q.dot(self.normals[0]),
            4.0 * x.m * x.m * k1 - 3.0 * (x.q - self.q4).dot(self.normals[1]),
        ]
    }
}

/// Sums over the samples of the polynomials 1, 2, 3 times what is known of a curve less the target.
#[inline(always)]
fn moments(
    frame: &Frame,
    samples: &Samples,
    target: impl Fn(usize, usize) -> Vec3,
) -> [Vectors; 3] {
    let mut sums = [Vectors::ZERO; 3];
    for (s, w) in samples.weights().iter().enumerate() {
        let local = (Vectors::of(|k| target(k, s)) - frame.origin).over(frame.chord);
        let offset = frame.q4.times(Lanes::all(w[3] + w[4])) - local;
        for (sum, weight) in sums.iter_mut().zip(&w[1..4]) {
            *sum = *sum + offset.times(Lanes::all(*weight));
        }
    }
    sums
}

/// Unknowns of eight curves.
#[derive(Clone, Copy)]
struct Unknowns {
    l: Lanes,
    m: Lanes,
    q: Vectors,
}

impl Unknowns {
    #[inline(always)]
    fn plus(&self, step: &Self) -> Self {
        Self { l: self.l + step.l, m: self.m + step.m, q: self.q + step.q }
    }

    #[inline(always)]
    fn size(&self) -> Lanes {
        (self.l * self.l + self.m * self.m + self.q.dot(self.q)).map(f64::sqrt)
    }

    /// The first where a mask says yes.
    #[inline(always)]
    fn picked(mask: Mask, yes: &Self, no: &Self) -> Self {
        let (l, m) = (mask.pick(yes.l, no.l), mask.pick(yes.m, no.m));
        Self { l, m, q: mask.pick_vectors(yes.q, no.q) }
    }
}

/// Eight curves in their frames.
struct Curves {
    x: Unknowns,
    residual: Lanes,
    iterations: Lanes,
}

impl Curves {
    #[inline(always)]
    fn solution(&self, k: usize, frame: &Frame, ends: &Ends) -> Solution {
        let chord = frame.chord.0[k];
        let [t0, t1] = frame.tangents.map(|t| t.get(k));
        let (l, m) = (chord * self.x.l.0[k], chord * self.x.m.0[k]);
        let [a, b] = ends.points;
        Solution {
            inner: [a + l * t0, a + chord * self.x.q.get(k), b - m * t1],
            tangent: [l, m],
            residual: self.residual.0[k],
            iterations: self.iterations.0[k] as u32,
            status: CurveStatus::Converged,
        }
    }
}

/// The least-squares problems `A x + g = 0` of eight edges, and their conditions;
/// `A = [s11, -s13 t0 t1, s12 t0; ., s33, -s23 t1; ., ., s22 I]`.
struct Problem<'a> {
    frame: &'a Frame,
    s: [[f64; 3]; 3],
    /// `t0 . t1`.
    turn: Lanes,
    g: Unknowns,
}

impl<'a> Problem<'a> {
    #[inline(always)]
    fn new(frame: &'a Frame, samples: &Samples, moments: &[Vectors; 3]) -> Self {
        let [t0, t1] = frame.tangents;
        let [m0, m1, m2] = *moments;
        let g = Unknowns { l: m0.dot(t0), m: m2.dot(t1).map(|x| -x), q: m1 };
        Self { frame, s: samples.products(), turn: t0.dot(t1), g }
    }

    /// The curves, and which are sound.
    #[inline(always)]
    fn solve(&self) -> (Curves, Mask) {
        let free = self.free();
        let (x, iterations, has_converged) = self.newton_lagrange(&free);
        let (x, residual) = self.restored(x);
        let in_range = |x: Lanes| x.is(x, |x, _| (LENGTH_RANGE[0]..=LENGTH_RANGE[1]).contains(&x));
        let is_met = residual.is(residual, |r, _| r <= CONDITION_TOLERANCE);
        let shift = (x.q - free.q).norm();
        let is_near = shift.is(shift, |shift, _| shift <= Q2_RANGE);
        let is_sound = has_converged.and(is_met).and(is_near);
        let is_sound = is_sound.and(in_range(x.l)).and(in_range(x.m));
        (Curves { x, residual, iterations }, is_sound)
    }

    /// Solutions of the equations without conditions.
    #[inline(always)]
    fn free(&self) -> Unknowns {
        let [[_, s12, _], [_, s22, s23], _] = self.s;
        let [t0, t1] = self.frame.tangents;
        let (a, b, d) = self.schur();
        let right = [
            (s12 / s22) * t0.dot(self.g.q) - self.g.l,
            Lanes::all(0.0) - self.g.m - (s23 / s22) * t1.dot(self.g.q),
        ];
        let [l, m] = solve_2(&[[Lanes::all(a), b], [b, Lanes::all(d)]], right);
        let q = t1.times(s23 * m) - t0.times(s12 * l) - self.g.q;
        Unknowns { l, m, q: q.over(Lanes::all(s22)) }
    }

    /// `A` with `q` eliminated: diagonal entry, the other, and the second of the diagonal.
    #[inline(always)]
    fn schur(&self) -> (f64, Lanes, f64) {
        let [[s11, s12, s13], [_, s22, s23], [_, _, s33]] = self.s;
        let mixed = -(s13 - s12 * s23 / s22);
        (s11 - s12 * s12 / s22, mixed * self.turn, s33 - s23 * s23 / s22)
    }

    /// Newton's method on the optimality conditions [TK, Alg. 5.1], the number of its steps, and
    /// where it has come to an end.
    #[inline(always)]
    fn newton_lagrange(&self, free: &Unknowns) -> (Unknowns, Lanes, Mask) {
        let (mut x, mut r) = (*free, [Lanes::all(0.0); 2]);
        let mut iterations = Lanes::all(0.0);
        let mut is_open = Mask([true; N]);
        for _ in 0..MAX_ITERATIONS {
            let (step, multipliers) = self.step(&x, r);
            let turns = [multipliers[0] - r[0], multipliers[1] - r[1]];
            let turn = (turns[0] * turns[0] + turns[1] * turns[1]).map(f64::sqrt);
            let change = step.size() + turn;
            // Lanes that have come to an end stay as they are.
            x = Unknowns::picked(is_open, &x.plus(&step), &x);
            iterations = is_open.pick(iterations.map(|n| n + 1.0), iterations);
            r = multipliers;
            let has_ended = change.is(change, |change, _| change < STEP_TOLERANCE);
            is_open = is_open.and(has_ended.not());
            if !is_open.any() {
                break;
            }
        }
        (x, iterations, is_open.not())
    }

    /// Steps of the unknowns and new multipliers [TK, Eq. (11)], `q` and then the lengths
    /// eliminated: `P d - Q^T r = b`, `Q d + W r = h` for the steps `d` of the lengths.
    #[inline(always)]
    fn step(&self, x: &Unknowns, r: [Lanes; 2]) -> (Unknowns, [Lanes; 2]) {
        let [[s11, s12, s13], [_, s22, s23], [_, _, s33]] = self.s;
        let ([t0, t1], [n0, n1]) = (self.frame.tangents, self.frame.normals);
        let [k0, k1] = self.frame.curvatures;
        let conditions = self.frame.conditions(x);
        // Half the gradient of the squared distance.
        let mixed = -s13 * self.turn;
        let gl = self.g.l + s11 * x.l + mixed * x.m + s12 * t0.dot(x.q);
        let gm = self.g.m + mixed * x.l + s33 * x.m - s23 * t1.dot(x.q);
        let gq = self.g.q + t0.times(s12 * x.l) - t1.times(s23 * x.m) + x.q.times(Lanes::all(s22));
        // The step of q with the lengths and without multipliers.
        let e = gq.times(Lanes::all(-1.0 / s22));
        let (alpha, beta, gamma) = (s12 / s22, s23 / s22, 1.5 / s22);
        let (a, b, d) = self.schur();
        let p00 = (8.0 * r[0] * k0).map(|bend| 2.0 * a - bend);
        let p11 = (8.0 * r[1] * k1).map(|bend| 2.0 * d - bend);
        let p01 = 2.0 * b;
        let b = [-2.0 * (gl + s12 * t0.dot(e)), 2.0 * (s23 * t1.dot(e) - gm)];
        let q00 = 8.0 * x.l * k0;
        let q01 = (-3.0 * beta) * n0.dot(t1);
        let q10 = (3.0 * alpha) * n1.dot(t0);
        let q11 = 8.0 * x.m * k1;
        let h = [3.0 * n0.dot(e) - conditions[0], 3.0 * n1.dot(e) - conditions[1]];
        let p = [[p00, p01], [p01, p11]];
        // P^-1 b and the columns of P^-1 Q^T.
        let [bl, bm] = solve_2(&p, b);
        let [y00, y01] = solve_2(&p, [q00, q01]);
        let [y10, y11] = solve_2(&p, [q10, q11]);
        let w = (3.0 * gamma) * n0.dot(n1);
        let own = Lanes::all(3.0 * gamma + COINCIDENT);
        let s = [
            [own + q00 * y00 + q01 * y01, w + q00 * y10 + q01 * y11],
            [w + q10 * y00 + q11 * y01, own + q10 * y10 + q11 * y11],
        ];
        let [r0, r1] = solve_2(&s, [h[0] - q00 * bl - q01 * bm, h[1] - q10 * bl - q11 * bm]);
        let (l, m) = (bl + y00 * r0 + y10 * r1, bm + y01 * r0 + y11 * r1);
        let q = e - t0.times(alpha * l) + t1.times(beta * m);
        let q = q - n0.times(gamma * r0) - n1.times(gamma * r1);
        (Unknowns { l, m, q }, [r0, r1])
    }

    /// Least-norm Newton steps onto the conditions, and what is left of them.
    #[inline(always)]
    fn restored(&self, mut x: Unknowns) -> (Unknowns, Lanes) {
        let [n0, n1] = self.frame.normals;
        let [k0, k1] = self.frame.curvatures;
        let mixed = 9.0 * n0.dot(n1);
        let mut c = self.frame.conditions(&x);
        let mut residual = largest(c);
        for _ in 0..RESTORING_STEPS {
            let (gl, gm) = (8.0 * x.l * k0, 8.0 * x.m * k1);
            let raised = |g: Lanes, n: Vectors| {
                (g * g + 9.0 * n.dot(n)).map(|square| square * (1.0 + COINCIDENT))
            };
            let [y0, y1] = solve_2(&[[raised(gl, n0), mixed], [mixed, raised(gm, n1)]], c);
            let q = x.q + n0.times(3.0 * y0) + n1.times(3.0 * y1);
            let next = Unknowns { l: x.l - y0 * gl, m: x.m - y1 * gm, q };
            let c_next = self.frame.conditions(&next);
            let left = largest(c_next);
            let is_better = left.is(residual, |left, residual| left < residual);
            if !is_better.any() {
                break;
            }
            x = Unknowns::picked(is_better, &next, &x);
            c = [0, 1].map(|i| is_better.pick(c_next[i], c[i]));
            residual = is_better.pick(left, residual);
        }
        (x, residual)
    }
}

#[inline(always)]
fn largest([a, b]: [Lanes; 2]) -> Lanes {
    a.with(b, |a, b| if a.abs() > b.abs() { a.abs() } else { b.abs() })
}

/// Solves `A x = b`; what is singular leads to numbers that are not finite.
#[inline(always)]
fn solve_2(a: &[[Lanes; 2]; 2], b: [Lanes; 2]) -> [Lanes; 2] {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [(a[1][1] * b[0] - a[0][1] * b[1]) / det, (a[0][0] * b[1] - a[1][0] * b[0]) / det]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edges on a sphere, the last ones too long for a sound curve, and their targets.
    fn sphere_edges(samples: &Samples) -> (Vec<Ends>, Vec<Vec3>) {
        let shape = |n: &Vec3| {
            [n.x * n.x - 1.0, n.x * n.y, n.x * n.z, n.y * n.y - 1.0, n.y * n.z, n.z * n.z - 1.0]
        };
        let edge = |k: usize| {
            let turn = if k < 9 { 0.1 + 0.07 * k as f64 } else { 1.9 };
            let points = [0.3, 0.3 + turn].map(|a: f64| Vec3::new(a.cos(), a.sin(), 0.0));
            Ends { points, normals: points, shapes: points.map(|p| shape(&p)) }
        };
        let edges: Vec<Ends> = (0..11).map(edge).collect();
        let bumpy = |ends: &Ends, t: f64| {
            let [a, b] = ends.points;
            (a + t * (b - a)).normalize() * (1.0 + 1e-3 * (9.0 * t).sin())
        };
        let of = |ends: &Ends| samples.parameters().map(|t| bumpy(ends, t)).collect::<Vec<_>>();
        let targets = edges.iter().flat_map(of).collect();
        (edges, targets)
    }

    #[test]
    fn curves_fitted_together_are_those_fitted_alone() {
        let samples = Samples::new(17);
        let (edges, targets) = sphere_edges(&samples);
        let together = fit_curves(&edges, &samples, &targets);
        assert_eq!(together.len(), edges.len());
        for ((ends, targets), curve) in
            edges.iter().zip(targets.chunks(samples.len())).zip(together)
        {
            let alone = fit_curve(ends, &samples, targets).unwrap();
            let curve = curve.unwrap();
            assert_eq!(curve.status, alone.status);
            assert!(curve.residual <= 1e-15, "{:e}", curve.residual);
            for (a, b) in curve.inner.iter().zip(&alone.inner) {
                assert!((a - b).norm() < 1e-11, "{:e}", (a - b).norm());
            }
        }
    }

    #[test]
    fn edges_on_a_plane_stay_straight() {
        let samples = Samples::new(17);
        let ends = Ends {
            points: [Vec3::zeros(), 2.0 * Vec3::x()],
            normals: [Vec3::z(), Vec3::z()],
            shapes: [[0.0; 6]; 2],
        };
        let targets: Vec<Vec3> = samples.parameters().map(|t| t * 2.0 * Vec3::x()).collect();
        let curve = fit_curves(&[ends], &samples, &targets)[0].unwrap();
        for (k, q) in curve.inner.iter().enumerate() {
            assert!((q - 0.5 * (k as f64 + 1.0) * Vec3::x()).norm() < 1e-14);
        }
    }
}
