//! What can keep a picture from being drawn.

use isospline_artifact::StoreError;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A side of the picture is out of range.
    #[error("a picture of {width} by {height} pixels is not possible: sides are {min} to {max}")]
    Size {
        /// Pixels a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Least pixels a side.
        min: u32,
        /// Most pixels a side.
        max: u32,
    },
    /// There cannot be as many stripes.
    #[error("{stripes} stripes are not in 1 to {max}")]
    Stripes {
        /// Stripes asked for.
        stripes: u32,
        /// Most that are possible.
        max: u32,
    },
    /// The range of the legend is empty or not a number.
    #[error("the range {lo} to {hi} holds no values that {style} can show")]
    Range {
        /// Lower end.
        lo: f64,
        /// Upper end.
        hi: f64,
        /// Name of the style.
        style: &'static str,
    },
    /// The eye cannot stand there.
    #[error("the view {what} is {value} degrees, outside {min} to {max}")]
    View {
        /// Which angle.
        what: &'static str,
        /// The angle.
        value: f64,
        /// Least angle.
        min: f64,
        /// Largest angle.
        max: f64,
    },
    /// There is nothing to draw.
    #[error("the surface has no faces")]
    Empty,
    /// No point of the surface is finite.
    #[error("the surface has no finite extent")]
    Extent,
    /// The patches are not polynomial of degree 7 with quartic boundaries.
    #[error("patches of degree {degree} with boundary degree {boundary_degree} cannot be drawn")]
    Degree {
        /// Degree found.
        degree: u32,
        /// Boundary degree found.
        boundary_degree: u32,
    },
    /// A row names something that does not exist.
    #[error("the surface does not fit together: {what} {row} names what is not there")]
    Incoherent {
        /// What the rows are.
        what: &'static str,
        /// The row.
        row: usize,
    },
    /// There is something at the path that a picture must not replace.
    #[error("{what} stands there, which is no file that can be replaced")]
    NotRegular {
        /// What it is.
        what: &'static str,
    },
    /// The file could not be written.
    #[error(transparent)]
    File(#[from] StoreError),
    /// The path could not be read.
    #[error("cannot read the path: {0}")]
    Io(#[from] std::io::Error),
}
