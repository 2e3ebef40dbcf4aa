//! Quartic curves nearest to the surface in normal distance, many edges at a time.
//!
//! A quartic with position, tangent plane and normal curvature of the surface at both ends has the
//! normal error `t^3 (1-t)^3 (e0 + e1 t + ...)`. Least squares of the parametric distance [TK,
//! Eq. (9)] leaves `e0` and `e1` as they come; what is free of the curve, tangent lengths, tangent
//! directions and the middle point, moves it tangentially by the third power of its length and can
//! cancel both \[derived\]. So only the normal distance is minimised, damped by Levenberg-Marquardt.
//! Everything happens in units of the chord.

pub mod answer;
mod conditions;
mod descent;
pub mod slant;

use crate::paper_curve::Ends;
use conditions::Frame;
use descent::Descent;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::bernstein;
use isospline_implicit::{Field, Jet1};
use slant::Slant;

/// How thoroughly curves are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NormalOptions {
    /// Samples of the normal distance, at Chebyshev parameters; 6 to 32. From 10 on the error
    /// between the samples is that at the samples.
    pub samples: u32,
    /// Evaluations of the field along a curve at most; 8 rank edges, 30 fit them.
    pub iterations: u32,
}

/// What is given of an edge.
#[derive(Clone, Copy, Debug)]
pub struct NormalEdge {
    /// What the curve interpolates.
    pub ends: Ends,
    /// How far the tangents may turn away from the chord, at each end.
    pub slants: [Slant; 2],
}

/// A fitted curve in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCurve {
    /// q1, q2, q3.
    pub inner: [Vec3; 3],
    /// Lengths of `q1 - q0` and `q4 - q3`.
    pub tangent: [f64; 2],
    /// Largest residual of the curvature conditions, scaled as in [`crate::paper_curve`].
    pub residual: f64,
    /// Largest normal distance at the samples.
    pub error: f64,
    /// Iterations taken.
    pub iterations: u32,
}

/// The fit with its samples.
#[derive(Clone, Debug)]
pub struct NormalFit {
    iterations: u32,
    /// Quartic Bernstein polynomials at the samples.
    weights: Vec<[f64; 5]>,
}

impl NormalFit {
    /// The fit with these options.
    pub fn new(options: NormalOptions) -> Self {
        let n = f64::from(options.samples);
        let parameter = |j: u32| {
            let angle = (f64::from(j) + 0.5) * std::f64::consts::PI / n;
            0.5 - 0.5 * libm::cos(angle)
        };
        let quartic = |t: f64| bernstein(4, t).try_into().expect("invariant: five polynomials");
        let weights = (0..options.samples).map(|j| quartic(parameter(j))).collect();
        Self { iterations: options.iterations, weights }
    }

    /// Fits the curve of each edge by itself; `None` where no sound curve was found.
    ///
    /// Minimises the squared `f / |grad f|` at the samples under the conditions `3 (q2 - q0) . N0 =
    /// 4 l^2 k0` and its mirror image [TK, Eq. (9b)], `l t` being any vector of the tangent plane
    /// within the slants of the edge and `k0 = t^T M0 t`. Every edge begins with tangents of a
    /// quarter of the chord and once more with the inner control points of its start, if it has
    /// one; the nearer curve wins. (There are several minima: from the start of the paper alone an
    /// arc of a sphere stays in its plane, a thousand times farther off; without it one edge in a
    /// thousand is up to a hundred times worse.)
    pub fn fit(
        &self,
        field: &dyn Field,
        edges: &[NormalEdge],
        starts: &[Option<[Vec3; 3]>],
    ) -> Vec<Option<NormalCurve>> {
        let mut out = vec![None; edges.len()];
        let mut active: Vec<Walk> = Vec::with_capacity(edges.len());
        for (index, (edge, start)) in edges.iter().zip(starts).enumerate() {
            active.extend(Walk::plain(index, edge));
            active.extend(start.as_ref().and_then(|start| Walk::from(index, edge, start)));
        }
        let mut points = Vec::new();
        let mut jets = Vec::new();
        while !active.is_empty() {
            points.clear();
            points.extend(active.iter().flat_map(|walk| self.curve_points(walk)));
            jets.resize(points.len(), Jet1 { value: 0.0, gradient: Vec3::zeros() });
            field.gradients(&points, &mut jets);
            let mut samples = jets.chunks_exact(self.weights.len());
            active.retain_mut(|walk| {
                let jets = samples.next().expect("invariant: samples of every curve");
                let goes_on = walk.descent.judge(&walk.frame, &self.weights, jets)
                    && walk.descent.iterations < self.iterations;
                if !goes_on {
                    let other = out[walk.index].take();
                    out[walk.index] = nearer(other, walk.curve());
                }
                goes_on
            });
        }
        out
    }

    fn curve_points<'a>(&'a self, walk: &'a Walk) -> impl Iterator<Item = Vec3> + 'a {
        let q = walk.frame.control(walk.descent.trial());
        self.weights
            .iter()
            .map(move |w| w[0] * q[0] + w[1] * q[1] + w[2] * q[2] + w[3] * q[3] + w[4] * q[4])
    }
}

/// One edge on its way.
struct Walk {
    index: usize,
    frame: Frame,
    descent: Descent,
}

impl Walk {
    fn plain(index: usize, edge: &NormalEdge) -> Option<Self> {
        let frame = Frame::new(edge)?;
        let x = frame.restore(frame.plain())?;
        Some(Self { index, frame, descent: Descent::from(x) })
    }

    fn from(index: usize, edge: &NormalEdge, inner: &[Vec3; 3]) -> Option<Self> {
        let frame = Frame::new(edge)?;
        let x = frame.restore(frame.clamped(frame.unknowns(inner)))?;
        Some(Self { index, frame, descent: Descent::from(x) })
    }

    fn curve(&self) -> Option<NormalCurve> {
        let x = self.descent.best()?;
        let q = self.frame.control(x);
        let sound = self.frame.is_sound(x);
        sound.then(|| NormalCurve {
            inner: [q[1], q[2], q[3]],
            tangent: self.frame.lengths(x),
            residual: self.frame.residual(x),
            error: self.frame.chord() * self.descent.largest(),
            iterations: self.descent.iterations,
        })
    }
}

/// The first of two curves unless the second is nearer; which walk ends first plays no part but
/// for equal distances.
fn nearer(a: Option<NormalCurve>, b: Option<NormalCurve>) -> Option<NormalCurve> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.error < a.error { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::answer::OWN;
    use super::*;
    use crate::shape::second_fundamental_form;
    use isospline_implicit::ClosureField;

    const OPTIONS: NormalOptions = NormalOptions { samples: 12, iterations: 40 };

    /// An ellipsoid with half axes 1, 0.8 and 1.3, or a multiple of it.
    fn ellipsoid(scale: f64) -> ClosureField {
        let weights = Vec3::new(1.0, 1.0 / 0.64, 1.0 / 1.69) / (scale * scale);
        ClosureField::new(2.0 * scale, move |p: Vec3| p.dot(&p.component_mul(&weights)) - 1.0)
            .with_gradient(move |p| 2.0 * p.component_mul(&weights))
            .with_hessian(move |_| {
                [2.0 * weights.x, 0.0, 0.0, 2.0 * weights.y, 0.0, 2.0 * weights.z]
            })
    }

    /// An edge between points of the ellipsoid below two directions.
    fn edge(field: &ClosureField, directions: [Vec3; 2]) -> NormalEdge {
        // The factor 2^20 keeps the digits of a small quadratic form beside the 1 of the field.
        let form = |d: Vec3| (field.value(1048576.0 * d) + 1.0) / 1048576.0 / 1048576.0;
        let points = directions.map(|d| d / form(d).sqrt());
        let jets = points.map(|p| field.hessian(p));
        let ends = Ends {
            points,
            normals: jets.map(|jet| jet.gradient.normalize()),
            shapes: jets.map(|jet| second_fundamental_form(&jet)),
        };
        NormalEdge { ends, slants: [Slant::free(); 2] }
    }

    fn arc(turn: f64) -> [Vec3; 2] {
        let start = Vec3::new(0.6, 0.3, 0.5).normalize();
        let across = start.cross(&Vec3::new(0.2, -0.7, 0.4)).normalize();
        [start, turn.cos() * start + turn.sin() * across]
    }

    #[test]
    fn curves_on_an_ellipsoid_are_fitted_with_order_above_seven_and_meet_the_conditions() {
        let field = ellipsoid(1.0);
        let error = |turn: f64| {
            let edges = [edge(&field, arc(turn))];
            let curve = NormalFit::new(OPTIONS).fit(&field, &edges, &[None])[0].unwrap();
            assert!(curve.residual <= 1e-13, "{:e}", curve.residual);
            curve.error
        };
        let (coarse, fine) = (error(0.8), error(0.4));
        assert!(coarse < 1e-6, "{coarse:e}");
        assert!((coarse / fine).log2() > 7.0, "{coarse:e} {fine:e}");
    }

    #[test]
    fn a_curve_does_not_depend_on_the_unit_of_length() {
        let fit = |scale: f64| {
            let field = ellipsoid(scale);
            let edges = [edge(&field, arc(0.4))];
            NormalFit::new(OPTIONS).fit(&field, &edges, &[None])[0].unwrap()
        };
        let (here, there) = (fit(1.0), fit(1024.0));
        for (a, b) in here.inner.iter().zip(&there.inner) {
            assert!((a - b / 1024.0).norm() < 1e-9);
        }
    }

    #[test]
    fn a_curve_has_the_same_bits_whatever_is_fitted_beside_it() {
        let field = ellipsoid(1.0);
        let fit = NormalFit::new(OPTIONS);
        let edges = [0.2, 0.5, 0.9].map(|turn| edge(&field, arc(turn)));
        let together = fit.fit(&field, &edges, &[None; 3]);
        for (edge, curve) in edges.iter().zip(together) {
            assert_eq!(fit.fit(&field, &[*edge], &[None])[0], curve);
        }
    }

    /// Two tangents at each end.
    fn axes(edge: &NormalEdge) -> [[Vec3; 2]; 2] {
        edge.ends.normals.map(|n| {
            let first = n.cross(&Vec3::z()).normalize();
            [first, n.cross(&first)]
        })
    }

    /// The edge after a move of one end, in the units of answers.
    fn moved(edge: &NormalEdge, end: usize, kind: usize, amount: f64) -> NormalEdge {
        let mut moved = *edge;
        let chord = (edge.ends.points[1] - edge.ends.points[0]).norm();
        let (n, [a, b]) = (edge.ends.normals[end], axes(edge)[end]);
        match kind {
            0 => moved.ends.points[end] += amount * chord * n,
            1 => moved.ends.normals[end] = (n + amount * a).normalize(),
            2 => moved.ends.normals[end] = (n + amount * b).normalize(),
            _ => {
                let entries =
                    [a * a.transpose(), a * b.transpose() + b * a.transpose(), b * b.transpose()];
                let m = entries[kind - 3] * (amount / chord);
                let change = [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33];
                moved.ends.shapes[end].iter_mut().zip(change).for_each(|(x, y)| *x += y);
            }
        }
        moved
    }

    #[test]
    fn the_answer_to_offsets_and_tilts_is_what_curves_fitted_again_give() {
        let field = ellipsoid(1.0);
        let fit = NormalFit::new(NormalOptions { iterations: 200, ..OPTIONS });
        let cost = |edge: &NormalEdge| {
            let curve = fit.fit(&field, &[*edge], &[None])[0].unwrap();
            let points = fit.points(edge, &curve);
            let sum = points.map(|p| (field.value(p) / field.gradient(p).gradient.norm()).powi(2));
            0.5 * sum.sum::<f64>()
        };
        let edge = edge(&field, arc(0.9));
        let chord = (edge.ends.points[1] - edge.ends.points[0]).norm();
        let curve = fit.fit(&field, &[edge], &[None])[0].unwrap();
        let jets: Vec<Jet1> = fit.points(&edge, &curve).map(|p| field.gradient(p)).collect();
        let answer = fit.answer(&edge, &curve, &jets, &axes(&edge)).unwrap();
        assert!((chord * chord * answer.cost / cost(&edge) - 1.0).abs() < 1e-6);
        for (end, kind) in [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)] {
            let amount = 1e-5;
            let second = answer.matrix[OWN * end + kind][OWN * end + kind];
            let predicted = 0.5 * (chord * amount) * (chord * amount) * second;
            let both = [amount, -amount].map(|amount| cost(&moved(&edge, end, kind, amount)));
            let found = 0.5 * (both[0] + both[1]) - cost(&edge);
            // Tilts move curves along the surface too, which is not linear.
            let within = if kind == 0 { 0.15 } else { 0.5 };
            let ratio = found / predicted;
            assert!((ratio - 1.0).abs() < within, "{end} {kind}: {found:e} {predicted:e}");
        }
    }

    #[test]
    fn forms_change_the_conditions_as_their_gradients_say() {
        let edge = edge(&ellipsoid(1.0), arc(0.9));
        let conditions = |edge: &NormalEdge| {
            let frame = Frame::new(edge).unwrap();
            frame.conditions(&frame.plain())
        };
        let frame = Frame::new(&edge).unwrap();
        let gradients = frame.conditions_by_moves(&frame.plain(), &axes(&edge));
        for (end, kind) in [(0, 3), (0, 4), (0, 5), (1, 3), (1, 4), (1, 5)] {
            let changed = conditions(&moved(&edge, end, kind, 0.5))[end] - conditions(&edge)[end];
            let predicted = 0.5 * gradients[end][OWN * end + kind];
            assert!((changed - predicted).abs() < 1e-13, "{end} {kind}: {changed} {predicted}");
        }
    }

    #[test]
    fn a_closed_range_of_slants_keeps_the_tangent_over_the_chord() {
        let field = ellipsoid(1.0);
        let mut edge = edge(&field, arc(0.6));
        edge.slants = [Slant([0.0, 0.0]); 2];
        let curve = NormalFit::new(OPTIONS).fit(&field, &[edge], &[None])[0].unwrap();
        let chord = edge.ends.points[1] - edge.ends.points[0];
        let beside = edge.ends.normals[0].cross(&chord).normalize();
        let tangent = curve.inner[0] - edge.ends.points[0];
        // The step back onto the conditions may turn it by a little.
        assert!(tangent.normalize().dot(&beside).abs() < 1e-2);
    }
}
