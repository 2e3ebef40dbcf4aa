//! Work split into blocks over threads that the caller lends.

use std::ops::Range;
use std::sync::OnceLock;

/// Runs `body(0) .. body(n - 1)`, each once, in any order and on any thread.
pub type ForEach<'a> = &'a (dyn Fn(usize, &(dyn Fn(usize) + Sync)) + 'a);

/// A [`ForEach`] that uses the calling thread alone.
pub fn on_this_thread(n: usize, body: &(dyn Fn(usize) + Sync)) {
    (0..n).for_each(body);
}

/// Items a block: large enough to hide the hand-over, small enough to share out 1000 faces.
const BLOCK: usize = 64;

/// Results of `make` for items `0 .. n`, in order, whatever thread made them.
pub(crate) fn map<T: Send + Sync>(
    for_each: ForEach<'_>,
    n: usize,
    make: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let slots: Vec<OnceLock<Vec<T>>> = (0..n.div_ceil(BLOCK)).map(|_| OnceLock::new()).collect();
    for_each(slots.len(), &|b| {
        // Each block is asked for once; a second call would compute the same values.
        let _ = slots[b].set(make(b * BLOCK..((b + 1) * BLOCK).min(n)));
    });
    slots.into_iter().flat_map(|s| s.into_inner().expect("invariant: each block ran")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_order_whatever_order_the_blocks_ran_in() {
        let backwards = |n: usize, body: &(dyn Fn(usize) + Sync)| (0..n).rev().for_each(body);
        for n in [0, 1, 63, 64, 65, 1000] {
            let squares = map(&backwards, n, |r| r.map(|i| i * i).collect());
            assert_eq!(squares, (0..n).map(|i| i * i).collect::<Vec<_>>());
        }
    }
}
