//! The surface as it is drawn: vertices, faces, and for each face the net of a degree-7 patch.

use crate::RenderError;
use isospline_artifact::kinds::{BaseMeshView, G0FitView, NetworkView, PatchMeta, PatchesView};
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, grid};
use isospline_geometry::{Aabb, Vec3};

/// What is drawn: curved patches or flat triangles.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    position: &'a [[f64; 3]],
    face: &'a [[u32; 3]],
    /// None: the faces are flat.
    patches: Option<PatchesView<'a>>,
}

/// Degree 7 over quartic boundaries, what all patches of the program are.
const META: PatchMeta =
    PatchMeta { scheme: 0, degree: DEGREE as u32, boundary_degree: 4, rational: 0 };

impl<'a> Surface<'a> {
    /// Finished patches.
    ///
    /// # Errors
    /// [`RenderError::Degree`], [`RenderError::Incoherent`], [`RenderError::Empty`].
    pub fn from_patches(patches: &PatchesView<'a>) -> Result<Self, RenderError> {
        let meta = patches.meta.first().copied().unwrap_or_default();
        if !meta.is_known() {
            let (degree, boundary_degree) = (meta.degree, meta.boundary_degree);
            return Err(RenderError::Degree { degree, boundary_degree });
        }
        let flat = Self::from_mesh(patches.position, patches.face)?;
        let n_faces = patches.face.len();
        let n_nets = patches.interior.len().min(patches.edge_of.len() / 3);
        if n_nets < n_faces {
            return Err(RenderError::Incoherent { what: "face", row: n_nets });
        }
        let n_edges = patches.boundary.len();
        if let Some(row) = patches.edge_of.iter().position(|&e| e as usize >= n_edges) {
            return Err(RenderError::Incoherent { what: "half-edge", row });
        }
        Ok(Self { patches: Some(*patches), ..flat })
    }

    /// The patches of the G0 fit: they meet along the curves of the network and nothing more.
    ///
    /// # Errors
    /// As [`Surface::from_patches`].
    pub fn from_g0_fit(
        base: &BaseMeshView<'a>,
        network: &NetworkView<'a>,
        fit: &G0FitView<'a>,
    ) -> Result<Self, RenderError> {
        Self::from_patches(&PatchesView {
            meta: &[META],
            position: base.position,
            face: base.face,
            edge_of: base.edge_of,
            boundary: network.control,
            interior: fit.interior,
        })
    }

    /// Flat triangles.
    ///
    /// # Errors
    /// [`RenderError::Incoherent`], [`RenderError::Empty`].
    pub fn from_mesh(position: &'a [[f64; 3]], face: &'a [[u32; 3]]) -> Result<Self, RenderError> {
        let n = position.len();
        if let Some(row) = face.iter().position(|f| f.iter().any(|&v| v as usize >= n)) {
            return Err(RenderError::Incoherent { what: "face", row });
        }
        if face.is_empty() {
            return Err(RenderError::Empty);
        }
        Ok(Self { position, face, patches: None })
    }

    /// Number of faces.
    pub fn n_faces(&self) -> usize {
        self.face.len()
    }

    /// Control points of a face, in storage order; those of a flat face lie in its plane.
    pub fn net(&self, face: usize) -> [Vec3; N_CONTROL] {
        if let Some(patches) = &self.patches {
            return patches.net(face);
        }
        let [a, b, c] = self.face[face].map(|v| Vec3::from(self.position[v as usize]));
        let mut net = [Vec3::zeros(); N_CONTROL];
        for (slot, [u, v, w]) in net.iter_mut().zip(grid(DEGREE)) {
            *slot = u * a + v * b + w * c;
        }
        net
    }

    /// Diagonal of the box around the vertices: the unit of relative figures.
    pub fn diagonal(&self) -> f64 {
        let points: Vec<Vec3> = self.position.iter().map(|&p| p.into()).collect();
        Aabb::around(&points).diagonal()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::two_bowls;

    #[test]
    fn rows_that_name_what_is_not_there_are_refused() {
        let sound = two_bowls(0.0);
        assert!(Surface::from_patches(&sound.view()).is_ok());
        let refused = |change: &dyn Fn(&mut isospline_artifact::kinds::Patches)| {
            let mut rows = sound.clone();
            change(&mut rows);
            Surface::from_patches(&rows.view()).unwrap_err().to_string()
        };
        assert!(refused(&|rows| rows.face[1][2] = 9).contains("face 1"));
        assert!(refused(&|rows| rows.edge_of[4] = 9).contains("half-edge 4"));
        assert!(refused(&|rows| rows.interior.truncate(1)).contains("face 1"));
        assert!(refused(&|rows| rows.meta[0].degree = 3).contains("degree 3"));
        assert!(refused(&|rows| rows.face.clear()).contains("no faces"));
    }

    #[test]
    fn the_net_of_a_flat_face_lies_in_its_plane() {
        let position = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 3.0, 1.0]];
        let surface = Surface::from_mesh(&position, &[[0, 1, 2]]).unwrap();
        let net = surface.net(0);
        assert!(net.iter().all(|p| (p.z - 1.0).abs() < 1e-15));
        assert_eq!(net[35], Vec3::new(0.0, 3.0, 1.0));
    }
}
