//! The model file: what surface, how many faces, what passes, and the parameters of the stages.

use crate::config::tables::{out_of_range, refuse_unknown_tables, typed};
use crate::config::target::give_way;
use crate::config::{ConfigError, Document, StageParams, TargetTable, foreign_as_toml};
use crate::text_file::read_text;
use isospline_adapt::Vertices;
use isospline_check::CheckParams;
use isospline_export::LengthUnit;
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{ForeignFormat, Formula};
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// `check.vertices` of a model whose vertices are free to leave the surface: as far as patches may
/// where nothing is said.
const FREE_VERTICES: f64 = 1e-3;

/// Where the surface is looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Domain {
    /// A box that holds the surface is found by interval bisection.
    #[default]
    Auto,
    /// The box `[[x0, x1], [y0, y1], [z0, z1]]`, in model units.
    Given([[f64; 2]; 3]),
}

impl Domain {
    /// The box, if it is given.
    pub fn given(&self) -> Option<Aabb> {
        match self {
            Self::Auto => None,
            Self::Given([x, y, z]) => {
                Some(Aabb::new(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1])))
            }
        }
    }
}

/// Which sign of `formula - level` is inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// The sign on the border of the box is outside.
    #[default]
    Auto,
    /// Negative values are inside.
    Negative,
    /// Positive values are inside.
    Positive,
}

/// Table `[model]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ModelTable {
    /// Name; also that of the folder under `out/`.
    pub name: String,
    /// The formula in `x`, `y`, `z` and the parameters.
    pub formula: String,
    /// The value of the formula on the surface; default 0.
    pub level: f64,
    /// The box.
    #[serde(rename = "box")]
    pub domain: Domain,
    /// Half side of the cube around the origin in which `"auto"` looks, model units; default 1000.
    pub box_limit: f64,
    /// Named numbers that the formula may use.
    pub parameters: BTreeMap<String, f64>,
    /// The side that is solid.
    pub inside: Inside,
    /// An OBJ file that takes the place of polygonize and decimate, relative to the model file.
    pub base_mesh: Option<PathBuf>,
    /// Unit of length, passed on to formats that name one; millimetres where absent.
    pub unit: Option<LengthUnit>,
}

/// Far beyond what a modeller's box has, near enough to be searched in milliseconds.
const DEFAULT_BOX_LIMIT: f64 = 1000.0;

/// Largest coordinate: the product of three is still a finite number.
const LARGEST: f64 = 1e100;

impl Default for ModelTable {
    fn default() -> Self {
        Self {
            name: String::new(),
            formula: String::new(),
            level: 0.0,
            domain: Domain::Auto,
            box_limit: DEFAULT_BOX_LIMIT,
            parameters: BTreeMap::new(),
            inside: Inside::Auto,
            base_mesh: None,
            unit: None,
        }
    }
}

/// A model file, read and checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelFile {
    /// Table `[model]`.
    pub model: ModelTable,
    /// Table `[target]`.
    pub target: TargetTable,
    /// Table `[check]`.
    pub check: CheckParams,
    /// A table a stage.
    pub stages: StageParams,
}

impl ModelFile {
    /// Reads a model file, of this program or a [`ForeignFormat`], and applies `overrides`
    /// (`KEY=VALUE`).
    ///
    /// # Errors
    /// The first thing that is wrong with the file or an override.
    pub fn open(path: &Path, overrides: &[String]) -> Result<Self, ConfigError> {
        let text = read_text(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        let name = path.display().to_string();
        let mut doc = match ForeignFormat::of(path) {
            None => Document::parse(&name, &text)?,
            Some(format) => Document::parse(
                &format!("{name}, as TOML"),
                &foreign_as_toml(path, format, &text)?,
            )?,
        };
        give_way(&mut doc, overrides);
        overrides.iter().try_for_each(|argument| doc.set(argument))?;
        let mut file = Self::from_document(&doc)?;
        if file.model.name.is_empty() {
            file.model.name = name_of(path);
        }
        if let Some(mesh) = &mut file.model.base_mesh {
            let folder = path.parent().unwrap_or(Path::new(""));
            *mesh = std::path::absolute(folder.join(&*mesh)).unwrap_or_else(|_| mesh.clone());
        }
        Ok(file)
    }

    /// The model of a bare formula.
    ///
    /// # Errors
    /// As [`ModelFile::open`].
    pub fn from_formula(formula: &str, overrides: &[String]) -> Result<Self, ConfigError> {
        let mut doc = Document::default();
        doc.put("model", "formula", formula);
        doc.put("model", "name", "formula");
        overrides.iter().try_for_each(|argument| doc.set(argument))?;
        Self::from_document(&doc)
    }

    /// The model of a document.
    ///
    /// # Errors
    /// As [`ModelFile::open`].
    pub fn from_document(doc: &Document) -> Result<Self, ConfigError> {
        let mut known = vec!["model", "target", "check"];
        known.extend(StageParams::NAMES);
        refuse_unknown_tables(doc, &known)?;
        let model: ModelTable = typed(doc, "model", &["base_mesh", "unit"])?;
        let target: TargetTable = typed(doc, "target", &["faces", "tolerance", "tolerance_abs"])?;
        let mut check: CheckParams = typed(doc, "check", &["error"])?;
        validate_model(doc, &model)?;
        validate_parameters(doc, &model)?;
        target.validate(doc)?;
        let target = target.completed();
        check
            .validate()
            .map_err(|(key, message)| out_of_range(doc, &format!("check.{key}"), message))?;
        let mut filled = doc.clone();
        target.fit.fill(&mut filled);
        let stages = StageParams::read(&filled, target.faces())?;
        if stages.adapt.vertices == Vertices::Free && !doc.has("check", "vertices") {
            check.vertices = FREE_VERTICES;
        }
        Ok(Self { model, target, check, stages })
    }
}

/// The file's name without extension, as the name of a folder may be.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map_or_else(|| "model".into(), |stem| stem.to_string_lossy());
    let stem = stem.trim_start_matches('.');
    stem.chars().map(|c| if is_plain(c) { c } else { '_' }).collect()
}

fn is_plain(c: char) -> bool {
    c.is_alphanumeric() || "-_.+".contains(c)
}

fn validate_model(doc: &Document, model: &ModelTable) -> Result<(), ConfigError> {
    if model.formula.trim().is_empty() {
        return Err(ConfigError::Missing { key: "model.formula" });
    }
    if !model.name.chars().all(is_plain) || model.name.starts_with('.') {
        let range = "letters, digits, `-`, `_`, `.` and `+`: it names a folder";
        return Err(out_of_range(doc, "model.name", range));
    }
    if !model.level.is_finite() {
        return Err(out_of_range(doc, "model.level", "a finite number"));
    }
    if !(model.box_limit > 0.0 && model.box_limit <= LARGEST) {
        let range = format!("a number above 0, at most {LARGEST:e}");
        return Err(out_of_range(doc, "model.box_limit", range));
    }
    if let Domain::Given(sides) = model.domain {
        let fine = |[lo, hi]: [f64; 2]| lo.is_finite() && hi.is_finite() && lo < hi;
        if let Some(axis) = sides.into_iter().position(|side| !fine(side)) {
            let side = ["x", "y", "z"][axis];
            let message = format!("the {side} side needs two finite numbers, the smaller first");
            return Err(out_of_range(doc, "model.box", message));
        }
        if sides.as_flattened().iter().any(|x| x.abs() > LARGEST) {
            let message = format!("beyond {LARGEST:e} products of coordinates overflow");
            return Err(out_of_range(doc, "model.box", message));
        }
    }
    Ok(())
}

fn validate_parameters(doc: &Document, model: &ModelTable) -> Result<(), ConfigError> {
    for (name, &value) in &model.parameters {
        let key = format!("model.parameters.{name}");
        if !value.is_finite() {
            return Err(out_of_range(doc, &key, "a finite number"));
        }
        // What a name may be is the formula's to say.
        let alone = BTreeMap::from([(name.clone(), value)]);
        if let Err(error) = Formula::parse("0", &alone) {
            let (message, place) = (error.kind.to_string(), doc.key_place(&key));
            return Err(ConfigError::ParameterName { key, message, place });
        }
    }
    Ok(())
}

impl Serialize for Domain {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::Given(sides) => sides.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Domain {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DomainVisitor)
    }
}

struct DomainVisitor;

impl<'de> Visitor<'de> for DomainVisitor {
    type Value = Domain;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"auto\" or [[x0, x1], [y0, y1], [z0, z1]]")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Domain, E> {
        match text {
            "auto" => Ok(Domain::Auto),
            _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Domain, A::Error> {
        let mut sides = [[0.0; 2]; 3];
        for (axis, side) in sides.iter_mut().enumerate() {
            *side = seq.next_element()?.ok_or_else(|| de::Error::invalid_length(axis, &self))?;
        }
        match seq.next_element::<de::IgnoredAny>()? {
            None => Ok(Domain::Given(sides)),
            Some(_) => Err(de::Error::invalid_length(4, &self)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DEFAULT_FACES;

    fn read(text: &str) -> Result<ModelFile, ConfigError> {
        ModelFile::from_document(&Document::parse("a.toml", text)?)
    }

    const SPHERE: &str = "[model]\nformula = \"x^2 + y^2 + z^2 - 1\"\n";

    fn refused(text: &str) -> ConfigError {
        read(&format!("{SPHERE}{text}")).expect_err(text)
    }

    #[test]
    fn a_formula_alone_is_a_model() {
        let file = read(SPHERE).unwrap();
        assert_eq!(file.model.domain, Domain::Auto);
        assert_eq!(file.target.faces, Some(DEFAULT_FACES));
        assert_eq!(file.stages.decimate.faces, DEFAULT_FACES);
    }

    #[test]
    fn a_misspelt_key_is_refused_with_the_nearest_name_and_its_line() {
        for (text, line, name) in [
            ("levle = 1", 3, "level"),
            ("base_mash = \"a.obj\"", 3, "base_mesh"),
            ("[target]\nface = 3", 4, "faces"),
            ("[decimat]\n", 3, "decimate"),
            ("[check]\ngpa = 3", 4, "gap"),
            ("[check]\nerorr = 3", 4, "error"),
            ("[decimate]\nmin_qualty = 3", 4, "min_quality"),
        ] {
            let ConfigError::UnknownKey { nearest, place, .. } = refused(text) else {
                panic!("{text}")
            };
            assert_eq!(nearest.as_deref(), Some(name), "{text}");
            assert_eq!(place.unwrap().line(), line, "{text}");
        }
    }

    #[test]
    fn a_value_of_another_type_is_named_with_its_path() {
        for (text, path) in [
            ("level = \"zero\"", "model.level"),
            ("parameters = { a = true }", "model.parameters.a"),
            ("box = \"big\"", "model.box"),
            ("box = [[0, 1], [0, 1]]", "model.box"),
            ("box = [[0, 1], [0, 1], [0, \"1\"]]", "model.box"),
            ("inside = \"left\"", "model.inside"),
            ("[target]\nfaces = -3", "target.faces"),
            ("[target]\nfaces = 2.5", "target.faces"),
        ] {
            let error = refused(text);
            let ConfigError::WrongType { key, place, .. } = &error else {
                panic!("{text}: {error}")
            };
            assert!(key.starts_with(path), "{text}: {key}");
            assert!(place.is_some(), "{text}");
        }
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for text in [
            "level = nan",
            "name = \"../a\"",
            "parameters = { a = inf }",
            "box = [[1, 0], [0, 1], [0, 1]]",
            "[target]\nfaces = 3",
            "[target]\ntolerance = 0",
            "[decimate]\nmin_quality = 7",
        ] {
            let error = refused(text);
            assert!(matches!(error, ConfigError::OutOfRange { .. }), "{text}: {error}");
        }
    }

    #[test]
    fn the_faces_of_a_stage_are_set_as_the_target_only() {
        let error = refused("[decimate]\nfaces = 7");
        assert!(matches!(error, ConfigError::Elsewhere { .. }), "{error}");
    }

    #[test]
    fn a_model_without_a_formula_is_refused() {
        let error = read("[target]\nfaces = 7").unwrap_err();
        assert!(matches!(error, ConfigError::Missing { key: "model.formula" }), "{error}");
    }

    #[test]
    fn the_canonical_text_reads_back_as_an_equal_model() {
        let text = "name = \"a\"\nlevel = 0.1\nparameters = { a = 0.8 }\nunit = \"mm\"\n\
            box = [[-1, 1], [-1, 1], [-2.5, 2]]\n[target]\ntolerance = 1e-5\n\
            [check]\nerror = 1e-7\n[decimate]\nspread = 0.25\n";
        let file = read(&format!("{SPHERE}{text}")).unwrap();
        assert_eq!(read(&file.to_toml()).unwrap(), file);
    }
}
