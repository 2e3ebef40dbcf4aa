//! Scalar fields: bulk value, gradient, Hessian and interval enclosure.
//!
//! A text becomes tokens, a graph without equal nodes, derivatives in the same graph, a tape on
//! few registers, and is evaluated over blocks of points or over boxes.

pub mod bounds;
mod canonical;
pub mod closure;
mod dag;
mod derivative;
mod evaluator;
pub mod field;
pub mod formula;
pub mod formula_error;
pub mod functions;
pub mod inside;
pub mod interval;
mod interval_evaluator;
mod interval_functions;
mod lexer;
mod lowering;
mod operation;
mod parser;
mod tape;

pub use bounds::{BoundsError, auto_box};
pub use closure::ClosureField;
pub use field::{Field, Jet1, Jet2, Oriented, SymMat3};
pub use formula::Formula;
pub use formula_error::{FormulaError, FormulaErrorKind};
pub use functions::{CONSTANTS, FUNCTIONS, Function, VARIABLES};
pub use inside::{Inside, InsideError, Side, resolve_inside};
pub use interval::{Interval, IntervalJet};
