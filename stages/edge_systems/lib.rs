//! Stage edge_systems
