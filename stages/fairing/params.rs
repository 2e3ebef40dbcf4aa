//! Parameters of the fairing.

use isospline_fitting::patch_fit::{MAX_GRID, MIN_GRID};
use isospline_stage::Params;

/// The `[fairing]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FairingParams {
    /// Steps a side of the barycentric grid on which the patch of `g0_fit` is followed; 8 to 64,
    /// default 8. That of `g0_fit` makes it as near to the surface as that patch lets it be.
    pub grid: u32,
}

impl Default for FairingParams {
    fn default() -> Self {
        Self { grid: MIN_GRID }
    }
}

impl Params for FairingParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        if (MIN_GRID..=MAX_GRID).contains(&self.grid) {
            return Ok(());
        }
        Err(("grid", format!("{} is out of range: {MIN_GRID} to {MAX_GRID}", self.grid)))
    }
}
