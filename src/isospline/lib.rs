//! Implicit surfaces to watertight G1 triangular spline surfaces.
//!
//! [`convert`] turns a field of the caller's own into a surface in memory; [`ModelFolder`] turns a
//! model file into a folder of artifacts, as the command line does.

pub mod batch;
mod box_search;
pub mod config;
mod convert;
mod folder;
mod mending;
mod model;
pub mod report;
pub mod stages;
pub mod text_file;
pub mod tolerance;

pub use box_search::Reach;
pub use convert::{Conversion, ConvertError, Options, convert, convert_with_events};
pub use folder::{
    BASE_MESH_NOTE, FolderError, MENDS_NOTE, MODEL_NOTE, ModelFolder, REPORT_NOTE, ROUNDS_NOTE,
    Rounds,
};
pub use isospline_check::{CheckParams, CheckReport};
pub use isospline_geometry::{Aabb, TriangleMesh, Vec3};
pub use isospline_implicit::{ClosureField, Field, InsideError};
pub use model::{Model, ModelError};
