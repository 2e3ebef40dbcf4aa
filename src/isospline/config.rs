//! Model files: TOML to typed tables, with places for every complaint.

mod canonical;
mod document;
mod error;
mod fit;
mod foreign;
mod model_file;
mod schema;
mod stage_params;
mod tables;
mod target;

pub use document::{Document, Place, Source};
pub use error::ConfigError;
pub use fit::Fit;
pub use foreign::foreign_as_toml;
pub use model_file::{Domain, Inside, ModelFile, ModelTable};
pub use schema::schema;
pub use stage_params::StageParams;
pub use target::{DEFAULT_FACES, DEFAULT_MENDS, TargetTable};
