//! What can be wrong with a model file.

use crate::config::Place;
use isospline_implicit::ForeignError;
use std::path::PathBuf;

/// Why a model file or an override is refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not TOML.
    #[error("not valid TOML: {message}")]
    Syntax {
        /// The parser's sentence.
        message: String,
        /// Where.
        place: Place,
    },
    /// A model file of another program is not what its format asks for.
    #[error("{error}")]
    Foreign {
        /// What is wrong with it.
        error: Box<ForeignError>,
        /// Where.
        place: Place,
    },
    /// A `--set` argument is malformed.
    #[error("cannot use --set {argument}: {reason}")]
    Override {
        /// The argument.
        argument: String,
        /// Why not.
        reason: &'static str,
    },
    /// A key that nothing reads.
    #[error("unknown key `{key}`{}", line_of(place.as_ref()))]
    UnknownKey {
        /// Dotted path.
        key: String,
        /// The known name most like it.
        nearest: Option<String>,
        /// All names known there.
        known: Vec<String>,
        /// Where.
        place: Option<Place>,
    },
    /// A value of another type than the key takes.
    #[error("`{key}` cannot be read{}: {message}", line_of(place.as_ref()))]
    WrongType {
        /// Dotted path.
        key: String,
        /// What was expected and found.
        message: String,
        /// Where.
        place: Option<Place>,
    },
    /// A value outside its range.
    #[error("`{key}` is out of range{}: {message}", line_of(place.as_ref()))]
    OutOfRange {
        /// Dotted path.
        key: String,
        /// The range.
        message: String,
        /// Where.
        place: Option<Place>,
    },
    /// A parameter that no formula can name.
    #[error("`{key}` is no parameter{}: {message}", line_of(place.as_ref()))]
    ParameterName {
        /// Dotted path.
        key: String,
        /// What is wrong with the name.
        message: String,
        /// Where.
        place: Option<Place>,
    },
    /// A key without which there is no model.
    #[error("`{key}` is missing")]
    Missing {
        /// Dotted path.
        key: &'static str,
    },
    /// Two keys that exclude each other.
    #[error("`{key}` and `{other}` exclude each other{}", line_of(place.as_ref()))]
    Conflict {
        /// Dotted path.
        key: String,
        /// Dotted path of the other.
        other: String,
        /// Where the other stands.
        place: Option<Place>,
    },
    /// A key that is set in one place for several stages.
    #[error("`{key}` is not set here{}", line_of(place.as_ref()))]
    Elsewhere {
        /// Dotted path.
        key: String,
        /// The key to set in its place.
        instead: &'static str,
        /// Where.
        place: Option<Place>,
    },
}

impl ConfigError {
    /// Where it is seen, if in a text.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::Syntax { place, .. } | Self::Foreign { place, .. } => Some(place),
            Self::UnknownKey { place, .. }
            | Self::WrongType { place, .. }
            | Self::OutOfRange { place, .. }
            | Self::ParameterName { place, .. }
            | Self::Conflict { place, .. }
            | Self::Elsewhere { place, .. } => place.as_ref(),
            Self::Read { .. } | Self::Override { .. } | Self::Missing { .. } => None,
        }
    }

    /// A stable code, kebab-case.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Read { .. } => "model-file-unreadable",
            Self::Syntax { .. } => "toml-syntax",
            Self::Foreign { .. } => "foreign-syntax",
            Self::Override { .. } => "bad-override",
            Self::UnknownKey { .. } => "unknown-key",
            Self::WrongType { .. } => "wrong-type",
            Self::OutOfRange { .. } => "out-of-range",
            Self::ParameterName { .. } => "parameter-name",
            Self::Missing { .. } => "missing-key",
            Self::Conflict { .. } => "keys-conflict",
            Self::Elsewhere { .. } => "key-set-elsewhere",
        }
    }

    /// What the user can do.
    pub fn help(&self) -> String {
        match self {
            Self::Read { .. } => "give the path of a model file, or --formula \"...\"".to_owned(),
            Self::Syntax { .. } => "strings need quotes; see configs/reference.toml".to_owned(),
            Self::Foreign { .. } => "mend the line, or write the model as TOML".to_owned(),
            Self::Override { .. } => {
                "write --set TABLE.KEY=VALUE, such as --set target.faces=2000".to_owned()
            }
            Self::UnknownKey { nearest: Some(name), .. } => format!("did you mean `{name}`?"),
            Self::UnknownKey { known, .. } if known.is_empty() => {
                "this table has no keys".to_owned()
            }
            Self::UnknownKey { known, .. } => format!("known here: {}", known.join(", ")),
            Self::WrongType { .. } | Self::OutOfRange { .. } => {
                "configs/reference.toml lists each key with its type and range".to_owned()
            }
            Self::ParameterName { .. } => {
                "rename the parameter, here and in the formula".to_owned()
            }
            Self::Missing { key } => format!("add `{key}` to the model file"),
            Self::Conflict { key, other, .. } => format!("leave out `{key}` or `{other}`"),
            Self::Elsewhere { instead, .. } => format!("set `{instead}`: all stages take it"),
        }
    }
}

fn line_of(place: Option<&Place>) -> String {
    place.map_or_else(String::new, |place| match place.source.name.as_str() {
        "--set" => " (--set)".to_owned(),
        name => format!(" ({name}, line {})", place.line()),
    })
}
