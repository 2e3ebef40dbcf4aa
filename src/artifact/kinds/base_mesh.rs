//! Kind `base_mesh`: the frozen, ordered mesh with all adjacency that later stages need.

use crate::artifact;

/// Normal and its bookkeeping, one row a sector (one a smooth vertex, several at a crease).
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Frame {
    /// Outward unit normal, `grad f / |grad f|` unless the vertex was left free.
    pub normal: [f64; 3],
    /// `|grad f|`, in units of f a model unit.
    pub gradient_norm: f64,
    /// The vertex.
    pub vertex: u32,
    /// The sheet of the surface that the sector belongs to.
    pub sheet: u32,
}

/// A run of faces about a vertex: the unit of work of the vertex systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Fan {
    /// The vertex.
    pub vertex: u32,
    /// Its first outgoing half-edge; the next ones follow counter-clockwise in `star`.
    pub first_half_edge: u32,
    /// Faces of the fan.
    pub n_faces: u32,
    /// 1 if the fan closes around the vertex, 0 if borders end it.
    pub closed: u32,
}

/// Extent of the mesh: the diagonal is the unit of all relative figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Bounds {
    /// Lower corner of the box around the vertices.
    pub min: [f64; 3],
    /// Upper corner.
    pub max: [f64; 3],
    /// Length of its diagonal.
    pub diagonal: f64,
}

/// What an edge asks of the two patches that meet there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// One tangent plane: a G1 edge.
    Smooth,
    /// Two sheets that join smoothly.
    Join,
    /// Two tangent planes.
    Crease,
    /// One face only.
    Border,
    /// No curve.
    Null,
}

impl EdgeKind {
    /// The stored code.
    pub fn code(self) -> u8 {
        match self {
            Self::Smooth => 0,
            Self::Join => 1,
            Self::Crease => 2,
            Self::Border => 3,
            Self::Null => 4,
        }
    }
}

artifact! {
    /// The base mesh, ordered by a breadth-first front and frozen (adapt).
    ///
    /// Row `star_first[v] .. star_first[v + 1]` of the sections in star order belong to vertex
    /// `v`; `star_row[h]` is the place of half-edge `h` in that order.
    pub struct BaseMesh / BaseMeshView = "base_mesh", schema 2 {
        /// Vertex positions, on the surface unless they were left free.
        position: [f64; 3], Vertices;
        /// Normals.
        frame: Frame, Sectors;
        /// Second fundamental forms `[xx, xy, xz, yy, yz, zz]`, 1/length, that free vertices were
        /// given; none where those of the surface hold.
        shape: [f64; 6], SectorsOrNone;
        /// Corners of each face, counter-clockwise seen from outside.
        face: [u32; 3], Faces;
        /// Sheet of each face.
        face_sheet: u32, Faces;
        /// Opposite half-edge; `u32::MAX` at a border.
        opposite: u32, HalfEdges;
        /// Vertices `[a, b]` of each edge, `a < b`.
        edge: [u32; 2], Edges;
        /// Half-edges `[a -> b, b -> a]` of each edge; `u32::MAX` where there is none.
        edge_half: [u32; 2], Edges;
        /// Code of the [`EdgeKind`].
        edge_kind: u8, Edges;
        /// Edge of each half-edge.
        edge_of: u32, HalfEdges;
        /// First row of each vertex in star order, and the number of rows.
        star_first: u32, VerticesPlusOne;
        /// Outgoing half-edges of each vertex, counter-clockwise.
        star: u32, HalfEdges;
        /// Place of each half-edge in `star`.
        star_row: u32, HalfEdges;
        /// Sector of the corner that each half-edge leaves.
        sector: u32, HalfEdges;
        /// Fans of faces.
        fan: Fan, Fans;
        /// Extent.
        bounds: Bounds, One;
    }
}
