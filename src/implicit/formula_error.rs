//! What can be wrong with a formula, and where.

use std::fmt;
use std::ops::Range;
use thiserror::Error;

/// A formula that cannot be read: the cause and its place.
///
/// # Examples
/// ```
/// use isospline_implicit::{Formula, FormulaErrorKind};
/// use std::collections::BTreeMap;
///
/// let error = Formula::parse("x^2 + log(y)", &BTreeMap::new()).unwrap_err();
/// assert_eq!(error.kind, FormulaErrorKind::AmbiguousLog);
/// assert_eq!((error.line, error.column), (1, 7));
/// assert_eq!(error.rendered(), "\
/// `log` is ambiguous: ln or log10?
///   |
/// 1 | x^2 + log(y)
///   |       ^^^");
/// ```
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{kind} (line {line}, column {column})")]
pub struct FormulaError {
    /// The cause.
    pub kind: FormulaErrorKind,
    /// Bytes of the text that are to blame; empty at the end of the text and for parameters.
    pub span: Range<usize>,
    /// Line of the start, from 1.
    pub line: usize,
    /// Column of the start in characters, from 1.
    pub column: usize,
    // Boxed to keep results small.
    excerpt: Box<Excerpt>,
}

/// Causes of a [`FormulaError`].
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FormulaErrorKind {
    /// `""`
    #[error("the formula is empty")]
    Empty,
    /// `x $ y`
    #[error("unexpected character `{character}`")]
    UnexpectedCharacter {
        /// It.
        character: char,
    },
    /// `1.2.3` or `1e999`
    #[error("`{text}` is not a finite number")]
    BadNumber {
        /// It.
        text: String,
    },
    /// `x + * y`
    #[error("expected a value, found {found}")]
    ExpectedValue {
        /// What stands there.
        found: String,
    },
    /// `2 x`
    #[error("expected an operator, found {found} (a product is written with `*`)")]
    ExpectedOperator {
        /// What stands there.
        found: String,
    },
    /// `(x + y`
    #[error("this parenthesis is never closed")]
    Unclosed,
    /// `x + y)`
    #[error("this parenthesis was never opened")]
    Unopened,
    /// `x + , y`
    #[error("a comma outside of a call")]
    StrayComma,
    /// `x^2 + rr` where only `r` is known
    #[error("unknown name `{name}`{}", suggestion(nearest.as_deref()))]
    UnknownName {
        /// It.
        name: String,
        /// The nearest known name, if one is near.
        nearest: Option<String>,
    },
    /// `sqr(x)`
    #[error("unknown function `{name}`{}", suggestion(nearest.as_deref()))]
    UnknownFunction {
        /// It.
        name: String,
        /// The nearest known function, if one is near.
        nearest: Option<String>,
    },
    /// `log(x)`
    #[error("`log` is ambiguous: ln or log10?")]
    AmbiguousLog,
    /// `x(2)`
    #[error("`{name}` is not a function (a product is written with `*`)")]
    NotAFunction {
        /// It.
        name: String,
    },
    /// `sin + 1`
    #[error("`{name}` is a function and needs arguments in parentheses")]
    NoArguments {
        /// It.
        name: &'static str,
    },
    /// `atan2(x)`
    #[error("`{name}` takes {}, not {found}", arguments(*least, *most))]
    ArgumentCount {
        /// The function.
        name: &'static str,
        /// Fewest arguments.
        least: usize,
        /// Most arguments.
        most: usize,
        /// Arguments given.
        found: usize,
    },
    /// `smin(x, y, 0)`
    #[error("the width of a blend must be positive, not {width}")]
    BlendWidth {
        /// The third argument.
        width: f64,
    },
    /// `r = x; r = y; r`
    #[error("`{name}` is defined twice")]
    DefinedTwice {
        /// It.
        name: String,
    },
    /// `x = 2; x`
    #[error("`{name}` has a meaning of its own and cannot be redefined")]
    Reserved {
        /// It.
        name: String,
    },
    /// `x + 1` on one line, `y` on the next
    #[error(
        "only the last line may stand without a name (end a line with an operator to continue it)"
    )]
    ValueNotLast,
    /// `r = x^2`
    #[error("the last line must be the value, not a definition")]
    NoValue,
    /// two hundred opening parentheses
    #[error("nested deeper than {limit} levels")]
    TooDeep {
        /// Levels allowed.
        limit: usize,
    },
    /// a parameter `2r`
    #[error("the parameter `{name}` is not a name (letters, digits, `_`)")]
    ParameterName {
        /// It.
        name: String,
    },
    /// a parameter `sin`
    #[error("the parameter `{name}` takes a name that has a meaning of its own")]
    ParameterReserved {
        /// It.
        name: String,
    },
    /// a parameter `r = inf`
    #[error("the parameter `{name}` is {value}, not a finite number")]
    ParameterValue {
        /// Its name.
        name: String,
        /// Its value.
        value: f64,
    },
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

fn arguments(least: usize, most: usize) -> String {
    match (least, most) {
        (1, 1) => "1 argument".into(),
        _ if least == most => format!("{least} arguments"),
        _ => format!("{least} or more arguments"),
    }
}

/// The part of the line to show.
#[derive(Clone, Debug, PartialEq)]
struct Excerpt {
    text: String,
    /// Characters before the caret, and carets.
    caret: (usize, usize),
}

/// Characters shown on either side of an error: a line of a million terms is not printed whole.
const REACH: usize = 60;

impl Excerpt {
    fn new(line: &str, column: usize, width: usize) -> Self {
        let first = column.saturating_sub(REACH);
        let mut shown = line.chars().skip(first);
        let mut text: String = if first > 0 { "...".into() } else { String::new() };
        let before = text.chars().count() + column - first;
        text.extend(shown.by_ref().take(column - first + REACH));
        if shown.next().is_some() {
            text.push_str("...");
        }
        let room = text.chars().count().saturating_sub(before).max(1);
        Self { text, caret: (before, width.clamp(1, room)) }
    }
}

impl FormulaError {
    /// `span` in bytes of `text`.
    pub(crate) fn new(kind: FormulaErrorKind, text: &str, span: Range<usize>) -> Self {
        let before = &text[..span.start];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line_text = text[line_start..].lines().next().unwrap_or("");
        let column = text[line_start..span.start].chars().count();
        let width = text[span.clone()].lines().next().unwrap_or("").chars().count();
        Self {
            kind,
            line: before.matches('\n').count() + 1,
            column: column + 1,
            excerpt: Box::new(Excerpt::new(line_text, column, width)),
            span,
        }
    }

    /// The message, the line of the formula and a caret below the place.
    pub fn rendered(&self) -> String {
        Rendered(self).to_string()
    }
}

struct Rendered<'a>(&'a FormulaError);

impl fmt::Display for Rendered<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FormulaError { kind, line, excerpt, .. } = self.0;
        let gutter = line.to_string().len();
        let (before, width) = excerpt.caret;
        // Tabs stay tabs, so that the caret stands below its character.
        let pad: String =
            excerpt.text.chars().take(before).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        writeln!(f, "{kind}\n{:gutter$} |", "")?;
        writeln!(f, "{line} | {}", excerpt.text)?;
        write!(f, "{:gutter$} | {pad}{}", "", "^".repeat(width))
    }
}
