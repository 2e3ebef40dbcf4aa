//! How a stage cuts its work.

use std::ops::Range;

/// The tasks of a stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Output of unknown size: one task makes all of it.
    Whole,
    /// Output of known size, written row range by row range in any order.
    Rows {
        /// Rows of each output section, in table order.
        lengths: Vec<usize>,
        /// The tasks; their written ranges tile every section.
        tasks: Vec<Task>,
    },
}

/// One unit of work.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Task {
    /// Rows written in each output section, in table order; empty for [`Plan::Whole`].
    pub writes: Vec<Range<usize>>,
    /// Rows read of each section of each streamed input: `(input, section, rows)`, where `input`
    /// counts the members of `Stage::Rows`.
    pub needs: Vec<Need>,
}

/// Rows of a streamed input that a task reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Need {
    /// Place of the input in `Stage::Rows`.
    pub input: usize,
    /// Section name.
    pub section: &'static str,
    /// Rows, as sorted disjoint ranges.
    pub rows: Vec<Range<usize>>,
}

/// `0..n` cut into ranges of at most `size` rows; none if `n` is zero.
pub fn cut(n: usize, size: usize) -> impl Iterator<Item = Range<usize>> {
    let size = size.max(1);
    (0..n.div_ceil(size)).map(move |k| k * size..((k + 1) * size).min(n))
}

/// Sorted disjoint ranges that hold exactly `rows`.
pub fn ranges(mut rows: Vec<usize>) -> Vec<Range<usize>> {
    rows.sort_unstable();
    rows.dedup();
    let mut out: Vec<Range<usize>> = Vec::new();
    for row in rows {
        match out.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => out.push(row..row + 1),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_tile_the_rows() {
        assert_eq!(cut(7, 3).collect::<Vec<_>>(), [0..3, 3..6, 6..7]);
        assert_eq!(cut(0, 3).count(), 0);
        assert_eq!(cut(2, 0).count(), 2);
    }

    #[test]
    fn ranges_hold_exactly_the_rows() {
        assert_eq!(ranges(vec![5, 1, 2, 2, 3, 9]), [1..4, 5..6, 9..10]);
    }
}
