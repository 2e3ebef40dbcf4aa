//! Finished patches become files that other programs read, one module a format.
//!
//! Exact formats (npz, vtu, bv, step, and msh of order 7) carry the control points themselves or as
//! many points, f64; the others a triangle mesh within a tolerance of the patches. In every format the points on a shared edge are made once, from data
//! that both faces name by id: files are closed by construction, and equal surfaces give equal
//! bytes. Writers stream; they hold one face and a few words an edge.

mod about;
mod bezier_view;
mod error;
mod file;
mod format;
mod glb;
mod mass;
mod msh;
mod node_order;
mod npz;
mod npz_reader;
mod obj;
mod ply;
mod quads;
mod solids;
mod step;
mod step_lint;
mod stl;
mod tessellation;
mod three_mf;
mod vtu;
mod zip_archive;

#[cfg(test)]
mod sample;

pub use about::{About, LengthUnit};
pub use error::ExportError;
pub use file::{read_npz_file, write_file};
pub use format::{Format, Options, UnknownFormat, write};
pub use npz_reader::{NpzError, NpzSurface, read_npz};
pub use step::{StepOptions, StepSchema};
pub use step_lint::{StepDefect, StepShell, StepSummary, lint_step, lint_step_file};
pub use tessellation::Density;
