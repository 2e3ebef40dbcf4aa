//! A model file becomes a field, a box and a base mesh: what the stages work on.

use crate::box_search::{self, Reach};
use crate::config::{ConfigError, Domain, Inside, ModelFile};
use crate::text_file::read_text;
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
    /// The formula lacks a coordinate: what it describes goes on for ever along that axis.
    #[error("model.formula does not depend on {}: {}", free_axes(*depends_on), endless(*depends_on))]
    TwoDimensional {
        /// Whether it depends on x, y, z.
        depends_on: [bool; 3],
    },
    /// The surface leaves the box that is given.
    #[error("{error}; {}", told_reach(reach))]
    LeavesBox {
        /// Through which sides, and where.
        error: InsideError,
        /// How far it goes.
        reach: Reach,
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

fn free_axes(depends_on: [bool; 3]) -> String {
    let free = ["x", "y", "z"].into_iter().zip(depends_on).filter(|(_, depends)| !depends);
    free.map(|(axis, _)| axis).collect::<Vec<_>>().join(" and ")
}

fn endless(depends_on: [bool; 3]) -> &'static str {
    match depends_on.iter().filter(|&&depends| depends).count() {
        2 => "it is two-dimensional, and its surface a cylinder without ends",
        1 => "it is one-dimensional, and its surface parallel planes",
        _ => "it is a constant",
    }
}

fn told_reach(reach: &Reach) -> String {
    match reach {
        Reach::Beyond(times) => format!("it leaves a box {times} times as large as well"),
        Reach::Within(domain) => {
            let (min, max) = (domain.min, domain.max);
            let sides = [0, 1, 2].map(|k| format!("[{:?}, {:?}]", short(min[k]), short(max[k])));
            format!("all of it lies in [{}]", sides.join(", "))
        }
        Reach::Unknown => "how far it goes is not known".to_owned(),
    }
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
        let depends_on = formula.depends_on();
        // Only of a field that has a surface: that there is none would be the better message.
        let is_flat = depends_on.contains(&false) && depends_on.contains(&true);
        let operations = formula.n_operations();
        let level = Oriented { inner: &formula, level: model.level, flipped: false };
        let domain = if let Some(domain) = model.domain.given() {
            domain
        } else {
            match box_search::find(&level, operations, model.box_limit) {
                Err(ModelError::Box(error)) if is_flat && has_zeros(&error) => {
                    return Err(ModelError::TwoDimensional { depends_on });
                }
                found => found?,
            }
        };
        let flipped = match resolve_inside(&level, &domain, model.inside.into()) {
            Err(InsideError::LeavesBox { .. }) if is_flat => {
                return Err(ModelError::TwoDimensional { depends_on });
            }
            Err(error @ InsideError::LeavesBox { .. }) => {
                let reach = box_search::reach(&level, operations, &domain);
                return Err(ModelError::LeavesBox { error, reach });
            }
            flipped => flipped?,
        };
        let field = Oriented { inner: formula, level: model.level, flipped };
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

/// Whether the search for a box found zeros, but no end of them.
fn has_zeros(error: &BoundsError) -> bool {
    !matches!(error, BoundsError::Empty { .. } | BoundsError::Undefined { .. })
}

/// The number to five digits.
fn short(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

fn read_base_mesh(path: &Path) -> Result<(Given, String), ModelError> {
    let text = read_text(path)
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
