//! Why a field cannot be polygonized.

use isospline_geometry::Vec3;
use isospline_stage::{Diagnosis, Stopped};
use std::fmt;

/// A side of the model's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether it is the side of the larger coordinate.
    pub upper: bool,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", ["x", "y", "z"][self.axis], if self.upper { '+' } else { '-' })
    }
}

/// Why a field cannot be polygonized.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolygonizeError {
    /// The surface has no point in the box.
    #[error("the level set is empty: f stays within [{min:?}, {max:?}] in the box")]
    EmptyLevelSet {
        /// Least value seen.
        min: f64,
        /// Largest value seen.
        max: f64,
    },
    /// f touches zero without changing its sign, as `(x^2 + y^2 + z^2 - 1)^2` does: there is no
    /// inside.
    #[error(
        "f does not change its sign: it touches zero near ({}, {}, {}) and stays within \
         [{min:?}, {max:?}] in the box",
        at.x, at.y, at.z
    )]
    NoSignChange {
        /// A point where it is zero.
        at: Vec3,
        /// Least value seen.
        min: f64,
        /// Largest value seen.
        max: f64,
    },
    /// The gradient vanishes all over the surface, as that of `(x^2 + y^2 + z^2 - 1)^3` does.
    #[error(
        "the level is not regular: grad f vanishes all over the surface, as near ({}, {}, {})",
        at.x, at.y, at.z
    )]
    LevelNotRegular {
        /// One such point.
        at: Vec3,
    },
    /// The surface has a sharp edge or tip.
    #[error(
        "the surface has a sharp edge of {:.1} degrees at ({}, {}, {}){}",
        angle_deg, at.x, at.y, at.z, made_by(kinks)
    )]
    SharpEdge {
        /// A point on it.
        at: Vec3,
        /// The angle between the normals on both sides.
        angle_deg: f64,
        /// Functions of the formula that make it, such as `min`; empty where that is not known.
        kinks: Vec<&'static str>,
    },
    /// The surface reaches a side of the box.
    #[error("the surface leaves the box at side {side} near ({}, {}, {})", at.x, at.y, at.z)]
    LeavesBox {
        /// The side.
        side: Side,
        /// A point there.
        at: Vec3,
    },
    /// The field has no value where the search needs one.
    #[error("f is not a number at ({}, {}, {})", at.x, at.y, at.z)]
    NotANumber {
        /// The point.
        at: Vec3,
    },
    /// Value and gradient vanish together.
    #[error(
        "the surface is singular at ({}, {}, {}): f = {value:e} and |grad f| = {slope:e} there",
        at.x, at.y, at.z
    )]
    SingularPoint {
        /// The point.
        at: Vec3,
        /// The value there.
        value: f64,
        /// Length of the gradient there.
        slope: f64,
    },
    /// Neither the interval test nor two resolutions that agree settle the topology.
    #[error("the topology is unresolved: {cells} and {} cells a side still disagree", 2 * cells)]
    TopologyUnresolved {
        /// Cells along the longest side at the finest pair of grids compared.
        cells: u32,
    },
    /// Enclosures leave room for surface at a place where the mesh has none.
    #[error(
        "the surface may have a part near ({}, {}, {}) that the grid cannot show{}",
        at.x, at.y, at.z, how_thin(*thickness, *cell)
    )]
    ThinnerThanGrid {
        /// A point there.
        at: Vec3,
        /// How thick the part is along the gradient, model units, if that can be told.
        thickness: Option<f64>,
        /// Side of a cell, model units.
        cell: f64,
    },
    /// The surface touches more cells than allowed.
    #[error("a grid of {cells} cells a side has more than {limit} cells on the surface")]
    TooManyCells {
        /// Cells along the longest side.
        cells: u64,
        /// The limit.
        limit: u32,
    },
    /// The box holds nothing.
    #[error("the box has no volume")]
    EmptyBox,
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

fn made_by(kinks: &[&str]) -> String {
    if kinks.is_empty() { String::new() } else { format!(", made by {}", kinks.join(" and ")) }
}

fn how_thin(thickness: Option<f64>, cell: f64) -> String {
    thickness.map_or_else(String::new, |t| format!(": it is {t:.2e} thick, a cell {cell:.2e}"))
}

impl Diagnosis for PolygonizeError {
    fn code(&self) -> &'static str {
        match self {
            Self::EmptyLevelSet { .. } => "empty-level-set",
            Self::NoSignChange { .. } => "no-sign-change",
            Self::LevelNotRegular { .. } => "level-not-regular",
            Self::SharpEdge { .. } => "sharp-edge",
            Self::LeavesBox { .. } => "leaves-box",
            Self::NotANumber { .. } => "not-a-number",
            Self::SingularPoint { .. } => "singular-point",
            Self::TopologyUnresolved { .. } => "topology-unresolved",
            Self::ThinnerThanGrid { .. } => "thinner-than-grid",
            Self::TooManyCells { .. } => "too-many-cells",
            Self::EmptyBox => "empty-box",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::LeavesBox { at, .. }
            | Self::NoSignChange { at, .. }
            | Self::LevelNotRegular { at }
            | Self::SharpEdge { at, .. }
            | Self::NotANumber { at }
            | Self::ThinnerThanGrid { at, .. }
            | Self::SingularPoint { at, .. } => Some(*at),
            _ => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = match self {
            Self::EmptyLevelSet { min, max } if *min > 0.0 || *max < 0.0 => {
                "set model.level within that range, or check model.box"
            }
            Self::EmptyLevelSet { .. } => "check model.box and model.level",
            Self::LeavesBox { .. } => {
                "enlarge model.box on that side if the surface is closed; open surfaces are refused"
            }
            Self::NoSignChange { .. } => {
                "a surface has an inside: set model.level off zero, or take the root of a square"
            }
            Self::LevelNotRegular { .. } => {
                "take the root of a power that stands alone in the formula, or change model.level"
            }
            Self::SharpEdge { .. } => {
                "round it off: smin(a, b, k) and smax(a, b, k) for min and max, \
                 sqrt(a^2 + k^2) for abs(a); k is the width of the rounding"
            }
            Self::NotANumber { .. } => {
                "make the formula defined there, or shrink model.box so that the point is outside"
            }
            Self::SingularPoint { .. } => {
                "a smooth surface has a gradient everywhere: change model.level or a parameter"
            }
            Self::TopologyUnresolved { .. } => {
                "set polygonize.cells higher, or smooth the formula (smin and smax have no kinks)"
            }
            Self::ThinnerThanGrid { .. } => "set polygonize.cells or target.faces higher",
            Self::TooManyCells { .. } => "ask for fewer faces, or raise polygonize.max_cells",
            Self::EmptyBox => "give model.box a lower bound below its upper bound on every axis",
            Self::Stopped(_) => return None,
        };
        Some(text.to_owned())
    }
}
