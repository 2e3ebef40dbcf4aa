//! The suite that every stage passes: the same bytes however its work is cut, ordered or lent
//! threads, no look at a row that was not asked for, parameters that survive being written.
//!
//! One line in a stage's tests, `stage_contract!(Network, fixture)`, gives all of them; `fixture`
//! is a function that returns a [`Fixture`].

use crate::{Ctx, Host, InputSource, Inputs, Plan, Serial, Stage, Stopped, Task};
use isospline_artifact::{Artifact, SectionSource, SectionSpec};
use isospline_geometry::Aabb;
use isospline_implicit::Field;
use poison::Poisoned;
use std::fmt::Debug;
use std::ops::Range;

mod poison;

/// Tests that a stage keeps its contract; `$fixture` is called without arguments.
#[macro_export]
macro_rules! stage_contract {
    ($stage:ty, $fixture:expr) => {
        #[test]
        fn contract_every_task_size_gives_the_same_bytes() {
            $crate::contract::task_sizes::<$stage>(&$fixture());
        }

        #[test]
        fn contract_every_order_of_tasks_gives_the_same_bytes() {
            $crate::contract::task_orders::<$stage>(&$fixture());
        }

        #[test]
        fn contract_every_order_of_threads_gives_the_same_bytes() {
            $crate::contract::thread_orders::<$stage>(&$fixture());
        }

        #[test]
        fn contract_rows_that_were_not_asked_for_are_not_read() {
            $crate::contract::poisoned_rows::<$stage>(&$fixture());
        }

        #[test]
        fn contract_parameters_survive_being_written() {
            $crate::contract::params_round_trip::<$stage>(&$fixture());
        }
    };
}

/// A small case for a stage: a few hundred rows, so that many tasks of one row stay quick.
pub struct Fixture<S: Stage> {
    field: Box<dyn Field>,
    domain: Aabb,
    params: S::Params,
    inputs: Vec<Input>,
}

struct Input {
    kind: &'static str,
    specs: &'static [SectionSpec],
    rows: Box<dyn SectionSource>,
}

impl<S: Stage> Debug for Fixture<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Fixture").field("params", &self.params).finish_non_exhaustive()
    }
}

impl<S: Stage> Fixture<S> {
    /// A case with default parameters and no inputs yet.
    pub fn new(field: impl Field + 'static, domain: Aabb) -> Self {
        Self { field: Box::new(field), domain, params: S::Params::default(), inputs: Vec::new() }
    }

    /// Takes these parameters.
    #[must_use]
    pub fn with_params(mut self, params: S::Params) -> Self {
        self.params = params;
        self
    }

    /// Adds an artifact that the stage reads.
    #[must_use]
    pub fn with_input<A: Artifact>(mut self, artifact: A) -> Self {
        let rows = Box::new(artifact);
        self.inputs.push(Input { kind: A::KIND, specs: A::SECTIONS, rows });
        self
    }
}

/// Sections of a stage's output, in table order.
pub type OutputBytes = Vec<Vec<u8>>;

/// All bytes that the stage gives for the fixture, tasks in order.
///
/// # Panics
/// If the stage fails or breaks its promises.
pub fn output<S: Stage>(fixture: &Fixture<S>) -> OutputBytes {
    run(fixture, &Case::default())
}

/// Tasks of one row, of few, of the default and of all rows.
///
/// # Panics
/// If the bytes differ.
pub fn task_sizes<S: Stage>(fixture: &Fixture<S>) {
    let expected = output(fixture);
    for rows_per_task in [1, 7, 100, usize::MAX] {
        let case = Case { rows_per_task, ..Case::default() };
        assert_equal::<S>(&expected, &run(fixture, &case), &format!("{rows_per_task} rows a task"));
    }
}

/// Tasks backwards and shuffled.
///
/// # Panics
/// If the bytes differ.
pub fn task_orders<S: Stage>(fixture: &Fixture<S>) {
    let expected = output(fixture);
    for order in [Order::Backwards, Order::Shuffled] {
        let case = Case { rows_per_task: 3, order, ..Case::default() };
        assert_equal::<S>(&expected, &run(fixture, &case), &format!("tasks {order:?}"));
    }
}

/// `Host::for_each` backwards and shuffled: what threads would do at worst.
///
/// # Panics
/// If the bytes differ.
pub fn thread_orders<S: Stage>(fixture: &Fixture<S>) {
    let expected = output(fixture);
    for threads in [Order::Backwards, Order::Shuffled] {
        let case = Case { threads, ..Case::default() };
        assert_equal::<S>(&expected, &run(fixture, &case), &format!("threads {threads:?}"));
    }
}

/// Rows of streamed inputs that a task did not name are set to NaN and `u32::MAX`.
///
/// # Panics
/// If the bytes differ, or a task names rows that are not there.
pub fn poisoned_rows<S: Stage>(fixture: &Fixture<S>) {
    let expected = output(fixture);
    for rows_per_task in [7, usize::MAX] {
        let case = Case { rows_per_task, poison: true, ..Case::default() };
        assert_equal::<S>(&expected, &run(fixture, &case), "rows not asked for poisoned");
    }
}

/// Parameters through JSON; unknown keys are refused.
///
/// # Panics
/// If they change, or an unknown key passes, or the defaults are out of their own range.
pub fn params_round_trip<S: Stage>(fixture: &Fixture<S>) {
    use crate::Params;
    for params in [&fixture.params, &S::Params::default()] {
        assert_eq!(params.validate(), Ok(()), "{}: parameters out of range", S::NAME);
        let text = serde_json::to_string(params).expect("parameters can be written");
        let again: S::Params = serde_json::from_str(&text).expect("and read");
        assert_eq!(&again, params, "{}: parameters changed through {text}", S::NAME);
    }
    let empty = serde_json::from_str::<S::Params>("{}").expect("every key has a default");
    assert_eq!(empty, S::Params::default(), "{}: two sets of defaults", S::NAME);
    let unknown = serde_json::from_str::<S::Params>(r#"{"no such key": 1}"#);
    assert!(unknown.is_err(), "{}: an unknown key is not refused", S::NAME);
}

/// An order of indices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Order {
    #[default]
    Forwards,
    Backwards,
    Shuffled,
}

impl Order {
    fn of(self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        match self {
            Self::Forwards => {}
            Self::Backwards => order.reverse(),
            Self::Shuffled => order.sort_by_cached_key(|&i| scramble(i as u64)),
        }
        order
    }
}

/// A number without visible order (the finaliser of `SplitMix64`).
fn scramble(i: u64) -> u64 {
    let z = i.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// How the fixture is run.
#[derive(Clone, Copy, Debug)]
struct Case {
    rows_per_task: usize,
    order: Order,
    threads: Order,
    poison: bool,
}

impl Default for Case {
    fn default() -> Self {
        let (order, threads) = (Order::Forwards, Order::Forwards);
        Self { rows_per_task: 16, order, threads, poison: false }
    }
}

/// Calls the indices in an order.
#[derive(Debug)]
struct Ordered(Order);

impl Host for Ordered {
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        self.0.of(n).into_iter().for_each(body);
    }

    fn progress(&self, done: u64, of: u64) -> Result<(), Stopped> {
        Serial.progress(done, of)
    }
}

impl<S: Stage> InputSource for Fixture<S> {
    fn input(&self, kind: &str) -> Option<&dyn SectionSource> {
        self.inputs.iter().find(|i| i.kind == kind).map(|i| &*i.rows)
    }
}

fn run<S: Stage>(fixture: &Fixture<S>, case: &Case) -> OutputBytes {
    let host = Ordered(case.threads);
    let ctx = Ctx { field: &*fixture.field, domain: fixture.domain, host: &host };
    let whole = <S::Whole<'_> as Inputs<'_>>::open(fixture).expect("whole inputs are given");
    let stage = S::prepare(&ctx, &fixture.params, whole);
    let stage = stage.unwrap_or_else(|e| panic!("{}: {e}", S::NAME));
    let (lengths, tasks) = match stage.plan(whole, case.rows_per_task) {
        Plan::Whole => (None, vec![Task::default()]),
        Plan::Rows { lengths, tasks } => (Some(lengths), tasks),
    };
    let mut out = Output::of::<S>(lengths);
    for number in case.order.of(tasks.len()) {
        let task = &tasks[number];
        let poisoned = case.poison.then(|| poisoned_inputs(fixture, task));
        let source: &dyn InputSource = poisoned.as_ref().map_or(fixture, |p| p);
        let rows = <S::Rows<'_> as Inputs<'_>>::open(source).expect("streamed inputs are given");
        let piece = stage.process(&ctx, whole, rows, task);
        let piece = piece.unwrap_or_else(|e| panic!("{} task {number}: {e}", S::NAME));
        out.take::<S>(task, &piece.rows);
    }
    out.finish::<S>()
}

fn poisoned_inputs<S: Stage>(fixture: &Fixture<S>, task: &Task) -> Poisoned {
    let kinds = <S::Rows<'static> as Inputs<'static>>::KINDS;
    let mut out = Poisoned::default();
    for (idx, kind) in kinds.iter().enumerate() {
        let input = fixture.inputs.iter().find(|i| i.kind == *kind);
        let input = input.unwrap_or_else(|| panic!("{}: {kind} is not given", S::NAME));
        let needs: Vec<_> = task.needs.iter().filter(|n| n.input == idx).collect();
        out.add(kind, input.specs, &*input.rows, &needs);
    }
    out
}

/// Rows as they come, with a count of how often each was made.
struct Output {
    sections: OutputBytes,
    made: Vec<Vec<u8>>,
    known: bool,
}

impl Output {
    fn of<S: Stage>(lengths: Option<Vec<usize>>) -> Self {
        let specs = S::Output::SECTIONS;
        let known = lengths.is_some();
        let lengths = lengths.unwrap_or_else(|| vec![0; specs.len()]);
        assert_eq!(lengths.len(), specs.len(), "{}: a length for every section", S::NAME);
        let bytes = specs.iter().zip(&lengths).map(|(s, n)| vec![0; s.stride * n]).collect();
        Self { sections: bytes, made: lengths.iter().map(|&n| vec![0; n]).collect(), known }
    }

    fn take<S: Stage>(&mut self, task: &Task, piece: &S::Output) {
        let sections = piece.sections().into_iter().zip(S::Output::SECTIONS).enumerate();
        for (k, (section, spec)) in sections {
            let n = section.bytes.len() / spec.stride;
            if !self.known {
                self.sections[k] = section.bytes.to_vec();
                self.made[k] = vec![1; n];
                continue;
            }
            let rows: Range<usize> = task.writes.get(k).cloned().unwrap_or_default();
            let place = format!("{}: section {} rows {rows:?}", S::NAME, spec.name);
            assert_eq!(n, rows.len(), "{place}: the piece has other rows than promised");
            assert!(rows.end <= self.made[k].len(), "{place}: beyond the end");
            self.made[k][rows.clone()].iter_mut().for_each(|times| *times += 1);
            let bytes = rows.start * spec.stride..rows.end * spec.stride;
            self.sections[k][bytes].copy_from_slice(section.bytes);
        }
    }

    fn finish<S: Stage>(self) -> OutputBytes {
        for (spec, made) in S::Output::SECTIONS.iter().zip(&self.made) {
            let odd = made.iter().position(|&times| times != 1);
            assert_eq!(odd, None, "{}: row of {} not made once", S::NAME, spec.name);
        }
        self.sections
    }
}

fn assert_equal<S: Stage>(expected: &OutputBytes, found: &OutputBytes, case: &str) {
    for ((spec, a), b) in S::Output::SECTIONS.iter().zip(expected).zip(found) {
        assert_eq!(a.len(), b.len(), "{}: {case}: length of {}", S::NAME, spec.name);
        let odd = a.iter().zip(b).position(|(x, y)| x != y);
        let row = odd.map(|byte| byte / spec.stride);
        assert_eq!(row, None, "{}: {case}: section {} differs in a row", S::NAME, spec.name);
    }
}

#[cfg(test)]
mod tests;
