//! Points where value and gradient vanish together: no smooth surface passes there.

use crate::PolygonizeError;
use isospline_geometry::{Aabb, Vec3, linear};
use isospline_implicit::Field;

/// Newton steps from one start; at a multiple root each gains a bit only, so many.
const MOST_STEPS: u32 = 100;
/// What counts as zero of the value and of `|grad f| h`, relative to the size of f about the
/// surface. A regular surface this near to a singular one has a neck of some 1e-5 cells.
const VALUE_ZERO: f64 = 1e-10;
const SLOPE_ZERO: f64 = 1e-6;

/// How far, in cells, Newton's method may go on from a point that is flat.
const NEAR: f64 = 1e-3;
/// Decimals, finer and finer from the size of a cell, to which a coordinate of the place is rounded
/// if that leaves the gradient no longer: at a root of high order Newton's method ends some way off.
const MOST_ROUNDINGS: i32 = 6;

/// Searches from `start` for a singular point within `reach` of it.
///
/// `scale` is the size of f about the surface (values a cell away from it), `cell` the side of a
/// cell. At a multiple root the steps shrink by a constant factor only; they are carried on until
/// the gradient falls no more, so that the place is told as well as it can be.
pub(crate) fn near(
    field: &dyn Field,
    start: Vec3,
    reach: &Aabb,
    scale: f64,
    cell: f64,
) -> Option<PolygonizeError> {
    let mut at = start;
    let mut found: Option<Flat> = None;
    for _ in 0..MOST_STEPS {
        let jet = field.hessian(at);
        let slope = jet.gradient.norm();
        let is_flat = slope * cell <= SLOPE_ZERO * scale;
        if is_flat && jet.value.abs() <= VALUE_ZERO * scale {
            if found.as_ref().is_some_and(|flat| flat.slope <= slope) {
                break;
            }
            found = Some(Flat { at, value: jet.value, slope });
        }
        let Some(step) = step_to_flat(&jet.gradient, &jet.hessian) else { break };
        // Steps longer than a cell leave the region where the test failed.
        at += step * (cell / step.norm()).min(1.0);
        if !reach.contains(&at) || step.norm() <= 1e-15 * at.norm() {
            break;
        }
    }
    // Across a thin sheet f varies so much that all else looks flat; but there the steps go on.
    let flat = found.filter(|flat| (flat.at - at).norm() <= NEAR * cell)?;
    Some(flat.told(field, cell))
}

/// A point where value and gradient are as good as zero.
struct Flat {
    at: Vec3,
    value: f64,
    slope: f64,
}

impl Flat {
    fn told(mut self, field: &dyn Field, cell: f64) -> PolygonizeError {
        let decimals = -libm::floor(libm::log10(cell)) as i32;
        let finer = decimals..decimals + MOST_ROUNDINGS;
        for axis in 0..3 {
            if let Some(rounded) = finer.clone().find_map(|k| self.rounded(field, axis, k)) {
                self = rounded;
            }
        }
        PolygonizeError::SingularPoint { at: self.at, value: self.value, slope: self.slope }
    }

    /// The same place with a coordinate of so many decimals, if it is no less flat there.
    fn rounded(&self, field: &dyn Field, axis: usize, decimals: i32) -> Option<Self> {
        let unit = libm::pow(10.0, f64::from(decimals));
        let mut at = self.at;
        // Minus nothing is told as nothing.
        at[axis] = (at[axis] * unit).round() / unit + 0.0;
        let jet = field.gradient(at);
        let (value, slope) = (jet.value, jet.gradient.norm());
        (slope <= self.slope && value.abs() <= self.value.abs()).then_some(Self {
            at,
            value,
            slope,
        })
    }
}

/// The Levenberg-Marquardt step for `grad f = 0`.
fn step_to_flat(gradient: &Vec3, h: &[f64; 6]) -> Option<Vec3> {
    let rows = [[h[0], h[1], h[2]], [h[1], h[3], h[4]], [h[2], h[4], h[5]]];
    let size_sq: f64 = rows.iter().flatten().map(|x| x * x).sum();
    // Damping far below the curvature in play: needed only where the Hessian is singular.
    let mut normal = [[0.0; 3]; 3];
    let mut rhs = [[0.0]; 3];
    for i in 0..3 {
        for j in 0..3 {
            normal[i][j] = (0..3).map(|k| rows[i][k] * rows[k][j]).sum();
        }
        normal[i][i] += 1e-12 * size_sq;
        rhs[i][0] = -(0..3).map(|k| rows[i][k] * gradient[k]).sum::<f64>();
    }
    let factor = linear::cholesky(&normal).ok()?;
    linear::cholesky_solve(&factor, &mut rhs);
    let step = Vec3::new(rhs[0][0], rhs[1][0], rhs[2][0]);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;

    fn found_from(start: Vec3, f: fn(Vec3) -> f64) -> Option<PolygonizeError> {
        let reach = Aabb::new(start.add_scalar(-1.0), start.add_scalar(1.0));
        near(&ClosureField::new(1.0, f), start, &reach, 0.1, 0.1)
    }

    #[test]
    fn the_apex_of_a_cone_is_found_and_the_axis_of_a_thin_tube_is_not() {
        let start = Vec3::new(0.05, -0.03, 0.04);
        let cone = found_from(start, |p| p.x * p.x + p.y * p.y - p.z * p.z);
        let Some(PolygonizeError::SingularPoint { at, .. }) = cone else { panic!("{cone:?}") };
        assert!(at.norm() < 1e-6, "{at}");
        assert_eq!(found_from(start, |p| p.x * p.x + p.y * p.y - 1e-6), None);
    }

    #[test]
    fn a_squared_field_is_singular_all_over_its_surface() {
        let start = Vec3::new(0.75, 0.1, 0.7);
        let square = |p: Vec3| (p.norm_squared() - 1.0) * (p.norm_squared() - 1.0);
        let Some(PolygonizeError::SingularPoint { at, .. }) = found_from(start, square) else {
            panic!("not found");
        };
        assert!((at.norm() - 1.0).abs() < 1e-4, "{at}");
    }
}
