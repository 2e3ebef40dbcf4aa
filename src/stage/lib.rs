//! The Stage trait: a pure function of inputs, parameters and field, cut into tasks.

#[cfg(feature = "contract")]
pub mod contract;
pub mod counters;
pub mod host;
pub mod inputs;
pub mod plan;
pub mod stage;

pub use counters::Counters;
pub use host::{Host, Serial, Stopped, map};
pub use inputs::{InputSource, Inputs};
pub use plan::{Need, Plan, Task};
pub use stage::{Ctx, Diagnosis, Params, Piece, Stage};
