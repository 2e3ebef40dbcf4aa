//! Scalar fields: bulk value, gradient, Hessian and interval enclosure.

pub mod closure;
pub mod field;
pub mod interval;

pub use closure::ClosureField;
pub use field::{Field, Jet1, Jet2, Oriented, SymMat3};
pub use interval::{Interval, IntervalJet};
