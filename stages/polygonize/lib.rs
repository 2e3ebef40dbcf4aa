//! Stage polygonize
