//! What several stages share of the method: projection, shape operator, curves of edges, systems
//! of vertices and edges.

pub mod curve_samples;
pub mod edge_end;
pub mod edge_rows;
pub mod edge_system;
pub mod innermost;
pub mod lanes;
pub mod net;
pub mod normal_curve;
pub mod paper_curve;
pub mod paper_curves;
pub mod patch_fit;
pub mod projection;
pub mod sextic_edge;
pub mod shape;
pub mod start;
pub mod vertex_star;
pub mod vertex_system;
