//! The surface as the checker sees it: vertices, faces and expanded nets.

use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::N_CONTROL;
use isospline_geometry::{Aabb, HalfEdge, Vec3};

/// Control points of one degree-7 patch, in storage order, model units.
pub type Net = [Vec3; N_CONTROL];

/// Vertices, faces and nets; faces name existing vertices and have a net each.
#[derive(Clone, Debug)]
pub struct Surface<'a> {
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    nets: Nets<'a>,
}

/// Where nets come from.
#[derive(Clone, Debug)]
enum Nets<'a> {
    Expanded(Vec<Net>),
    /// Expanded when they are looked at: a million nets are a gigabyte.
    Rows(PatchesView<'a>),
}

/// Why arrays are not a surface at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SurfaceError {
    /// The numbers of faces and nets differ.
    #[error("{faces} faces but {nets} nets of control points")]
    Lengths {
        /// Number of faces.
        faces: usize,
        /// Number of nets.
        nets: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are {vertices} vertices")]
    MissingVertex {
        /// The face.
        face: usize,
        /// The vertex index that it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A half-edge names an edge that does not exist.
    #[error("half-edge {half_edge} names edge {edge}, but there are {edges} edges")]
    MissingEdge {
        /// The half-edge.
        half_edge: usize,
        /// The edge index that it names.
        edge: u32,
        /// Number of edges.
        edges: usize,
    },
    /// The patches are not polynomial of degree 7 with quartic boundaries.
    #[error("patches of degree {degree} with boundary degree {boundary_degree} cannot be checked")]
    Degree {
        /// Degree found.
        degree: u32,
        /// Boundary degree found.
        boundary_degree: u32,
    },
}

impl<'a> Surface<'a> {
    /// A surface from its arrays.
    ///
    /// # Errors
    /// [`SurfaceError::Lengths`] or [`SurfaceError::MissingVertex`].
    pub fn new(
        vertices: Vec<Vec3>,
        faces: Vec<[u32; 3]>,
        nets: Vec<Net>,
    ) -> Result<Self, SurfaceError> {
        if faces.len() != nets.len() {
            return Err(SurfaceError::Lengths { faces: faces.len(), nets: nets.len() });
        }
        require_vertices(&faces, vertices.len())?;
        Ok(Self { vertices, faces, nets: Nets::Expanded(nets) })
    }

    /// The surface of a `patches` artifact, whose nets stay where they are.
    ///
    /// # Errors
    /// Any [`SurfaceError`]: rows with sound checksums may still name what does not exist.
    pub fn from_patches(patches: &PatchesView<'a>) -> Result<Self, SurfaceError> {
        let meta = patches.meta.first().copied().unwrap_or_default();
        if !meta.is_known() {
            let (degree, boundary_degree) = (meta.degree, meta.boundary_degree);
            return Err(SurfaceError::Degree { degree, boundary_degree });
        }
        require_vertices(patches.face, patches.position.len())?;
        let n_nets = patches.interior.len().min(patches.edge_of.len() / 3);
        if n_nets != patches.face.len() {
            return Err(SurfaceError::Lengths { faces: patches.face.len(), nets: n_nets });
        }
        let edges = patches.boundary.len();
        for (half_edge, &edge) in patches.edge_of.iter().enumerate() {
            if edge as usize >= edges {
                return Err(SurfaceError::MissingEdge { half_edge, edge, edges });
            }
        }
        let vertices = patches.position.iter().map(|&p| Vec3::from(p)).collect();
        Ok(Self { vertices, faces: patches.face.to_vec(), nets: Nets::Rows(*patches) })
    }

    /// Vertex positions.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Corners of each face, counter-clockwise seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Control points of a face.
    pub fn net(&self, face: usize) -> Net {
        match &self.nets {
            Nets::Expanded(nets) => nets[face],
            Nets::Rows(patches) => patches.net(face),
        }
    }

    /// Diagonal of the box around the vertices: the unit of relative figures.
    pub fn diagonal(&self) -> f64 {
        Aabb::around(&self.vertices).diagonal()
    }

    /// The vertex at corner 0 of a face.
    pub(crate) fn corner(&self, face: usize) -> Vec3 {
        self.vertices[self.faces[face][0] as usize]
    }

    pub(crate) fn origin(&self, h: HalfEdge) -> u32 {
        self.faces[h.face() as usize][h.corner() as usize]
    }
}

/// Whether two points agree in all bits.
pub(crate) fn same_bits(p: &Vec3, q: &Vec3) -> bool {
    (0..3).all(|k| p[k].to_bits() == q[k].to_bits())
}

fn require_vertices(faces: &[[u32; 3]], vertices: usize) -> Result<(), SurfaceError> {
    for (face, corners) in faces.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
            return Err(SurfaceError::MissingVertex { face, vertex, vertices });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_do_not_fit_together_are_refused() {
        let net = [Vec3::zeros(); N_CONTROL];
        let vertices = vec![Vec3::zeros(); 3];
        assert_eq!(
            Surface::new(vertices.clone(), vec![[0, 1, 2]], vec![]).unwrap_err(),
            SurfaceError::Lengths { faces: 1, nets: 0 }
        );
        assert_eq!(
            Surface::new(vertices, vec![[0, 1, 3]], vec![net]).unwrap_err(),
            SurfaceError::MissingVertex { face: 0, vertex: 3, vertices: 3 }
        );
    }
}
