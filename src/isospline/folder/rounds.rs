//! Rounds of a model with a tolerance: the graph run for one number of faces after another, and
//! what was learnt kept beside the artifacts.
//!
//! Every round is an ordinary run in the same folder, so it streams, resumes and keeps what is
//! fresh as any other. The note is written after each: a run that was stopped goes on in the round
//! where it stopped, and one that ended knows the faces and finds its artifacts fresh.

use super::{FolderError, ModelFolder};
use crate::config::ModelFile;
use crate::mending::Remedies;
use crate::stages;
use crate::tolerance::{Found, MOST_REFUSALS, Round, Step, Verdict, next};
use isospline_artifact::StoreError;
use isospline_artifact::kinds::BaseMesh;
use isospline_check::{CheckParams, CheckReport};
use isospline_pipeline::{Event, Graph, RunError, RunOptions, RunReport};
use isospline_stage::Diagnosis;
use serde::{Deserialize, Serialize};

/// Name of the note of the rounds.
pub const ROUNDS_NOTE: &str = "rounds.json";

/// Code of a stage that asks for fewer faces.
const TOO_MANY: &str = "too-many-cells";
/// Codes of stages that ask for more faces.
const TOO_FEW: [&str; 6] = [
    "too-few-faces",
    "base-mesh-unfit",
    "thinner-than-grid",
    "topology-unresolved",
    "no-boundary-curve",
    "degenerate-vertex",
];

/// The distance from which patches are not brought nearer: part of the tolerance, since the worst
/// patch decides.
pub(crate) fn relax_goal(tolerance: f64) -> f64 {
    0.1 * tolerance
}

/// The last stage of a round of curves, and the largest error that it counts.
const CURVES_STAGE: &str = "network";
pub(crate) const CURVES_COUNTER: &str = "curve_distance_max_rel";

/// What is kept of a search.
#[derive(Debug, Serialize, Deserialize)]
struct Note {
    /// What the rounds depend on; under another they are worth nothing.
    of: String,
    rounds: Vec<Round>,
}

/// The rounds of a search and how it ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rounds {
    /// Faces of the surface that is kept.
    pub faces: u32,
    /// What decided.
    pub verdict: Verdict,
    /// All rounds, in order.
    pub rounds: Vec<Round>,
}

impl ModelFolder {
    /// The search for the faces of this model, if it has a tolerance and the search is over.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn rounds(&self) -> Result<Option<Rounds>, StoreError> {
        let rounds = if self.has_rounds() { self.noted_rounds()? } else { Vec::new() };
        Ok(match next(&rounds) {
            Step::End(end) => Some(Rounds { faces: end.faces, verdict: end.verdict, rounds }),
            Step::Curves(_) | Step::Surface(_) => None,
        })
    }

    /// Whether the faces follow from a tolerance; those of a given mesh are as they are.
    pub(super) fn has_rounds(&self) -> bool {
        self.model.file.target.is_by_tolerance() && self.model.base_mesh.is_none()
    }

    /// The faces asked for: of the round that is next, or of the surface that is kept.
    pub(super) fn noted_faces(&self) -> Result<u32, StoreError> {
        if !self.has_rounds() {
            return Ok(self.model.file.target.faces());
        }
        Ok(match next(&self.noted_rounds()?) {
            Step::Curves(faces) | Step::Surface(faces) => faces,
            Step::End(ending) => ending.faces,
        })
    }

    /// Runs rounds until the search is over; the artifacts are those of the best surface.
    pub(super) fn run_rounds(
        &self,
        options: &RunOptions<'_>,
        on_event: &(dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        let mut rounds = self.noted_rounds()?;
        let mut seconds = 0.0;
        let mut latest: Option<(u32, RunReport)> = None;
        loop {
            let (faces, is_whole) = match next(&rounds) {
                Step::Curves(faces) => (faces, false),
                Step::Surface(faces) => (faces, true),
                Step::End(ending) => {
                    let latest = latest.filter(|(faces, _)| *faces == ending.faces);
                    let report = match latest {
                        Some((_, report)) => report,
                        None => self.run_sized(ending.faces, true, options, on_event)?,
                    };
                    return Ok(RunReport { seconds: report.seconds + seconds, ..report });
                }
            };
            let plain = RunOptions { from: None, ..*options };
            let found = match self.run_sized(faces, is_whole, &plain, on_event) {
                Ok(report) => {
                    let found = self.found(&report, is_whole, options.threads)?;
                    seconds += report.seconds;
                    latest = is_whole.then_some((faces, RunReport { seconds: 0.0, ..report }));
                    found
                }
                Err(error) => refused(error, &rounds)?,
            };
            rounds.push(Round { faces, found });
            self.note_rounds(&rounds)?;
        }
    }

    /// Makes the surface of so many faces, or its part up to the curves.
    fn run_sized(
        &self,
        faces: u32,
        is_whole: bool,
        options: &RunOptions<'_>,
        on_event: &(dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        if is_whole {
            return self.run_mended(faces, options, on_event);
        }
        let mut graph = self.sized_graph(faces, Remedies::default());
        up_to_curves(&mut graph);
        self.run_graph(&graph, options, on_event)
    }

    /// The graph for so many faces, with what is done about unfit patches.
    pub(super) fn sized_graph(&self, faces: u32, remedies: Remedies) -> Graph {
        let file = &self.model.file;
        let mut params = file.stages.with_faces(faces);
        remedies.put_into(&mut params);
        // The default, which the user may have written.
        if params.relax.goal <= 0.0 {
            // The box is a little larger than the surface, which does not matter here.
            let tolerance = file.target.tolerance(self.model.domain.diagonal());
            params.relax.goal = tolerance.map_or(0.0, relax_goal);
        }
        stages::graph(&self.registry, &params, self.model.base_mesh.as_ref())
    }

    fn found(&self, run: &RunReport, is_whole: bool, threads: usize) -> Result<Found, RunError> {
        let record = |node: &&isospline_pipeline::NodeReport| node.stage == CURVES_STAGE;
        let record = run.nodes.iter().find(record).and_then(|node| node.provenance.as_ref());
        let curves = record.and_then(|r| r.counters.maxima.get(CURVES_COUNTER));
        // Without its record, which someone has removed, a round is as one of great error.
        let curves = curves.copied().unwrap_or(1.0);
        if !is_whole {
            return Ok(Found::Curves { curves: curves / self.tolerance(self.base_diagonal()?) });
        }
        // All limits but that of the error: whether the mesh is good enough.
        let limits = CheckParams { error: Some(1.0), ..self.model.file.check.clone() };
        match self.check_against(&limits, threads) {
            Ok(CheckReport { diagonal, rel_error_max, pass, .. }) => {
                let tolerance = self.tolerance(diagonal);
                let surface = Some(rel_error_max / tolerance).filter(|e| e.is_finite());
                Ok(Found::Surface { curves: curves / tolerance, surface, sound: pass })
            }
            Err(FolderError::Store(error)) => Err(error.into()),
            Err(_) => {
                let curves = curves / self.tolerance(self.base_diagonal()?);
                Ok(Found::Surface { curves, surface: None, sound: false })
            }
        }
    }

    fn tolerance(&self, diagonal: f64) -> f64 {
        self.model.file.target.tolerance(diagonal).expect("invariant: rounds have a tolerance")
    }

    /// Diagonal of the box around the vertices of the base mesh, in model units.
    fn base_diagonal(&self) -> Result<f64, StoreError> {
        let node = self.graph.nodes.iter().find(|node| node.stage == "adapt");
        let node = node.expect("invariant: every graph adapts");
        let mesh = self.store().open(&self.registry.artifact_name(node))?;
        Ok(mesh.view::<BaseMesh>()?.bounds[0].diagonal)
    }

    fn noted_rounds(&self) -> Result<Vec<Round>, StoreError> {
        let bytes = self.note(ROUNDS_NOTE)?;
        let note = bytes.and_then(|bytes| serde_json::from_slice::<Note>(&bytes).ok());
        Ok(note.filter(|note| note.of == self.rounds_key()).map_or_else(Vec::new, |n| n.rounds))
    }

    fn note_rounds(&self, rounds: &[Round]) -> Result<(), StoreError> {
        let note = Note { of: self.rounds_key(), rounds: rounds.to_vec() };
        let bytes = serde_json::to_vec_pretty(&note).expect("invariant: a note is plain data");
        self.write_note(ROUNDS_NOTE, &bytes)
    }

    /// All that the rounds depend on: the surfaces, how folds are mended, the limits.
    fn rounds_key(&self) -> String {
        let ModelFile { target, check, .. } = &self.model.file;
        serde_json::json!([self.surfaces_key(), target.mends, check]).to_string()
    }

    /// All that surfaces, and which of their patches are unfit, depend on but their faces: model,
    /// parameters, versions of the stages, tolerance.
    pub(super) fn surfaces_key(&self) -> String {
        let graph = self.sized_graph(crate::tolerance::FIRST_FACES, Remedies::default());
        let params: Vec<_> = graph.nodes.iter().map(|node| (&node.stage, &node.params)).collect();
        let versions: Vec<_> = self.registry.stages().map(|s| (s.name, s.version)).collect();
        let target = &self.model.file.target;
        let tolerance = (target.tolerance, target.tolerance_abs);
        serde_json::json!([self.key.content, params, versions, tolerance]).to_string()
    }
}

/// Takes away what comes after the curves.
pub(crate) fn up_to_curves(graph: &mut Graph) {
    let curves = graph.nodes.iter().position(|node| node.stage == CURVES_STAGE);
    graph.nodes.truncate(curves.expect("invariant: every graph fits curves") + 1);
}

/// The round that a refusal makes; the refusal itself if no other number of faces helps.
pub(crate) fn refused(error: RunError, rounds: &[Round]) -> Result<Found, RunError> {
    if error.diagnosis().is_some_and(|d| d.code() == TOO_MANY) && !rounds.is_empty() {
        return Ok(Found::TooMany);
    }
    let code = error.diagnosis().map_or("", Diagnosis::code);
    if !TOO_FEW.contains(&code) {
        return Err(error);
    }
    let earlier = rounds.iter().filter(|r| matches!(r.found, Found::Refused { .. })).count();
    if earlier + 1 >= MOST_REFUSALS {
        return Err(error);
    }
    Ok(Found::Refused { code: code.to_owned() })
}
