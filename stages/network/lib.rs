//! Stage network
