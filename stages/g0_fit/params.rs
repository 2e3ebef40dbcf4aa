//! Parameters of the G0 fit.

use isospline_fitting::patch_fit::{MAX_GRID, MIN_GRID};
use isospline_stage::Params;

/// The `[g0_fit]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct G0FitParams {
    /// Steps a side of the barycentric sample grid; 8 to 64, default 8. Finer gains nothing.
    pub grid: u32,
}

impl Default for G0FitParams {
    fn default() -> Self {
        Self { grid: MIN_GRID }
    }
}

impl Params for G0FitParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        if (MIN_GRID..=MAX_GRID).contains(&self.grid) {
            return Ok(());
        }
        Err(("grid", format!("{} is out of range: {MIN_GRID} to {MAX_GRID}", self.grid)))
    }
}
