//! One edge in its own frame: unknowns, conditions at its ends, and the way back onto them.
//
// symbols: x = (a0, b0, a1, b1, q2), q1 = a0 e0 + b0 s0, q3 = q4 - a1 e1 - b1 s1; e the chord turned
// into the tangent plane, s beside it, m the second fundamental form in (e, s) times the chord

use super::{NormalEdge, Slant};
use crate::shape::apply;
use isospline_geometry::Vec3;
use isospline_geometry::linear::solve;

/// Number of unknowns of an edge.
pub(super) const N: usize = 7;

/// `[a0, b0, a1, b1, q2.x, q2.y, q2.z]` in units of the chord, `q0` at the origin.
pub(super) type Unknowns = [f64; N];

/// Tangent lengths allowed on the way, times the chord.
const LENGTH_RANGE: [f64; 2] = [0.1, 0.6];
/// What the last step back onto the conditions may add to either range.
const SLACK: f64 = 0.05;
/// Largest residual of the conditions of a sound curve; a residual `c` costs about `50 c` degrees
/// of G1 angle.
const CONDITION_TOLERANCE: f64 = 1e-13;
/// Lets conditions that coincide (equal normals on planes and along rulings) be solved: both
/// multipliers then share the load.
pub(super) const COINCIDENT: f64 = 1e-13;

/// An edge in its own frame.
pub(super) struct Frame {
    origin: Vec3,
    chord: f64,
    q4: Vec3,
    normals: [Vec3; 2],
    along: [Vec3; 2],
    beside: [Vec3; 2],
    forms: [[f64; 3]; 2],
    slants: [Slant; 2],
}

impl Frame {
    /// `None` if the chord is normal to a tangent plane or has no length.
    pub(super) fn new(NormalEdge { ends, slants }: &NormalEdge) -> Option<Self> {
        let d = ends.points[1] - ends.points[0];
        let chord = d.norm();
        let q4 = d / chord;
        let tangent = |n: &Vec3| (q4 - q4.dot(n) * n).try_normalize(1e-6);
        let along = [tangent(&ends.normals[0])?, tangent(&ends.normals[1])?];
        let beside = [ends.normals[0].cross(&along[0]), ends.normals[1].cross(&along[1])];
        let form = |k: usize| {
            let (m, e, s) = (&ends.shapes[k], &along[k], &beside[k]);
            [chord * apply(m, e, e), chord * apply(m, e, s), chord * apply(m, s, s)]
        };
        let forms = [form(0), form(1)];
        let (origin, normals, slants) = (ends.points[0], ends.normals, *slants);
        Some(Self { origin, chord, q4, normals, along, beside, forms, slants })
    }

    /// Length of the chord in model units.
    pub(super) fn chord(&self) -> f64 {
        self.chord
    }

    /// Unit normals at both ends.
    pub(super) fn normals(&self) -> [Vec3; 2] {
        self.normals
    }

    /// `q2 - q0` and `q2 - q4`, times the chord.
    pub(super) fn middle_from_ends(&self, x: &Unknowns) -> [Vec3; 2] {
        let q2 = Vec3::new(x[4], x[5], x[6]);
        [q2, q2 - self.q4]
    }

    /// Outset of control point 1 from `q0`, and of `q4` from control point 3.
    pub(super) fn leg(&self, x: &Unknowns, end: usize) -> Vec3 {
        x[2 * end] * self.along[end] + x[2 * end + 1] * self.beside[end]
    }

    /// Control points in model units.
    pub(super) fn control(&self, x: &Unknowns) -> [Vec3; 5] {
        let far = self.origin + self.chord * self.q4;
        let q2 = self.origin + self.chord * Vec3::new(x[4], x[5], x[6]);
        let (first, last) = (self.chord * self.leg(x, 0), self.chord * self.leg(x, 1));
        [self.origin, self.origin + first, q2, far - last, far]
    }

    /// Unknowns of a curve with these inner control points.
    pub(super) fn unknowns(&self, inner: &[Vec3; 3]) -> Unknowns {
        let [q1, q2, q3] = inner.map(|q| (q - self.origin) / self.chord);
        let back = self.q4 - q3;
        let [e0, e1] = &self.along;
        let [s0, s1] = &self.beside;
        [q1.dot(e0), q1.dot(s0), back.dot(e1), back.dot(s1), q2.x, q2.y, q2.z]
    }

    /// Tangents of a quarter of the chord, the middle point over the middle of the chord.
    pub(super) fn plain(&self) -> Unknowns {
        let legs = 0.25 * (self.along[0] - self.along[1]);
        let q2 = 0.5 * self.q4 + legs * (2.0 / 3.0);
        [0.25, 0.0, 0.25, 0.0, q2.x, q2.y, q2.z]
    }

    /// The nearest tangents in range.
    pub(super) fn clamped(&self, mut x: Unknowns) -> Unknowns {
        for end in 0..2 {
            let (a, b) = (x[2 * end].max(0.5 * LENGTH_RANGE[0]), x[2 * end + 1]);
            let Slant([low, high]) = self.slants[end];
            let b = b.clamp(low * a, high * a);
            let length = (a * a + b * b).sqrt();
            let scale = length.clamp(LENGTH_RANGE[0], LENGTH_RANGE[1]) / length;
            x[2 * end] = a * scale;
            x[2 * end + 1] = b * scale;
        }
        x
    }

    /// Whether conditions are met and tangents in range.
    pub(super) fn is_sound(&self, x: &Unknowns) -> bool {
        let [low, high] = [LENGTH_RANGE[0] * (1.0 - SLACK), LENGTH_RANGE[1] * (1.0 + SLACK)];
        let in_range = |end: usize| {
            let (a, b) = (x[2 * end], x[2 * end + 1]);
            let Slant([right, left]) = self.slants[end];
            (low * low..=high * high).contains(&(a * a + b * b))
                && (right - SLACK..=left + SLACK).contains(&(b / a))
        };
        in_range(0) && in_range(1) && self.residual(x) <= CONDITION_TOLERANCE
    }

    /// Tangent lengths in model units.
    pub(super) fn lengths(&self, x: &Unknowns) -> [f64; 2] {
        [self.chord * self.leg(x, 0).norm(), self.chord * self.leg(x, 1).norm()]
    }

    /// Largest residual of the conditions.
    pub(super) fn residual(&self, x: &Unknowns) -> f64 {
        largest(&self.conditions(x))
    }

    /// `4 l^2 k - 3 (q2 - q_end) . N` at both ends.
    pub(super) fn conditions(&self, x: &Unknowns) -> [f64; 2] {
        let middle = self.middle_from_ends(x);
        let bend = |end: usize| {
            let ([ee, es, ss], a, b) = (self.forms[end], x[2 * end], x[2 * end + 1]);
            4.0 * (ee * a * a + 2.0 * es * a * b + ss * b * b)
        };
        [
            bend(0) - 3.0 * middle[0].dot(&self.normals[0]),
            bend(1) - 3.0 * middle[1].dot(&self.normals[1]),
        ]
    }

    /// Gradients of the two conditions.
    pub(super) fn condition_gradients(&self, x: &Unknowns) -> [Unknowns; 2] {
        let mut out = [[0.0; N]; 2];
        for end in 0..2 {
            let ([ee, es, ss], a, b) = (self.forms[end], x[2 * end], x[2 * end + 1]);
            out[end][2 * end] = 8.0 * (ee * a + es * b);
            out[end][2 * end + 1] = 8.0 * (es * a + ss * b);
            for k in 0..3 {
                out[end][4 + k] = -3.0 * self.normals[end][k];
            }
        }
        out
    }

    /// Change of the normal distance at a point with quartic weights `w` and unit normal `n`.
    pub(super) fn distance_gradient(&self, w: &[f64; 5], n: &Vec3) -> Unknowns {
        let [e0, e1] = &self.along;
        let [s0, s1] = &self.beside;
        let near = [w[1] * n.dot(e0), w[1] * n.dot(s0)];
        let far = [-w[3] * n.dot(e1), -w[3] * n.dot(s1)];
        [near[0], near[1], far[0], far[1], w[2] * n.x, w[2] * n.y, w[2] * n.z]
    }

    /// Least-norm Newton steps onto the conditions; `None` if they do not get there.
    pub(super) fn restore(&self, mut x: Unknowns) -> Option<Unknowns> {
        const STEPS: u32 = 10;
        let dot = |a: &Unknowns, b: &Unknowns| (0..N).map(|i| a[i] * b[i]).sum::<f64>();
        for _ in 0..STEPS {
            let c = self.conditions(&x);
            let g = self.condition_gradients(&x);
            let mixed = dot(&g[0], &g[1]);
            let raised = |k: usize| dot(&g[k], &g[k]) * (1.0 + COINCIDENT);
            let y = solve([[raised(0), mixed], [mixed, raised(1)]], c)?;
            let next: Unknowns = std::array::from_fn(|i| x[i] - y[0] * g[0][i] - y[1] * g[1][i]);
            if largest(&self.conditions(&next)) >= largest(&c) {
                break;
            }
            x = next;
        }
        (self.residual(&x) <= CONDITION_TOLERANCE).then_some(x)
    }
}

fn largest(c: &[f64; 2]) -> f64 {
    c[0].abs().max(c[1].abs())
}
