//! Projection onto the surface by Newton steps along the gradient [TK, Eq. (4)].

use isospline_geometry::Vec3;
use isospline_implicit::{Field, Jet1};

/// Relative residual below which a point counts as on the surface (times the diagonal).
const REACHED_REL: f64 = 1e-9;
/// Steps taken after [`REACHED_REL`]: Newton squares the residual, so two reach rounding.
const POLISH_STEPS: u32 = 2;
/// Steps before giving up; good starts need 3 to 5.
const MAX_STEPS: u32 = 60;
/// Longest step, as a fraction of the diagonal.
const STEP_CAP_REL: f64 = 0.1;

/// What became of a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Points that did not come within 1e-9 of the diagonal.
    pub failed: usize,
    /// Gradient evaluations, over all points.
    pub evaluations: usize,
}

/// Moves every point onto the zero set of `field`.
///
/// Steps `-f grad f / |grad f|^2`, halved while they do not lower `|f| / |grad f|`. A point is
/// left at the lowest residual met: stopping at the paper's 1e-6 would pollute every later stage,
/// and a fixed 1e-15 is not reachable where f has large terms. `diagonal` is that of the model's
/// bounding box. Points that fail (counted) stay at their best place.
pub fn project_all(field: &dyn Field, diagonal: f64, points: &mut [Vec3]) -> Figures {
    let mut figures = Figures::default();
    let mut walkers: Vec<Walker> = (0..points.len()).map(|i| Walker::at(i, points[i])).collect();
    let mut trial = Vec::with_capacity(points.len());
    let mut jets = Vec::with_capacity(points.len());
    while !walkers.is_empty() {
        trial.clear();
        trial.extend(walkers.iter().map(|w| w.trial));
        jets.resize(trial.len(), Jet1 { value: 0.0, gradient: Vec3::zeros() });
        field.gradients(&trial, &mut jets);
        figures.evaluations += trial.len();
        let mut at = 0;
        walkers.retain_mut(|walker| {
            let goes_on = walker.judge(&jets[at], diagonal);
            at += 1;
            if !goes_on {
                points[walker.index] = walker.best;
                figures.failed += usize::from(walker.residual_or_inf() > REACHED_REL * diagonal);
            }
            goes_on
        });
    }
    figures
}

/// One point on its way.
struct Walker {
    index: usize,
    best: Vec3,
    residual: f64,
    step: Vec3,
    trial: Vec3,
    steps: u32,
    polished: u32,
}

impl Walker {
    fn at(index: usize, start: Vec3) -> Self {
        let (residual, step) = (f64::INFINITY, Vec3::zeros());
        Self { index, best: start, residual, step, trial: start, steps: 0, polished: 0 }
    }

    fn residual_or_inf(&self) -> f64 {
        if self.residual.is_nan() { f64::INFINITY } else { self.residual }
    }

    /// Takes the field at the trial point in; false when the walk ends.
    fn judge(&mut self, jet: &Jet1, diagonal: f64) -> bool {
        self.steps += 1;
        let slope_sq = jet.gradient.norm_squared();
        let residual = jet.value.abs() / slope_sq.sqrt();
        let reached = self.residual <= REACHED_REL * diagonal;
        if residual < self.residual {
            self.best = self.trial;
            self.residual = residual;
            let newton = -jet.value / slope_sq * jet.gradient;
            let cap = STEP_CAP_REL * diagonal;
            self.step = if residual > cap { newton * (cap / residual) } else { newton };
            self.polished += u32::from(reached);
        } else if reached {
            // At rounding level the residual only flickers.
            return false;
        } else {
            self.step *= 0.5;
        }
        self.trial = self.best + self.step;
        // An exact zero cannot be improved.
        residual != 0.0 && self.polished < POLISH_STEPS && self.steps < MAX_STEPS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;

    fn torus() -> ClosureField {
        let value = |p: Vec3| {
            let r = (p.x * p.x + p.y * p.y).sqrt() - 5.0;
            r * r + p.z * p.z - 1.0
        };
        let gradient = |p: Vec3| {
            let radius = (p.x * p.x + p.y * p.y).sqrt();
            let k = 2.0 * (radius - 5.0) / radius;
            Vec3::new(k * p.x, k * p.y, 2.0 * p.z)
        };
        ClosureField::new(12.0, value).with_gradient(gradient)
    }

    #[test]
    fn points_near_a_torus_reach_it_to_rounding() {
        let field = torus();
        let mut points: Vec<Vec3> = (0..100)
            .map(|i| {
                let (a, b) = (0.37 * f64::from(i), 1.1 * f64::from(i));
                let r = 5.0 + 1.3 * b.cos();
                Vec3::new(r * a.cos(), r * a.sin(), 0.8 * b.sin())
            })
            .collect();
        let figures = project_all(&field, 17.0, &mut points);
        assert_eq!(figures.failed, 0);
        assert!(figures.evaluations < 800, "{figures:?}");
        for p in points {
            assert!(field.value(p).abs() < 5e-15, "{p}");
        }
    }

    #[test]
    fn a_point_where_the_gradient_vanishes_fails_and_is_counted() {
        let field = ClosureField::new(1.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p: Vec3| 2.0 * p);
        let mut points = [Vec3::zeros(), Vec3::new(0.9, 0.0, 0.0)];
        let figures = project_all(&field, 2.0, &mut points);
        assert_eq!(figures.failed, 1);
        assert!((points[1].norm() - 1.0).abs() < 1e-15);
    }
}
