//! Makes a stage ready for its tasks: prepare, plan, the file of its rows, what is left of an
//! earlier run; a stage with one task of unknown size is done here at once.

use crate::driver::Frame;
use crate::erase::{Bundle, Prepared};
use crate::host::StageHost;
use crate::keeper::Keeper;
use crate::readiness::RowOwners;
use crate::resume::{Opened, open};
use crate::row_writer::{Made, RowWriter};
use crate::trace::Lane;
use crate::workers::{Active, Notice, QUEUED_PER_THREAD, caught};
use crate::{RunError, clock, tiling};
use crossbeam::channel::{Receiver, Sender, bounded};
use isospline_artifact::{Hashed, StoreError, Unfinished, Writer};
use isospline_stage::{Counters, Ctx, Plan, Task};
use std::sync::Arc;
use std::time::Duration;

/// A node about to run.
pub(crate) struct Assignment {
    pub(crate) node: usize,
    pub(crate) inputs: Bundle,
    /// By place in `Stage::Rows`: the source, if it is being made, and who writes its rows.
    pub(crate) sources: Vec<Option<(usize, Arc<RowOwners>)>>,
}

/// A stage whose tasks can begin.
pub(crate) struct Planned<'f> {
    pub(crate) active: Arc<Active<'f>>,
    pub(crate) writer: RowWriter,
    pub(crate) pieces: Receiver<Made>,
    pub(crate) rows: Unfinished,
    pub(crate) owners: Arc<RowOwners>,
    /// Tasks whose rows an earlier run left, with what they counted.
    pub(crate) taken: Vec<(usize, Counters)>,
    /// By source: the tasks of it that each task waits for.
    pub(crate) awaited: Vec<(usize, Vec<Vec<u32>>)>,
    pub(crate) time: Duration,
}

impl Assignment {
    /// Does it and tells what came of it.
    pub(crate) fn carry_out<'f>(
        self,
        frame: &'f Frame<'f>,
        lane: Lane<'_>,
        notices: &Sender<Notice<'f>>,
    ) {
        let (node, start) = (self.node, clock::now());
        let notice = match self.planned(frame) {
            Ok(Ready::Tasks(mut planned)) => {
                lane.note(&frame.nodes[node].label, "prepare", start, None);
                planned.time = start.elapsed();
                Notice::Planned(planned)
            }
            Ok(Ready::Whole(prepared, inputs)) => {
                lane.note(&frame.nodes[node].label, "prepare", start, None);
                let prepare = start.elapsed();
                match whole(frame, node, (&*prepared, &inputs), prepare, lane, notices) {
                    Ok((hashed, time)) => Notice::hashed(node, hashed, time),
                    Err(error) => Notice::Failed { node, task: 0, error: Some(error) },
                }
            }
            Err(error) => Notice::Failed { node, task: 0, error: Some(error) },
        };
        // A failed send means that the run is over.
        drop(notices.send(notice));
    }

    fn planned<'f>(self, frame: &'f Frame<'f>) -> Result<Ready<'f>, RunError> {
        let (idx, inputs) = (self.node, &self.inputs);
        let node = &frame.nodes[idx];
        let failed = |failure| frame.failed(idx, 0, failure);
        let host = host(frame, idx);
        let ctx = Ctx { field: frame.scene.field, domain: frame.scene.domain, host: &host };
        let stage = frame.pipeline.registry.erased(node.info.name);
        let stage = stage.expect("invariant: graph is checked");
        let prepared = caught(|| stage.prepare(&ctx, &node.params, inputs)).map_err(failed)?;
        let plan = || prepared.plan(inputs, frame.options.rows_per_task);
        let (lengths, tasks) = match caught(plan).map_err(failed)? {
            Plan::Whole => return Ok(Ready::Whole(prepared, self.inputs)),
            Plan::Rows { lengths, tasks } => (lengths, tasks),
        };
        if let Some(fault) = tiling::fault(node.info.sections, &lengths, &tasks) {
            let tiling::Fault { section, row, times } = fault;
            return Err(RunError::Tiling { stage: frame.label(idx), section, row, times });
        }
        let opened = open(frame, idx, &lengths, &tasks)?;
        Ok(Ready::Tasks(Box::new(self.ready(frame, prepared, tasks, opened))))
    }

    fn ready<'f>(
        self,
        frame: &'f Frame<'f>,
        prepared: Box<dyn Prepared>,
        tasks: Vec<Task>,
        opened: Opened,
    ) -> Planned<'f> {
        let node = self.node;
        let specs = frame.nodes[node].info.sections;
        let sources = self.sources.iter().enumerate();
        let awaited = sources.filter_map(|(input, source)| {
            source.as_ref().map(|(node, owners)| (*node, owners.awaited(&tasks, input)))
        });
        let awaited = awaited.collect();
        let owners = Arc::new(RowOwners::of(specs, &tasks));
        let tasks: Arc<[Task]> = tasks.into();
        let (sender, pieces) = bounded(QUEUED_PER_THREAD * frame.threads());
        let Opened { writer, journal, taken } = opened;
        let rows = writer.rows().clone();
        let remaining = tasks.len() - taken.len();
        let (label, host) = (frame.label(node), host(frame, node));
        let writer =
            RowWriter { node, label, specs, tasks: Arc::clone(&tasks), writer, journal, remaining };
        let (inputs, time) = (self.inputs, Duration::ZERO);
        let active = Arc::new(Active { node, prepared, inputs, tasks, host, pieces: sender });
        Planned { active, writer, pieces, rows, owners, taken, awaited, time }
    }
}

enum Ready<'f> {
    Whole(Box<dyn Prepared>, Bundle),
    Tasks(Box<Planned<'f>>),
}

/// One task makes all rows; how many is known when it has. Tells when they are written, and gives
/// their hash and what that took.
fn whole<'f>(
    frame: &'f Frame<'f>,
    idx: usize,
    (prepared, inputs): (&dyn Prepared, &Bundle),
    prepare: Duration,
    lane: Lane<'_>,
    notices: &Sender<Notice<'f>>,
) -> Result<(Result<Hashed, StoreError>, Duration), RunError> {
    let start = clock::now();
    let node = &frame.nodes[idx];
    let keeper = Keeper::of(frame, idx);
    let host = StageHost { keeper: keeper.as_ref(), ..host(frame, idx) };
    let ctx = Ctx { field: frame.scene.field, domain: frame.scene.domain, host: &host };
    let process = || prepared.process(&ctx, inputs, &Task::default());
    let piece = frame.pool.within(|| caught(process)).map_err(|f| frame.failed(idx, 0, f))?;
    let time = start.elapsed();
    let sections = piece.rows.all();
    let lengths: Vec<usize> = sections.iter().map(|s| s.bytes.len() / s.stride).collect();
    lane.note(host.label, "task", start, Some((0, lengths.iter().sum())));
    let writing = clock::now();
    let (store, specs) = (frame.pipeline.store, node.info.sections);
    let mut writer = Writer::begin(store, &node.artifact, &node.identity(), specs, &lengths)?;
    for (k, section) in sections.iter().enumerate() {
        writer.write_rows(k, 0, section.bytes)?;
    }
    drop(sections);
    lane.note(host.label, "write", writing, None);
    let (rows, counters) = (writer.rows().clone(), piece.counters);
    drop(piece.rows);
    // What reads these rows may begin while they are hashed.
    drop(notices.send(Notice::Written { node: idx, rows, counters, prepare, time }));
    let hashing = clock::now();
    let hashed = writer.hash();
    lane.note(host.label, "hash", hashing, None);
    Ok((hashed, hashing.elapsed()))
}

fn host<'f>(frame: &'f Frame<'f>, node: usize) -> StageHost<'f> {
    StageHost {
        node,
        label: &frame.nodes[node].label,
        pool: &frame.pool,
        stop: frame.options.stop,
        events: frame.events,
        keeper: None,
    }
}
