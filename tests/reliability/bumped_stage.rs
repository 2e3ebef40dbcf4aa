//! A registry in which one stage has a higher version, as if a new release had changed it.

use isospline::config::ModelFile;
use isospline::{Model, stages};
use isospline_artifact::{Durability, FolderStore};
use isospline_pipeline::{Event, Pipeline, Registry, RunOptions, Scene};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use std::path::Path;
use std::sync::Mutex;

/// The stage `S`, of the next version.
struct Bumped<S>(S);

impl<S: Stage> Stage for Bumped<S> {
    const NAME: &'static str = S::NAME;
    const VERSION: u32 = S::VERSION + 1;
    type Params = S::Params;
    type Whole<'a> = S::Whole<'a>;
    type Rows<'a> = S::Rows<'a>;
    type Output = S::Output;
    type Error = S::Error;

    fn prepare(
        ctx: &Ctx<'_>,
        params: &Self::Params,
        whole: Self::Whole<'_>,
    ) -> Result<Self, Self::Error> {
        S::prepare(ctx, params, whole).map(Self)
    }

    fn plan(&self, whole: Self::Whole<'_>, rows_per_task: usize) -> Plan {
        self.0.plan(whole, rows_per_task)
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        whole: Self::Whole<'_>,
        rows: Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<Self::Output>, Self::Error> {
        self.0.process(ctx, whole, rows, task)
    }
}

macro_rules! with_one_bumped {
    ($($stage:ty),* $(,)?) => {
        /// Stages of a model without a base mesh, in their order.
        pub(crate) const STAGES: [&str; 11] = {
            let names = [$(<$stage>::NAME),*];
            let mut own = [""; 11];
            let mut k = 0;
            while k < own.len() {
                own[k] = names[k + 1];
                k += 1;
            }
            own
        };

        fn registry(bumped: &str) -> Registry {
            let mut registry = Registry::new();
            $(registry = if <$stage>::NAME == bumped {
                registry.with::<Bumped<$stage>>()
            } else {
                registry.with::<$stage>()
            };)*
            registry
        }
    };
}

with_one_bumped! {
    isospline_import::Import,
    isospline_polygonize::Polygonize,
    isospline_decimate::Decimate,
    isospline_project::Project,
    isospline_adapt::Adapt,
    isospline_curvature::CurvatureStage,
    isospline_network::NetworkStage,
    isospline_g0_fit::G0FitStage,
    isospline_vertex_systems::VertexSystemsStage,
    isospline_edge_systems::EdgeSystemsStage,
    isospline_fairing::Fairing,
    isospline_relax::Relax,
}

/// Runs a model into a store with `stage` of the next version; gives the stages that ran.
///
/// # Errors
/// Why the run failed.
pub(crate) fn run_bumped(model: &Path, store: &Path, stage: &str) -> Result<Vec<String>, String> {
    let file = ModelFile::open(model, &[]).map_err(|error| error.to_string())?;
    let model = Model::new(file).map_err(|error| error.to_string())?;
    let registry = registry(stage);
    let graph = stages::graph(&registry, &model.file.stages, None);
    let (key, store) = (model.key(), FolderStore::new(store, Durability::Fast));
    let pipeline = Pipeline { registry: &registry, graph: &graph, model: &key, store: &store };
    let ran = Mutex::new(Vec::new());
    let hear = |event: &Event| {
        if let Event::StageStarted { stage, .. } = event {
            ran.lock().expect("no listener panics").push(stage.clone());
        }
    };
    let scene = Scene { field: &model.field, domain: model.domain };
    pipeline.run(scene, &RunOptions::default(), &hear).map_err(|error| error.to_string())?;
    Ok(ran.into_inner().expect("no listener panics"))
}
