//! Parameters of the decimation.

/// Parameters of the decimation. The guards hold as long as enough collapses pass them; after
/// that they are relaxed in steps, and every collapse made so is counted.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DecimateParams {
    /// Faces left at most (`target.faces`); from 4. At least 98 % of it is reached.
    pub faces: u32,
    /// Power of the curvature (over its mean) that weighs the error, 0 to 4; 0 makes the flat
    /// distance alone count, larger values put more faces where the surface bends.
    pub curvature_power: f64,
    /// Weight of the distance to the merged vertices against the distance to the planes, 1e-9 to
    /// 1; spreads vertices evenly where the surface is flat.
    pub spread: f64,
    /// Least quality of a new face, 0 to 1 (equilateral); slivers below it are refused.
    pub min_quality: f64,
    /// Largest angle between the normals at the ends of a new edge, 5 to 180 degrees; short of the
    /// limit of adapt, as vertices move afterwards.
    pub max_turning_deg: f64,
    /// Largest part of a new edge's chord along the normal at an end, 0.05 to 1.
    pub max_slope: f64,
    /// Most edges at a vertex, from 6.
    pub max_valence: u32,
}

impl Default for DecimateParams {
    fn default() -> Self {
        Self {
            faces: 5000,
            curvature_power: 1.0,
            spread: 1e-3,
            min_quality: 0.2,
            max_turning_deg: 85.0,
            max_slope: 0.7,
            max_valence: 9,
        }
    }
}

impl isospline_stage::Params for DecimateParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        let ranges = [
            ("curvature_power", self.curvature_power, 0.0, 4.0),
            ("spread", self.spread, 1e-9, 1.0),
            ("min_quality", self.min_quality, 0.0, 1.0),
            ("max_turning_deg", self.max_turning_deg, 5.0, 180.0),
            ("max_slope", self.max_slope, 0.05, 1.0),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, format!("{value} is not in {low} to {high}")));
            }
        }
        if self.faces < 4 {
            return Err(("faces", format!("{} is less than 4, a tetrahedron", self.faces)));
        }
        if self.max_valence < 6 {
            return Err(("max_valence", format!("{} is less than 6", self.max_valence)));
        }
        Ok(())
    }
}
