//! Surfaces with unfit patches, made again with something done about those.
//!
//! What was unfit is kept beside the artifacts after each surface: a run that was stopped goes on
//! where it stopped, and one that ended finds its artifacts fresh.

use super::{FolderError, ModelFolder};
use crate::mending::{Mending, Remedies, Unfit, applies, unfit};
use isospline_artifact::StoreError;
use isospline_pipeline::{Event, RunError, RunOptions, RunReport};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the note of the unfit faces.
pub const MENDS_NOTE: &str = "mends.json";

/// What is kept of all numbers of faces.
#[derive(Debug, Serialize, Deserialize)]
struct Note {
    /// What the surfaces depend on; under another the note is worth nothing.
    of: String,
    by_faces: BTreeMap<u32, Mending>,
}

impl ModelFolder {
    /// What is done about unfit patches of so many faces.
    pub(super) fn noted_remedies(&self, faces: u32) -> Result<Remedies, StoreError> {
        let mending = self.noted_mending(faces)?;
        let is_over = mending.is_over(self.model.file.target.mends, faces);
        Ok(if is_over { mending.kept() } else { mending.tried() })
    }

    /// Runs the whole graph for so many faces, again and again while patches are unfit; the
    /// artifacts are those of the surface with the fewest of them.
    pub(super) fn run_mended(
        &self,
        faces: u32,
        options: &RunOptions<'_>,
        on_event: &(dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        if !self.has_mends() {
            return self.run_graph(
                &self.sized_graph(faces, Remedies::default()),
                options,
                on_event,
            );
        }
        let mut mending = self.noted_mending(faces)?;
        let mut seconds = 0.0;
        let mut latest: Option<(usize, RunReport)> = None;
        let mut options = *options;
        while !mending.is_over(self.model.file.target.mends, faces) {
            let graph = self.sized_graph(faces, mending.tried());
            let report = self.run_graph(&graph, &options, on_event)?;
            // What was asked to be made again is made once.
            options.from = None;
            seconds += report.seconds;
            latest = Some((mending.n_tried(), report));
            mending.add(self.unfit(options.threads)?);
            self.note_mending(faces, &mending)?;
        }
        let latest = latest.filter(|(n_before, _)| *n_before == mending.n_kept());
        let Some((_, report)) = latest else {
            let graph = self.sized_graph(faces, mending.kept());
            let report = self.run_graph(&graph, &options, on_event)?;
            return Ok(RunReport { seconds: report.seconds + seconds, ..report });
        };
        Ok(RunReport { seconds, ..report })
    }

    fn has_mends(&self) -> bool {
        let file = &self.model.file;
        file.target.mends > 0 && applies(&file.stages, self.model.base_mesh.is_some())
    }

    fn unfit(&self, threads: usize) -> Result<Vec<Unfit>, RunError> {
        let file = &self.model.file;
        let measured = self.measured(&file.check, threads, |surface, checked| {
            let tolerance = file.target.tolerance(surface.diagonal());
            let method = file.stages.network.method;
            (unfit(surface, &self.model.field, &checked, tolerance, method), checked.report)
        });
        match measured {
            Ok((content, (unfit, report))) => {
                *self.last_check() = Some((content, report));
                Ok(unfit)
            }
            Err(FolderError::Store(error)) => Err(error.into()),
            // Of patches that do not fit together the check tells what is wrong.
            Err(_) => Ok(Vec::new()),
        }
    }

    fn noted_mending(&self, faces: u32) -> Result<Mending, StoreError> {
        // A longer search before this one must not show in its outcome.
        let mending = self.mends()?.remove(&faces).unwrap_or_default();
        Ok(mending.up_to(self.model.file.target.mends))
    }

    fn mends(&self) -> Result<BTreeMap<u32, Mending>, StoreError> {
        let bytes = self.note(MENDS_NOTE)?;
        let note = bytes.and_then(|bytes| serde_json::from_slice::<Note>(&bytes).ok());
        let note = note.filter(|note| note.of == self.surfaces_key());
        Ok(note.map_or_else(BTreeMap::new, |note| note.by_faces))
    }

    fn note_mending(&self, faces: u32, mending: &Mending) -> Result<(), StoreError> {
        let mut by_faces = self.mends()?;
        by_faces.insert(faces, mending.clone());
        let note = Note { of: self.surfaces_key(), by_faces };
        let bytes = serde_json::to_vec(&note).expect("invariant: a note is plain data");
        self.write_note(MENDS_NOTE, &bytes)
    }
}
