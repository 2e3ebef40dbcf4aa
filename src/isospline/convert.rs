//! A caller's own field becomes a surface in memory.

use crate::config::DEFAULT_MENDS;
use crate::config::{ConfigError, Inside, StageParams};
use crate::folder::{CURVES_COUNTER, refused, relax_goal, up_to_curves};
use crate::mending::{Mending, Unfit, applies, unfit};
use crate::model::{given_mesh, oriented};
use crate::stages;
use crate::tolerance::{Found, Round, Step, next};
use isospline_artifact::kinds::{Mesh, Patches, PatchesView};
use isospline_artifact::{Container, MemoryStore, StoreError};
use isospline_check::{
    CheckParams, CheckReport, Checked, Expected, Job, Surface, SurfaceError, check_faces,
};
use isospline_geometry::{Aabb, TriangleMesh};
use isospline_implicit::{Field, InsideError, Oriented};
use isospline_network::Method;
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
    /// Faces of the base mesh, at most; of no account where there is a tolerance.
    pub faces: u32,
    /// Largest error, relative to the diagonal of the box around the vertices, above 0 and below
    /// 1: the faces follow from it, unless a base mesh is given. Default: none.
    pub tolerance: Option<f64>,
    /// Surfaces made at most after one with patches that fold or lie beyond the
    /// tolerance, with those faces split.
    pub mends: u32,
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
            tolerance: None,
            mends: DEFAULT_MENDS,
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
    let Oriented { level, flipped, .. } =
        oriented(field, options.level, options.inside, &options.domain)?;
    let field = move || Oriented { inner: field, level, flipped };
    let job = ConvertJob { field: &field, options, on_event, registry: stages::registry() };
    match options.tolerance {
        Some(tolerance) if options.base_mesh.is_none() => job.within(tolerance),
        _ => job.mended(&options.stages.with_faces(options.faces), options.faces),
    }
}

/// What all rounds of a conversion share.
struct ConvertJob<'a, 'f> {
    field: &'a dyn Fn() -> Oriented<&'f dyn Field>,
    options: &'a Options<'a>,
    on_event: &'a (dyn Fn(&Event) + Sync),
    registry: Registry,
}

impl<'f> ConvertJob<'_, 'f> {
    /// Rounds until the error is just below the tolerance, as near as it comes.
    fn within(&self, tolerance: f64) -> Result<Conversion<'f>, ConvertError> {
        let mut rounds: Vec<Round> = Vec::new();
        let mut latest: Option<(u32, Conversion<'f>)> = None;
        loop {
            let (faces, is_whole) = match next(&rounds) {
                Step::Curves(faces) => (faces, false),
                Step::Surface(faces) => (faces, true),
                Step::End(ending) => match latest.filter(|(faces, _)| *faces == ending.faces) {
                    Some((_, conversion)) => return Ok(conversion),
                    None => {
                        return self.mended(&self.params(ending.faces, tolerance), ending.faces);
                    }
                },
            };
            let params = self.params(faces, tolerance);
            let made = if is_whole {
                self.mended(&params, faces).map(Some)
            } else {
                let made = self.run(&params, false);
                made.map(|(run, ..)| curves_of(&run, tolerance)).map(|curves| {
                    rounds.push(Round { faces, found: Found::Curves { curves } });
                    None
                })
            };
            match made {
                Ok(None) => {}
                Ok(Some(conversion)) => {
                    let found = conversion.found(tolerance)?;
                    rounds.push(Round { faces, found });
                    latest = Some((faces, conversion));
                }
                Err(ConvertError::Run(error)) => {
                    let found = refused(error, &rounds)?;
                    rounds.push(Round { faces, found });
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn params(&self, faces: u32, tolerance: f64) -> StageParams {
        let mut params = self.options.stages.with_faces(faces);
        params.relax.goal = params.relax.goal.max(relax_goal(tolerance));
        params
    }

    /// The surface, made again and again while patches are unfit; the one with the
    /// fewest of them.
    fn mended(&self, params: &StageParams, faces: u32) -> Result<Conversion<'f>, ConvertError> {
        let mut best = self.whole(params)?;
        if !applies(params, self.options.base_mesh.is_some()) {
            return Ok(best);
        }
        let mut mending = Mending::default();
        let (method, threads) = (params.network.method, self.options.run.threads);
        mending.add(best.unfit(method, threads)?);
        while !mending.is_over(self.options.mends, faces) {
            let mut params = params.clone();
            mending.tried().put_into(&mut params);
            let n_before = mending.n_tried();
            let made = self.whole(&params)?;
            mending.add(made.unfit(method, threads)?);
            if mending.n_kept() == n_before {
                best = made;
            }
        }
        Ok(best)
    }

    fn whole(&self, params: &StageParams) -> Result<Conversion<'f>, ConvertError> {
        let (report, graph, store) = self.run(params, true)?;
        let registry = &self.registry;
        let last = graph.last_of_kind(registry, <Patches as isospline_artifact::Artifact>::KIND);
        let last = last.expect("invariant: graphs end in patches");
        let patches = opened(registry, &graph, &store, last)?;
        let first = opened(registry, &graph, &store, 0)?;
        let topology = first.view::<Mesh>()?.topology[0];
        let expected = Expected {
            components: Some(topology.components),
            euler_characteristic: Some(topology.euler_characteristic),
            tolerance: self.options.tolerance,
        };
        Ok(Conversion { field: (self.field)(), report, patches, expected })
    }

    /// Runs the stages, or those up to the curves.
    fn run(
        &self,
        params: &StageParams,
        is_whole: bool,
    ) -> Result<(RunReport, Graph, MemoryStore), ConvertError> {
        let base_mesh = self.options.base_mesh.as_ref().map(given);
        let mut graph = stages::graph(&self.registry, params, base_mesh.as_ref());
        if !is_whole {
            up_to_curves(&mut graph);
        }
        let key =
            ModelKey { name: "closure".to_owned(), content: BTreeMap::new(), hashable: false };
        let (store, field) = (MemoryStore::new(), (self.field)());
        let (registry, model) = (&self.registry, &key);
        let pipeline = Pipeline { registry, graph: &graph, model, store: &store };
        let scene = Scene { field: &field, domain: self.options.domain };
        let report = pipeline.run(scene, &self.options.run, self.on_event)?;
        Ok((report, graph, store))
    }
}

/// Largest error of a curve, times the tolerance.
fn curves_of(run: &RunReport, tolerance: f64) -> f64 {
    let records = run.nodes.iter().filter_map(|node| node.provenance.as_ref());
    let errors = records.filter_map(|r| r.counters.maxima.get(CURVES_COUNTER));
    errors.fold(0.0, |acc: f64, e| acc.max(*e)) / tolerance
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
        let threads = RunOptions::default().threads;
        self.measured(limits, threads, |_, checked| checked.report)
    }

    /// What `take` makes of the surface and what its check found.
    fn measured<T>(
        &self,
        limits: &CheckParams,
        threads: usize,
        take: impl FnOnce(&Surface<'_>, Checked) -> T,
    ) -> Result<T, ConvertError> {
        let surface = Surface::from_patches(&self.patches()?)?;
        let job = Job {
            surface: &surface,
            field: &self.field,
            expected: self.expected,
            params: limits,
            repairs: self.repairs(),
        };
        let threads = Threads::new(threads);
        Ok(take(&surface, check_faces(&job, &|n, body| threads.for_each(n, body))))
    }

    fn unfit(&self, method: Method, threads: usize) -> Result<Vec<Unfit>, ConvertError> {
        self.measured(&CheckParams::default(), threads, |surface, checked| {
            unfit(surface, &self.field, &checked, self.expected.tolerance, method)
        })
    }

    fn found(&self, tolerance: f64) -> Result<Found, ConvertError> {
        let limits = CheckParams { error: Some(1.0), ..CheckParams::default() };
        let check = self.check(&limits)?;
        let surface = Some(check.rel_error_max / tolerance).filter(|error| error.is_finite());
        let curves = curves_of(&self.report, tolerance);
        Ok(Found::Surface { curves, surface, sound: check.pass })
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
