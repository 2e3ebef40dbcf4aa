//! What a conversion did and what came out, as `report.json` holds it.

use crate::{ModelFolder, Rounds};
use isospline_artifact::StoreError;
use isospline_artifact::kinds::TopologyProof;
use isospline_check::{CheckParams, CheckReport};
use isospline_pipeline::{Outcome, RunReport};
use isospline_stage::Counters;
use serde::Serialize;

/// One stage of a conversion.
#[derive(Clone, Debug, Serialize)]
pub struct StageReport {
    /// Name.
    pub stage: String,
    /// Whether it ran in this conversion.
    pub outcome: Outcome,
    /// Wall time of its last run, seconds; stages at work at once share it.
    pub seconds: f64,
    /// Time of its own work, seconds: its tasks spread evenly over all threads.
    pub own_seconds: f64,
    /// Tasks of its last run that were taken from an earlier one.
    pub resumed_tasks: usize,
    /// Size of its artifact.
    pub bytes: u64,
    /// Figures and repairs.
    pub counters: Counters,
}

/// A whole conversion.
#[derive(Clone, Debug, Serialize)]
pub struct ConversionReport {
    /// Version of the program.
    pub program: &'static str,
    /// Name of the model.
    pub model: String,
    /// What the report stands for; see [`fingerprint`].
    pub fingerprint: String,
    /// `certified`, `observed` or `imported`: how the topology was established.
    pub topology: Option<&'static str>,
    /// Whether the formula was turned, so that negative values are inside.
    pub sign_turned: bool,
    /// The box `[[x0, x1], [y0, y1], [z0, z1]]`.
    #[serde(rename = "box")]
    pub domain: [[f64; 2]; 3],
    /// Faces asked for, by the model or by the last round for its tolerance.
    pub target_faces: u32,
    /// The search for these faces, where the model has a tolerance.
    pub rounds: Option<Rounds>,
    /// Working threads.
    pub threads: usize,
    /// Wall time of the conversion, without the check.
    pub seconds: f64,
    /// Largest resident memory of the process while stages ran, bytes; 0 if unknown.
    pub peak_resident_bytes: u64,
    /// The stages, in order.
    pub stages: Vec<StageReport>,
    /// The check of the surface.
    pub check: CheckReport,
}

impl ConversionReport {
    /// The report of a run in `folder` and of the check after it.
    ///
    /// # Errors
    /// [`StoreError`] if the first mesh cannot be read.
    pub fn new(
        folder: &ModelFolder,
        run: &RunReport,
        threads: usize,
        check: CheckReport,
    ) -> Result<Self, StoreError> {
        let (model, rounds) = (folder.model(), folder.rounds()?);
        let (min, max) = (model.domain.min, model.domain.max);
        let peak =
            run.nodes.iter().filter_map(|n| Some(n.provenance.as_ref()?.cost.peak_resident_bytes));
        Ok(Self {
            program: env!("CARGO_PKG_VERSION"),
            model: model.file.model.name.clone(),
            fingerprint: fingerprint(folder, run),
            topology: folder.topology()?.map(|(_, proof)| proof_name(proof)),
            sign_turned: model.field.flipped,
            domain: [0, 1, 2].map(|axis| [min[axis], max[axis]]),
            target_faces: rounds.as_ref().map_or(model.file.target.faces(), |r| r.faces),
            rounds,
            threads,
            seconds: run.seconds,
            peak_resident_bytes: peak.max().unwrap_or(0),
            stages: stages(run),
            check,
        })
    }
}

/// Names what a check depends on: the finished rows, the model and the limits.
///
/// A report with an equal fingerprint need not be made again.
pub fn fingerprint(folder: &ModelFolder, run: &RunReport) -> String {
    let surface = run.nodes.last().map(|node| node.content.to_string()).unwrap_or_default();
    let model = folder.model();
    let limits: &CheckParams = &model.file.check;
    let key = serde_json::json!([
        env!("CARGO_PKG_VERSION"),
        surface,
        model.key().content,
        limits,
        model.file.target.tolerance,
        model.file.target.tolerance_abs,
    ]);
    key.to_string()
}

/// The word for a proof of topology.
pub fn proof_name(proof: TopologyProof) -> &'static str {
    match proof {
        TopologyProof::Imported => "imported",
        TopologyProof::Observed => "observed",
        TopologyProof::Certified => "certified",
    }
}

fn stages(run: &RunReport) -> Vec<StageReport> {
    let stage = |node: &isospline_pipeline::NodeReport| {
        let record = node.provenance.as_ref();
        StageReport {
            stage: node.stage.clone(),
            outcome: node.outcome,
            seconds: record.map_or(f64::NAN, |record| record.cost.seconds),
            own_seconds: record.map_or(f64::NAN, |record| record.cost.own_seconds()),
            resumed_tasks: node.resumed_tasks(),
            bytes: node.bytes,
            counters: record.map(|record| record.counters.clone()).unwrap_or_default(),
        }
    };
    run.nodes.iter().map(stage).collect()
}
