//! What a stage is.

use crate::{Counters, Host, Inputs, Plan, Stopped, Task};
use isospline_artifact::Artifact;
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::Field;
use std::fmt;

/// What surrounds a stage: the field, its domain, and the host that lends threads.
#[derive(Clone, Copy)]
pub struct Ctx<'a> {
    /// The field, level at zero, `f < 0` inside.
    pub field: &'a dyn Field,
    /// The box that holds the surface.
    pub domain: Aabb,
    /// Threads, progress and the stop signal.
    pub host: &'a dyn Host,
}

impl fmt::Debug for Ctx<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ctx").field("domain", &self.domain).finish_non_exhaustive()
    }
}

/// Parameters of a stage: everything that may change its output and nothing else.
///
/// Unknown keys are refused; defaults are those of `configs/reference.toml`.
pub trait Params:
    serde::Serialize
    + serde::de::DeserializeOwned
    + Default
    + Clone
    + PartialEq
    + fmt::Debug
    + Send
    + Sync
{
    /// Names the first value out of its range: `(key, what is wrong)`.
    ///
    /// # Errors
    /// The key and a sentence with the range.
    fn validate(&self) -> Result<(), (&'static str, String)> {
        Ok(())
    }
}

/// What a user can be told of an error beyond its sentence.
pub trait Diagnosis: std::error::Error + Send + Sync + 'static {
    /// A stable code, kebab-case.
    fn code(&self) -> &'static str;
    /// Where it is seen.
    fn place(&self) -> Option<Vec3> {
        None
    }
    /// What the user can do.
    fn help(&self) -> Option<String> {
        None
    }
}

/// The rows that one task made: an artifact that holds just those, and counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece<A> {
    /// The rows of the task, section by section; row 0 is the first row that the task names.
    pub rows: A,
    /// Figures and repairs; sums and maxima, so the order of tasks does not matter.
    pub counters: Counters,
}

/// One step of the pipeline.
///
/// A pure function of (inputs, params, field): it opens no file, starts no thread and reads no
/// clock, environment or random source. Equal inputs give equal bytes whatever the threads and
/// the order of tasks.
pub trait Stage: Sized + Send + Sync {
    /// Name, as commands and config tables write it.
    const NAME: &'static str;
    /// Raised when equal inputs may give other bytes.
    const VERSION: u32;
    /// Parameters.
    type Params: Params;
    /// Inputs that are complete before [`Stage::prepare`].
    type Whole<'a>: Inputs<'a>;
    /// Inputs of which a task may read only the rows that it named.
    type Rows<'a>: Inputs<'a>;
    /// What comes out.
    type Output: Artifact;
    /// Why it may fail.
    type Error: Diagnosis + From<Stopped>;

    /// Builds what all tasks share.
    ///
    /// # Errors
    /// Inputs that the stage cannot work on.
    fn prepare(
        ctx: &Ctx<'_>,
        params: &Self::Params,
        whole: Self::Whole<'_>,
    ) -> Result<Self, Self::Error>;

    /// Row counts and tasks; `rows_per_task` is a hint that must not change the output.
    fn plan(&self, whole: Self::Whole<'_>, rows_per_task: usize) -> Plan;

    /// Computes the rows of one task.
    ///
    /// # Errors
    /// What the stage cannot repair, and [`Stopped`].
    fn process(
        &self,
        ctx: &Ctx<'_>,
        whole: Self::Whole<'_>,
        rows: Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<Self::Output>, Self::Error>;
}
