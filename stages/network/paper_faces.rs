//! Faces whose sides keep the curves of the paper.

use isospline_artifact::kinds::BaseMeshView;
use isospline_geometry::{HalfEdge, Vec3};

/// Distance of a face's middle from where it was seen, times the diagonal, that is rounding.
const SAME: f64 = 1e-9;

/// The faces, by their middles in model units.
#[derive(Clone, Debug)]
pub(crate) struct PaperFaces(Vec<Vec3>);

impl PaperFaces {
    pub(crate) fn new(middles: &[[f64; 3]]) -> Self {
        Self(middles.iter().map(|&middle| middle.into()).collect())
    }

    /// Whether one of the two faces beside an edge is among them.
    pub(crate) fn are_beside(&self, mesh: &BaseMeshView<'_>, edge: usize) -> bool {
        let reach = SAME * mesh.bounds[0].diagonal;
        !self.0.is_empty()
            && mesh.edge_half[edge].iter().any(|&h| {
                let [a, b, c] = mesh.face[HalfEdge(h).face() as usize]
                    .map(|v| Vec3::from(mesh.position[v as usize]));
                let middle = (a + b + c) / 3.0;
                self.0.iter().any(|seen| (seen - middle).norm() <= reach)
            })
    }
}
