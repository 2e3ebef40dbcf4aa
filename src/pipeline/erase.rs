//! Stages without their types: what the driver needs of any of them.

use crate::{ParamsError, StageFailure, StageInfo};
use isospline_artifact::{Artifact, RowsError, Section, SectionSource};
use isospline_stage::{Counters, Ctx, InputSource, Inputs, Params as _, Piece, Plan, Stage, Task};
use serde_json::Value;
use std::marker::PhantomData;
use std::sync::Arc;

/// A stage that can be looked at and prepared.
pub(crate) trait ErasedStage: Send + Sync {
    fn info(&self) -> &StageInfo;

    /// All parameters, with defaults where `params` has nothing.
    fn canonical_params(&self, params: &Value) -> Result<Value, ParamsError>;

    /// Builds what all tasks share, from canonical parameters.
    fn prepare(
        &self,
        ctx: &Ctx<'_>,
        params: &Value,
        inputs: &Bundle,
    ) -> Result<Box<dyn Prepared>, Failure>;
}

/// A stage ready for its tasks.
pub(crate) trait Prepared: Send + Sync {
    fn plan(&self, inputs: &Bundle, rows_per_task: usize) -> Result<Plan, Failure>;

    fn process(&self, ctx: &Ctx<'_>, inputs: &Bundle, task: &Task) -> Result<ErasedPiece, Failure>;
}

/// Why a stage gave up.
#[derive(Debug)]
pub(crate) enum Failure {
    Stage(StageFailure),
    Rows(RowsError),
    Params(ParamsError),
}

/// The rows that a task made, and its figures.
pub(crate) struct ErasedPiece {
    pub(crate) rows: Box<dyn AllSections>,
    pub(crate) counters: Counters,
}

/// The sections of any artifact.
pub(crate) trait AllSections: Send {
    fn all(&self) -> Vec<Section<'_>>;
}

impl<A: Artifact> AllSections for A {
    fn all(&self) -> Vec<Section<'_>> {
        self.sections()
    }
}

/// The artifacts that a stage reads, by kind.
#[derive(Clone, Default)]
pub(crate) struct Bundle(pub(crate) Vec<(&'static str, Arc<dyn SectionSource>)>);

impl InputSource for Bundle {
    fn input(&self, kind: &str) -> Option<&dyn SectionSource> {
        self.0.iter().find(|(k, _)| *k == kind).map(|(_, rows)| &**rows)
    }
}

/// The erased form of `S`.
pub(crate) struct Erased<S> {
    info: StageInfo,
    stage: PhantomData<fn() -> S>,
}

impl<S: Stage + 'static> Erased<S> {
    pub(crate) fn new() -> Self {
        let info = StageInfo {
            name: S::NAME,
            version: S::VERSION,
            kind: S::Output::KIND,
            schema: S::Output::SCHEMA,
            sections: S::Output::SECTIONS,
            whole: <S::Whole<'static> as Inputs<'static>>::KINDS,
            rows: <S::Rows<'static> as Inputs<'static>>::KINDS,
        };
        Self { info, stage: PhantomData }
    }
}

impl<S: Stage + 'static> ErasedStage for Erased<S> {
    fn info(&self) -> &StageInfo {
        &self.info
    }

    fn canonical_params(&self, params: &Value) -> Result<Value, ParamsError> {
        let params: S::Params = match params {
            Value::Null => S::Params::default(),
            table => parse(table)?,
        };
        params.validate().map_err(|(key, message)| ParamsError::Range { key, message })?;
        let canonical = serde_json::to_value(&params).map_err(|_| ParamsError::RoundTrip)?;
        // JSON has no nan or inf: they would be written as null and read as something else.
        match serde_json::from_value::<S::Params>(canonical.clone()) {
            Ok(again) if again == params => Ok(canonical),
            _ => Err(ParamsError::RoundTrip),
        }
    }

    fn prepare(
        &self,
        ctx: &Ctx<'_>,
        params: &Value,
        inputs: &Bundle,
    ) -> Result<Box<dyn Prepared>, Failure> {
        let params = parse(params).map_err(Failure::Params)?;
        let whole = S::Whole::open(inputs).map_err(Failure::Rows)?;
        let stage = S::prepare(ctx, &params, whole).map_err(failure)?;
        Ok(Box::new(Ready { stage }))
    }
}

struct Ready<S> {
    stage: S,
}

impl<S: Stage> Prepared for Ready<S> {
    fn plan(&self, inputs: &Bundle, rows_per_task: usize) -> Result<Plan, Failure> {
        let whole = S::Whole::open(inputs).map_err(Failure::Rows)?;
        Ok(self.stage.plan(whole, rows_per_task))
    }

    fn process(&self, ctx: &Ctx<'_>, inputs: &Bundle, task: &Task) -> Result<ErasedPiece, Failure> {
        let whole = S::Whole::open(inputs).map_err(Failure::Rows)?;
        let rows = S::Rows::open(inputs).map_err(Failure::Rows)?;
        let Piece { rows, counters } =
            self.stage.process(ctx, whole, rows, task).map_err(failure)?;
        Ok(ErasedPiece { rows: Box::new(rows), counters })
    }
}

fn parse<P: serde::de::DeserializeOwned>(table: &Value) -> Result<P, ParamsError> {
    P::deserialize(table).map_err(|e| ParamsError::Shape { message: e.to_string() })
}

fn failure(error: impl isospline_stage::Diagnosis) -> Failure {
    Failure::Stage(StageFailure(Box::new(error)))
}
