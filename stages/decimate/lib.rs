//! Stage decimate
