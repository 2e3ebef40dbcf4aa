//! Parameters of the boundary network.

use isospline_stage::Params;

/// How curves are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Least normal distance, with free tangent directions: two orders better at the same ends.
    #[default]
    Normal,
    /// Least squares of the distance to projected chord points [TK, Eq. (9)].
    Paper,
}

/// The `[network]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkParams {
    /// How curves are fitted; default `normal`.
    pub method: Method,
    /// Equidistant chord points a curve of the paper is fitted to and every curve is measured at,
    /// ends included; 7 to 129, default 17. More than 17 gains nothing.
    pub samples: u32,
    /// Samples of the normal distance a curve, 6 to 32, default 12; `normal` only.
    pub normal_samples: u32,
    /// Evaluations of the field along a curve at most, of each of two starts, 1 to 200, default 40; `normal` only.
    pub iterations: u32,
    /// Middles of faces, model units, whose sides keep the curves of the paper; `normal` only.
    pub paper_faces: Vec<[f64; 3]>,
}

impl Default for NetworkParams {
    fn default() -> Self {
        Self {
            method: Method::Normal,
            samples: 17,
            normal_samples: 12,
            iterations: 40,
            paper_faces: Vec::new(),
        }
    }
}

impl Params for NetworkParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        let ranges = [
            ("samples", self.samples, 7, 129),
            ("normal_samples", self.normal_samples, 6, 32),
            ("iterations", self.iterations, 1, 200),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err((key, format!("{value} is out of range: {low} to {high}")));
            }
        }
        Ok(())
    }
}
