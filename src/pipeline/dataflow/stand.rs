//! Where a node stands in a run.

use crate::Reason;
use crate::provenance::Cost;
use crate::readiness::RowOwners;
use crate::workers::Active;
use isospline_artifact::{Container, Hashed, SectionSource, Unfinished};
use isospline_stage::Counters;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

/// From not looked at to stored.
pub(super) enum Stand<'f> {
    /// Not looked at yet, or only the contents of its inputs can tell; so many were known then.
    Open { known: Option<usize> },
    /// Not fresh, and not asked for.
    Skipped,
    /// Its artifact is what is asked for.
    Fresh { container: Arc<Container>, trust: Trust },
    /// It is to be made.
    Due(Vec<Reason>),
    /// A worker prepares it, since then; a stage with one task is done by that worker.
    Preparing(Instant),
    /// Its tasks are done as the rows they read come in.
    Running(Box<Running<'f>>),
    /// All rows are there, and are being hashed.
    Written(Box<Figures>),
    /// All rows are hashed; the contents of its inputs are waited for.
    Hashed(Box<Figures>, Box<Hashed>),
    /// On its way to its name.
    Done(Arc<Container>),
}

/// What is known of the rows of a fresh artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    Unread,
    Reading,
    Whole,
}

/// What a run has of an artifact that it makes.
pub(super) struct Figures {
    pub(super) start: Instant,
    pub(super) rows: Unfinished,
    pub(super) counters: Counters,
    pub(super) cost: Cost,
}

/// A stage at work.
pub(super) struct Running<'f> {
    pub(super) figures: Figures,
    pub(super) active: Arc<Active<'f>>,
    pub(super) owners: Arc<RowOwners>,
    pub(super) n_committed: usize,
    /// Tasks that can begin.
    pub(super) ready: BTreeSet<u32>,
    committed: Vec<bool>,
    /// For each task, how many tasks of other stages it waits for.
    waiting: Vec<u32>,
    /// For each task, the tasks `(node, task)` that wait for it.
    followers: Vec<Vec<(u32, u32)>>,
}

impl<'f> Stand<'f> {
    /// Whether nothing more will be done to the node.
    pub(super) fn is_settled(&self) -> bool {
        matches!(self, Self::Fresh { .. } | Self::Skipped | Self::Done(_))
    }

    /// The rows, if all of them are there and known to be whole.
    pub(super) fn rows(&self) -> Option<Arc<dyn SectionSource>> {
        match self {
            Self::Fresh { container, trust: Trust::Whole } | Self::Done(container) => {
                Some(Arc::clone(container) as Arc<dyn SectionSource>)
            }
            Self::Written(figures) | Self::Hashed(figures, _) => {
                Some(Arc::new(figures.rows.clone()))
            }
            _ => None,
        }
    }

    /// The stage, if it has tasks that can begin.
    pub(super) fn with_ready_tasks(&mut self) -> Option<&mut Running<'f>> {
        match self {
            Self::Running(running) if !running.ready.is_empty() => Some(running),
            _ => None,
        }
    }

    /// Tasks whose rows a later run will find, and all tasks.
    pub(super) fn kept(&self) -> Option<(usize, usize)> {
        match self {
            Self::Running(running) => Some((running.n_committed, running.active.tasks.len())),
            Self::Written(figures) | Self::Hashed(figures, _) => {
                let n = figures.cost.tasks;
                (n > 1).then_some((n, n))
            }
            _ => None,
        }
    }
}

impl Figures {
    pub(super) fn new(start: Instant, rows: Unfinished) -> Self {
        Self { start, rows, counters: Counters::default(), cost: Cost::default() }
    }
}

impl<'f> Running<'f> {
    /// A stage of which the tasks `taken` are done already; none is ready before
    /// [`Running::release`].
    pub(super) fn new(
        figures: Figures,
        active: Arc<Active<'f>>,
        owners: Arc<RowOwners>,
        taken: &[usize],
    ) -> Self {
        let n = active.tasks.len();
        let mut committed = vec![false; n];
        for &task in taken {
            committed[task] = true;
        }
        Self {
            figures,
            active,
            owners,
            n_committed: taken.len(),
            ready: BTreeSet::new(),
            committed,
            waiting: vec![0; n],
            followers: vec![Vec::new(); n],
        }
    }

    /// Lets each task of this stage, node `idx`, wait for tasks of `source`.
    pub(super) fn wait_for(&mut self, idx: usize, source: &mut Running<'_>, awaited: &[Vec<u32>]) {
        for (task, owners) in awaited.iter().enumerate() {
            if self.committed[task] {
                continue;
            }
            for &owner in owners.iter().filter(|&&owner| !source.committed[owner as usize]) {
                self.waiting[task] += 1;
                source.followers[owner as usize].push((idx as u32, task as u32));
            }
        }
    }

    /// Makes ready what waits for nothing.
    pub(super) fn release(&mut self) {
        let idle = |&task: &u32| self.waiting[task as usize] == 0 && !self.committed[task as usize];
        self.ready = (0..self.waiting.len() as u32).filter(idle).collect();
    }

    /// Notes that the rows of a task are there; gives the tasks that wait for them.
    pub(super) fn commit(&mut self, task: usize) -> Vec<(u32, u32)> {
        self.committed[task] = true;
        self.n_committed += 1;
        std::mem::take(&mut self.followers[task])
    }

    /// One of the tasks that `task` waits for is done.
    pub(super) fn one_less(&mut self, task: u32) {
        let waiting = &mut self.waiting[task as usize];
        *waiting -= 1;
        if *waiting == 0 {
            self.ready.insert(task);
        }
    }
}
