//! All stages, and the graph of a model: which stages run, and what each reads.

use crate::config::StageParams;
use isospline_network::Method;
use isospline_pipeline::{Given, Graph, Node, Registry};

/// Every stage, in the order that numbers the files.
pub fn registry() -> Registry {
    Registry::new()
        .with::<isospline_import::Import>()
        .with::<isospline_polygonize::Polygonize>()
        .with::<isospline_decimate::Decimate>()
        .with::<isospline_project::Project>()
        .with::<isospline_adapt::Adapt>()
        .with::<isospline_curvature::CurvatureStage>()
        .with::<isospline_network::NetworkStage>()
        .with::<isospline_g0_fit::G0FitStage>()
        .with::<isospline_vertex_systems::VertexSystemsStage>()
        .with::<isospline_edge_systems::EdgeSystemsStage>()
        .with::<isospline_fairing::Fairing>()
        .with::<isospline_relax::Relax>()
}

/// Name and version of every stage.
pub fn versions() -> Vec<(&'static str, u32)> {
    registry().stages().map(|stage| (stage.name, stage.version)).collect()
}

/// Stages between the base mesh's shape and the finished patches.
const SPINE: [&str; 8] = [
    "project",
    "adapt",
    "curvature",
    "network",
    "g0_fit",
    "vertex_systems",
    "edge_systems",
    "fairing",
];

/// The stage after them where curves are fitted by normal distance. The curves of the paper lie
/// farther from the surface than patches come without them.
const RELAXATION: [&str; 1] = ["relax"];

/// The graph of a model: `base_mesh`, if given, takes the place of polygonize and decimate.
pub fn graph(registry: &Registry, params: &StageParams, base_mesh: Option<&Given>) -> Graph {
    let start: &[&str] =
        if base_mesh.is_some() { &["import"] } else { &["polygonize", "decimate"] };
    let end: &[&str] = if params.network.method == Method::Normal { &RELAXATION } else { &[] };
    let mut graph = Graph::default();
    for stage in start.iter().chain(&SPINE).chain(end) {
        let mut node = Node::new(*stage).with(params.json(stage));
        if *stage == "import" {
            node.given.extend(base_mesh.cloned());
        } else {
            node = node.reading(latest_inputs(registry, &graph, stage));
        }
        graph.push(node);
    }
    graph
}

/// For each kind that `stage` reads, the last node so far that makes it.
fn latest_inputs(registry: &Registry, graph: &Graph, stage: &str) -> Vec<usize> {
    let info = registry.stage(stage).expect("invariant: the graph names registered stages");
    let kinds = info.whole.iter().chain(info.rows);
    kinds.filter_map(|kind| graph.last_of_kind(registry, kind)).collect()
}
