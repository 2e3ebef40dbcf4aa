//! The suite passes an honest stage and fails each kind of dishonest one.

use super::*;
use crate::plan::{Need, cut};
use crate::{Diagnosis, Params, Piece, map};
use isospline_artifact::artifact;
use isospline_geometry::Vec3;
use isospline_implicit::{Interval, IntervalJet, Jet1, Jet2};
use std::panic::{AssertUnwindSafe, catch_unwind};

artifact! {
    /// Numbers.
    pub struct Numbers / NumbersView = "numbers", schema 1 {
        /// A value a row.
        value: f64, Vertices;
    }
}

artifact! {
    /// Sums of neighbours.
    pub struct Sums / SumsView = "sums", schema 1 {
        /// A sum a row.
        sum: f64, Vertices;
    }
}

/// What is wrong with the toy stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
enum Fault {
    #[default]
    None,
    DependsOnTaskSize,
    DependsOnThreads,
    ReadsTooMuch,
    LeavesAGap,
    MakesTooFew,
}

#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ToyParams {
    fault: Fault,
}

impl Params for ToyParams {}

#[derive(Debug, thiserror::Error)]
#[error("stopped")]
struct ToyError(#[from] Stopped);

impl Diagnosis for ToyError {
    fn code(&self) -> &'static str {
        "toy"
    }
}

/// Adds each value and its successor.
#[derive(Debug)]
struct Toy {
    fault: Fault,
    n: usize,
}

impl Toy {
    fn has(&self, fault: Fault) -> bool {
        self.fault == fault
    }
}

impl Stage for Toy {
    const NAME: &'static str = "toy";
    const VERSION: u32 = 1;
    type Params = ToyParams;
    type Whole<'a> = ();
    type Rows<'a> = (NumbersView<'a>,);
    type Output = Sums;
    type Error = ToyError;

    fn prepare(_: &Ctx<'_>, params: &ToyParams, (): ()) -> Result<Self, ToyError> {
        Ok(Self { fault: params.fault, n: 50 })
    }

    fn plan(&self, (): (), rows_per_task: usize) -> Plan {
        let n = self.n - usize::from(self.has(Fault::LeavesAGap));
        let task = |rows: Range<usize>| {
            let last = if self.has(Fault::ReadsTooMuch) { rows.end } else { rows.end + 1 };
            let rows_read = rows.start..last.min(self.n);
            let need = Need { input: 0, section: "value", rows: [rows_read].into() };
            Task { writes: [rows].into(), needs: vec![need] }
        };
        Plan::Rows { lengths: vec![self.n], tasks: cut(n, rows_per_task).map(task).collect() }
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (): (),
        (numbers,): (NumbersView<'_>,),
        task: &Task,
    ) -> Result<Piece<Sums>, ToyError> {
        let rows = task.writes[0].clone();
        let next = |i: usize| numbers.value.get(i + 1).copied().unwrap_or(0.0);
        let last = std::sync::Mutex::new(0.0);
        let mut sum = map(ctx.host, rows.len(), |k| {
            *last.lock().unwrap() = k as f64;
            numbers.value[rows.start + k] + next(rows.start + k)
        });
        if self.has(Fault::DependsOnTaskSize) {
            sum[0] += rows.len() as f64;
        }
        if self.has(Fault::DependsOnThreads) {
            sum[0] += *last.lock().unwrap();
        }
        if self.has(Fault::MakesTooFew) {
            sum.pop();
        }
        Ok(Piece { rows: Sums { sum }, ..Piece::default() })
    }
}

#[derive(Debug)]
struct NoField;

impl Field for NoField {
    fn values(&self, _: &[Vec3], _: &mut [f64]) {}
    fn gradients(&self, _: &[Vec3], _: &mut [Jet1]) {}
    fn hessians(&self, _: &[Vec3], _: &mut [Jet2]) {}
    fn value_enclosure(&self, _: [Interval; 3]) -> Option<Interval> {
        None
    }
    fn gradient_enclosure(&self, _: [Interval; 3]) -> Option<IntervalJet> {
        None
    }
}

fn toy(fault: Fault) -> Fixture<Toy> {
    let value = (0..50).map(|i| f64::from(i * i)).collect();
    let domain = Aabb::new(Vec3::zeros(), Vec3::zeros());
    let fixture = Fixture::new(NoField, domain).with_params(ToyParams { fault });
    fixture.with_input(Numbers { value })
}

crate::stage_contract!(Toy, || toy(Fault::None));

#[test]
fn every_broken_promise_is_found() {
    let fails = |check: fn(&Fixture<Toy>), fault| {
        let caught = catch_unwind(AssertUnwindSafe(|| check(&toy(fault))));
        assert!(caught.is_err(), "{fault:?} was not found");
    };
    fails(task_sizes, Fault::DependsOnTaskSize);
    fails(thread_orders, Fault::DependsOnThreads);
    fails(poisoned_rows, Fault::ReadsTooMuch);
    fails(task_sizes, Fault::LeavesAGap);
    fails(task_sizes, Fault::MakesTooFew);
}
