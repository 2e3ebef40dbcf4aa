//! Stage adapt
