//! Parameters of the edge systems.

use isospline_stage::Params;

/// The `[edge_systems]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EdgeSystemsParams {
    /// Penalty on the squared free scalar of an edge, beside squared moves of control points in
    /// chords; 0 to 1, default 1e-4. It does no harm and keeps `mu2` tame.
    pub nu_weight: f64,
}

impl Default for EdgeSystemsParams {
    fn default() -> Self {
        Self { nu_weight: 1e-4 }
    }
}

impl Params for EdgeSystemsParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        if (0.0..=1.0).contains(&self.nu_weight) {
            return Ok(());
        }
        Err(("nu_weight", format!("{} is out of range: 0 to 1", self.nu_weight)))
    }
}
