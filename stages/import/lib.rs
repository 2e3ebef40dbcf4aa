//! Stage import
