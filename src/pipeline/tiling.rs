//! Tasks must make every row exactly once.

use isospline_artifact::SectionSpec;
use isospline_stage::Task;

/// A row that is not made exactly once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    pub(crate) section: &'static str,
    pub(crate) row: usize,
    pub(crate) times: usize,
}

/// The first fault, if any, of tasks that write `lengths` rows of each of `specs`.
pub(crate) fn fault(specs: &[SectionSpec], lengths: &[usize], tasks: &[Task]) -> Option<Fault> {
    let missing = specs.get(lengths.len());
    let short = missing.map(|spec| Fault { section: spec.name, row: 0, times: 0 });
    let sections = specs.iter().zip(lengths).enumerate();
    let mut faults =
        sections.filter_map(|(s, (spec, &n))| fault_in_section(spec.name, s, n, tasks));
    short.or_else(|| faults.next())
}

fn fault_in_section(
    section: &'static str,
    idx: usize,
    length: usize,
    tasks: &[Task],
) -> Option<Fault> {
    let ranges = tasks.iter().filter_map(|t| t.writes.get(idx).cloned());
    let mut ranges: Vec<_> = ranges.filter(|r| !r.is_empty()).collect();
    ranges.sort_unstable_by_key(|r| r.start);
    let mut next = 0;
    for range in ranges {
        if range.start != next {
            let (row, times) = if range.start > next { (next, 0) } else { (range.start, 2) };
            return Some(Fault { section, row, times });
        }
        next = range.end;
    }
    let (row, times) = if next < length { (next, 0) } else { (length, 1) };
    (next != length).then_some(Fault { section, row, times })
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_artifact::Count;

    fn found(length: usize, ranges: &[(usize, usize)]) -> Option<(usize, usize)> {
        let specs = [SectionSpec { name: "a", stride: 8, count: Count::Faces }];
        let task = |&(start, end): &(usize, usize)| Task {
            writes: std::iter::once(start..end).collect(),
            needs: Vec::new(),
        };
        let tasks: Vec<Task> = ranges.iter().map(task).collect();
        fault(&specs, &[length], &tasks).map(|f| (f.row, f.times))
    }

    #[test]
    fn gaps_and_overlaps_are_found_in_any_order() {
        assert_eq!(found(6, &[(4, 6), (0, 2), (2, 4)]), None);
        assert_eq!(found(6, &[(4, 6), (0, 2), (2, 3)]), Some((3, 0)));
        assert_eq!(found(6, &[(0, 4), (2, 6)]), Some((2, 2)));
        assert_eq!(found(6, &[(0, 4)]), Some((4, 0)));
        assert_eq!(found(6, &[(0, 7)]), Some((6, 1)));
        assert_eq!(found(0, &[]), None);
    }

    #[test]
    fn a_section_without_a_length_is_found() {
        let specs = [SectionSpec { name: "a", stride: 8, count: Count::Faces }];
        assert_eq!(fault(&specs, &[], &[]), Some(Fault { section: "a", row: 0, times: 0 }));
    }
}
