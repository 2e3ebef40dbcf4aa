//! Work split into blocks over threads that the caller lends.

use std::ops::Range;
use std::sync::OnceLock;

/// Runs `body(0) .. body(n - 1)`, each once, in any order and on any thread.
pub type ForEach<'a> = &'a (dyn Fn(usize, &(dyn Fn(usize) + Sync)) + 'a);

/// A [`ForEach`] that uses the calling thread alone.
pub fn on_this_thread(n: usize, body: &(dyn Fn(usize) + Sync)) {
    (0..n).for_each(body);
}

/// Items a block.
const BLOCK: usize = 64;

/// Results of `make` for the items `0 .. n` in blocks, in order, whatever thread made them.
pub(crate) fn map<T: Send + Sync>(
    for_each: ForEach<'_>,
    n: usize,
    make: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let blocks = each(for_each, n.div_ceil(BLOCK), |b| make(b * BLOCK..((b + 1) * BLOCK).min(n)));
    blocks.into_iter().flatten().collect()
}

/// Results of `make(0) .. make(n - 1)`, in order.
pub(crate) fn each<T: Send + Sync>(
    for_each: ForEach<'_>,
    n: usize,
    make: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let slots: Vec<OnceLock<T>> = (0..n).map(|_| OnceLock::new()).collect();
    for_each(n, &|i| {
        // Each index is asked for once; a second call would compute the same value.
        let _ = slots[i].set(make(i));
    });
    slots.into_iter().map(|s| s.into_inner().expect("invariant: each index ran")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_order_whatever_order_the_blocks_ran_in() {
        let backwards = |n: usize, body: &(dyn Fn(usize) + Sync)| (0..n).rev().for_each(body);
        for n in [0, 1, 63, 64, 65, 300] {
            let squares = map(&backwards, n, |r| r.map(|i| i * i).collect());
            assert_eq!(squares, (0..n).map(|i| i * i).collect::<Vec<_>>());
        }
    }
}
