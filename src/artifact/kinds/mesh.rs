//! Kind `mesh`: a triangle mesh on its way to a base mesh.

use crate::artifact;
use isospline_geometry::{TriangleMesh, Vec3};

/// How the topology of a mesh was established.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopologyProof {
    /// Taken from a file as it is.
    Imported,
    /// Two resolutions agree; no proof.
    Observed,
    /// Every surface cell passed the interval test.
    Certified,
}

impl TopologyProof {
    /// The stored code.
    pub fn code(self) -> u32 {
        match self {
            Self::Imported => 0,
            Self::Observed => 1,
            Self::Certified => 2,
        }
    }

    /// The proof with this stored code.
    pub fn from_code(code: u32) -> Option<Self> {
        [Self::Imported, Self::Observed, Self::Certified].into_iter().find(|p| p.code() == code)
    }
}

/// One row: what is known of a mesh's topology and extent.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Topology {
    /// Connected components.
    pub components: u32,
    /// Code of a [`TopologyProof`].
    pub proof: u32,
    /// Euler characteristic over all components.
    pub euler_characteristic: i64,
    /// Lower corner of the bounding box of the vertices.
    pub min: [f64; 3],
    /// Upper corner.
    pub max: [f64; 3],
}

artifact! {
    /// A triangle mesh (import, polygonize, decimate, project).
    pub struct Mesh / MeshView = "mesh", schema 1 {
        /// Vertex positions.
        position: [f64; 3], Vertices;
        /// Corners of each face, counter-clockwise seen from outside.
        face: [u32; 3], Faces;
        /// Connected component of each face, numbered from 0.
        component: u32, Faces;
        /// What is known of the whole.
        topology: Topology, One;
    }
}

impl Mesh {
    /// Rows of a closed mesh; components, characteristic and bounds are computed.
    ///
    /// # Errors
    /// The [`isospline_geometry::triangle_mesh::Defect`] that keeps it from being a manifold.
    pub fn from_triangles(
        mesh: &TriangleMesh,
        proof: TopologyProof,
    ) -> Result<Self, isospline_geometry::triangle_mesh::Defect> {
        let opposite = mesh.opposites()?;
        mesh.check_fans(&opposite)?;
        let component = mesh.face_components(&opposite);
        let bounds = mesh.bounds();
        let topology = Topology {
            components: component.iter().max().map_or(0, |c| c + 1),
            proof: proof.code(),
            euler_characteristic: mesh.euler_characteristic(&opposite),
            min: bounds.min.into(),
            max: bounds.max.into(),
        };
        let position = mesh.positions.iter().map(|&p| p.into()).collect();
        Ok(Self { position, face: mesh.faces.clone(), component, topology: vec![topology] })
    }
}

impl MeshView<'_> {
    /// The mesh in memory.
    pub fn to_triangles(&self) -> TriangleMesh {
        let positions = self.position.iter().map(|&p| Vec3::from(p)).collect();
        TriangleMesh { positions, faces: self.face.to_vec() }
    }
}
