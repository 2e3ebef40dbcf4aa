//! A model folder: artifacts, the canonical model file, the last report.

mod mends;
mod rounds;

pub use mends::MENDS_NOTE;
pub(crate) use rounds::{CURVES_COUNTER, refused, relax_goal, up_to_curves};
pub use rounds::{ROUNDS_NOTE, Rounds};

use crate::config::ModelFile;
use crate::{Model, ModelError, stages};
use isospline_artifact::kinds::{Mesh, Patches, Topology, TopologyProof};
use isospline_artifact::{Artifact, Container, Durability, FolderStore, Key, Store, StoreError};
use isospline_check::{
    CheckParams, CheckReport, Checked, Expected, Job, Surface, SurfaceError, check_faces,
};
use isospline_pipeline::{
    Event, Graph, ModelKey, NodeStatus, Pipeline, Provenance, Registry, RunError, RunOptions,
    RunReport, Scene, Threads, read_provenance,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Name of the canonical model file.
pub const MODEL_NOTE: &str = "model.toml";
/// Name of the copy of `model.base_mesh`.
pub const BASE_MESH_NOTE: &str = "base_mesh.obj";
/// Name of the last report.
pub const REPORT_NOTE: &str = "report.json";

/// Why a model folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// There is no model file in it.
    #[error("{} is not a model folder: it has no {MODEL_NOTE}", path.display())]
    NotAModel {
        /// The folder.
        path: PathBuf,
    },
    /// Its model is refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Its files cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Its last artifact is no surface.
    #[error("the patches do not fit together: {0}")]
    Surface(#[from] SurfaceError),
}

/// A model and the folder of its artifacts.
#[derive(Debug)]
pub struct ModelFolder {
    model: Model,
    key: ModelKey,
    store: FolderStore,
    registry: Registry,
    graph: Graph,
    /// The check of the surface that was made last, with the content of its patches.
    last_check: Mutex<Option<(Key, CheckReport)>>,
}

impl ModelFolder {
    /// The folder at `path`, there or not, of this model.
    pub fn new(model: Model, path: impl Into<PathBuf>, durability: Durability) -> Self {
        let registry = stages::registry();
        let graph = stages::graph(&registry, &model.file.stages, model.base_mesh.as_ref());
        let (key, store) = (model.key(), FolderStore::new(path, durability));
        let mut folder = Self { model, key, store, registry, graph, last_check: Mutex::default() };
        if let Ok(faces) = folder.noted_faces()
            && let Ok(remedies) = folder.noted_remedies(faces)
        {
            folder.graph = folder.sized_graph(faces, remedies);
        }
        folder
    }

    /// The folder at `path` with the model that it holds.
    ///
    /// # Errors
    /// [`FolderError::NotAModel`], or what is wrong with its model.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let file = path.join(MODEL_NOTE);
        if !file.is_file() {
            return Err(FolderError::NotAModel { path: path.to_owned() });
        }
        let file = ModelFile::open(&file, &[]).map_err(ModelError::from)?;
        Ok(Self::new(Model::new(file)?, path, Durability::Durable))
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.store.folder()
    }

    /// Makes what is not fresh, after writing the canonical model file. A model with a tolerance
    /// is run for several numbers of faces, until its error is just below it; where patches
    /// fold or lie beyond the tolerance the surface is made again with those faces edited.
    ///
    /// # Errors
    /// See [`RunError`]; what was finished is kept.
    pub fn run(
        &self,
        options: &RunOptions<'_>,
        on_event: &(dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        self.save_model()?;
        if options.only.is_some() {
            return self.run_graph(&self.graph, options, on_event);
        }
        if self.has_rounds() {
            return self.run_rounds(options, on_event);
        }
        self.run_mended(self.model.file.target.faces(), options, on_event)
    }

    fn run_graph(
        &self,
        graph: &Graph,
        options: &RunOptions<'_>,
        on_event: &(dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        let (registry, model) = (&self.registry, &self.key);
        let pipeline = Pipeline { registry, graph, model, store: &self.store };
        let scene = Scene { field: &self.model.field, domain: self.model.domain };
        pipeline.run(scene, options, on_event)
    }

    /// State of every stage.
    ///
    /// # Errors
    /// See [`RunError`].
    pub fn status(&self) -> Result<Vec<NodeStatus>, RunError> {
        self.pipeline().status()
    }

    /// The record of an artifact; `None` if it is not there.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn record(&self, artifact: &str) -> Result<Option<Provenance>, StoreError> {
        read_provenance(self.store(), artifact)
    }

    /// The finished surface, all rows verified.
    ///
    /// # Errors
    /// [`StoreError::Missing`], [`StoreError::Damaged`], [`StoreError::Io`].
    pub fn patches(&self) -> Result<Arc<Container>, StoreError> {
        let last = self.graph.last_of_kind(&self.registry, Patches::KIND);
        let node = &self.graph.nodes[last.expect("invariant: every graph ends in patches")];
        self.store().open(&self.registry.artifact_name(node))
    }

    /// Names of the stages of this model, in the order in which they run.
    pub fn stage_names(&self) -> impl Iterator<Item = &str> {
        self.graph.nodes.iter().map(|node| node.stage.as_str())
    }

    /// What the last run of a stage made, all rows verified; `None` if the model has no such stage.
    ///
    /// # Errors
    /// As [`ModelFolder::patches`].
    pub fn artifact(&self, stage: &str) -> Option<Result<Arc<Container>, StoreError>> {
        let node = self.graph.nodes.iter().rfind(|node| node.stage == stage)?;
        Some(self.store().open(&self.registry.artifact_name(node)))
    }

    /// Measures the finished surface on as many threads, unless [`ModelFolder::run`] has done so.
    ///
    /// # Errors
    /// [`FolderError::Store`], [`FolderError::Surface`].
    pub fn check(&self, threads: usize) -> Result<CheckReport, FolderError> {
        let last = self.last_check().take();
        if let Some((content, report)) = last
            && content == self.patches()?.content()
        {
            return Ok(report);
        }
        self.check_against(&self.model.file.check, threads)
    }

    fn check_against(
        &self,
        limits: &CheckParams,
        threads: usize,
    ) -> Result<CheckReport, FolderError> {
        let (_, report) = self.measured(limits, threads, |_, checked| checked.report)?;
        Ok(report)
    }

    /// The content of the finished patches, and what `take` makes of their surface and of what its
    /// check found.
    fn measured<T>(
        &self,
        limits: &CheckParams,
        threads: usize,
        take: impl FnOnce(&Surface<'_>, Checked) -> T,
    ) -> Result<(Key, T), FolderError> {
        let container = self.patches()?;
        let surface = Surface::from_patches(&container.view::<Patches>()?)?;
        let job = Job {
            surface: &surface,
            field: &self.model.field,
            expected: self.expected(surface.diagonal())?,
            params: limits,
            repairs: self.repairs()?,
        };
        let threads = Threads::new(threads);
        let check = || check_faces(&job, &|n, body| threads.for_each(n, body));
        Ok((container.content(), take(&surface, threads.within(check))))
    }

    fn last_check(&self) -> MutexGuard<'_, Option<(Key, CheckReport)>> {
        // The report of a thread that panicked is still one.
        self.last_check.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counters of every fallback that a stage took, as `stage.name`.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn repairs(&self) -> Result<BTreeMap<String, u64>, StoreError> {
        let mut all = BTreeMap::new();
        for node in &self.graph.nodes {
            let artifact = self.registry.artifact_name(node);
            let Some(record) = read_provenance(self.store(), &artifact)? else { continue };
            let repairs = record.counters.repairs.into_iter();
            all.extend(repairs.map(|(name, n)| (format!("{}.{name}", node.label()), n)));
        }
        Ok(all)
    }

    /// How the topology of the first mesh was established; `None` without that mesh.
    ///
    /// # Errors
    /// [`StoreError::Damaged`], [`StoreError::Io`].
    pub fn topology(&self) -> Result<Option<(Topology, TopologyProof)>, StoreError> {
        let first = self.registry.artifact_name(&self.graph.nodes[0]);
        let Some(container) = self.store().peek(&first)? else { return Ok(None) };
        container.verify()?;
        let topology = container.view::<Mesh>()?.topology[0];
        Ok(TopologyProof::from_code(topology.proof).map(|proof| (topology, proof)))
    }

    /// Reads a note beside the artifacts.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn note(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.store.read_note(name)
    }

    /// Writes a note beside the artifacts, whole or not at all.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn write_note(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.store.write_note(name, bytes)
    }

    fn expected(&self, diagonal: f64) -> Result<Expected, StoreError> {
        let topology = self.topology()?.map(|(topology, _)| topology);
        Ok(Expected {
            components: topology.map(|t| t.components),
            euler_characteristic: topology.map(|t| t.euler_characteristic),
            tolerance: self.model.file.target.tolerance(diagonal),
        })
    }

    /// Writes the model file, and the base mesh it names, where they are not there or differ.
    ///
    /// The mesh stands beside the file, so that the folder can be moved.
    fn save_model(&self) -> Result<(), StoreError> {
        let mut file = self.model.file.clone();
        if let Some(text) = &self.model.base_mesh_text {
            file.model.base_mesh = Some(BASE_MESH_NOTE.into());
            self.bring_up(BASE_MESH_NOTE, text)?;
        }
        self.bring_up(MODEL_NOTE, &file.to_toml())
    }

    fn bring_up(&self, name: &str, text: &str) -> Result<(), StoreError> {
        if self.store.read_note(name)?.as_deref() == Some(text.as_bytes()) {
            return Ok(());
        }
        // Taken and freed: a folder that another process works on keeps its model.
        drop(self.store.lock()?);
        self.store.write_note(name, text.as_bytes())
    }

    fn store(&self) -> &dyn Store {
        &self.store
    }

    fn pipeline(&self) -> Pipeline<'_> {
        let (registry, graph) = (&self.registry, &self.graph);
        Pipeline { registry, graph, model: &self.key, store: &self.store }
    }
}
