//! Scalar fields: bulk value, gradient, Hessian and interval enclosure.
//!
//! Text becomes tokens (`lexer`), a graph without equal nodes (`parser`, `dag`), derivatives
//! in the same graph (`derivative`), elementary operations (`lowering`) and instructions on
//! few registers (`tape`), which run over blocks of points (`evaluator`) or over boxes
//! (`interval_evaluator`, `affine_lanes`). Model files of other programs become text (`foreign`).

mod affine;
mod affine_lanes;
pub mod bounds;
mod canonical;
mod circular;
pub mod closure;
mod dag;
mod derivative;
mod evaluator;
pub mod field;
pub mod foreign;
pub mod formula;
pub mod formula_error;
pub mod functions;
pub mod inside;
mod instruction_set;
mod interner;
pub mod interval;
mod interval_evaluator;
mod interval_functions;
mod interval_lanes;
mod kinks;
mod lexer;
mod lowering;
mod operation;
mod parser;
mod tape;

pub use affine::{Affine, AffineJet};
pub use bounds::{BoundsError, auto_box};
pub use closure::ClosureField;
pub use field::{BLOCK, Field, Jet1, Jet2, Oriented, SymMat3};
pub use foreign::{ForeignError, ForeignErrorKind, ForeignFormat, ForeignModel};
pub use formula::Formula;
pub use formula_error::{FormulaError, FormulaErrorKind};
pub use functions::{CONSTANTS, FUNCTIONS, Function, VARIABLES};
pub use inside::{Inside, InsideError, Side, resolve_inside};
#[doc(hidden)]
pub use instruction_set::{InstructionSet, Kernel, run_widest, use_at_most};
pub use interval::{Interval, IntervalJet};
