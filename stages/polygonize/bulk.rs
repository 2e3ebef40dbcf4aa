//! Field values of many points, in blocks that fit the evaluator.

use isospline_geometry::Vec3;
use isospline_implicit::Field;
use isospline_stage::{Host, map};

/// Points a call of the field: registers times block stay in the first-level cache.
const BLOCK: usize = 128;
/// Points a task, enough to outweigh handing it to a thread.
const SHARE: usize = 16 * BLOCK;

/// Values at `points`.
pub(crate) fn values(field: &dyn Field, points: &[Vec3]) -> Vec<f64> {
    let mut out = vec![0.0; points.len()];
    for (points, out) in points.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
        field.values(points, out);
    }
    out
}

/// `make` of the shares of `items`, on the host's threads, in order.
pub(crate) fn shares<I: Sync, T: Clone + Send + Sync>(
    host: &dyn Host,
    items: &[I],
    make: impl Fn(&[I]) -> Vec<T> + Sync,
) -> Vec<T> {
    let chunks: Vec<&[I]> = items.chunks(SHARE).collect();
    map(host, chunks.len(), |i| make(chunks[i])).concat()
}
