//! Model files: TOML to typed tables, with places for every complaint.

mod canonical;
mod document;
mod error;
mod fit;
mod foreign;
mod model_file;
mod stage_params;
mod tables;

pub use document::{Document, Place, Source};
pub use error::ConfigError;
pub use fit::Fit;
pub use foreign::foreign_as_toml;
pub use model_file::{DEFAULT_FACES, Domain, Inside, ModelFile, ModelTable, TargetTable};
pub use stage_params::StageParams;
