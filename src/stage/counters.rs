//! Figures that tasks add up.

use std::collections::BTreeMap;

/// Sums and maxima over the tasks of a stage; the order of tasks does not matter.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Counters {
    /// Fallbacks and repairs taken: shown to the user, never silent.
    pub repairs: BTreeMap<String, u64>,
    /// Other counts.
    pub counts: BTreeMap<String, u64>,
    /// Largest values.
    pub maxima: BTreeMap<String, f64>,
}

impl Counters {
    /// Adds `n` repairs; zero leaves no trace.
    pub fn repair(&mut self, name: &str, n: u64) {
        add(&mut self.repairs, name, n);
    }

    /// Adds `n` to a count; zero leaves no trace.
    pub fn count(&mut self, name: &str, n: u64) {
        add(&mut self.counts, name, n);
    }

    /// Raises a maximum.
    pub fn max(&mut self, name: &str, value: f64) {
        match self.maxima.get_mut(name) {
            Some(old) => *old = old.max(value),
            None => _ = self.maxima.insert(name.to_owned(), value),
        }
    }

    /// Takes in the counters of another task.
    pub fn merge(&mut self, other: &Self) {
        other.repairs.iter().for_each(|(name, n)| add(&mut self.repairs, name, *n));
        other.counts.iter().for_each(|(name, n)| add(&mut self.counts, name, *n));
        other.maxima.iter().for_each(|(name, x)| self.max(name, *x));
    }
}

fn add(map: &mut BTreeMap<String, u64>, name: &str, n: u64) {
    match map.get_mut(name) {
        Some(sum) => *sum += n,
        None if n > 0 => _ = map.insert(name.to_owned(), n),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merging_adds_counts_and_keeps_the_largest_value() {
        let (mut a, mut b) = (Counters::default(), Counters::default());
        a.repair("split", 2);
        a.max("turn", 3.0);
        b.repair("split", 1);
        b.repair("none", 0);
        b.max("turn", 2.0);
        a.merge(&b);
        assert_eq!(a.repairs, BTreeMap::from([("split".to_owned(), 3)]));
        assert_eq!(a.maxima, BTreeMap::from([("turn".to_owned(), 3.0)]));
    }
}
