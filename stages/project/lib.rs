//! Stage project
