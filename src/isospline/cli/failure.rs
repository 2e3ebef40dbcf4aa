//! Every error as the user sees it: message, place, help and exit code.

use crate::cli::excerpt::Excerpt;
use crate::cli::numbers::rounded;
use isospline::batch::BatchError;
use isospline::config::{ConfigError, Place};
use isospline::{FolderError, ModelError, Reach};
use isospline_artifact::{Damage, StoreError};
use isospline_implicit::{BoundsError, InsideError};
use isospline_pipeline::RunError;
use miette::{Diagnostic, LabeledSpan, SourceCode};
use std::error::Error;
use std::fmt;
use std::io::ErrorKind;
use std::ops::Range;

/// An error on its way to the terminal.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    code: &'static str,
    exit: u8,
    help: Option<String>,
    place: Option<[f64; 3]>,
    pointer: Option<Box<Pointer>>,
}

/// A place in a text.
#[derive(Debug)]
struct Pointer {
    text: Excerpt,
    label: LabeledSpan,
}

impl Pointer {
    fn new(name: &str, text: &str, range: Range<usize>) -> Self {
        let (text, label) = Excerpt::new(name, text, range);
        Self { text, label }
    }
}

/// A check that did not pass; the report has said why.
pub(crate) const CHECK_FAILED: u8 = 1;
const USAGE: u8 = 2;
const UNREADABLE: u8 = 10;
const BAD_KEY: u8 = 11;
const BAD_FORMULA: u8 = 12;
const NOT_A_NUMBER: u8 = 20;
const EMPTY: u8 = 21;
const SINGULAR: u8 = 22;
const LEAVES_BOX: u8 = 23;
const TOO_FEW_FACES: u8 = 24;
const OTHER_SURFACE: u8 = 25;
const BAD_BASE_MESH: u8 = 26;
const TWO_DIMENSIONAL: u8 = 27;
const SHARP_EDGE: u8 = 28;
const NO_SIGN_CHANGE: u8 = 29;
const OTHER_VERSION: u8 = 30;
const DAMAGED: u8 = 31;
pub(crate) const LOCKED: u8 = 32;
const IO: u8 = 33;
pub(crate) const NO_MEMORY: u8 = 34;
pub(crate) const BUG: u8 = 70;
pub(crate) const STOPPED: u8 = 130;

/// Exit codes of the stages' own error codes; others are [`OTHER_SURFACE`].
const STAGE_EXITS: [(&str, u8); 13] = [
    ("not-a-number", NOT_A_NUMBER),
    ("empty-level-set", EMPTY),
    ("singular-point", SINGULAR),
    ("level-not-regular", SINGULAR),
    ("no-sign-change", NO_SIGN_CHANGE),
    ("sharp-edge", SHARP_EDGE),
    ("leaves-box", LEAVES_BOX),
    ("too-few-faces", TOO_FEW_FACES),
    ("mesh-empty", BAD_BASE_MESH),
    ("mesh-not-manifold", BAD_BASE_MESH),
    ("mesh-open", BAD_BASE_MESH),
    ("not-manifold", BAD_BASE_MESH),
    ("stopped", STOPPED),
];

impl Failure {
    pub(crate) fn new(exit: u8, code: &'static str, message: impl Into<String>) -> Self {
        let message = clipped(rounded(&message.into()));
        Self { message, code, exit, help: None, place: None, pointer: None }
    }

    /// A command line that cannot be carried out.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::new(USAGE, "usage", message)
    }

    /// A file that cannot be read or written.
    pub(crate) fn io(message: impl Into<String>) -> Self {
        Self::new(IO, "input-output", message)
    }

    /// A surface whose numbers make no sense.
    pub(crate) fn damaged(message: impl Into<String>) -> Self {
        Self::new(DAMAGED, "damaged", message)
    }

    /// Adds what the user can do.
    #[must_use]
    pub(crate) fn helped(mut self, help: impl Into<String>) -> Self {
        self.help = Some(clipped(help.into()));
        self
    }

    pub(crate) fn exit(&self) -> u8 {
        self.exit
    }

    /// The failure as the last line of `--json`.
    pub(crate) fn to_json(&self) -> serde_json::Value {
        let (code, exit) = (self.code, self.exit);
        serde_json::json!({
            "event": "error", "code": code, "exit": exit, "message": self.message,
            "place": self.place, "help": self.help,
        })
    }

    /// Adds a point of space, to the message too where that does not name it.
    fn seen_at(mut self, place: Option<[f64; 3]>) -> Self {
        if let Some([x, y, z]) = place {
            let told = rounded(&format!("({x}, {y}, {z})"));
            if !self.message.contains(&told) {
                self.message = format!("{}, at {told}", self.message);
            }
        }
        Self { place, ..self }
    }

    /// Adds a point of space that the message names.
    fn at(self, place: Option<[f64; 3]>) -> Self {
        Self { place, ..self }
    }

    fn placed(mut self, place: Option<&Place>) -> Self {
        if let Some(Place { source, range }) = place {
            self.pointer = Some(Box::new(Pointer::new(&source.name, &source.text, range.clone())));
        }
        self
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        let exit = if matches!(error, ConfigError::Read { .. }) { UNREADABLE } else { BAD_KEY };
        let message = match error.source() {
            Some(cause) => format!("{error}: {cause}"),
            None => error.to_string(),
        };
        Self::new(exit, error.code(), message).helped(error.help()).placed(error.place())
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let (exit, code, help) = match &error {
            StoreError::Damaged {
                damage: Damage::Version { .. } | Damage::Kind { .. }, ..
            } => {
                let help = "it was written by another version of isospline: run the model again \
                            with --out DIR, or use that version";
                (OTHER_VERSION, "other-version", help)
            }
            StoreError::Damaged { .. } => {
                (DAMAGED, "damaged", "remove the file and run the model again")
            }
            StoreError::Missing { .. } => (DAMAGED, "missing-artifact", "run the model first"),
            StoreError::Locked { .. } => (
                LOCKED,
                "locked",
                "wait for the other run to end, or give another folder with --out",
            ),
            StoreError::Io { source, .. } if source.kind() == ErrorKind::OutOfMemory => {
                (NO_MEMORY, "no-memory", MORE_MEMORY)
            }
            StoreError::Io { .. } => (IO, "input-output", "see whether the folder can be written"),
            _ => return Self::new(BUG, "bug", error.to_string()).helped(REPORT),
        };
        Self::new(exit, code, error.to_string()).helped(help)
    }
}

impl From<BatchError> for Failure {
    fn from(error: BatchError) -> Self {
        let message = error.to_string();
        match error {
            BatchError::Source { .. } => Self::new(UNREADABLE, "unreadable", message),
            BatchError::NoModels { .. } | BatchError::NoSuchModel { .. } => Self::usage(message),
            BatchError::Store(error) => error.into(),
        }
    }
}

/// What to do where memory runs out; threads take the most of it before they do anything.
pub(crate) const MORE_MEMORY: &str = "what is finished is kept: run the same command with more memory to go on; fewer --threads \
     and MALLOC_ARENA_MAX=2 take less";

/// What to do about a bug.
const REPORT: &str = "this is a bug of isospline: please report it with the model file";

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        if let Some(diagnosis) = error.diagnosis() {
            let code = diagnosis.code();
            let exit = STAGE_EXITS.iter().find(|(known, _)| *known == code);
            let failure = Self::new(exit.map_or(OTHER_SURFACE, |e| e.1), code, error.to_string())
                .seen_at(diagnosis.place().map(<[f64; 3]>::from));
            return match diagnosis.help() {
                Some(help) => failure.helped(help),
                None => failure,
            };
        }
        let message = error.to_string();
        match error {
            RunError::Store(error) => error.into(),
            RunError::Stopped { .. } => {
                Self::new(STOPPED, "stopped", message).helped("run the same command to go on")
            }
            RunError::NotReady { .. } => Self::new(DAMAGED, "not-ready", message)
                .helped("`isospline run` makes everything that is missing"),
            RunError::NoSuchStage { .. } => Self::new(USAGE, "no-such-stage", message),
            RunError::Params { .. } => Self::new(BAD_KEY, "out-of-range", message),
            RunError::Threads { .. } => Self::new(IO, "threads", message).helped(MORE_MEMORY),
            _ => Self::new(BUG, "bug", message).helped(REPORT),
        }
    }
}

impl From<FolderError> for Failure {
    fn from(error: FolderError) -> Self {
        let message = error.to_string();
        match error {
            FolderError::NotAModel { .. } => Self::new(UNREADABLE, "not-a-model-folder", message)
                .helped("give the folder that `isospline run` wrote, such as out/deccube"),
            FolderError::Model(error) => error.into(),
            FolderError::Store(error) => error.into(),
            FolderError::Surface(_) => Self::damaged(message),
        }
    }
}

impl From<ModelError> for Failure {
    fn from(error: ModelError) -> Self {
        let message = error.to_string();
        match error {
            ModelError::Config(error) => error.into(),
            ModelError::Formula { text, error } => {
                let mut failure = Self::new(BAD_FORMULA, "formula", error.kind.to_string());
                failure.pointer =
                    Some(Box::new(Pointer::new("model.formula", &text, error.span.clone())));
                failure
            }
            ModelError::Box(error) => {
                let (exit, code, help) = box_trouble(&error);
                let place = match error {
                    BoundsError::NoChangeOfSign { near, .. }
                    | BoundsError::TouchesLimit { near, .. } => Some(near),
                    _ => None,
                };
                Self::new(exit, code, message).helped(help).at(place)
            }
            ModelError::LongFormula { .. } => {
                Self::new(BAD_KEY, "no-box", message).helped("state model.box")
            }
            ModelError::TwoDimensional { .. } => {
                Self::new(TWO_DIMENSIONAL, "two-dimensional", message)
                    .helped("give it ends, such as smax(f, z^2 - h^2, k) along z")
            }
            ModelError::LeavesBox { error, reach } => {
                let help = match reach {
                    Reach::Within(_) => "set model.box to that",
                    Reach::Beyond(_) => NOT_CLOSED,
                    Reach::Unknown => "enlarge model.box if the surface is closed",
                };
                Self::new(LEAVES_BOX, "leaves-box", message).helped(help).at(inside_place(&error))
            }
            ModelError::Inside(error) => {
                let (exit, code, help) = inside_trouble(&error);
                Self::new(exit, code, message).helped(help).at(inside_place(&error))
            }
            ModelError::MeshUnreadable { .. } => Self::new(UNREADABLE, "base-mesh", message)
                .helped("model.base_mesh is relative to the model file"),
            ModelError::Mesh { .. } => Self::new(BAD_BASE_MESH, "base-mesh", message)
                .helped("the base mesh is an OBJ of triangles"),
        }
    }
}

/// What to do about a surface without end.
const NOT_CLOSED: &str = "it seems to go on for ever, and a closed surface is needed: add a shape that ends it, such as \
     smax(f, x^2 + y^2 + z^2 - r^2, k)";

fn inside_place(error: &InsideError) -> Option<[f64; 3]> {
    match error {
        InsideError::NotANumber { point, .. } | InsideError::LeavesBox { point, .. } => {
            Some(*point)
        }
        _ => None,
    }
}

/// A text cut to what can be read: a value in it may be as long as the user's file.
fn clipped(text: String) -> String {
    const LONGEST: usize = 600;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text,
    }
}

fn box_trouble(error: &BoundsError) -> (u8, &'static str, &'static str) {
    match error {
        BoundsError::Empty { .. } => (
            EMPTY,
            "empty-level-set",
            "set model.level within that range, or raise model.box_limit",
        ),
        BoundsError::NoChangeOfSign { .. } => (
            NO_SIGN_CHANGE,
            "no-sign-change",
            "a surface has an inside: set model.level off zero, or take the root of a square",
        ),
        BoundsError::TouchesLimit { .. } => {
            (BAD_KEY, "no-box", "state model.box around the part that is wanted")
        }
        BoundsError::Undefined { .. } => {
            (NOT_A_NUMBER, "not-a-number", "state model.box where the formula is defined")
        }
        BoundsError::ReachesLimit { .. } => (
            LEAVES_BOX,
            "leaves-box",
            "a closed surface is needed: add a shape that ends it, smax(f, g, k); if it is closed, \
             raise model.box_limit",
        ),
        _ => (BAD_KEY, "no-box", "state model.box"),
    }
}

fn inside_trouble(error: &InsideError) -> (u8, &'static str, &'static str) {
    match error {
        InsideError::NotANumber { .. } => {
            let help = "make the formula defined there, or shrink model.box";
            (NOT_A_NUMBER, "not-a-number", help)
        }
        InsideError::LeavesBox { .. } => {
            (LEAVES_BOX, "leaves-box", "enlarge model.box if the surface is closed")
        }
        _ => (OTHER_SURFACE, "no-inside", "set model.inside"),
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Failure {}

impl Diagnostic for Failure {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.code))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.pointer.as_ref().map(|pointer| &pointer.text as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.pointer.as_ref().map(|p| Box::new(std::iter::once(p.label.clone())) as Box<_>)
    }
}
