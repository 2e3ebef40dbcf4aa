//! Stage vertex_systems
