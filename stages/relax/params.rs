//! Parameters of the relaxation.

use crate::degree::Degree;
use isospline_stage::Params;

/// The `[relax]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelaxParams {
    /// Passes over all tiles, 0 to 100, default 18. 2 leave about ten times the error, 12 up to
    /// three times; beyond 18 spheres gain up to ten times more, other models a fifth.
    pub sweeps: u32,
    /// Rings of faces about the vertex in the middle of a tile, 1 to 6, default 2. Tiles step by
    /// half their radius. With 1 a sweep is a third cheaper and coarse meshes need half as many
    /// again; 3 costs four times as much and saves a sweep.
    pub tile: u32,
    /// Steps a side of the sample grid, 9 to 32, default 12. Below 12 patches of coarse meshes
    /// swing between the samples.
    pub grid: u32,
    /// Distance at the samples, times the diagonal, below which a tile is left as it is; 0 to 1,
    /// default 0: all are brought as near as they come.
    pub goal: f64,
    /// Weight of squared second differences of the distance, over a twelfth of a side, beside the
    /// squared distance: a Sobolev term; 0 to 1, default 0. 0.3 halves jumps of curvature and
    /// costs half as much time again; 1 keeps sweeps from coming to an end.
    pub smoothness: f64,
    /// Degree of the patches, 6 or 7, default 7. Degree 6 has 28 control points in place of 36.
    pub degree: u32,
}

impl RelaxParams {
    pub(crate) fn degree(&self) -> Degree {
        if self.degree == 6 { Degree::Six } else { Degree::Seven }
    }
}

impl Default for RelaxParams {
    fn default() -> Self {
        Self { sweeps: 18, tile: 2, grid: 12, goal: 0.0, smoothness: 0.0, degree: 7 }
    }
}

impl Params for RelaxParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        let ranges = [
            ("sweeps", self.sweeps, 0, 100),
            ("tile", self.tile, 1, 6),
            ("grid", self.grid, 9, 32),
            ("degree", self.degree, 6, 7),
        ];
        for (key, value) in [("goal", self.goal), ("smoothness", self.smoothness)] {
            if !(0.0..=1.0).contains(&value) {
                return Err((key, format!("{value} is out of range: 0 to 1")));
            }
        }
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, format!("{value} is out of range: {low} to {high}")));
            }
        }
        Ok(())
    }
}
