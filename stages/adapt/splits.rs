//! Faces split where patches over them were unfit.

use crate::surface_mesh::SurfaceMesh;
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::Counters;

/// Distance of a face's middle from where it was seen, times the diagonal, that is rounding.
const SAME: f64 = 1e-9;

/// Splits the faces with these middles across their longest sides; those that an earlier split
/// took with it are gone.
pub(crate) fn split_faces(
    surface: &mut SurfaceMesh<'_>,
    middles: &[[f64; 3]],
    counters: &mut Counters,
) {
    for middle in middles {
        let Some(face) = face_about(surface, &Vec3::from(*middle)) else { continue };
        let length = |h: HalfEdge| {
            let [p, q] = surface.ends(h);
            (q.position - p.position).norm()
        };
        let sides = [0, 1, 2].map(|k| HalfEdge::new(face, k));
        let longest = sides.into_iter().max_by(|&x, &y| length(x).total_cmp(&length(y)));
        let longest = longest.expect("invariant: a face has sides");
        let reach = length(longest);
        let foot = surface.foot_within(surface.middle(longest), reach);
        if foot.is_some_and(|foot| surface.split(longest, foot).is_some()) {
            counters.repair("unfit_faces_split", 1);
        }
    }
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
