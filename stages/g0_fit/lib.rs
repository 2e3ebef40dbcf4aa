//! Stage g0_fit
