//! What several stages share of the method: projection, shape operator, edge-end weights.

pub mod edge_end;
pub mod net;
pub mod patch_fit;
pub mod projection;
pub mod shape;
pub mod start;
