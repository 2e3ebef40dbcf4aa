//! Which artifacts are what the graph asks for, and why the others are not.

use crate::keeper::Steps;
use crate::keys::{Ingredient, changes, ingredients, key_of};
use crate::provenance::InputRecord;
use crate::{Pipeline, Reason, RunError, StageInfo, keeper, read_provenance};
use isospline_artifact::{Container, Draft, Identity, Key, StoreError};
use std::fmt;

/// Whether a node's artifact can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// It is what the graph asks for.
    Fresh,
    /// It was made from something else.
    Stale(Vec<Reason>),
    /// It is not there.
    Missing,
    /// It is not whole.
    Damaged(String),
}

/// State of one node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeStatus {
    /// Place in the graph.
    pub node: usize,
    /// Label.
    pub stage: String,
    /// Name of the artifact in the store.
    pub artifact: String,
    /// Its state.
    pub state: State,
    /// What an earlier run left unfinished of it.
    pub begun: Option<Begun>,
}

/// An unfinished artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Begun {
    /// Tasks done; of a stage without tasks, steps.
    pub done: usize,
    /// All of them.
    pub of: usize,
    /// Whether the next run goes on with it; it was begun with something else otherwise.
    pub usable: bool,
}

impl fmt::Display for NodeStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.state {
            State::Fresh => write!(f, "{} is fresh", self.stage),
            State::Stale(reasons) => {
                let reasons: Vec<String> = reasons.iter().map(ToString::to_string).collect();
                write!(f, "{} is stale: {}", self.stage, reasons.join(", "))
            }
            State::Missing => write!(f, "{} is missing", self.stage),
            State::Damaged(damage) => write!(f, "{} is damaged: {damage}", self.stage),
        }?;
        self.begun.map_or(Ok(()), |begun| write!(f, "; {begun}"))
    }
}

impl fmt::Display for Begun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { done, of, usable } = self;
        let use_of_it = if *usable { "" } else { " of something else" };
        write!(f, "{done} of {of} tasks{use_of_it} are done")
    }
}

/// What an earlier run left of a node that is not fresh.
pub(crate) fn begun(pipeline: &Pipeline<'_>, node: &Resolved) -> Result<Option<Begun>, StoreError> {
    let tasks = Draft::read(pipeline.store, &node.artifact)?.and_then(|draft| {
        let (done, of) = draft.tasks()?;
        Some((draft.recorded?.head.recipe, done, of))
    });
    let steps = keeper::stand(pipeline.store, &node.artifact)?;
    let steps = steps.map(|(recipe, Steps { done, of })| (recipe, done as usize, of as usize));
    Ok(tasks.or(steps).map(|(recipe, done, of)| {
        let usable = recipe == node.recipe && pipeline.model.hashable;
        Begun { done, of, usable }
    }))
}

/// A node with all that is known of it before anything runs.
#[derive(Clone, Debug)]
pub(crate) struct Resolved {
    pub(crate) info: StageInfo,
    pub(crate) label: String,
    pub(crate) artifact: String,
    pub(crate) params: serde_json::Value,
    pub(crate) ingredients: Vec<Ingredient>,
    pub(crate) recipe: Key,
    pub(crate) inputs: Vec<Input>,
}

/// One artifact that a node reads.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub(crate) label: String,
    pub(crate) kind: &'static str,
    pub(crate) recipe: Key,
    pub(crate) source: Source,
}

/// Where an input comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    Node(usize),
    Given(usize, Key),
}

impl Input {
    /// Key of its rows, where it is known.
    pub(crate) fn content(&self, contents: &[Option<Key>]) -> Option<Key> {
        match self.source {
            Source::Node(node) => contents[node],
            Source::Given(_, content) => Some(content),
        }
    }
}

impl Resolved {
    /// What the header of its artifact says before its rows are made.
    pub(crate) fn identity(&self) -> Identity {
        Identity {
            kind: self.info.kind,
            schema: self.info.schema,
            stage: self.info.name.to_owned(),
            stage_version: self.info.version,
            recipe: self.recipe,
        }
    }

    /// The key over the contents of the inputs, where all are known.
    pub(crate) fn derivation(&self, contents: &[Option<Key>]) -> Option<Key> {
        let inputs = self.inputs.iter().map(|i| Some((i.kind, i.content(contents)?)));
        let inputs: Option<Vec<_>> = inputs.collect();
        Some(key_of("isospline derivation", &self.ingredients, inputs?))
    }

    /// The inputs as the record names them.
    pub(crate) fn input_records(&self, contents: &[Option<Key>]) -> Vec<InputRecord> {
        let record = |input: &Input| InputRecord {
            label: input.label.clone(),
            kind: input.kind.to_owned(),
            recipe: input.recipe,
            content: input.content(contents).unwrap_or_default(),
        };
        self.inputs.iter().map(record).collect()
    }
}

/// Parameters, ingredients and recipes of all nodes; nothing is read.
pub(crate) fn resolve(pipeline: &Pipeline<'_>) -> Result<Vec<Resolved>, RunError> {
    pipeline.graph.check(pipeline.registry)?;
    let mut nodes: Vec<Resolved> = Vec::with_capacity(pipeline.graph.nodes.len());
    for node in &pipeline.graph.nodes {
        let stage = pipeline.registry.erased(&node.stage).expect("invariant: graph is checked");
        let label = node.label();
        let params = stage.canonical_params(&node.params);
        let params = params.map_err(|source| RunError::Params { stage: label.clone(), source })?;
        let ingredients = ingredients(stage.info(), node, &params, pipeline.model);
        let from_node = |&idx: &usize| Input {
            label: nodes[idx].label.clone(),
            kind: nodes[idx].info.kind,
            recipe: nodes[idx].recipe,
            source: Source::Node(idx),
        };
        let from_outside = |(k, given): (usize, &crate::Given)| Input {
            label: given.label.clone(),
            kind: given.kind,
            recipe: given.content,
            source: Source::Given(k, given.content),
        };
        let given = node.given.iter().enumerate().map(from_outside);
        let inputs: Vec<Input> = node.inputs.iter().map(from_node).chain(given).collect();
        let keys = inputs.iter().map(|i| (i.kind, i.recipe));
        let recipe = key_of("isospline recipe", &ingredients, keys);
        let artifact = pipeline.registry.artifact_name(node);
        let info = *stage.info();
        nodes.push(Resolved { info, label, artifact, params, ingredients, recipe, inputs });
    }
    Ok(nodes)
}

/// State of a node, and its artifact (rows unread) if that is fresh.
pub(crate) fn assess(
    pipeline: &Pipeline<'_>,
    node: &Resolved,
    contents: &[Option<Key>],
) -> Result<(State, Option<Container>), StoreError> {
    let container = match pipeline.store.peek(&node.artifact) {
        Ok(Some(container)) => container,
        Ok(None) => return Ok((State::Missing, None)),
        Err(StoreError::Damaged { damage, .. }) => {
            return Ok((State::Damaged(damage.to_string()), None));
        }
        Err(error) => return Err(error),
    };
    if !pipeline.model.hashable {
        return Ok((State::Stale(vec![Reason::Unhashable]), None));
    }
    let header = container.header();
    let same_inputs = || node.derivation(contents) == Some(header.derivation);
    if header.recipe == node.recipe || same_inputs() {
        return Ok((State::Fresh, Some(container)));
    }
    Ok((State::Stale(reasons(pipeline, node, contents, header.recipe)?), None))
}

fn reasons(
    pipeline: &Pipeline<'_>,
    node: &Resolved,
    contents: &[Option<Key>],
    recipe: Key,
) -> Result<Vec<Reason>, StoreError> {
    let record = read_provenance(pipeline.store, &node.artifact)?;
    let Some(record) = record.filter(|r| r.recipe == recipe) else {
        // The artifact's derivation can still tell, once all inputs are there.
        let unknown = node.inputs.iter().filter(|input| input.content(contents).is_none());
        let pending = unknown.map(|input| Reason::Pending { stage: input.label.clone() });
        let pending: Vec<Reason> = pending.collect();
        return Ok(if pending.is_empty() { vec![Reason::Unrecorded] } else { pending });
    };
    let mut reasons = changes(&record.ingredients, &node.ingredients);
    for (k, input) in node.inputs.iter().enumerate() {
        let old = record.inputs.get(k).map(|i| (i.kind.as_str(), i.content));
        match input.content(contents) {
            None => reasons.push(Reason::Pending { stage: input.label.clone() }),
            Some(new) if old != Some((input.kind, new)) => {
                reasons.push(Reason::Input { kind: input.kind.to_owned() });
            }
            Some(_) => {}
        }
    }
    if reasons.is_empty() {
        reasons.push(Reason::Unrecorded);
    }
    Ok(reasons)
}

#[cfg(test)]
mod tests;
