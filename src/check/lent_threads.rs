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

/// Results of `make` for the blocks of items `0 .. n`, in order, whatever thread made them.
pub(crate) fn blocks<T: Send + Sync>(
    for_each: ForEach<'_>,
    n: usize,
    make: impl Fn(Range<usize>) -> T + Sync,
) -> Vec<T> {
    blocks_beside(for_each, || (), n, make).1
}

/// The same and the result of `alone`, which one thread makes while others work on the blocks: it
/// begins first, since it may take long.
pub(crate) fn blocks_beside<S: Send + Sync, T: Send + Sync>(
    for_each: ForEach<'_>,
    alone: impl Fn() -> S + Sync,
    n: usize,
    make: impl Fn(Range<usize>) -> T + Sync,
) -> (S, Vec<T>) {
    let single = OnceLock::new();
    let slots: Vec<OnceLock<T>> = (0..n.div_ceil(BLOCK)).map(|_| OnceLock::new()).collect();
    for_each(slots.len() + 1, &|part| {
        // Each part is asked for once; a second call would compute the same values.
        match part.checked_sub(1) {
            None => drop(single.set(alone())),
            Some(b) => drop(slots[b].set(make(b * BLOCK..((b + 1) * BLOCK).min(n)))),
        }
    });
    let made = |slot: OnceLock<T>| slot.into_inner().expect("invariant: each block ran");
    let single = single.into_inner().expect("invariant: each part ran");
    (single, slots.into_iter().map(made).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_order_whatever_order_the_blocks_ran_in() {
        let backwards = |n: usize, body: &(dyn Fn(usize) + Sync)| (0..n).rev().for_each(body);
        for n in [0, 1, 63, 64, 65, 1000] {
            let squares = |range: Range<usize>| range.map(|i| i * i).collect::<Vec<_>>();
            let (alone, blocks) = blocks_beside(&backwards, || 7, n, squares);
            assert_eq!(blocks.concat(), (0..n).map(|i| i * i).collect::<Vec<_>>());
            assert_eq!(alone, 7);
        }
    }
}
