//! The stages that a graph may name.

use crate::ParamsError;
use crate::erase::{Erased, ErasedStage};
use crate::graph::Node;
use isospline_artifact::SectionSpec;
use isospline_stage::Stage;
use std::fmt;

/// What a stage says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageInfo {
    /// Name.
    pub name: &'static str,
    /// Version.
    pub version: u32,
    /// Kind of the output.
    pub kind: &'static str,
    /// Schema version of the kind.
    pub schema: u32,
    /// Sections of the output.
    pub sections: &'static [SectionSpec],
    /// Kinds read as a whole.
    pub whole: &'static [&'static str],
    /// Kinds read row by row.
    pub rows: &'static [&'static str],
}

/// All stages, in the order that numbers their files.
#[derive(Default)]
pub struct Registry {
    stages: Vec<Box<dyn ErasedStage>>,
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.stages().map(|s| s.name)).finish()
    }
}

impl Registry {
    /// A registry without stages.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a stage; its place gives the number in the names of its files.
    ///
    /// # Panics
    /// If a stage of this name is there already.
    #[must_use]
    pub fn with<S: Stage + 'static>(mut self) -> Self {
        assert!(self.stage(S::NAME).is_none(), "stage {:?} is registered twice", S::NAME);
        self.stages.push(Box::new(Erased::<S>::new()));
        self
    }

    /// All stages, in order.
    pub fn stages(&self) -> impl Iterator<Item = &StageInfo> {
        self.stages.iter().map(|s| s.info())
    }

    /// The stage of this name.
    pub fn stage(&self, name: &str) -> Option<&StageInfo> {
        self.stages().find(|s| s.name == name)
    }

    /// All parameters of the stage of this name, with defaults where `params` has nothing;
    /// `null` stands for an empty table. `None` if there is no such stage.
    ///
    /// # Errors
    /// [`ParamsError`].
    pub fn params(
        &self,
        name: &str,
        params: &serde_json::Value,
    ) -> Option<Result<serde_json::Value, ParamsError>> {
        self.erased(name).map(|s| s.canonical_params(params))
    }

    /// Name of a node's artifact: `03-decimate.isos`, `05-adapt.r1.isos`.
    pub fn artifact_name(&self, node: &Node) -> String {
        let place = self.stages().position(|s| s.name == node.stage);
        let number = place.map_or(0, |p| p + 1);
        format!("{number:02}-{}{}", node.label(), isospline_artifact::folder::SUFFIX)
    }

    pub(crate) fn erased(&self, name: &str) -> Option<&dyn ErasedStage> {
        self.stages.iter().find(|s| s.info().name == name).map(AsRef::as_ref)
    }
}
