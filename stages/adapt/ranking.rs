//! Edges in the order of their errors, those of the same error in the order of their rows.

use crate::error_cache::EdgeError;
use isospline_geometry::HalfEdge;

/// From which end errors are ranked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum First {
    /// The least error comes first.
    Least,
    /// The largest error comes first.
    Worst,
}

/// The first `n` edges in order: most of a large mesh is never looked at.
pub(crate) fn ranked(
    edges: impl Iterator<Item = EdgeError>,
    n: usize,
    first: First,
) -> Vec<EdgeError> {
    let turn = if first == First::Worst { u64::MAX } else { 0 };
    // As whole numbers edges are compared without a branch, which is twice as fast.
    let mut words: Vec<u128> =
        edges.map(|(h, e)| u128::from(key(e) ^ turn) << 32 | u128::from(h.0)).collect();
    if n < words.len() {
        words.select_nth_unstable(n);
        words.truncate(n);
    }
    words.sort_unstable();
    let edge = |word: u128| (HalfEdge(word as u32), error((word >> 32) as u64 ^ turn));
    words.into_iter().map(edge).collect()
}

const SIGN: u64 = 1 << 63;

/// A number that sorts as `error` does by [`f64::total_cmp`].
fn key(error: f64) -> u64 {
    let bits = error.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

fn error(key: u64) -> f64 {
    f64::from_bits(if key & SIGN == 0 { !key } else { key ^ SIGN })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_come_as_comparing_their_errors_and_rows_puts_them() {
        let errors = [0.0, 1e-9, f64::INFINITY, 3.0, -0.0, 1e-300, 3.0, -2.0, f64::NAN, 5e-324];
        let edges: Vec<EdgeError> =
            (0..40u32).map(|k| (HalfEdge(97 * k % 41), errors[(k * k % 10) as usize])).collect();
        for n in [0, 1, 7, 39, 40, 100] {
            for first in [First::Least, First::Worst] {
                let mut sorted = edges.clone();
                sorted.sort_by(|x, y| {
                    let by_error = x.1.total_cmp(&y.1);
                    let by_error =
                        if first == First::Worst { by_error.reverse() } else { by_error };
                    by_error.then(x.0.cmp(&y.0))
                });
                sorted.truncate(n);
                let bits = |edges: &[EdgeError]| {
                    edges.iter().map(|e| (e.0, e.1.to_bits())).collect::<Vec<_>>()
                };
                assert_eq!(bits(&ranked(edges.iter().copied(), n, first)), bits(&sorted));
            }
        }
    }
}
