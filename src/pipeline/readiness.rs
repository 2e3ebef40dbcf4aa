//! Which tasks of a source a task waits for: those that write the rows that it names.

use isospline_artifact::SectionSpec;
use isospline_stage::{Need, Task};
use std::ops::Range;

/// Which task of a stage writes a row, for every row of every section.
#[derive(Debug)]
pub(crate) struct RowOwners {
    specs: &'static [SectionSpec],
    n_tasks: usize,
    /// `(row after the last, task)` by section, in the order of rows.
    sections: Vec<Vec<(usize, u32)>>,
}

impl RowOwners {
    /// The owners under tasks that make every row once.
    pub(crate) fn of(specs: &'static [SectionSpec], tasks: &[Task]) -> Self {
        let section = |k: usize| {
            let ranges = tasks.iter().enumerate().filter_map(|(t, task)| {
                task.writes.get(k).filter(|rows| !rows.is_empty()).map(|rows| (rows.end, t as u32))
            });
            let mut owners: Vec<(usize, u32)> = ranges.collect();
            owners.sort_unstable();
            owners
        };
        let sections = (0..specs.len()).map(section).collect();
        Self { specs, n_tasks: tasks.len(), sections }
    }

    /// For each of `tasks`, the owners of all rows that it needs of its streamed input `input`:
    /// each once.
    pub(crate) fn awaited(&self, tasks: &[Task], input: usize) -> Vec<Vec<u32>> {
        // Number of the last task that named an owner, so that it is named once.
        let mut seen = vec![usize::MAX; self.n_tasks];
        let of_task = |(t, task): (usize, &Task)| {
            let mut owners = Vec::new();
            for need in task.needs.iter().filter(|need| need.input == input) {
                self.visit(need, |owner| {
                    if std::mem::replace(&mut seen[owner as usize], t) != t {
                        owners.push(owner);
                    }
                });
            }
            owners
        };
        tasks.iter().enumerate().map(of_task).collect()
    }

    fn visit(&self, need: &Need, mut each: impl FnMut(u32)) {
        let Some(section) = self.specs.iter().position(|s| s.name == need.section) else {
            // A name that the kind does not have is a bug of the stage; all rows are safe.
            return (0..self.n_tasks as u32).for_each(each);
        };
        let mut rest = &self.sections[section][..];
        for Range { start, end } in &need.rows {
            rest = &rest[rest.partition_point(|&(owned, _)| owned <= *start)..];
            // The owner that holds the end may hold the start of the next range too.
            let last = rest.partition_point(|&(owned, _)| owned < *end);
            rest.iter().take(last + 1).for_each(|&(_, task)| each(task));
            rest = &rest[last.min(rest.len())..];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_artifact::Count;

    const SPECS: [SectionSpec; 2] = [
        SectionSpec { name: "a", stride: 8, count: Count::Faces },
        SectionSpec { name: "b", stride: 8, count: Count::Edges },
    ];

    fn source() -> RowOwners {
        let task = |a, b| Task { writes: vec![a, b], needs: Vec::new() };
        RowOwners::of(&SPECS, &[task(4..8, 0..3), task(0..4, 3..3), task(8..10, 3..9)])
    }

    fn awaited(section: &'static str, rows: &[(usize, usize)]) -> Vec<u32> {
        let rows: Vec<Range<usize>> = rows.iter().map(|&(start, end)| start..end).collect();
        let need = |input| Need { input, section, rows: rows.clone() };
        let task = Task { writes: Vec::new(), needs: vec![need(1), need(0)] };
        source().awaited(&[task], 1).remove(0)
    }

    #[test]
    fn every_owner_of_a_named_row_is_awaited_once() {
        assert_eq!(awaited("a", &[(0, 1), (2, 4)]), [1]);
        assert_eq!(awaited("a", &[(3, 5)]), [1, 0]);
        assert_eq!(awaited("a", &[(0, 1), (7, 8), (9, 10)]), [1, 0, 2]);
        assert_eq!(awaited("a", &[(0, 10)]), [1, 0, 2]);
        assert_eq!(awaited("b", &[(2, 4), (5, 6)]), [0, 2]);
        assert_eq!(awaited("b", &[]), [0; 0]);
    }

    #[test]
    fn an_unknown_section_waits_for_all_tasks() {
        assert_eq!(awaited("c", &[(0, 1)]), [0, 1, 2]);
    }

    #[test]
    fn the_owners_are_those_of_a_search_row_by_row() {
        let owner = |row: usize| [1, 1, 1, 1, 0, 0, 0, 0, 2, 2][row];
        for mask in 1..1_u32 << 10 {
            let rows: Vec<usize> = (0..10).filter(|&row| mask >> row & 1 == 1).collect();
            let mut expected: Vec<u32> = rows.iter().map(|&row| owner(row)).collect();
            expected.dedup();
            let ranges = isospline_stage::plan::ranges(rows);
            let ranges: Vec<_> = ranges.into_iter().map(|rows| (rows.start, rows.end)).collect();
            assert_eq!(awaited("a", &ranges), expected, "{ranges:?}");
        }
    }
}
