//! What several stages share of the method: projection, shape operator, curves of edges, edge-end
//! weights.

pub mod curve_samples;
pub mod edge_end;
pub mod net;
pub mod normal_curve;
pub mod paper_curve;
pub mod patch_fit;
pub mod projection;
pub mod shape;
pub mod start;
