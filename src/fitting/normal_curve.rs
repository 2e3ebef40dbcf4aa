//! Quartic curves nearest to the surface in normal distance, many edges at a time.
//!
//! A quartic with position, tangent plane and normal curvature of the surface at both ends has the
//! normal error `t^3 (1-t)^3 (e0 + e1 t + ...)`. Least squares of the parametric distance [TK,
//! Eq. (9)] leaves `e0` and `e1` as they come; what is free of the curve, tangent lengths, tangent
//! directions and the middle point, moves it tangentially by the third power of its length and can
//! cancel both [derived]. So only the normal distance is minimised, damped by Levenberg-Marquardt.
//! Everything happens in units of the chord.

mod conditions;
mod descent;
pub mod slant;

use crate::paper_curve::Ends;
use conditions::{Frame, Unknowns};
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
    /// within the slants of the edge and `k0 = t^T M0 t`. `starts` are inner control points of
    /// curves to begin with; an edge without one begins with tangents of a quarter of the chord.
    pub fn fit(
        &self,
        field: &dyn Field,
        edges: &[NormalEdge],
        starts: &[Option<[Vec3; 3]>],
    ) -> Vec<Option<NormalCurve>> {
        let mut out = vec![None; edges.len()];
        let mut active: Vec<Walk> = Vec::with_capacity(edges.len());
        for (index, (edge, start)) in edges.iter().zip(starts).enumerate() {
            active.extend(Walk::at(index, edge, start.as_ref()));
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
                    out[walk.index] = walk.curve();
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
    fn at(index: usize, edge: &NormalEdge, start: Option<&[Vec3; 3]>) -> Option<Self> {
        let frame = Frame::new(edge)?;
        let from = start.and_then(|inner| frame.restore(frame.clamped(frame.unknowns(inner))));
        let x: Unknowns = match from {
            Some(x) => x,
            None => frame.restore(frame.plain())?,
        };
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
