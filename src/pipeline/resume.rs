//! Takes up what an earlier run left of an unfinished artifact, as far as it can be trusted.

use crate::driver::Frame;
use crate::{Event, tally};
use isospline_artifact::journal::rows_checksum;
use isospline_artifact::{
    Identity, Journal, JournalEntry, JournalHead, Key, KeyHasher, Recorded, StoreError, Unfinished,
    Writer,
};
use isospline_stage::{Counters, Task};
use std::collections::BTreeMap;

/// An artifact to be written, with the tasks that need not be done again.
pub(crate) struct Opened {
    pub(crate) writer: Writer,
    /// `None` where nothing is ever resumed.
    pub(crate) journal: Option<Journal>,
    /// Tasks whose rows are there, with what they counted.
    pub(crate) taken: Vec<(usize, Counters)>,
}

/// Key over row counts and tasks; a journal's entries mean nothing under another plan.
pub(crate) fn plan_key(lengths: &[usize], tasks: &[Task]) -> Key {
    let mut hasher = KeyHasher::new("isospline plan");
    let mut numbers = |list: &mut dyn Iterator<Item = usize>| {
        let list: Vec<u8> = list.flat_map(|n| (n as u64).to_le_bytes()).collect();
        hasher.field(&list);
    };
    numbers(&mut lengths.iter().copied());
    for task in tasks {
        numbers(&mut task.writes.iter().flat_map(|rows| [rows.start, rows.end]));
    }
    hasher.finish()
}

/// Opens the artifact of node `idx` for writing: what an earlier run left, or a new file.
///
/// A closure has no recipe, so what it left is never taken.
pub(crate) fn open(
    frame: &Frame<'_>,
    idx: usize,
    lengths: &[usize],
    tasks: &[Task],
) -> Result<Opened, StoreError> {
    let node = &frame.nodes[idx];
    let (store, name) = (frame.pipeline.store, node.artifact.as_str());
    let (identity, specs) = (node.identity(), node.info.sections);
    let begin = || Writer::begin(store, name, &identity, specs, lengths);
    if !frame.pipeline.model.hashable {
        store.discard(name)?;
        return Ok(Opened { writer: begin()?, journal: None, taken: Vec::new() });
    }
    let (recipe, plan) = (node.recipe, plan_key(lengths, tasks));
    let head = JournalHead { recipe, plan, tasks: tasks.len() as u32 };
    match left_over(frame, idx, &head, lengths)? {
        Ok((recorded, writer)) => take_up(frame, idx, tasks, &recorded, writer),
        Err(reason) => {
            if let Some(reason) = reason {
                tell_discarded(frame, idx, reason.to_owned());
            }
            let mut writer = begin()?;
            writer.outlive();
            let journal = Some(Journal::begin(store, name, &head)?);
            Ok(Opened { writer, journal, taken: Vec::new() })
        }
    }
}

/// Journal and file that an earlier run left of the same recipe and plan; or else why what is
/// there is of no use, `None` if nothing is.
fn left_over(
    frame: &Frame<'_>,
    idx: usize,
    head: &JournalHead,
    lengths: &[usize],
) -> Result<Result<(Recorded, Writer), Option<&'static str>>, StoreError> {
    let node = &frame.nodes[idx];
    let (store, name) = (frame.pipeline.store, node.artifact.as_str());
    let (identity, specs): (Identity, _) = (node.identity(), node.info.sections);
    let Some(bytes) = store.read_journal(name)? else { return Ok(Err(None)) };
    let Some(recorded) = Recorded::decode(&bytes) else {
        return Ok(Err(Some("its journal is damaged")));
    };
    if recorded.head.recipe != head.recipe {
        return Ok(Err(Some("it was begun with other parameters, model or inputs")));
    }
    if recorded.head != *head {
        return Ok(Err(Some("it was cut into other tasks")));
    }
    match Writer::reopen(store, name, &identity, specs, lengths)? {
        Some(writer) => Ok(Ok((recorded, writer))),
        None => Ok(Err(Some("its file is gone or of another size"))),
    }
}

/// Takes the tasks whose rows agree with their checksums.
fn take_up(
    frame: &Frame<'_>,
    idx: usize,
    tasks: &[Task],
    recorded: &Recorded,
    mut writer: Writer,
) -> Result<Opened, StoreError> {
    let latest: BTreeMap<u32, &JournalEntry> =
        recorded.entries.iter().map(|entry| (entry.task, entry)).collect();
    let mut taken = Vec::with_capacity(latest.len());
    for (&number, entry) in &latest {
        let task = &tasks[number as usize];
        if let Some(counters) = trusted(writer.rows(), task, entry) {
            for (section, rows) in task.writes.iter().enumerate() {
                writer.take_over(section, rows.len() as u64);
            }
            taken.push((number as usize, counters));
        }
    }
    let lost = latest.len() - taken.len();
    if lost > 0 {
        tell_discarded(frame, idx, format!("{lost} tasks: their rows did not reach the disk"));
    }
    if !taken.is_empty() {
        let (stage, done, of) = (frame.label(idx), taken.len() as u64, tasks.len() as u64);
        (frame.events)(&Event::Resumed { node: idx, stage, done, of });
    }
    let node = &frame.nodes[idx];
    let journal = Journal::resume(frame.pipeline.store, &node.artifact, recorded)?;
    Ok(Opened { writer, journal: Some(journal), taken })
}

/// What the task counted, if its rows are those that it wrote.
fn trusted(rows: &Unfinished, task: &Task, entry: &JournalEntry) -> Option<Counters> {
    let sections = task.writes.iter().enumerate();
    let parts: Option<Vec<&[u8]>> =
        sections.map(|(section, range)| rows.bytes_of(section, range.clone())).collect();
    let whole = rows_checksum(parts?) == entry.rows;
    tally::decode(&entry.note).filter(|_| whole)
}

fn tell_discarded(frame: &Frame<'_>, idx: usize, reason: String) {
    (frame.events)(&Event::Discarded { node: idx, stage: frame.label(idx), reason });
}
