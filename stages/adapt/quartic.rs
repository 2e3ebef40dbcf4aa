//! The quartic of [TK, Eq. (9)] from few samples, of eight edges at a time.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::sampled::{N_SAMPLES, Places};
use crate::vertex::Vertex;
use isospline_fitting::lanes::{Lanes, Mask, N, Vectors};
use isospline_implicit::Kernel;

/// Steps onto the curvature conditions; they converge by a digit or more a step.
const CONDITION_STEPS: u32 = 4;
/// Change of the unknowns, in chords, after which a further step would only polish.
const CONVERGED: f64 = 1e-7;
/// Tangent lengths, times the chord, that a sound curve has; as in the network stage.
const LENGTH_RANGE: [f64; 2] = [0.08, 0.75];
/// Chord in the tangent plane, of the chord, below which a curve has no direction.
const SHORTEST_TANGENT: f64 = 1e-6;

/// Where curves are sampled, and the sums over the samples that every least-squares fit shares.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    pub(crate) places: [f64; N_SAMPLES],
    /// Quartic Bernstein polynomials at the places.
    weights: [[f64; 5]; N_SAMPLES],
    /// Sums of products of the polynomials 1, 2 and 3.
    products: [[f64; 3]; 3],
}

impl Samples {
    pub(crate) fn new() -> Self {
        let places = std::array::from_fn(|k| (k + 1) as f64 / (N_SAMPLES + 1) as f64);
        let weights: [[f64; 5]; N_SAMPLES] = places.map(bernstein_4);
        let product = |i: usize, j: usize| weights.iter().map(|w| w[i + 1] * w[j + 1]).sum();
        let products = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
        Self { places, weights, products }
    }
}

fn bernstein_4(t: f64) -> [f64; 5] {
    let s = 1.0 - t;
    let (s2, t2) = (s * s, t * t);
    [s2 * s2, 4.0 * s2 * s * t, 6.0 * s2 * t2, 4.0 * s * t2 * t, t2 * t2]
}

/// Moves samples to the quartic nearest to them that has position, tangent plane and normal
/// curvature of the surface at both ends; where each edge has a sound one.
pub(crate) struct MoveToQuartics<'a> {
    pub(crate) samples: &'a Samples,
    /// Of eight edges each.
    pub(crate) ends: &'a [[End; 2]],
    pub(crate) places: &'a mut Places,
}

impl Kernel for MoveToQuartics<'_> {
    type Output = Vec<Mask>;

    #[inline(always)]
    fn run(self) -> Vec<Mask> {
        let mut sound = Vec::with_capacity(self.ends.len());
        for (group, ends) in self.ends.iter().enumerate() {
            let mut targets = [Vectors::ZERO; N_SAMPLES];
            for (s, target) in targets.iter_mut().enumerate() {
                *target = self.places.row(group, s);
            }
            let (curve, is_sound) = quartic(self.samples, ends, &targets);
            for (s, (target, weights)) in targets.iter().zip(&self.samples.weights).enumerate() {
                let mut point = Vectors::ZERO;
                for (control, &weight) in curve.iter().zip(weights) {
                    point = point + control.times(Lanes::all(weight));
                }
                // Without a curve any place will do at which fields have values.
                self.places.set_row(group, s, is_sound.pick_vectors(point, *target));
            }
            sound.push(is_sound);
        }
        sound
    }
}

/// One end of eight edges.
#[derive(Debug)]
pub(crate) struct End {
    pub(crate) position: Vectors,
    normal: Vectors,
    shape: [Lanes; 6],
}

impl End {
    #[inline(always)]
    pub(crate) fn of<'v>(vertex: impl Fn(usize) -> &'v Vertex) -> Self {
        let mut shape = [Lanes::all(0.0); 6];
        for k in 0..N {
            for (lanes, m) in shape.iter_mut().zip(vertex(k).shape) {
                lanes.0[k] = m;
            }
        }
        let position = Vectors::of(|k| vertex(k).position);
        Self { position, normal: Vectors::of(|k| vertex(k).normal), shape }
    }
}

/// Control points of the quartics nearest to the targets; where there is no sound one any.
#[inline(always)]
fn quartic(
    samples: &Samples,
    ends: &[End; 2],
    targets: &[Vectors; N_SAMPLES],
) -> ([Vectors; 5], Mask) {
    // symbols: q1 = l t0, q3 = q4 - m t1, k normal curvatures times the chord
    let [q0, q4] = [ends[0].position, ends[1].position];
    let chord = q4 - q0;
    let length = chord.norm();
    let chord = chord.over(length);
    let normals = [ends[0].normal, ends[1].normal];
    let (t0, sound0) = tangent(normals[0], chord);
    let (t1, sound1) = tangent(normals[1], chord);
    let k = [length * t0.form(&ends[0].shape), length * t1.form(&ends[1].shape)];
    let (fit, is_regular) = Fit::new(samples, &[t0, t1]);
    let mut along = *targets;
    for point in &mut along {
        *point = (*point - q0).over(length);
    }
    let free = fit.solve(&pull(samples, [t0, t1], &along, chord));
    let (x, is_met) = Conditions { k, normals, chord }.nearest(&fit, &free);
    let in_range = |l: Lanes| l.is(l, |l, _| (LENGTH_RANGE[0]..=LENGTH_RANGE[1]).contains(&l));
    let q1 = q0 + t0.times(length * x.l);
    let q2 = q0 + x.q2.times(length);
    let q3 = q4 - t1.times(length * x.m);
    let is_sound = sound0.and(sound1).and(is_regular).and(is_met);
    ([q0, q1, q2, q3, q4], is_sound.and(in_range(x.l)).and(in_range(x.m)))
}

/// The direction of the chord in the tangent plane, and where there is one.
#[inline(always)]
fn tangent(normal: Vectors, chord: Vectors) -> (Vectors, Mask) {
    let along = chord - normal.times(normal.dot(chord));
    let size = along.norm();
    let is_sound = size.is(Lanes::all(SHORTEST_TANGENT), |size, least| size <= least).not();
    (along.over(size), is_sound)
}

/// Right-hand side of the normal equations, targets relative to `q0` in chords.
#[inline(always)]
fn pull(
    samples: &Samples,
    [t0, t1]: [Vectors; 2],
    targets: &[Vectors; N_SAMPLES],
    chord: Vectors,
) -> Unknowns {
    let mut sums = [Vectors::ZERO; 3];
    for (w, target) in samples.weights.iter().zip(targets) {
        let offset = *target - chord.times(Lanes::all(w[3] + w[4]));
        for (sum, weight) in sums.iter_mut().zip(&w[1..4]) {
            *sum = *sum + offset.times(Lanes::all(*weight));
        }
    }
    Unknowns { l: t0.dot(sums[0]), m: t1.dot(sums[2]).map(|x| -x), q2: sums[1] }
}

/// Unknowns of curves in units of the chord: tangent lengths `l`, `m` and `q2 - q0`.
#[derive(Clone, Copy)]
struct Unknowns {
    l: Lanes,
    m: Lanes,
    q2: Vectors,
}

impl Unknowns {
    #[inline(always)]
    fn dot(&self, other: &Self) -> Lanes {
        self.l * other.l + self.m * other.m + self.q2.dot(other.q2)
    }

    #[inline(always)]
    fn minus(&self, factor: Lanes, other: &Self) -> Self {
        let (l, m) = (self.l - factor * other.l, self.m - factor * other.m);
        Self { l, m, q2: self.q2 - other.q2.times(factor) }
    }

    /// The first where a mask says yes.
    #[inline(always)]
    fn picked(mask: Mask, yes: &Self, no: &Self) -> Self {
        let (l, m) = (mask.pick(yes.l, no.l), mask.pick(yes.m, no.m));
        Self { l, m, q2: yes.q2.with(no.q2, |yes, no| mask.pick(yes, no)) }
    }
}

/// The normal equations of the curves nearest to the targets, `q2` eliminated:
/// `[s11, -s13 t0 t1, s12 t0; ., s33, -s23 t1; ., ., s22 I]`, `s` the products of [`Samples`].
struct Fit<'a> {
    samples: &'a Samples,
    tangents: [Vectors; 2],
    /// Inverse of the Schur complement of `l` and `m`: diagonal, then the other entry.
    inverse: [Lanes; 3],
}

impl<'a> Fit<'a> {
    /// And where the equations are regular.
    #[inline(always)]
    fn new(samples: &'a Samples, tangents: &[Vectors; 2]) -> (Self, Mask) {
        let [[s11, s12, s13], [_, s22, s23], [_, _, s33]] = samples.products;
        let (a, d) = (s11 - s12 * s12 / s22, s33 - s23 * s23 / s22);
        let b = -(s13 - s12 * s23 / s22) * tangents[0].dot(tangents[1]);
        let det = b.map(|b| a * d - b * b);
        let inverse = [det.map(|det| d / det), det.map(|det| a / det), b.map(|b| -b) / det];
        let is_regular = det.is(Lanes::all(1e-12 * a * d), |det, least| det > least);
        (Self { samples, tangents: *tangents, inverse }, is_regular)
    }

    #[inline(always)]
    fn solve(&self, right: &Unknowns) -> Unknowns {
        let [[_, s12, _], [_, s22, s23], _] = self.samples.products;
        let [t0, t1] = self.tangents;
        let r0 = right.l - (s12 / s22) * t0.dot(right.q2);
        let r1 = right.m + (s23 / s22) * t1.dot(right.q2);
        let [i00, i11, i01] = self.inverse;
        let (l, m) = (i00 * r0 + i01 * r1, i01 * r0 + i11 * r1);
        let q2 = right.q2 - t0.times(s12 * l) + t1.times(s23 * m);
        Unknowns { l, m, q2: q2.over(Lanes::all(s22)) }
    }
}

/// The curvature conditions `4 l^2 k0 = 3 q2 n0` and `4 m^2 k1 = 3 (q2 - q4) n1`.
struct Conditions {
    k: [Lanes; 2],
    normals: [Vectors; 2],
    chord: Vectors,
}

impl Conditions {
    /// The curves nearest to the `free` ones that meet the conditions, and where there are such.
    #[inline(always)]
    fn nearest(&self, fit: &Fit<'_>, free: &Unknowns) -> (Unknowns, Mask) {
        let mut x = *free;
        let (mut is_met, mut is_open) = (Mask([true; N]), Mask([true; N]));
        for _ in 0..CONDITION_STEPS {
            let (next, is_there) = self.nearest_linearised(fit, free, &x);
            let change = next.minus(Lanes::all(1.0), &x);
            // Lanes that have come to an end stay as they are.
            x = Unknowns::picked(is_open, &next, &x);
            is_met = is_met.and(is_open.and(is_there.not()).not());
            let goes_on = change.dot(&change).is(Lanes::all(CONVERGED * CONVERGED), |c, least| {
                // Also where it is not a number.
                !matches!(c.partial_cmp(&least), Some(std::cmp::Ordering::Less))
            });
            is_open = is_open.and(goes_on).and(is_met);
            if !is_open.any() {
                break;
            }
        }
        (x, is_met)
    }

    /// The curves nearest to the free ones that meet the conditions linearised at `x`, and where
    /// there are such.
    #[inline(always)]
    fn nearest_linearised(&self, fit: &Fit<'_>, free: &Unknowns, x: &Unknowns) -> (Unknowns, Mask) {
        let [k0, k1] = self.k;
        let [n0, n1] = self.normals;
        let (zero, minus_3) = (Lanes::all(0.0), Lanes::all(-3.0));
        // Gradients g of the conditions.
        let g0 = Unknowns { l: (8.0 * x.l) * k0, m: zero, q2: n0.times(minus_3) };
        let g1 = Unknowns { l: zero, m: (8.0 * x.m) * k1, q2: n1.times(minus_3) };
        // Linearised at x: c(x) + g (y - x) with c = g x - 4 l^2 k0, so the value at `free` is:
        let at_free = [
            g0.dot(free) - (4.0 * x.l) * x.l * k0,
            g1.dot(free) - (4.0 * x.m) * x.m * k1 + 3.0 * self.chord.dot(n1),
        ];
        let (r0, r1) = (fit.solve(&g0), fit.solve(&g1));
        // Raised a little where both conditions say the same: both then share the load.
        let (d0, d1, mixed) = (g0.dot(&r0), g1.dot(&r1), g0.dot(&r1));
        let raised = |d: Lanes| d.map(|d| d * (1.0 + 1e-12));
        let (y, is_there) = solve_2(&[[raised(d0), mixed], [mixed, raised(d1)]], at_free);
        (free.minus(y[0], &r0).minus(y[1], &r1), is_there)
    }
}

/// Solves `A x = b` by elimination with row pivoting, and where there is a finite solution.
#[inline(always)]
fn solve_2(a: &[[Lanes; 2]; 2], b: [Lanes; 2]) -> ([Lanes; 2], Mask) {
    // Zero pivots and what is not a number lead to a solution that is not finite.
    let stays = a[0][0].is(a[1][0], |x, y| x.abs() > y.abs());
    let upper = |k: usize| stays.pick(a[0][k], a[1][k]);
    let lower = |k: usize| stays.pick(a[1][k], a[0][k]);
    let (b0, b1) = (stays.pick(b[0], b[1]), stays.pick(b[1], b[0]));
    let factor = lower(0) / upper(0);
    let y1 = (b1 - factor * b0) / (lower(1) - factor * upper(1));
    let y0 = (b0 - upper(1) * y1) / upper(0);
    let is_finite = |x: Lanes| x.is(x, |x, _| x.is_finite());
    ([y0, y1], is_finite(y0).and(is_finite(y1)))
}
