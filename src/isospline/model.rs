//! A model file becomes a field, a box and a base mesh: what the stages work on.

use crate::box_search;
use crate::config::{ConfigError, Domain, Inside, ModelFile};
use isospline_artifact::kinds::{Mesh, Topology};
use isospline_geometry::Aabb;
use isospline_implicit::{
    BoundsError, Field, Formula, FormulaError, InsideError, Oriented, resolve_inside,
};
use isospline_import::{ObjError, parse_obj};
use isospline_pipeline::{Given, ModelKey};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a model cannot be worked on.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The model file is refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The formula cannot be read.
    #[error("model.formula: {error}")]
    Formula {
        /// The formula.
        text: String,
        /// What is wrong with it, and where.
        error: Box<FormulaError>,
    },
    /// No box holds the surface.
    #[error(transparent)]
    Box(#[from] BoundsError),
    /// The search for a box would take too long.
    #[error("model.box: a formula of {operations} operations is too long to find its box")]
    LongFormula {
        /// Operations of the formula.
        operations: usize,
    },
    /// The side that is solid cannot be told.
    #[error(transparent)]
    Inside(#[from] InsideError),
    /// The base mesh cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    MeshUnreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The base mesh is no triangle mesh.
    #[error("{}: {error}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where.
        error: ObjError,
    },
}

impl ModelError {
    fn formula(text: &str, error: FormulaError) -> Self {
        Self::Formula { text: text.to_owned(), error: Box::new(error) }
    }
}

/// A model, ready to be converted.
#[derive(Debug)]
pub struct Model {
    /// The file it comes from.
    pub file: ModelFile,
    /// The field, level at zero, `f < 0` inside.
    pub field: Oriented<Formula>,
    /// The box that holds the surface.
    pub domain: Aabb,
    /// The mesh that takes the place of polygonize and decimate.
    pub base_mesh: Option<Given>,
    /// The OBJ text that it was read from.
    pub base_mesh_text: Option<String>,
}

impl Model {
    /// Reads formula and base mesh of a model file and finds its box and side.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn new(file: ModelFile) -> Result<Self, ModelError> {
        let model = &file.model;
        let formula = Formula::parse(&model.formula, &model.parameters)
            .map_err(|error| ModelError::formula(&model.formula, error))?;
        let level = Oriented { inner: &formula, level: model.level, flipped: false };
        let domain = if let Some(domain) = model.domain.given() {
            domain
        } else {
            let operations = formula.canonical().lines().count();
            box_search::find(&level, operations, model.box_limit)?
        };
        let field = oriented(formula, model.level, model.inside, &domain)?;
        let read = model.base_mesh.as_deref().map(read_base_mesh).transpose()?;
        let (base_mesh, base_mesh_text) = read.unzip();
        Ok(Self { file, field, domain, base_mesh, base_mesh_text })
    }

    /// What of the model may change the output.
    ///
    /// The formula enters as parsed, with its parameters put in: spacing, comments and the names
    /// of intermediate lines do not count. Parameters stand beside it for the sake of the reader.
    pub fn key(&self) -> ModelKey {
        let model = &self.file.model;
        let sides = [0, 1, 2].map(|k| [self.domain.min[k], self.domain.max[k]]);
        let mut content = BTreeMap::from([
            ("formula".to_owned(), self.field.inner.canonical()),
            ("level".to_owned(), model.level.to_string()),
            ("box".to_owned(), format!("{sides:?}")),
            ("sign_turned".to_owned(), self.field.flipped.to_string()),
        ]);
        for (name, value) in &model.parameters {
            content.insert(format!("parameters.{name}"), value.to_string());
        }
        ModelKey { name: model.name.clone(), content, hashable: true }
    }

    /// What the user is to know of how the model was read: a box that was found, a sign turned.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.file.model.domain == Domain::Auto {
            let (min, max) = (self.domain.min, self.domain.max);
            let sides = [0, 1, 2].map(|k| format!("[{:?}, {:?}]", short(min[k]), short(max[k])));
            remarks.push(format!("model.box is auto: found [{}]", sides.join(", ")));
        }
        if self.field.flipped && self.file.model.inside == Inside::Auto {
            let remark = "model.inside is auto: positive values are inside, the sign is turned";
            remarks.push(remark.to_owned());
        }
        remarks
    }
}

/// The number to five digits.
fn short(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

fn read_base_mesh(path: &Path) -> Result<(Given, String), ModelError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| ModelError::MeshUnreadable { path: path.to_owned(), source })?;
    let (position, face) =
        parse_obj(&text).map_err(|error| ModelError::Mesh { path: path.to_owned(), error })?;
    // No path: what is kept of a run says nothing of the machine.
    Ok((given_mesh("model.base_mesh".to_owned(), position, face), text))
}

/// Rows for stage import, which finds out what they are worth.
pub(crate) fn given_mesh(label: String, position: Vec<[f64; 3]>, face: Vec<[u32; 3]>) -> Given {
    let component = vec![0; face.len()];
    Given::new(label, Mesh { position, face, component, topology: vec![Topology::default()] })
}

/// `field - level`, turned so that `f < 0` inside.
///
/// # Errors
/// [`InsideError`] if the field is not a number or changes its sign on the border of the box.
pub(crate) fn oriented<F: Field>(
    field: F,
    level: f64,
    inside: Inside,
    domain: &Aabb,
) -> Result<Oriented<F>, InsideError> {
    let unturned = Oriented { inner: field, level, flipped: false };
    let flipped = resolve_inside(&unturned, domain, inside.into())?;
    Ok(Oriented { flipped, ..unturned })
}

impl From<Inside> for isospline_implicit::Inside {
    fn from(inside: Inside) -> Self {
        match inside {
            Inside::Auto => Self::Auto,
            Inside::Negative => Self::Negative,
            Inside::Positive => Self::Positive,
        }
    }
}
