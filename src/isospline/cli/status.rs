//! Command `status`.

use crate::cli::failure::Failure;
use crate::cli::output::{duration, say, size};
use isospline::ModelFolder;
use isospline_pipeline::{NodeStatus, Provenance, State};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::Path;

/// Says of every stage whether it is fresh: a table on a terminal, a sentence each elsewhere.
pub(crate) fn status(dir: &Path, as_json: bool) -> Result<u8, Failure> {
    let folder = ModelFolder::open(dir)?;
    let nodes = folder.status()?;
    let is_table = !as_json && std::io::stdout().is_terminal();
    if is_table {
        say(&line("stage", "state", ["tasks", "size", "time"], ""))?;
    }
    for node in &nodes {
        let record = folder.record(&node.artifact)?;
        say(&match (as_json, is_table) {
            (true, _) => value(node, record.as_ref()).to_string(),
            (_, true) => row(node, record.as_ref(), std::env::var_os("NO_COLOR").is_none()),
            _ => node.to_string(),
        })?;
    }
    Ok(0)
}

fn row(node: &NodeStatus, record: Option<&Provenance>, colored: bool) -> String {
    let (state, reasons) = words(&node.state);
    let record = record.filter(|_| node.state != State::Missing);
    let tasks = match (&node.begun, record) {
        (Some(begun), _) => format!("{}/{}", begun.done, begun.of),
        (None, Some(record)) => record.cost.tasks.to_string(),
        (None, None) => "-".to_owned(),
    };
    let bytes = record.map_or_else(|| "-".to_owned(), |r| size(r.bytes));
    let time = record.map_or_else(|| "-".to_owned(), |r| duration(r.cost.seconds));
    let other = node.begun.filter(|begun| !begun.usable).map(|begun| begun.to_string());
    let why: Vec<String> = reasons.into_iter().chain(other).collect();
    let text = line(&node.stage, state, [&tasks, &bytes, &time], &why.join(", "));
    if !colored {
        return text.trim_end().to_owned();
    }
    let color = match node.state {
        State::Fresh => 32,
        State::Stale(_) | State::Missing => 33,
        State::Damaged(_) => 31,
    };
    text.trim_end().replacen(state, &format!("\x1b[{color}m{state}\x1b[0m"), 1)
}

fn line(stage: &str, state: &str, [tasks, size, time]: [&str; 3], why: &str) -> String {
    format!("{stage:<15}{state:<9}{tasks:>9}{size:>10}{time:>10}  {why}")
}

/// The state in a word, and the reasons for it.
fn words(state: &State) -> (&'static str, Vec<String>) {
    match state {
        State::Fresh => ("fresh", Vec::new()),
        State::Stale(reasons) => ("stale", reasons.iter().map(ToString::to_string).collect()),
        State::Missing => ("missing", Vec::new()),
        State::Damaged(damage) => ("damaged", vec![damage.clone()]),
    }
}

fn value(node: &NodeStatus, record: Option<&Provenance>) -> Value {
    let (state, reasons) = words(&node.state);
    let begun = node.begun.map(|b| json!({"done": b.done, "of": b.of, "usable": b.usable}));
    json!({
        "stage": node.stage, "artifact": node.artifact, "state": state, "reasons": reasons,
        "begun": begun, "bytes": record.map(|r| r.bytes),
        "seconds": record.map(|r| r.cost.seconds),
    })
}
