//! The search for `model.box = "auto"`, with an end to its work.

use crate::ModelError;
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{
    Field, Inside, InsideError, Interval, IntervalJet, Jet1, Jet2, auto_box, resolve_inside,
};
use std::sync::atomic::{AtomicU64, Ordering};

/// Operations of the formula that the search may carry out: seconds, ten times what the longest
/// search takes for a formula of the paper.
const BUDGET: u64 = 1_000_000_000;

/// Points that are evaluated together: fewer cost as much.
const BLOCK: usize = 32;

/// Operations that a bound of the value, and of the gradient, count for.
const BOUND: u64 = 4;
const GRADIENT: u64 = 16;

/// A box around the zeros of `field`, a formula of so many operations.
///
/// # Errors
/// [`ModelError::Box`]; [`ModelError::LongFormula`] if the search takes too long. Counted in
/// operations, not in seconds, so it ends alike on every machine.
pub(crate) fn find(field: &dyn Field, operations: usize, limit: f64) -> Result<Aabb, ModelError> {
    let metered = Metered { inner: field, operations: operations as u64, spent: AtomicU64::new(0) };
    let found = auto_box(&metered, limit);
    if metered.is_exhausted() {
        return Err(ModelError::LongFormula { operations });
    }
    Ok(found?)
}

/// How far a surface goes that leaves its box.
#[derive(Clone, Debug, PartialEq)]
pub enum Reach {
    /// It leaves a box of so many times the size as well.
    Beyond(f64),
    /// All of it lies in this box.
    Within(Aabb),
    /// That cannot be told.
    Unknown,
}

/// How many times larger the box is in which the rest of a surface is looked for.
const WIDER: f64 = 16.0;

/// How far the surface goes that leaves `domain`.
pub(crate) fn reach(field: &dyn Field, operations: usize, domain: &Aabb) -> Reach {
    let (center, half) = (domain.center(), 0.5 * WIDER * domain.size());
    let wider = Aabb::new(center - half, center + half);
    if let Err(InsideError::LeavesBox { .. }) = resolve_inside(field, &wider, Inside::Auto) {
        return Reach::Beyond(WIDER);
    }
    let limit = wider.min.abs().sup(&wider.max.abs()).max();
    find(field, operations, limit).map_or(Reach::Unknown, Reach::Within)
}

/// Counts the work; once that is too much it is 1 everywhere, which ends any search for zeros.
struct Metered<'a> {
    inner: &'a dyn Field,
    operations: u64,
    spent: AtomicU64,
}

impl Metered<'_> {
    fn is_exhausted(&self) -> bool {
        self.spent.load(Ordering::Relaxed) > BUDGET
    }

    /// Whether `n` more evaluations may be made.
    fn spend(&self, n: u64) -> bool {
        let cost = self.operations.saturating_mul(n);
        self.spent.fetch_add(cost.min(BUDGET), Ordering::Relaxed);
        !self.is_exhausted()
    }
}

impl Field for Metered<'_> {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        if self.spend(points.len().next_multiple_of(BLOCK) as u64) {
            self.inner.values(points, out);
        } else {
            out.fill(1.0);
        }
    }

    fn gradients(&self, points: &[Vec3], out: &mut [Jet1]) {
        self.inner.gradients(points, out);
    }

    fn hessians(&self, points: &[Vec3], out: &mut [Jet2]) {
        self.inner.hessians(points, out);
    }

    fn value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval> {
        if self.spend(BOUND) {
            return self.inner.value_enclosure(domain);
        }
        Some(Interval::point(1.0))
    }

    fn gradient_enclosure(&self, domain: [Interval; 3]) -> Option<IntervalJet> {
        if self.spend(GRADIENT) {
            return self.inner.gradient_enclosure(domain);
        }
        let (value, zero) = (Interval::point(1.0), Interval::point(0.0));
        Some(IntervalJet { value, gradient: [zero; 3] })
    }
}
