//! Stage curvature
