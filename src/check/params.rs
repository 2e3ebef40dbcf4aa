//! What the surface is held against: the `[check]` table and what earlier stages promise.

use serde::{Deserialize, Serialize};

/// The `[check]` table of a model file: limits that `pass` is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CheckParams {
    /// Largest gap along shared edges, times the bounding-box diagonal; default 1e-14.
    pub gap: f64,
    /// Whether shared edges must agree in all bits, not only within `gap`; default true.
    pub same_bits: bool,
    /// Largest angle between the normals of two patches along their edge, degrees; default 1e-6.
    pub g1_angle_deg: f64,
    /// Largest distance of a vertex from the surface, times the diagonal; default 1e-12.
    pub vertices: f64,
    /// Largest distance of a patch from the surface, times the diagonal; `target.tolerance`, and
    /// without it 1e-3, where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Patches that may face inward somewhere; default 0.
    pub flipped_patches: u64,
}

impl Default for CheckParams {
    fn default() -> Self {
        Self {
            gap: 1e-14,
            same_bits: true,
            g1_angle_deg: 1e-6,
            vertices: 1e-12,
            error: None,
            flipped_patches: 0,
        }
    }
}

/// What earlier stages and the model promise about the surface; `None` where nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expected {
    /// Connected components that polygonize found.
    pub components: Option<u32>,
    /// Euler characteristic that polygonize found, over all components.
    pub euler_characteristic: Option<i64>,
    /// `target.tolerance`, times the diagonal.
    pub tolerance: Option<f64>,
}

/// Largest relative distance where neither the table nor the model names one.
pub const DEFAULT_ERROR: f64 = 1e-3;

impl CheckParams {
    /// Names the first limit out of its range: `(key, what is wrong)`.
    ///
    /// # Errors
    /// The key and a sentence with the range.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        let limits = [
            ("gap", Some(self.gap), 1.0),
            ("g1_angle_deg", Some(self.g1_angle_deg), 180.0),
            ("vertices", Some(self.vertices), 1.0),
            ("error", self.error, 1.0),
        ];
        for (key, limit, most) in limits {
            if let Some(limit) = limit.filter(|limit| !(0.0..=most).contains(limit)) {
                return Err((key, format!("{limit} is not within 0 to {most}")));
            }
        }
        Ok(())
    }

    /// The limit of `rel_error_max`: the table's own, then the model's tolerance, then 1e-3.
    pub fn error_limit(&self, expected: &Expected) -> f64 {
        self.error.or(expected.tolerance).unwrap_or(DEFAULT_ERROR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_table_gives_the_defaults_and_an_unknown_key_is_refused() {
        assert_eq!(toml::from_str::<CheckParams>("").unwrap(), CheckParams::default());
        let refused = toml::from_str::<CheckParams>("gpa = 1e-14").unwrap_err();
        assert!(refused.to_string().contains("gpa"), "{refused}");
    }

    #[test]
    fn limits_that_nothing_or_everything_passes_are_refused() {
        assert_eq!(CheckParams::default().validate(), Ok(()));
        for (text, key) in [
            ("gap = nan", "gap"),
            ("gap = -1.0", "gap"),
            ("g1_angle_deg = 181.0", "g1_angle_deg"),
            ("vertices = inf", "vertices"),
            ("error = 2.0", "error"),
        ] {
            let refused = toml::from_str::<CheckParams>(text).unwrap().validate().unwrap_err();
            assert_eq!(refused.0, key, "{text}");
        }
    }

    #[test]
    fn the_table_outranks_the_tolerance_of_the_model() {
        let expected = Expected { tolerance: Some(1e-5), ..Expected::default() };
        let own = CheckParams { error: Some(1e-4), ..CheckParams::default() };
        assert!((own.error_limit(&expected) - 1e-4).abs() < 1e-18);
        assert!((CheckParams::default().error_limit(&expected) - 1e-5).abs() < 1e-18);
        assert!((CheckParams::default().error_limit(&Expected::default()) - 1e-3).abs() < 1e-18);
    }
}
