//! A graph of stages becomes artifacts in a store: keys, staleness, driver, threads, events.
//!
//! The only crate that starts threads and reads clocks. [`Pipeline::status`] says what is fresh
//! and why the rest is not; [`Pipeline::run`] computes the rest.

mod clock;
mod dataflow;
pub mod driver;
mod erase;
pub mod error;
pub mod event;
#[cfg(test)]
mod faulty;
mod finisher;
pub mod freshness;
pub mod graph;
mod host;
mod keeper;
pub mod keys;
mod memory;
pub mod options;
mod prepare;
pub mod provenance;
mod readiness;
pub mod registry;
pub mod report;
mod resume;
mod row_writer;
mod tally;
mod tiling;
#[cfg(test)]
mod toys;
pub mod trace;
mod workers;

pub use driver::Pipeline;
pub use error::{GraphError, Kept, ParamsError, RunError, StageFailure};
pub use event::Event;
pub use freshness::{Begun, NodeStatus, State};
pub use graph::{Given, Graph, ModelKey, Node};
pub use host::Threads;
pub use keys::Reason;
pub use options::{RunOptions, Scene};
pub use provenance::{Provenance, read_provenance};
pub use registry::{Registry, StageInfo};
pub use report::{NodeReport, Outcome, RunReport};
pub use trace::Trace;
