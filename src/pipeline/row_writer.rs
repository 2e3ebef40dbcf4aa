//! The one writer of a stage: rows at their place, then the journal, then the word that they are
//! there; hashes all at the end.

use crate::driver::Frame;
use crate::erase::ErasedPiece;
use crate::trace::Lane;
use crate::workers::Notice;
use crate::{RunError, clock, tally};
use crossbeam::channel::{Receiver, Sender};
use isospline_artifact::journal::rows_checksum;
use isospline_artifact::{Journal, JournalEntry, Section, SectionSpec, Writer};
use isospline_stage::Task;
use std::sync::Arc;
use std::time::Duration;

/// The rows of a task on their way to the writer.
pub(crate) struct Made {
    pub(crate) task: usize,
    pub(crate) piece: ErasedPiece,
    pub(crate) time: Duration,
}

/// Everything that a stage's writer needs.
#[derive(Debug)]
pub(crate) struct RowWriter {
    pub(crate) node: usize,
    pub(crate) label: String,
    pub(crate) specs: &'static [SectionSpec],
    pub(crate) tasks: Arc<[Task]>,
    pub(crate) writer: Writer,
    /// `None` where nothing is ever resumed.
    pub(crate) journal: Option<Journal>,
    /// Tasks whose rows are not there.
    pub(crate) remaining: usize,
}

impl RowWriter {
    /// Writes what comes until all rows are there, and hashes them; gives up without a word when
    /// nothing can come any more. Every piece is answered by one notice, and the hash by another.
    pub(crate) fn serve<'f>(
        mut self,
        frame: &'f Frame<'f>,
        pieces: &Receiver<Made>,
        notices: &Sender<Notice<'f>>,
    ) {
        let lane = Lane::new(frame.options.trace, || format!("writer of {}", self.label));
        // A failed send means that the run is over.
        while self.remaining > 0 {
            let Ok(made) = pieces.recv() else { return };
            let start = clock::now();
            let (task, time) = (made.task, made.time);
            let notice = match self.commit(&made) {
                Ok(rows) => {
                    self.remaining -= 1;
                    lane.note(&self.label, "write", start, Some((task, rows)));
                    let counters = made.piece.counters;
                    Notice::Committed { node: self.node, task, counters, time }
                }
                Err(error) => Notice::Failed { node: self.node, task, error: Some(error) },
            };
            drop(notices.send(notice));
        }
        let (node, label) = (self.node, self.label.clone());
        let start = clock::now();
        let hashed = self.writer.hash();
        lane.note(&label, "hash", start, None);
        drop(notices.send(Notice::hashed(node, hashed, start.elapsed())));
    }

    /// Writes rows and entry; gives the number of rows.
    fn commit(&mut self, made: &Made) -> Result<usize, RunError> {
        let sections = made.piece.rows.all();
        let task = &self.tasks[made.task];
        let mut n_rows = 0;
        for (k, (spec, section)) in self.specs.iter().zip(&sections).enumerate() {
            let rows = task.writes.get(k).cloned().unwrap_or_default();
            let (found, expected) = (section.bytes.len() / spec.stride, rows.len());
            if found != expected {
                let (stage, section) = (self.label.clone(), spec.name);
                let task = made.task;
                return Err(RunError::PieceSize { stage, task, section, found, expected });
            }
            self.writer.write_rows(k, rows.start as u64, section.bytes)?;
            n_rows += expected;
        }
        self.record(made, &sections)?;
        Ok(n_rows)
    }

    fn record(&mut self, made: &Made, sections: &[Section<'_>]) -> Result<(), RunError> {
        if let Some(journal) = &mut self.journal {
            let rows = rows_checksum(sections.iter().map(|s| s.bytes));
            let (task, note) = (made.task as u32, tally::encode(&made.piece.counters));
            journal.append(&JournalEntry { task, rows, note })?;
        }
        Ok(())
    }
}
