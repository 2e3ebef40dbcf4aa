//! A finished surface becomes a report of figures and a verdict: the outside checker.
//!
//! It sees what a user of the surface sees, the expanded nets and the face list, and nothing of
//! how they were made. It finds neighbours itself, evaluates patches with its own code and
//! derives the weights of the G1 conditions from the nets, so a defect of the solvers cannot
//! hide in code that both share. A figure that is not a number fails the check.

mod checker;
mod continuity;
mod curvature;
mod distance;
mod edges;
mod evaluate;
mod faces;
mod foot;
mod grid;
mod lanes;
mod lent_threads;
mod nesting;
mod octet;
mod params;
mod percentile;
mod quality;
mod report;
mod seam;
mod sector;
mod slope;
mod surface;
mod topology;
mod verdict;
mod volume;

#[cfg(test)]
mod box_spline;
#[cfg(test)]
mod seeded_defects;

pub use checker::{Checked, Job, check, check_faces};
pub use distance::UnfitFace;
pub use lent_threads::{ForEach, on_this_thread};
pub use params::{CheckParams, DEFAULT_ERROR, Expected};
pub use report::{CheckReport, Component, EdgeDefects, Place};
pub use surface::{Net, Surface, SurfaceError};
