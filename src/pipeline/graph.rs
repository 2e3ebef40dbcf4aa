//! What is to be computed: nodes, their inputs, and the model that all of them see.

use crate::{GraphError, Registry};
use isospline_artifact::{Artifact, Key, SectionSource, content_key};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;

/// What of a model may change the output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelKey {
    /// Name, for messages; not hashed.
    pub name: String,
    /// Everything hashed, by name: formula, level, box, inside, each parameter. A change is
    /// shown to the user with these names and values.
    pub content: BTreeMap<String, String>,
    /// False if the field has no text (a user's closure): nothing is ever fresh then.
    pub hashable: bool,
}

/// An artifact that the caller brings: the rows of a file that the user names.
#[derive(Clone)]
pub struct Given {
    /// What reasons call it, such as the file's name; not hashed.
    pub label: String,
    /// Kind of its rows.
    pub kind: &'static str,
    /// The rows.
    pub rows: Arc<dyn SectionSource>,
    /// Key of the rows.
    pub content: Key,
}

impl Given {
    /// Takes rows of any kind; their content key is computed here.
    pub fn new<A: Artifact>(label: impl Into<String>, artifact: A) -> Self {
        let names = A::SECTIONS.iter().map(|s| s.name);
        let content = content_key(names.zip(artifact.sections()));
        Self { label: label.into(), kind: A::KIND, rows: Arc::new(artifact), content }
    }
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("Given");
        out.field("label", &self.label).field("kind", &self.kind).finish_non_exhaustive()
    }
}

/// One run of a stage.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name of the stage.
    pub stage: String,
    /// Counts the runs of the same stage from 0.
    pub round: u32,
    /// Nodes, by place in the graph, whose artifacts the stage reads, at most one of a kind.
    pub inputs: Vec<usize>,
    /// Artifacts from outside that the stage reads.
    pub given: Vec<Given>,
    /// The stage's table of parameters; what is not named has its default. `null` for none.
    pub params: serde_json::Value,
}

impl Node {
    /// A first-round node without inputs, with default parameters.
    pub fn new(stage: impl Into<String>) -> Self {
        Self { stage: stage.into(), ..Self::default() }
    }

    /// Reads the artifacts of these nodes.
    #[must_use]
    pub fn reading(mut self, inputs: impl IntoIterator<Item = usize>) -> Self {
        self.inputs.extend(inputs);
        self
    }

    /// Has these parameters.
    #[must_use]
    pub fn with(mut self, params: serde_json::Value) -> Self {
        self.params = params;
        self
    }

    /// What messages call it: `adapt`, `adapt.r1`.
    pub fn label(&self) -> String {
        match self.round {
            0 => self.stage.clone(),
            round => format!("{}.r{round}", self.stage),
        }
    }
}

/// Nodes in an order in which they can run.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    /// The nodes; a node reads earlier ones only.
    pub nodes: Vec<Node>,
}

impl Graph {
    /// Adds a node and gives its place.
    pub fn push(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// The last node whose artifact is of `kind`.
    pub fn last_of_kind(&self, registry: &Registry, kind: &str) -> Option<usize> {
        let is_kind = |n: &Node| registry.stage(&n.stage).is_some_and(|s| s.kind == kind);
        self.nodes.iter().rposition(is_kind)
    }

    /// Checks that every node can run: known stage, inputs before it, each kind that it reads
    /// there once.
    ///
    /// # Errors
    /// The first [`GraphError`].
    pub fn check(&self, registry: &Registry) -> Result<(), GraphError> {
        let mut seen = BTreeSet::new();
        for (idx, node) in self.nodes.iter().enumerate() {
            if !seen.insert((&node.stage, node.round)) {
                return Err(GraphError::Twice { stage: node.label() });
            }
            self.check_node(registry, idx)?;
        }
        Ok(())
    }

    fn check_node(&self, registry: &Registry, idx: usize) -> Result<(), GraphError> {
        let node = &self.nodes[idx];
        let unknown = || GraphError::UnknownStage { stage: node.stage.clone() };
        let info = registry.stage(&node.stage).ok_or_else(unknown)?;
        let mut kinds: Vec<&str> = node.given.iter().map(|g| g.kind).collect();
        for &input in &node.inputs {
            let source = self.nodes[..idx].get(input);
            let source = source.ok_or_else(|| GraphError::Order { stage: node.label(), input })?;
            kinds.extend(registry.stage(&source.stage).map(|s| s.kind));
        }
        for &kind in info.whole.iter().chain(info.rows) {
            let found = kinds.iter().filter(|&&k| k == kind).count();
            if found != 1 {
                return Err(GraphError::Input { stage: node.label(), kind, found });
            }
        }
        Ok(())
    }
}
