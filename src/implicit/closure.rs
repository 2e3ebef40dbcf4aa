//! Fields from a user's closures.

use crate::field::SymMat3;
use crate::{Field, Interval, IntervalJet, Jet1, Jet2};
use isospline_geometry::Vec3;
use std::fmt;

type ValueFn = dyn Fn(Vec3) -> f64 + Send + Sync;
type GradientFn = dyn Fn(Vec3) -> Vec3 + Send + Sync;
type HessianFn = dyn Fn(Vec3) -> SymMat3 + Send + Sync;

/// A field given by closures; missing derivatives are central differences.
pub struct ClosureField {
    value: Box<ValueFn>,
    gradient: Option<Box<GradientFn>>,
    hessian: Option<Box<HessianFn>>,
    scale: f64,
}

impl fmt::Debug for ClosureField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ClosureField").field("scale", &self.scale).finish_non_exhaustive()
    }
}

impl ClosureField {
    /// A field from its value; `scale` is the size of the model, the unit of the difference steps.
    pub fn new(scale: f64, value: impl Fn(Vec3) -> f64 + Send + Sync + 'static) -> Self {
        Self { value: Box::new(value), gradient: None, hessian: None, scale }
    }

    /// Adds the exact gradient.
    #[must_use]
    pub fn with_gradient(mut self, g: impl Fn(Vec3) -> Vec3 + Send + Sync + 'static) -> Self {
        self.gradient = Some(Box::new(g));
        self
    }

    /// Adds the exact Hessian `[xx, xy, xz, yy, yz, zz]`.
    #[must_use]
    pub fn with_hessian(mut self, h: impl Fn(Vec3) -> SymMat3 + Send + Sync + 'static) -> Self {
        self.hessian = Some(Box::new(h));
        self
    }

    fn gradient_at(&self, p: Vec3) -> Vec3 {
        if let Some(gradient) = &self.gradient {
            return gradient(p);
        }
        // Five-point rule: error h^4 against rounding eps / h, balanced near eps^(1/5).
        let h = 1e-3 * self.scale;
        let f = |k: usize, s: f64| (self.value)(p + s * h * Vec3::ith(k, 1.0));
        let slope = |k| (8.0 * (f(k, 1.0) - f(k, -1.0)) - (f(k, 2.0) - f(k, -2.0))) / (12.0 * h);
        Vec3::new(slope(0), slope(1), slope(2))
    }

    fn hessian_at(&self, p: Vec3) -> SymMat3 {
        if let Some(hessian) = &self.hessian {
            return hessian(p);
        }
        // Differences of the gradient: exact gradients bear a smaller step than differenced ones.
        let h = self.scale * if self.gradient.is_some() { 1e-3 } else { 4e-3 };
        let g = |k: usize, s: f64| self.gradient_at(p + s * h * Vec3::ith(k, 1.0));
        let column = |k| (8.0 * (g(k, 1.0) - g(k, -1.0)) - (g(k, 2.0) - g(k, -2.0))) / (12.0 * h);
        let [x, y, z] = [column(0), column(1), column(2)];
        let mean = f64::midpoint;
        [x.x, mean(x.y, y.x), mean(x.z, z.x), y.y, mean(y.z, z.y), z.z]
    }
}

impl Field for ClosureField {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (p, f) in points.iter().zip(out) {
            *f = (self.value)(*p);
        }
    }

    fn gradients(&self, points: &[Vec3], out: &mut [Jet1]) {
        for (p, jet) in points.iter().zip(out) {
            *jet = Jet1 { value: (self.value)(*p), gradient: self.gradient_at(*p) };
        }
    }

    fn hessians(&self, points: &[Vec3], out: &mut [Jet2]) {
        for (p, jet) in points.iter().zip(out) {
            let (value, gradient) = ((self.value)(*p), self.gradient_at(*p));
            *jet = Jet2 { value, gradient, hessian: self.hessian_at(*p) };
        }
    }

    fn value_enclosure(&self, _: [Interval; 3]) -> Option<Interval> {
        None
    }

    fn gradient_enclosure(&self, _: [Interval; 3]) -> Option<IntervalJet> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differenced_derivatives_of_a_sphere_are_right_to_eight_digits() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm() - 1.0);
        let p = Vec3::new(0.6, 0.0, 0.8);
        let jet = field.hessian(p);
        assert!((jet.gradient - p).norm() < 1e-10);
        assert!((jet.hessian[0] - 0.64).abs() < 1e-7);
        assert!((jet.hessian[2] + 0.48).abs() < 1e-7);
    }
}
