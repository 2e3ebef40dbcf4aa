//! Command `import`: the model file that says what a foreign one says.

use crate::cli::args::ImportArgs;
use crate::cli::failure::Failure;
use crate::cli::output::say;
use isospline::ModelError;
use isospline::config::{ConfigError, ModelFile, foreign_as_toml};
use isospline::text_file::read_text;
use isospline_artifact::{Durability, write_file_atomic};
use isospline_implicit::{ForeignFormat, Formula};

/// Writes the model file of a foreign model.
pub(crate) fn import(args: &ImportArgs) -> Result<u8, Failure> {
    let format = ForeignFormat::of(&args.file).ok_or_else(|| {
        Failure::usage(format!("{} is neither .jsurf nor .vm", args.file.display()))
    })?;
    let text = read_text(&args.file)
        .map_err(|source| ConfigError::Read { path: args.file.clone(), source })?;
    let toml = foreign_as_toml(&args.file, format, &text)?;
    // What is written can be read: a formula that cannot is told here, with its place.
    let model = ModelFile::open(&args.file, &[])?.model;
    Formula::parse(&model.formula, &model.parameters).map_err(|error| ModelError::Formula {
        text: model.formula.clone(),
        error: Box::new(error),
    })?;
    let Some(path) = &args.output else {
        say(toml.trim_end())?;
        return Ok(0);
    };
    if path.exists() && !args.force {
        return Err(Failure::usage(format!("{} is there already", path.display()))
            .helped("give another name, or --force"));
    }
    write_file_atomic(path, Durability::Durable, |out| out.write_all(toml.as_bytes()))?;
    say(&path.display().to_string())?;
    Ok(0)
}
