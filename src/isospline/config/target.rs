//! Table `[target]`: how many faces, or how near.

use crate::config::tables::out_of_range;
use crate::config::{ConfigError, Document, Fit};
use serde::{Deserialize, Serialize};

/// Table `[target]`. Of `faces`, `tolerance` and `tolerance_abs` one is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TargetTable {
    /// Faces of the base mesh, at most.
    pub faces: Option<u32>,
    /// Largest error, relative to the diagonal of the bounding box; the faces follow from it.
    pub tolerance: Option<f64>,
    /// The same in model units.
    pub tolerance_abs: Option<f64>,
    /// How the patches are fitted.
    pub fit: Fit,
    /// Surfaces made at most after one with patches that fold or lie beyond the tolerance, with
    /// those faces split or their curves fitted otherwise, 0 to 50.
    pub mends: u32,
}

impl Default for TargetTable {
    fn default() -> Self {
        Self {
            faces: None,
            tolerance: None,
            tolerance_abs: None,
            fit: Fit::default(),
            mends: DEFAULT_MENDS,
        }
    }
}

/// Faces where none are asked for: enough for a genus of about five, done in a blink.
pub const DEFAULT_FACES: u32 = 2000;

/// A tenth of what values of fields are rounded to, times the diagonal, where formulas are kind.
const LEAST_TOLERANCE: f64 = 1e-12;

/// Surfaces made at most after one with unfit patches: smooth models take two or three, boxes and
/// capsules with planar and cylindrical parts up to ten, with ups and downs on the way.
pub const DEFAULT_MENDS: u32 = 12;

/// Largest `target.mends`.
const MOST_MENDS: u32 = 50;

/// Keys of which one is given.
const EXCLUSIVE: [&str; 3] = ["faces", "tolerance", "tolerance_abs"];

impl TargetTable {
    /// Faces asked for.
    pub fn faces(&self) -> u32 {
        self.faces.unwrap_or(DEFAULT_FACES)
    }

    /// Largest error that passes, relative to `diagonal`; `None` where faces are asked for.
    pub fn tolerance(&self, diagonal: f64) -> Option<f64> {
        self.tolerance.or(self.tolerance_abs.map(|t| t / diagonal))
    }

    /// Whether the faces follow from a tolerance.
    pub fn is_by_tolerance(&self) -> bool {
        self.faces.is_none() && (self.tolerance.is_some() || self.tolerance_abs.is_some())
    }

    /// The table with the default number of faces where it says nothing.
    pub(crate) fn completed(mut self) -> Self {
        if !self.is_by_tolerance() {
            self.faces = Some(self.faces());
        }
        self
    }

    pub(crate) fn validate(&self, doc: &Document) -> Result<(), ConfigError> {
        let given = [self.faces.is_some(), self.tolerance.is_some(), self.tolerance_abs.is_some()];
        let given = EXCLUSIVE.iter().zip(given).filter(|(_, is_given)| *is_given);
        if let [(first, _), (second, _), ..] = given.collect::<Vec<_>>()[..] {
            let [key, other] = [first, second].map(|key| format!("target.{key}"));
            let place = doc.key_place(&other);
            return Err(ConfigError::Conflict { key, other, place });
        }
        if self.faces.is_some_and(|faces| faces < 4) {
            return Err(out_of_range(
                doc,
                "target.faces",
                "at least 4, the faces of a tetrahedron",
            ));
        }
        if self.mends > MOST_MENDS {
            return Err(out_of_range(doc, "target.mends", "0 to 50"));
        }
        if self.tolerance.is_some_and(|t| !(LEAST_TOLERANCE..1.0).contains(&t)) {
            let message = "from 1e-12, where rounding begins, to below 1, of the box diagonal";
            return Err(out_of_range(doc, "target.tolerance", message));
        }
        if self.tolerance_abs.is_some_and(|t| !(t > 0.0 && t.is_finite())) {
            let message = "above 0 and finite, in model units";
            return Err(out_of_range(doc, "target.tolerance_abs", message));
        }
        Ok(())
    }
}

/// Takes out of the file what an override is to stand for: `--set target.tolerance=1e-6` in place
/// of the file's `target.faces`.
pub(crate) fn give_way(doc: &mut Document, overrides: &[String]) {
    let key = |argument: &String| argument.split('=').next().map(|key| key.trim().to_owned());
    let keys: Vec<String> = overrides.iter().filter_map(key).collect();
    let is_set = |name: &str| keys.iter().any(|key| *key == format!("target.{name}"));
    if EXCLUSIVE.iter().any(|name| is_set(name)) {
        for name in EXCLUSIVE {
            doc.take("target", name);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::{ConfigError, Document, ModelFile};

    fn read(target: &str, overrides: &[&str]) -> Result<ModelFile, ConfigError> {
        let text = format!("[model]\nformula = \"x\"\n[target]\n{target}\n");
        let mut doc = Document::parse("a.toml", &text)?;
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        super::give_way(&mut doc, &overrides);
        overrides.iter().try_for_each(|argument| doc.set(argument))?;
        ModelFile::from_document(&doc)
    }

    #[test]
    fn faces_and_a_tolerance_exclude_each_other() {
        for text in [
            "faces = 9\ntolerance = 1e-6",
            "faces = 9\ntolerance_abs = 1e-6",
            "tolerance = 1e-6\ntolerance_abs = 1e-6",
        ] {
            let error = read(text, &[]).unwrap_err();
            assert!(matches!(error, ConfigError::Conflict { .. }), "{text}: {error}");
        }
        let both = read("", &["target.faces=9", "target.tolerance=1e-6"]).unwrap_err();
        assert!(matches!(both, ConfigError::Conflict { .. }), "{both}");
    }

    #[test]
    fn an_override_of_one_takes_the_place_of_the_others() {
        let target = read("faces = 9", &["target.tolerance=1e-6"]).unwrap().target;
        assert_eq!((target.faces, target.tolerance(2.0)), (None, Some(1e-6)));
        let target = read("tolerance = 1e-6", &["target.tolerance_abs=1e-3"]).unwrap().target;
        assert_eq!((target.faces, target.tolerance(2.0)), (None, Some(5e-4)));
        let target = read("tolerance = 1e-6", &["target.faces=70"]).unwrap().target;
        assert_eq!((target.faces(), target.tolerance(2.0)), (70, None));
        assert!(read("", &[]).unwrap().target.faces.is_some());
    }

    #[test]
    fn tolerances_out_of_range_are_refused() {
        for text in
            ["tolerance = 0", "tolerance = 1.5", "tolerance_abs = -1", "tolerance_abs = inf"]
        {
            let error = read(text, &[]).unwrap_err();
            assert!(matches!(error, ConfigError::OutOfRange { .. }), "{text}: {error}");
        }
    }
}
