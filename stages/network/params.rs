//! Parameters of the boundary network.

use isospline_stage::Params;

/// How curves are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Least squares of the distance to projected chord points [TK, Eq. (9)].
    #[default]
    Paper,
}

/// The `[network]` table.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkParams {
    /// How curves are fitted; default `paper`.
    pub method: Method,
    /// Equidistant chord points a curve is fitted to, ends included; 7 to 129, default 17.
    /// More than 17 gains nothing.
    pub samples: u32,
}

impl Default for NetworkParams {
    fn default() -> Self {
        Self { method: Method::Paper, samples: 17 }
    }
}

impl Params for NetworkParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        if (7..=129).contains(&self.samples) {
            return Ok(());
        }
        Err(("samples", format!("{} is out of range: 7 to 129", self.samples)))
    }
}
