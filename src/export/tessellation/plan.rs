//! Into how many segments each edge is cut, and how fine the grid in each face is.

use super::piece::{Cutter, faces_as, is_arc_within, is_within};
use super::tiling::{Shape, Tiling};
use super::{Density, edge_curve, split};
use crate::ExportError;
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::N_CONTROL;
use isospline_geometry::{Aabb, Vec3};

/// Most segments of an edge: 65 536 triangles a patch.
const MOST: usize = 256;

/// Part of the tolerance that edges may use. On a sphere the middle of an equilateral triangle is
/// 4/3 as far off as the middles of its edges: with more the faces need finer grids than their
/// edges, with less edges are cut where no face asks for it.
const EDGE_SHARE: f64 = 0.75;

/// Edges with more segments than this are no longer cut because triangles look away from their
/// patch: a patch that is folded has such triangles however small they are.
const MOST_FOR_FACING: usize = 32;

/// Segments of every edge and level of every face; see [`Shape`].
#[derive(Debug)]
pub(super) struct Plan {
    segments: Vec<u16>,
    levels: Vec<u16>,
}

impl Plan {
    pub(super) fn new(
        patches: &PatchesView<'_>,
        half_of_edge: &[u32],
        density: Density,
    ) -> Result<Self, ExportError> {
        match density {
            Density::Samples(samples) => Self::uniform(patches, samples),
            Density::Relative(share) => {
                let points = patches.position.iter().map(|&p| Vec3::from(p));
                let bounds = points.fold(Aabb::EMPTY, |bounds, p| bounds.including(&p));
                require_tolerance(share, share < 1.0)?;
                Self::within(patches, half_of_edge, share * bounds.diagonal())
            }
            Density::Length(length) => {
                require_tolerance(length, true)?;
                Self::within(patches, half_of_edge, length)
            }
        }
    }

    /// Segments of an edge.
    pub(super) fn segments(&self, edge: usize) -> usize {
        usize::from(self.segments[edge])
    }

    pub(super) fn shape(&self, patches: &PatchesView<'_>, f: usize) -> Shape {
        let segments =
            [0, 1, 2].map(|corner| self.segments(patches.edge_of[3 * f + corner] as usize));
        Shape { segments, level: usize::from(self.levels[f]) }
    }

    fn uniform(patches: &PatchesView<'_>, samples: u32) -> Result<Self, ExportError> {
        let max = MOST as u32;
        if !(1..=max).contains(&samples) {
            return Err(ExportError::Samples { samples, max });
        }
        let n = samples as u16;
        Ok(Self { segments: vec![n; patches.boundary.len()], levels: vec![n; patches.face.len()] })
    }

    /// The edges alone decide first; a face that no grid brings within the tolerance then asks
    /// for more segments, which its neighbours share.
    fn within(
        patches: &PatchesView<'_>,
        half_of_edge: &[u32],
        tolerance: f64,
    ) -> Result<Self, ExportError> {
        let cutter = Cutter::new();
        let segments = half_of_edge.iter().map(|&half| {
            let (f, corner) = split(half);
            segments_within(&edge_curve(patches, f, corner), EDGE_SHARE * tolerance)
        });
        let segments: Vec<u16> = segments.collect();
        let mut plan = Self { segments, levels: vec![u16::MAX; patches.face.len()] };
        let mut open: Vec<usize> = (0..patches.face.len()).collect();
        while !open.is_empty() {
            let mut is_raised = vec![false; plan.segments.len()];
            for &f in &open {
                let segments = plan.shape(patches, f).segments;
                let net = patches.net(f);
                if let Some(level) = level_within(&cutter, &net, segments, tolerance) {
                    plan.levels[f] = level as u16;
                    continue;
                }
                if segments.iter().all(|&n| n == MOST) {
                    return Err(ExportError::Tolerance { tolerance, face: f });
                }
                for corner in 0..3 {
                    is_raised[patches.edge_of[3 * f + corner] as usize] = true;
                }
            }
            for (segments, _) in plan.segments.iter_mut().zip(&is_raised).filter(|(_, r)| **r) {
                *segments = (*segments + *segments / 2 + 1).min(MOST as u16);
            }
            let touched =
                |f: &usize| (0..3).any(|c| is_raised[patches.edge_of[3 * f + c] as usize]);
            open = (0..patches.face.len()).filter(touched).collect();
        }
        Ok(plan)
    }
}

fn require_tolerance(tolerance: f64, is_low: bool) -> Result<(), ExportError> {
    if tolerance > 0.0 && tolerance.is_finite() && is_low {
        return Ok(());
    }
    Err(ExportError::ToleranceRange { tolerance })
}

/// Fewest equal steps of the parameter whose arcs all stay within `tolerance` of their chords, or
/// the most that there may be.
fn segments_within(curve: &[Vec3; 5], tolerance: f64) -> u16 {
    let mut n = 1;
    while n < MOST {
        let arcs = (0..n).map(|k| [k, k + 1].map(|step| step as f64 / n as f64));
        if arcs.into_iter().all(|arc| is_arc_within(curve, arc, tolerance)) {
            break;
        }
        // Later in steps of a thirty-second: some segments too many for a tenth of the work.
        n = (n + 1 + n / 32).min(MOST);
    }
    n as u16
}

/// The level of the coarsest tiling that stays within `tolerance` of the patch; `None` where
/// grids much finer than the edges would be needed, or triangles look away from the patch.
fn level_within(
    cutter: &Cutter,
    net: &[Vec3; N_CONTROL],
    segments: [usize; 3],
    tolerance: f64,
) -> Option<usize> {
    let most = segments.into_iter().max().unwrap_or(1);
    let even = segments == [most; 3];
    let must_face = most <= MOST_FOR_FACING;
    let serves = |level: &usize| {
        let shape = Shape { segments, level: *level };
        is_shape_within(cutter, net, shape, tolerance, must_face)
    };
    let whole = (segments.contains(&1) && !even).then_some(0);
    let grid = even.then_some(most);
    let finest = 2 * most + 3;
    let mut level = 3.max(3 * most / 4);
    let finer = std::iter::from_fn(|| {
        let now = level;
        level += 1 + now / 32;
        (now <= finest).then_some(now)
    });
    whole.into_iter().chain(grid).chain(finer).find(serves)
}

fn is_shape_within(
    cutter: &Cutter,
    net: &[Vec3; N_CONTROL],
    shape: Shape,
    tolerance: f64,
    must_face: bool,
) -> bool {
    if shape.level == 1 {
        return is_within(net, tolerance) && (!must_face || faces_as(net));
    }
    let Tiling { places, triangles } = shape.tiling();
    triangles.iter().all(|t| {
        let corners = t.map(|q| shape.at(places[q as usize]));
        let piece = cutter.piece(net, corners);
        is_within(&piece, tolerance) && (!must_face || faces_as(&piece))
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Tessellation, evaluate};
    use super::*;
    use crate::sample;
    use isospline_geometry::bezier_triangle::grid;

    /// Largest distance of points of the patches from the triangles of their own face.
    fn deviation(patches: &PatchesView<'_>, tessellation: &Tessellation<'_>) -> f64 {
        let mut worst = 0.0_f64;
        for f in 0..patches.face.len() {
            let net = patches.net(f);
            let triangles: Vec<[Vec3; 3]> = tessellation.triangle_positions(f).collect();
            for at in grid(7) {
                let p = evaluate(&net, at).0;
                let to =
                    |t: &[Vec3; 3]| (p - super::super::piece::nearest_in_triangle(p, *t)).norm();
                worst = worst.max(triangles.iter().map(to).fold(f64::INFINITY, f64::min));
            }
        }
        worst
    }

    #[test]
    fn no_point_of_a_patch_is_farther_off_than_the_tolerance() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        for tolerance in [0.3, 0.1, 1e-2, 1e-3] {
            let tessellation = Tessellation::new(&view, Density::Length(tolerance)).unwrap();
            let found = deviation(&view, &tessellation);
            assert!(found <= tolerance, "{found:e} of {tolerance:e}");
            // Nor are there many more triangles than it takes.
            assert!(found > 0.3 * tolerance || tolerance > 0.05, "{found:e} of {tolerance:e}");
        }
    }

    #[test]
    fn a_ball_takes_at_most_twice_the_triangles_of_an_ideal_mesh() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        for tolerance in [3e-3, 1e-3] {
            let tessellation = Tessellation::new(&view, Density::Length(tolerance)).unwrap();
            let found: usize = (0..8).map(|f| tessellation.triangles(f).count()).sum();
            // Equilateral triangles of side h sink h^2 / 6 into a unit ball in their middle. The
            // patches of this one are eighths of it, stretched to the double in their middle.
            let h_sq = 6.0 * tolerance;
            let ideal = 4.0 * std::f64::consts::PI / (0.25 * 3.0_f64.sqrt() * h_sq);
            assert!((found as f64) < 2.0 * ideal, "{found} of {ideal}");
        }
    }

    #[test]
    fn flat_patches_are_single_triangles_and_their_bent_neighbours_are_not() {
        // A flat octahedron, one vertex of which is pulled out: half of its patches bend.
        let flat = sample::flat_octahedron();
        let view = flat.view();
        let count = |density| Tessellation::new(&view, density).unwrap().n_triangles();
        assert_eq!(count(Density::Relative(1e-6)), 8);
        let mut bent = flat.clone();
        for x in &mut bent.interior[0] {
            *x *= 1.01;
        }
        let view = bent.view();
        let tessellation = Tessellation::new(&view, Density::Relative(1e-4)).unwrap();
        let of_face = |f| tessellation.triangles(f).count();
        assert!(of_face(0) > 10, "{}", of_face(0));
        assert!(deviation(&view, &tessellation) <= 1e-4 * 12.0_f64.sqrt());
        assert!(of_face(6) <= 4, "{}", of_face(6));
    }

    #[test]
    fn tolerances_that_cannot_be_met_are_refused() {
        let patches = sample::ball_and_ring();
        for density in [
            Density::Relative(0.0),
            Density::Relative(1.0),
            Density::Relative(f64::NAN),
            Density::Length(-1.0),
            Density::Length(f64::INFINITY),
        ] {
            let refused = Tessellation::new(&patches.view(), density).unwrap_err();
            assert!(matches!(refused, ExportError::ToleranceRange { .. }), "{refused}");
        }
        let refused = Tessellation::new(&patches.view(), Density::Length(1e-9)).unwrap_err();
        assert!(matches!(refused, ExportError::Tolerance { .. }), "{refused}");
    }
}
