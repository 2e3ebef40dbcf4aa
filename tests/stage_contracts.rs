//! Every numeric stage keeps the contract of stages on a real model: the same bytes however its
//! work is cut and ordered, and no look at rows that it did not ask for.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline_adapt::freeze::freeze;
use isospline_artifact::kinds::{
    BaseMesh, Curvature, EdgeSystems, G0Fit, Network, Patches, VertexSystems,
};
use isospline_artifact::{Artifact, SectionSource};
use isospline_curvature::CurvatureStage;
use isospline_edge_systems::EdgeSystemsStage;
use isospline_fairing::Fairing;
use isospline_g0_fit::G0FitStage;
use isospline_geometry::{Aabb, TriangleMesh};
use isospline_implicit::{Field, Formula};
use isospline_network::NetworkStage;
use isospline_relax::{Relax, RelaxParams};
use isospline_stage::contract::Fixture;
use isospline_stage::{Ctx, InputSource, Inputs, Plan, Serial, Stage, Task, stage_contract};
use isospline_tests::root;
use isospline_vertex_systems::VertexSystemsStage;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The torus of [TK, Fig. 9] on a small mesh of its own, and what each stage makes of it.
struct Chain {
    base_mesh: BaseMesh,
    curvature: Curvature,
    network: Network,
    g0_fit: G0Fit,
    vertex_systems: VertexSystems,
    edge_systems: EdgeSystems,
    patches: Patches,
}

fn torus() -> Formula {
    Formula::parse("(sqrt(x^2+y^2)-5)^2+z^2-1", &BTreeMap::new()).unwrap()
}

fn mesh() -> TriangleMesh {
    let path = root().join("tests/fixtures/meshes/torus_20x10.obj");
    let text = std::fs::read_to_string(path).unwrap();
    let (positions, faces) = isospline_import::parse_obj(&text).unwrap();
    TriangleMesh { positions: positions.into_iter().map(Into::into).collect(), faces }
}

fn domain() -> Aabb {
    mesh().bounds()
}

struct Sources<'a>(Vec<(&'static str, &'a dyn SectionSource)>);

impl InputSource for Sources<'_> {
    fn input(&self, kind: &str) -> Option<&dyn SectionSource> {
        self.0.iter().find(|(k, _)| *k == kind).map(|(_, source)| *source)
    }
}

/// The stage's whole output as typed rows.
fn run<S: Stage>(inputs: &[(&'static str, &dyn SectionSource)]) -> S::Output {
    let field = torus();
    let ctx = Ctx { field: &field as &dyn Field, domain: domain(), host: &Serial };
    let sources = Sources(inputs.to_vec());
    let whole = S::Whole::open(&sources).unwrap();
    let rows = S::Rows::open(&sources).unwrap();
    let stage = S::prepare(&ctx, &S::Params::default(), whole).unwrap();
    let task = match stage.plan(whole, usize::MAX) {
        Plan::Whole => Task::default(),
        Plan::Rows { tasks, .. } => tasks.into_iter().next().unwrap(),
    };
    stage.process(&ctx, whole, rows, &task).unwrap().rows
}

fn chain() -> &'static Chain {
    static CHAIN: OnceLock<Chain> = OnceLock::new();
    CHAIN.get_or_init(|| {
        let base_mesh = freeze(&mesh(), &torus(), &Serial).unwrap();
        let base = (BaseMesh::KIND, &base_mesh as &dyn SectionSource);
        let curvature = run::<CurvatureStage>(&[base]);
        let network = run::<NetworkStage>(&[base, (Curvature::KIND, &curvature)]);
        let curves = (Network::KIND, &network as &dyn SectionSource);
        let g0_fit = run::<G0FitStage>(&[base, curves]);
        let fit = (G0Fit::KIND, &g0_fit as &dyn SectionSource);
        let shape = (Curvature::KIND, &curvature as &dyn SectionSource);
        let vertex_systems = run::<VertexSystemsStage>(&[base, shape, curves, fit]);
        let vertices = (VertexSystems::KIND, &vertex_systems as &dyn SectionSource);
        let edge_systems = run::<EdgeSystemsStage>(&[base, curves, fit, vertices]);
        let edges = (EdgeSystems::KIND, &edge_systems as &dyn SectionSource);
        let patches = run::<Fairing>(&[base, curves, fit, vertices, edges]);
        Chain { base_mesh, curvature, network, g0_fit, vertex_systems, edge_systems, patches }
    })
}

fn fixture<S: Stage>() -> Fixture<S> {
    Fixture::new(torus(), domain()).with_input(chain().base_mesh.clone())
}

mod curvature {
    use super::*;
    stage_contract!(CurvatureStage, fixture);
}

mod network {
    use super::*;
    stage_contract!(NetworkStage, || fixture().with_input(chain().curvature.clone()));
}

mod g0_fit {
    use super::*;
    stage_contract!(G0FitStage, || fixture().with_input(chain().network.clone()));
}

mod vertex_systems {
    use super::*;

    fn case() -> Fixture<VertexSystemsStage> {
        fixture()
            .with_input(chain().curvature.clone())
            .with_input(chain().network.clone())
            .with_input(chain().g0_fit.clone())
    }

    stage_contract!(VertexSystemsStage, case);

    #[test]
    fn weights_lie_in_range_and_nothing_is_regularised() {
        let systems = &chain().vertex_systems;
        assert!(systems.weights.iter().all(|w| w[0] > 0.0 && w[0] < 1.0));
        assert!(systems.status.iter().all(|s| *s == 0));
    }
}

mod edge_systems {
    use super::*;

    fn case() -> Fixture<EdgeSystemsStage> {
        fixture()
            .with_input(chain().network.clone())
            .with_input(chain().g0_fit.clone())
            .with_input(chain().vertex_systems.clone())
    }

    stage_contract!(EdgeSystemsStage, case);

    #[test]
    fn all_eight_rows_of_every_edge_hold_to_rounding() {
        let worst = chain().edge_systems.weights.iter().map(|w| w.residual).fold(0.0, f64::max);
        assert!(worst < 2e-14, "{worst:e}");
    }
}

mod fairing {
    use super::*;

    fn case() -> Fixture<Fairing> {
        fixture()
            .with_input(chain().network.clone())
            .with_input(chain().g0_fit.clone())
            .with_input(chain().vertex_systems.clone())
            .with_input(chain().edge_systems.clone())
    }

    stage_contract!(Fairing, case);
}

mod relax {
    use super::*;

    fn case() -> Fixture<Relax> {
        fixture()
            .with_params(RelaxParams { sweeps: 1, ..RelaxParams::default() })
            .with_input(chain().curvature.clone())
            .with_input(chain().network.clone())
            .with_input(chain().vertex_systems.clone())
            .with_input(chain().edge_systems.clone())
            .with_input(chain().patches.clone())
    }

    stage_contract!(Relax, case);
}
