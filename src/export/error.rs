//! What can keep a surface from being written.

use isospline_artifact::StoreError;

/// Why a surface was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The output refused what was written to it.
    #[error("cannot write the export: {0}")]
    Io(#[from] std::io::Error),
    /// The file could not be put in its place.
    #[error(transparent)]
    File(#[from] StoreError),
    /// There is something at the path that an export must not replace.
    #[error("{what} stands there, which is no file that can be replaced")]
    NotRegular {
        /// What it is.
        what: &'static str,
    },
    /// `samples` is outside its range.
    #[error("samples = {samples} is not in 1 ..= {max}")]
    Samples {
        /// Samples asked for.
        samples: u32,
        /// Most that are possible.
        max: u32,
    },
    /// `order` is outside its range.
    #[error("order = {order} is not in 1 ..= {max}")]
    Order {
        /// Order asked for.
        order: u32,
        /// Highest that there is.
        max: u32,
    },
    /// A tolerance is no distance, or not below the size of the model.
    #[error("a tolerance of {tolerance} is not above 0 and, as a part of the diagonal, below 1")]
    ToleranceRange {
        /// Tolerance asked for.
        tolerance: f64,
    },
    /// A tolerance takes more triangles a patch than there may be.
    #[error("patch {face} would need more than 65536 triangles for a tolerance of {tolerance:e}")]
    Tolerance {
        /// Tolerance asked for, model units.
        tolerance: f64,
        /// The patch.
        face: usize,
    },
    /// The format cannot count that far.
    #[error("{count} {what} are more than the {limit} that {format} can hold")]
    TooLarge {
        /// Name of the format.
        format: &'static str,
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: u64,
        /// How many there may be.
        limit: u64,
    },
    /// The patches are not polynomial of degree 7 with quartic boundaries.
    #[error("patches of degree {degree} with boundary degree {boundary_degree} cannot be exported")]
    Degree {
        /// Degree found.
        degree: u32,
        /// Boundary degree found.
        boundary_degree: u32,
    },
    /// A row names something that does not exist, or nothing names a row.
    #[error("the patches do not fit together: {what} {row} is {defect}")]
    Incoherent {
        /// What the rows are.
        what: &'static str,
        /// The row.
        row: usize,
        /// What is wrong with it.
        defect: &'static str,
    },
}
