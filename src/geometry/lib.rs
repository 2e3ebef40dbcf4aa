//! Points, barycentrics, Bézier curves and triangles, triangle meshes and small dense solves.
//!
//! The bottom layer: it knows nothing of fields, files or stages.

pub mod aabb;
pub mod bezier_curve;
pub mod bezier_triangle;
pub mod degree_change;
pub mod edit_mesh;
pub mod half_edge;
pub mod linear;
pub mod triangle_mesh;

pub use aabb::Aabb;
pub use edit_mesh::EditMesh;
pub use half_edge::HalfEdge;
pub use triangle_mesh::TriangleMesh;

/// A point or a vector in model units.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 by 3 matrix, column-major in memory.
pub type Mat3 = nalgebra::Matrix3<f64>;
