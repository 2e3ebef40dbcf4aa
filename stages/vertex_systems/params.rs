//! Parameters of the vertex systems.

use isospline_stage::Params;

/// The `[vertex_systems]` table: it has no keys yet.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VertexSystemsParams {}

impl Params for VertexSystemsParams {}
