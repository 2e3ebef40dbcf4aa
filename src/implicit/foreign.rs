//! Model files of other programs become formulas of this one.

mod jsurf;
mod vm;

use std::collections::BTreeMap;
use std::path::Path;

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForeignFormat {
    /// `.jsurf`: the gallery format of SURFER, Java properties.
    Jsurf,
    /// `.vm`: the op list of fidget, one operation a line.
    Vm,
}

/// What a foreign file says of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignModel {
    /// The formula, in the language of [`crate::Formula`].
    pub formula: String,
    /// Values of its named parameters.
    pub parameters: BTreeMap<String, f64>,
    /// Radius of the ball around the origin to which the other program clips its picture, in
    /// model units, if the file tells.
    pub view_radius: Option<f64>,
}

/// Why a foreign file is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {kind}")]
pub struct ForeignError {
    /// Line, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub kind: ForeignErrorKind,
}

/// What can be wrong with a foreign file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForeignErrorKind {
    /// Nothing says what the surface is.
    #[error("no {expected}")]
    Empty {
        /// What was looked for.
        expected: &'static str,
    },
    /// Not a number where one has to be.
    #[error("`{text}` is not a finite number")]
    Number {
        /// What stands there.
        text: String,
    },
    /// An operation that the format does not have.
    #[error("unknown operation `{name}`")]
    Operation {
        /// Its name.
        name: String,
    },
    /// Too few or too many arguments.
    #[error("`{name}` takes {expected} arguments and has {found}")]
    Arguments {
        /// The operation.
        name: String,
        /// How many it takes.
        expected: usize,
        /// How many stand there.
        found: usize,
    },
    /// An argument that no line before names.
    #[error("`{name}` is not defined before this line")]
    Undefined {
        /// Its name.
        name: String,
    },
    /// A name that a line before has taken.
    #[error("`{name}` is defined twice")]
    Twice {
        /// The name.
        name: String,
    },
}

impl ForeignFormat {
    /// All formats with their file extensions.
    pub const ALL: [(&'static str, Self); 2] = [("jsurf", Self::Jsurf), ("vm", Self::Vm)];

    /// The format of a file, by its extension in any case.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        let is_it = |(known, _): &&(&str, Self)| extension.eq_ignore_ascii_case(known);
        Self::ALL.iter().find(is_it).map(|&(_, format)| format)
    }

    /// Reads a file's text. The formula itself is checked when it is parsed.
    ///
    /// # Errors
    /// [`ForeignError`] with the line.
    pub fn read(self, text: &str) -> Result<ForeignModel, ForeignError> {
        // Editors on Windows put a byte order mark before the first line.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        match self {
            Self::Jsurf => jsurf::read(text),
            Self::Vm => vm::read(text),
        }
    }
}

fn finite(text: &str, line: usize) -> Result<f64, ForeignError> {
    let value = text.trim().parse().ok().filter(|value: &f64| value.is_finite());
    let kind = || ForeignErrorKind::Number { text: text.trim().to_owned() };
    value.ok_or_else(|| ForeignError { line, kind: kind() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_extension() {
        assert_eq!(ForeignFormat::of(Path::new("a/b.c.JSurf")), Some(ForeignFormat::Jsurf));
        assert_eq!(ForeignFormat::of(Path::new("bear.vm")), Some(ForeignFormat::Vm));
        assert_eq!(ForeignFormat::of(Path::new("vm")), None);
        assert_eq!(ForeignFormat::of(Path::new("model.toml")), None);
    }
}
