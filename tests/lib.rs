//! One file a promise, checked from outside
