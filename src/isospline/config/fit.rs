//! `target.fit`: how near the patches come to the surface, and for how much time.

use crate::config::Document;
use serde::{Deserialize, Serialize};

/// How the patches are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// Curves of normal distance, base mesh driven by their error, patches relaxed to the end.
    #[default]
    Full,
    /// As full, with a base mesh judged by the curves of the paper and fewer sweeps.
    Fast,
    /// Curves and patches of Tong and Kim [TK, Sec. 4].
    Paper,
}

/// Sweeps of a fast fit: further ones gain a factor of about ten and take most of the time.
const QUICK_SWEEPS: i64 = 2;

/// Iterations of the curves of a fast fit: on deccube of 5000 faces 40 leave no less error.
const QUICK_ITERATIONS: i64 = 16;

/// Rings of the tiles of a fast fit: on deccube of 5000 faces two sweeps take half the time that they
/// take with two rings, and leave no larger error.
const QUICK_TILE: i64 = 1;

/// Limits of the edges where patches are not relaxed to the end, or the mesh is as its author
/// wants it: the paper's patches fold beside edges that turn farther (deccube of 5000 faces has
/// two folds), and quick sweeps leave two or three times the error on torus and deccube.
const NARROW: [(&str, &str, f64); 4] = [
    ("decimate", "max_turning_deg", 50.0),
    ("decimate", "max_slope", 0.42),
    ("adapt", "max_turning_deg", 60.0),
    ("adapt", "max_slope", 0.5),
];

impl Fit {
    /// Puts the parameters of the stages that follow from the fit, where the user wrote none.
    pub(crate) fn fill(self, doc: &mut Document) {
        let values: &[(&str, &str, toml::Value)] = match self {
            Self::Full => &[],
            Self::Fast => &[
                ("adapt", "curves", "paper".into()),
                ("network", "iterations", QUICK_ITERATIONS.into()),
                ("relax", "sweeps", QUICK_SWEEPS.into()),
                ("relax", "tile", QUICK_TILE.into()),
            ],
            Self::Paper => {
                &[("adapt", "curves", "paper".into()), ("network", "method", "paper".into())]
            }
        };
        let is_narrow = self != Self::Full || doc.has("model", "base_mesh");
        let narrow = NARROW.iter().take(if is_narrow { NARROW.len() } else { 0 });
        let narrow = narrow.map(|&(table, key, value)| (table, key, value.into()));
        for (table, key, value) in values.iter().cloned().chain(narrow) {
            if !doc.has(table, key) {
                doc.put(table, key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::ModelFile;

    fn chosen(overrides: &[&str]) -> String {
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        let stages = ModelFile::from_formula("x", &overrides).unwrap().stages;
        let (curves, method) = (stages.adapt.curves, stages.network.method);
        let (iterations, relax) = (stages.network.iterations, stages.relax);
        format!("{curves:?} {method:?} {iterations} {} {}", relax.sweeps, relax.tile)
    }

    #[test]
    fn edges_turn_farther_where_a_mesh_of_our_own_is_relaxed_to_the_end() {
        let turning = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
            let stages = ModelFile::from_formula("x", &overrides).unwrap().stages;
            format!("{} {}", stages.decimate.max_turning_deg, stages.adapt.max_turning_deg)
        };
        assert_eq!(turning(&[]), "85 100");
        assert_eq!(turning(&["target.fit=paper"]), "50 60");
        assert_eq!(turning(&["target.fit=fast", "adapt.max_turning_deg=70"]), "50 70");
        assert_eq!(turning(&["model.base_mesh=a.obj"]), "50 60");
    }

    #[test]
    fn a_fit_sets_the_stages_and_what_the_user_wrote_stays() {
        assert_eq!(chosen(&[]), "Normal Normal 40 18 2");
        assert_eq!(chosen(&["target.fit=paper"]), "Paper Paper 40 18 2");
        assert_eq!(chosen(&["target.fit=full"]), "Normal Normal 40 18 2");
        assert_eq!(chosen(&["target.fit=fast"]), "Paper Normal 16 2 1");
        let mixed = ["target.fit=full", "relax.sweeps=3", "network.method=paper"];
        assert_eq!(chosen(&mixed), "Normal Paper 40 3 2");
    }
}
