//! Implicit surfaces to watertight G1 triangular spline surfaces: library and command line
