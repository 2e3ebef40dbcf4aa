//! A caller's own field becomes a surface in memory.

use crate::config::{ConfigError, Inside, StageParams};
use crate::model::{given_mesh, oriented};
use crate::stages;
use isospline_artifact::kinds::{Mesh, Patches, PatchesView};
use isospline_artifact::{Container, MemoryStore, StoreError};
use isospline_check::{CheckParams, CheckReport, Expected, Job, Surface, SurfaceError};
use isospline_geometry::{Aabb, TriangleMesh};
use isospline_implicit::{Field, InsideError, Oriented};
use isospline_pipeline::{
    Event, Given, Graph, ModelKey, Pipeline, Registry, RunError, RunOptions, RunReport, Scene,
    Threads,
};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// What to convert a field with.
///
/// # Examples
/// ```
/// use isospline::{Aabb, Options, Vec3};
///
/// let domain = Aabb::new(Vec3::repeat(-1.1), Vec3::repeat(1.1));
/// let options = Options { faces: 200, ..Options::new(domain) };
/// ```
#[derive(Clone, Debug)]
pub struct Options<'a> {
    /// The box that holds the surface.
    pub domain: Aabb,
    /// Faces of the base mesh, at most.
    pub faces: u32,
    /// The value of the field on the surface.
    pub level: f64,
    /// The side that is solid.
    pub inside: Inside,
    /// A mesh near the surface that takes the place of polygonize and decimate.
    pub base_mesh: Option<TriangleMesh>,
    /// Parameters of the stages; their `faces` are those above.
    pub stages: StageParams,
    /// Threads, task size and stop flag.
    pub run: RunOptions<'a>,
}

impl Options<'_> {
    /// All defaults: 2000 faces, level 0, the sign on the border of the box outside.
    pub fn new(domain: Aabb) -> Self {
        Self {
            domain,
            faces: crate::config::DEFAULT_FACES,
            level: 0.0,
            inside: Inside::Auto,
            base_mesh: None,
            stages: StageParams::default(),
            run: RunOptions::default(),
        }
    }
}

/// Why a field cannot be converted.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// A parameter out of its range.
    #[error(transparent)]
    Params(#[from] ConfigError),
    /// The side of the surface cannot be told.
    #[error(transparent)]
    Inside(#[from] InsideError),
    /// A stage cannot do its work.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The patches do not fit together.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The artifact in memory cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// A converted field.
pub struct Conversion<'f> {
    /// The field as converted: level at zero, `f < 0` inside.
    pub field: Oriented<&'f dyn Field>,
    /// Stages, times and counters.
    pub report: RunReport,
    patches: Arc<Container>,
    expected: Expected,
}

impl fmt::Debug for Conversion<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("Conversion");
        out.field("report", &self.report).field("expected", &self.expected).finish_non_exhaustive()
    }
}

/// Converts `field` into a watertight G1 surface of degree-7 triangular Bézier patches.
///
/// The field may be an expression, closures or the caller's own type; the artifacts stay in
/// memory.
///
/// # Errors
/// [`ConvertError`]: among others an empty or open level set and too few faces.
///
/// # Examples
/// ```
/// use isospline::{Aabb, ClosureField, Options, Vec3, convert};
///
/// let sphere = ClosureField::new(1.0, |p: Vec3| p.norm_squared() - 1.0);
/// let domain = Aabb::new(Vec3::repeat(-1.1), Vec3::repeat(1.1));
/// let surface = convert(&sphere, &Options { faces: 200, ..Options::new(domain) })?;
/// assert!(surface.patches()?.face.len() <= 200);
/// # Ok::<(), isospline::ConvertError>(())
/// ```
pub fn convert<'f>(
    field: &'f dyn Field,
    options: &Options<'_>,
) -> Result<Conversion<'f>, ConvertError> {
    convert_with_events(field, options, &|_| ())
}

/// As [`convert`], and tells what happens meanwhile; `on_event` is called from any thread.
///
/// # Errors
/// As [`convert`].
pub fn convert_with_events<'f>(
    field: &'f dyn Field,
    options: &Options<'_>,
    on_event: &(dyn Fn(&Event) + Sync),
) -> Result<Conversion<'f>, ConvertError> {
    let field = oriented(field, options.level, options.inside, &options.domain)?;
    let registry = stages::registry();
    let base_mesh = options.base_mesh.as_ref().map(given);
    let params = options.stages.with_faces(options.faces);
    let graph = stages::graph(&registry, &params, base_mesh.as_ref());
    let key = ModelKey { name: "closure".to_owned(), content: BTreeMap::new(), hashable: false };
    let store = MemoryStore::new();
    let pipeline = Pipeline { registry: &registry, graph: &graph, model: &key, store: &store };
    let scene = Scene { field: &field, domain: options.domain };
    let report = pipeline.run(scene, &options.run, on_event)?;
    let last = graph.last_of_kind(&registry, <Patches as isospline_artifact::Artifact>::KIND);
    let patches =
        opened(&registry, &graph, &store, last.expect("invariant: graphs end in patches"))?;
    let first = opened(&registry, &graph, &store, 0)?;
    let topology = first.view::<Mesh>()?.topology[0];
    let expected = Expected {
        components: Some(topology.components),
        euler_characteristic: Some(topology.euler_characteristic),
        tolerance: None,
    };
    Ok(Conversion { field, report, patches, expected })
}

impl Conversion<'_> {
    /// The finished surface.
    ///
    /// # Errors
    /// [`StoreError`] if the artifact is of another kind.
    pub fn patches(&self) -> Result<PatchesView<'_>, StoreError> {
        self.patches.view::<Patches>()
    }

    /// Measures the surface from outside and holds it against `limits`.
    ///
    /// # Errors
    /// [`ConvertError::Surface`] if the patches do not fit together.
    pub fn check(&self, limits: &CheckParams) -> Result<CheckReport, ConvertError> {
        let surface = Surface::from_patches(&self.patches()?)?;
        let job = Job {
            surface: &surface,
            field: &self.field,
            expected: self.expected,
            params: limits,
            repairs: self.repairs(),
        };
        let threads = Threads::new(RunOptions::default().threads);
        Ok(isospline_check::check(&job, &|n, body| threads.for_each(n, body)))
    }

    /// Counters of every fallback that a stage took, as `stage.name`.
    pub fn repairs(&self) -> BTreeMap<String, u64> {
        let records = self.report.nodes.iter().filter_map(|n| Some((n, n.provenance.as_ref()?)));
        let all = records.flat_map(|(node, record)| {
            let repairs = record.counters.repairs.iter();
            repairs.map(|(name, count)| (format!("{}.{name}", node.stage), *count))
        });
        all.collect()
    }
}

fn given(mesh: &TriangleMesh) -> Given {
    let position = mesh.positions.iter().map(|&p| p.into()).collect();
    given_mesh("base mesh".to_owned(), position, mesh.faces.clone())
}

fn opened(
    registry: &Registry,
    graph: &Graph,
    store: &MemoryStore,
    node: usize,
) -> Result<Arc<Container>, StoreError> {
    let store: &dyn isospline_artifact::Store = store;
    store.open(&registry.artifact_name(&graph.nodes[node]))
}
