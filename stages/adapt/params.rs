//! Parameters of the repair.

/// When a fit mesh is improved further.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Improve {
    /// Unless the mesh was imported: the author of a base mesh wants it as it is.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// The method by which curves will be fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curves {
    /// `network.method = "normal"`: further rounds move faces to where such curves are worst.
    #[default]
    Normal,
    /// `network.method = "paper"`.
    Paper,
}

/// Whether curves pass through points of the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Vertices {
    /// Vertices lie on the surface, with its normals.
    #[default]
    OnSurface,
    /// Vertices leave it, by about the error of the curves, where that brings the curves nearer.
    Free,
}

/// Parameters of the repair.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdaptParams {
    /// Largest angle between the normals at the ends of an edge, 5 to 120 degrees. Patches that are
    /// relaxed bear 100, those of the paper's method 60, which leaves coarse meshes no choice: of 31
    /// coarse surfaces of nine models 2 have no fold and no more faces than asked for with 60, 13
    /// with 90, 19 with 100, 18 with 110.
    pub max_turning_deg: f64,
    /// Largest part of an edge's chord along the normal at an end, 0.05 to 1.
    pub max_slope: f64,
    /// Quality (1 if equilateral) below which a face is a sliver, 0 to 0.5: avoided, not refused.
    pub min_quality: f64,
    /// Rounds of repair at most, 1 to 1000.
    pub max_rounds: u32,
    /// When a fit mesh is improved.
    pub improve: Improve,
    /// Rounds of improvement at most, 0 to 1000. On deccube the first four bring the error from
    /// 5e-4 to 7e-5; later ones help small meshes, until the interior of the patches decides.
    pub improve_rounds: u32,
    /// By which curves edges are judged.
    pub curves: Curves,
    /// Rounds of improvement for curves of normal distance, after the others, 0 to 1000.
    pub normal_rounds: u32,
    /// Middles of faces, model units, that are edited when all else is done, list after list: split
    /// across their longest side or, where one side is very short, merged away. A middle that no
    /// face has is left out.
    pub unfit_faces: Vec<Vec<[f64; 3]>>,
    /// Whether vertices stay on the surface.
    pub vertices: Vertices,
}

impl Default for AdaptParams {
    fn default() -> Self {
        Self {
            max_turning_deg: 100.0,
            max_slope: 0.8,
            min_quality: 0.1,
            max_rounds: 40,
            improve: Improve::Auto,
            improve_rounds: 8,
            curves: Curves::Normal,
            normal_rounds: 12,
            unfit_faces: Vec::new(),
            vertices: Vertices::OnSurface,
        }
    }
}

impl isospline_stage::Params for AdaptParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        let ranges = [
            ("max_turning_deg", self.max_turning_deg, 5.0, 120.0),
            ("max_slope", self.max_slope, 0.05, 1.0),
            ("min_quality", self.min_quality, 0.0, 0.5),
            ("max_rounds", f64::from(self.max_rounds), 1.0, 1000.0),
            ("improve_rounds", f64::from(self.improve_rounds), 0.0, 1000.0),
            ("normal_rounds", f64::from(self.normal_rounds), 0.0, 1000.0),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, format!("{value} is not in {low} to {high}")));
            }
        }
        Ok(())
    }
}
