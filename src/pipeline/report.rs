//! What a run did.

use crate::Provenance;
use isospline_artifact::{Container, Key, Sealed};
use std::sync::Arc;

/// What happened to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Its artifact was fresh.
    Fresh,
    /// Its artifact was computed.
    Computed,
}

/// One node of a run.
#[derive(Clone, Debug)]
pub struct NodeReport {
    /// Place in the graph.
    pub node: usize,
    /// Label.
    pub stage: String,
    /// Name of the artifact in the store.
    pub artifact: String,
    /// What happened.
    pub outcome: Outcome,
    /// Key of the rows.
    pub content: Key,
    /// Size of the artifact.
    pub bytes: u64,
    /// Record of the computation, now or earlier; `None` if its file is lost.
    pub provenance: Option<Provenance>,
    /// The artifact, if the run computed or read it.
    pub container: Option<Arc<Container>>,
}

impl NodeReport {
    pub(crate) fn computed(
        stage: &str,
        artifact: &str,
        node: usize,
        sealed: &Sealed,
        provenance: &Provenance,
    ) -> Self {
        Self {
            node,
            stage: stage.to_owned(),
            artifact: artifact.to_owned(),
            outcome: Outcome::Computed,
            content: sealed.container.content(),
            bytes: sealed.container.length(),
            provenance: Some(provenance.clone()),
            container: Some(Arc::clone(&sealed.container)),
        }
    }

    /// Tasks that this run took from an earlier one.
    pub fn resumed_tasks(&self) -> usize {
        let record = self.provenance.as_ref().filter(|_| self.outcome == Outcome::Computed);
        record.map_or(0, |record| record.cost.resumed_tasks)
    }
}

/// A finished run.
#[derive(Clone, Debug)]
pub struct RunReport {
    /// The nodes looked at, in graph order.
    pub nodes: Vec<NodeReport>,
    /// Wall time.
    pub seconds: f64,
}

impl RunReport {
    /// Whether nothing had to be done.
    pub fn all_fresh(&self) -> bool {
        self.nodes.iter().all(|n| n.outcome == Outcome::Fresh)
    }
}
