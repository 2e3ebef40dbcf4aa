//! Which nodes are fresh, which are to be made, and of which only the contents of their inputs can
//! tell.

use super::Dataflow;
use super::stand::{Stand, Trust};
use crate::driver::fresh_report;
use crate::freshness::{Source, assess};
use crate::workers::Job;
use crate::{Event, Reason, RunError, State};
use isospline_artifact::{Container, StoreError};
use std::sync::Arc;

impl Dataflow<'_, '_> {
    /// Finds a node fresh or due, unless only the contents of its inputs can tell.
    ///
    /// `known` inputs had known contents when it was last looked at.
    pub(super) fn decide(&mut self, idx: usize, known: Option<usize>) -> Result<(), RunError> {
        let frame = self.frame;
        let node = &frame.nodes[idx];
        let now = node.inputs.iter().filter(|i| i.content(&self.contents).is_some()).count();
        if known == Some(now) {
            return Ok(());
        }
        let (state, container) = assess(&frame.pipeline, node, &self.contents)?;
        let may_run = self.wanted.may_run(idx);
        let forced = self.wanted.forced[idx] && may_run;
        self.stands[idx] = match (state, container) {
            (State::Fresh, Some(container)) if !forced => return self.keep(idx, container),
            _ if !may_run => Stand::Skipped,
            (State::Fresh, _) => Stand::Due(vec![Reason::Asked]),
            (State::Missing, _) => Stand::Due(vec![Reason::Missing]),
            (State::Damaged(reason), _) => {
                self.tell_damage(idx, reason);
                Stand::Due(vec![Reason::Damaged])
            }
            (State::Stale(_), _) if forced => Stand::Due(vec![Reason::Asked]),
            (State::Stale(reasons), _) if self.may_become_fresh(idx, &reasons) => {
                Stand::Open { known: Some(now) }
            }
            (State::Stale(reasons), _) => Stand::Due(reasons),
        };
        Ok(())
    }

    /// Whether all that is against a node is that inputs are not made yet, which will be.
    fn may_become_fresh(&self, idx: usize, reasons: &[Reason]) -> bool {
        let comes = |source| match source {
            Source::Node(node) => !matches!(self.stands[node], Stand::Skipped),
            Source::Given(..) => true,
        };
        reasons.iter().all(|reason| matches!(reason, Reason::Pending { .. }))
            && self.frame.nodes[idx].inputs.iter().all(|input| comes(input.source))
    }

    /// Takes a fresh artifact as it is.
    fn keep(&mut self, idx: usize, container: Container) -> Result<(), RunError> {
        let container = Arc::new(container);
        let report = fresh_report(self.frame, idx, &container)?;
        self.contents[idx] = Some(report.content);
        self.reports[idx] = Some(report);
        (self.frame.events)(&Event::Fresh { node: idx, stage: self.frame.label(idx) });
        self.stands[idx] = Stand::Fresh { container, trust: Trust::Unread };
        Ok(())
    }

    fn tell_damage(&self, idx: usize, reason: String) {
        let stage = self.frame.label(idx);
        (self.frame.events)(&Event::Damaged { node: idx, stage, reason });
    }

    /// Has the rows of a fresh artifact read, if they are not already.
    pub(super) fn verify(&mut self, idx: usize) {
        if let Stand::Fresh { container, trust: trust @ Trust::Unread } = &mut self.stands[idx] {
            *trust = Trust::Reading;
            let container = Arc::clone(container);
            self.urgent.push_back(Job::Verify { node: idx, container });
        }
    }

    pub(super) fn verified(&mut self, idx: usize, result: Result<(), StoreError>) {
        self.under_way -= 1;
        self.stirred = true;
        match (result, &mut self.stands[idx]) {
            (Ok(()), Stand::Fresh { trust, .. }) => *trust = Trust::Whole,
            (Err(StoreError::Damaged { damage, .. }), stand) if self.wanted.only.is_none() => {
                *stand = Stand::Due(vec![Reason::Damaged]);
                self.tell_damage(idx, damage.to_string());
            }
            (Err(error), _) => self.fail((idx, 0), error.into()),
            (Ok(()), _) => {}
        }
    }
}
