//! Faces edited where patches over them were unfit.

use crate::gate::Gate;
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::Counters;

/// Distance of a face's middle from where it was seen, times the diagonal, that is rounding.
const SAME: f64 = 1e-9;
/// Shortest side of a needle, of its longest.
const NEEDLE: f64 = 0.3;

/// Splits the faces with these middles across their longest sides, but merges the ends of the
/// shortest side of a needle where that leaves fit faces; what an earlier edit took with it is gone.
pub(crate) fn edit(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    middles: &[[f64; 3]],
    counters: &mut Counters,
) {
    for middle in middles {
        let Some(face) = face_about(surface, &Vec3::from(*middle)) else { continue };
        let length = |h: HalfEdge| {
            let [p, q] = surface.ends(h);
            (q.position - p.position).norm()
        };
        let mut sides = [0, 1, 2].map(|k| HalfEdge::new(face, k)).map(|h| (length(h), h));
        sides.sort_by(|x, y| x.0.total_cmp(&y.0));
        let [shortest, _, longest] = sides;
        let is_needle = shortest.0 < NEEDLE * longest.0;
        if is_needle && merge(surface, gate, shortest) {
            counters.repair("unfit_faces_merged", 1);
        } else if split(surface, longest) {
            counters.repair("unfit_faces_split", 1);
        }
    }
}

/// Whether an edge of this length was split.
fn split(surface: &mut SurfaceMesh<'_>, (length, h): (f64, HalfEdge)) -> bool {
    let foot = surface.foot_within(surface.middle(h), length);
    foot.is_some_and(|foot| surface.split(h, foot).is_some())
}

/// Whether the ends of an edge of this length were merged.
fn merge(surface: &mut SurfaceMesh<'_>, gate: &Gate, (length, h): (f64, HalfEdge)) -> bool {
    let ends = surface.ends(h).map(|v| *v);
    let middle = surface.foot_within(surface.middle(h), length);
    let mut choices = middle.into_iter().chain(ends);
    let fits = |merged: &Vertex| surface.collapse_is_better(gate, h, merged, 1.0);
    let Some(merged) = choices.find(fits) else { return false };
    surface.collapse(h, merged);
    true
}

/// The face with this middle.
fn face_about(surface: &SurfaceMesh<'_>, middle: &Vec3) -> Option<u32> {
    let distance = |face: u32| {
        let [a, b, c] = surface.corners(face).map(|v| v.position);
        ((a + b + c) / 3.0 - middle).norm()
    };
    let faces = surface.mesh.live_faces().map(|face| (distance(face), face));
    let (distance, face) = faces.min_by(|x, y| x.0.total_cmp(&y.0))?;
    (distance <= SAME * surface.diagonal).then_some(face)
}
