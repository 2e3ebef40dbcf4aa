//! The record beside an artifact: what it was made from, what it counted, how long it took.
//!
//! Never needed to read an artifact or to find it fresh; it says why a stale one is stale.

use crate::driver::Frame;
use crate::keys::Ingredient;
use isospline_artifact::{Key, Sealed, Store, StoreError};
use isospline_stage::Counters;
use serde::{Deserialize, Serialize};

/// Contents of the `.json` file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the model.
    pub model: String,
    /// Name of the stage.
    pub stage: String,
    /// Version of the stage.
    pub stage_version: u32,
    /// Round of the node.
    pub round: u32,
    /// Kind of the artifact.
    pub kind: String,
    /// Schema version of the kind.
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// Key over the ingredients and the recipes of the inputs.
    pub recipe: Key,
    /// Key over the ingredients and the contents of the inputs.
    pub derivation: Key,
    /// Key of the rows.
    pub content: Key,
    /// All parameters, defaults written out.
    pub params: serde_json::Value,
    /// Everything hashed that is not an input.
    pub ingredients: Vec<Ingredient>,
    /// The artifacts read.
    pub inputs: Vec<InputRecord>,
    /// Rows of each section.
    pub rows: Vec<(String, u64)>,
    /// Bytes of the file.
    pub bytes: u64,
    /// Figures and repairs.
    pub counters: Counters,
    /// Times, threads, memory.
    pub cost: Cost,
}

/// One artifact read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InputRecord {
    /// Label of the node, or of the given rows.
    pub label: String,
    /// Kind.
    pub kind: String,
    /// Recipe of the node; for given rows, their content.
    pub recipe: Key,
    /// Content.
    pub content: Key,
}

/// What a stage cost; recorded, never hashed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall time from the preparation to the last hash; stages at work at once share it.
    pub seconds: f64,
    /// Wall time of `prepare` and `plan`.
    pub prepare_seconds: f64,
    /// Time in tasks, added over the threads.
    pub task_seconds: f64,
    /// Wall time of hashing the rows.
    pub seal_seconds: f64,
    /// Tasks.
    pub tasks: usize,
    /// Tasks of these whose rows an earlier run left; their times are not in these figures.
    #[serde(default)]
    pub resumed_tasks: usize,
    /// Threads of the run.
    pub threads: usize,
    /// Largest resident memory of the process up to the end of the stage, bytes; 0 if unknown.
    pub peak_resident_bytes: u64,
    /// Anonymous resident memory at the end of the stage, bytes: without mapped files.
    pub anonymous_bytes: u64,
}

impl Cost {
    /// Time of the stage's own work, seconds: the tasks of a stage that has many spread evenly
    /// over all threads. Added over all stages, it is about the time of a run without streaming.
    pub fn own_seconds(&self) -> f64 {
        let threads = if self.tasks > 1 { self.threads.max(1) } else { 1 };
        self.prepare_seconds + self.task_seconds / threads as f64 + self.seal_seconds
    }
}

/// Name of the record beside the artifact of this name.
pub fn note_name(artifact: &str) -> String {
    let stem = artifact.strip_suffix(isospline_artifact::folder::SUFFIX).unwrap_or(artifact);
    format!("{stem}.json")
}

/// The record of an artifact; `None` if it is not there or not readable.
///
/// # Errors
/// [`StoreError::Io`].
pub fn read_provenance(
    store: &dyn Store,
    artifact: &str,
) -> Result<Option<Provenance>, StoreError> {
    let note = store.read_note(&note_name(artifact))?;
    Ok(note.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
}

impl Provenance {
    /// The record of an artifact that this run made.
    pub(crate) fn of(
        frame: &Frame<'_>,
        idx: usize,
        contents: &[Option<Key>],
        sealed: &Sealed,
        counters: Counters,
        cost: Cost,
    ) -> Self {
        let node = &frame.nodes[idx];
        let header = sealed.container.header();
        Self {
            model: frame.pipeline.model.name.clone(),
            stage: node.info.name.to_owned(),
            stage_version: node.info.version,
            round: frame.pipeline.graph.nodes[idx].round,
            kind: node.info.kind.to_owned(),
            schema: node.info.schema,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            recipe: header.recipe,
            derivation: header.derivation,
            content: sealed.container.content(),
            params: node.params.clone(),
            ingredients: node.ingredients.clone(),
            inputs: node.input_records(contents),
            rows: header.sections.iter().map(|s| (s.name.clone(), s.rows)).collect(),
            bytes: sealed.container.length(),
            counters,
            cost,
        }
    }

    /// The text of the record's file.
    pub fn to_json(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec_pretty(self).expect("invariant: maps have text keys");
        text.push(b'\n');
        text
    }
}
