//! The largest distance, sought between the samples and confirmed by its foot point.

use crate::distance::{FaceFigures, GRID, first_order, place};
use crate::evaluate::Stencil;
use crate::grid::Grid;
use crate::report::{Place, worse};
use crate::surface::{Net, Surface};
use isospline_geometry::Vec3;
use isospline_implicit::Field;

/// A grid maximum lies up to a tenth below the true one, so patches within a fifth of the largest
/// found may hold it.
const MAY_STILL_WIN: f64 = 0.8;
/// Patches looked at closely; the rest count with their grid maximum.
const MAX_CANDIDATES: usize = 256;

/// The largest distance of any patch in model units, and where; not-a-number if some sample has
/// no distance.
pub(crate) fn largest(
    surface: &Surface<'_>,
    field: &dyn Field,
    faces: &[FaceFigures],
    grid: &Grid,
) -> Option<(f64, Place)> {
    let mut order: Vec<usize> = (0..faces.len()).collect();
    // Not-a-number sorts first: it is the worst of all.
    order.sort_by(|&a, &b| faces[b].max.total_cmp(&faces[a].max));
    let mut best: Option<(f64, Place)> = None;
    for (n, &f) in order.iter().enumerate() {
        let on_grid = faces[f].max;
        let so_far = best.map_or(0.0, |(d, _)| d);
        if best.is_some() && (so_far.is_nan() || on_grid < MAY_STILL_WIN * so_far) {
            break;
        }
        let start = grid.stencil(faces[f].worst as usize);
        if on_grid.is_nan() || n >= MAX_CANDIDATES {
            let better = worse(so_far, on_grid);
            if best.is_none() || better > so_far || better.is_nan() {
                best = Some((better, place(surface, f, &start, better)));
            }
            break;
        }
        let net = surface.net(f);
        let (at, estimate) = climb(&net, field, start.at, on_grid);
        let found = confirmed(at.point(&net), field).unwrap_or(estimate);
        let better = worse(so_far, found);
        if best.is_none() || better > so_far || better.is_nan() {
            best = Some((better, place(surface, f, &at, better)));
        }
    }
    best
}

/// Climbs to a local maximum of the first-order distance: the best of six neighbours in
/// barycentric space while one is higher, else half the step, down to 1/64 of a grid step.
fn climb(net: &Net, field: &dyn Field, start: [f64; 3], value: f64) -> (Stencil, f64) {
    let (mut best, mut height) = (Stencil::new(start), value);
    let mut step = 1.0 / GRID as f64;
    while step > 1.0 / (64 * GRID) as f64 {
        let mut has_moved = false;
        for candidate in neighbours(best.at, step) {
            let stencil = Stencil::new(candidate);
            let found = first_order(&field.gradient(stencil.point(net)));
            if found.is_nan() {
                return (stencil, found);
            }
            if found > height {
                (best, height, has_moved) = (stencil, found, true);
            }
        }
        if !has_moved {
            step *= 0.5;
        }
    }
    (best, height)
}

/// The six neighbours of a barycentric point at this step that lie in the triangle.
fn neighbours(at: [f64; 3], step: f64) -> impl Iterator<Item = [f64; 3]> {
    let moves = [[1, 0], [0, 1], [1, 2], [2, 1], [0, 2], [2, 0]];
    moves.into_iter().filter_map(move |[up, down]: [usize; 2]| {
        let mut to = at;
        to[up] += step;
        to[down] -= step;
        (to[down] >= 0.0).then_some(to)
    })
}

/// Distance of `p` from its foot point on the zero set; `None` if the iteration does not settle.
///
/// Repeats `x <- p - ((p - x) . n) n - (f / |grad f|) n`, the projection of `p` on the tangent
/// plane at `x`, which shrinks the error by distance times curvature a step.
fn confirmed(p: Vec3, field: &dyn Field) -> Option<f64> {
    const MAX_STEPS: usize = 60;
    let mut x = p;
    for _ in 0..MAX_STEPS {
        let jet = field.gradient(x);
        let slope = jet.gradient.norm();
        let n = jet.gradient / slope;
        let offset = (p - x).dot(&n) + jet.value / slope;
        let next = p - offset * n;
        let change = (next - x).norm();
        x = next;
        if !change.is_finite() {
            return None;
        }
        if change <= 1e-6 * offset.abs() {
            return Some(offset.abs());
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;

    fn ellipsoid() -> ClosureField {
        let f = |p: Vec3| p.x * p.x / 4.0 + p.y * p.y + p.z * p.z - 1.0;
        ClosureField::new(4.0, f)
            .with_gradient(|p: Vec3| Vec3::new(p.x / 2.0, 2.0 * p.y, 2.0 * p.z))
    }

    #[test]
    fn the_foot_distance_is_the_true_distance_where_the_first_order_is_not() {
        let field = ellipsoid();
        // A point off the ellipsoid along its normal at a known foot.
        let foot = Vec3::new(2.0 * 0.6, 0.8, 0.0);
        let normal = field.gradient(foot).gradient.normalize();
        for distance in [1e-6, 1e-3, 0.1, 0.3] {
            let found = confirmed(foot + distance * normal, &field).unwrap();
            assert!((found - distance).abs() < 2e-6 * distance, "{found} {distance}");
        }
        let rough = first_order(&field.gradient(foot + 0.3 * normal));
        assert!((rough - 0.3).abs() > 0.02, "{rough}");
    }

    #[test]
    fn a_climb_ends_on_the_highest_point_of_a_bump() {
        // The flat triangle over a field whose distance peaks at barycentric (0.3, 0.5, 0.2).
        let net: [Vec3; 36] = {
            let mut net = [Vec3::zeros(); 36];
            for (slot, [_, v, w]) in
                net.iter_mut().zip(isospline_geometry::bezier_triangle::grid(7))
            {
                *slot = Vec3::new(v, w, 0.0);
            }
            net
        };
        let field = ClosureField::new(1.0, |p: Vec3| {
            let (dx, dy) = (p.x - 0.5, p.y - 0.2);
            p.z - 0.01 * (1.0 - dx * dx - dy * dy)
        })
        .with_gradient(|_| Vec3::z());
        let start = [0.5, 0.25, 0.25];
        let (at, height) = climb(&net, &field, start, 0.0);
        assert!((at.at[0] - 0.3).abs() < 2e-3 && (at.at[1] - 0.5).abs() < 2e-3, "{at:?}");
        assert!((height - 0.01).abs() < 1e-7);
    }
}
