//! Stage fairing
