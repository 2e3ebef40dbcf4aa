//! A map from packed keys to row numbers.
//!
//! Own code because the map sits in the inner loops and std's hash maps are seeded at random;
//! this one is never iterated, so its layout cannot reach the output.

/// Marks a free slot; no packed key has all bits set.
const FREE: u64 = u64::MAX;

/// Open addressing with linear probing; at most three quarters of the slots are taken.
#[derive(Clone, Debug)]
pub(crate) struct KeyMap {
    keys: Vec<u64>,
    /// Beside the keys, not among them: a pair would be padded by a quarter.
    rows: Vec<u32>,
    len: usize,
}

impl KeyMap {
    /// A map with room for `n` keys before it grows.
    pub(crate) fn with_room_for(n: usize) -> Self {
        let slots = (n + n / 3 + 1).next_power_of_two().max(16);
        Self { keys: vec![FREE; slots], rows: vec![0; slots], len: 0 }
    }

    /// Whether there is no key.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The row of `key`.
    pub(crate) fn get(&self, key: u64) -> Option<u32> {
        let slot = self.slot(key);
        (self.keys[slot] == key).then(|| self.rows[slot])
    }

    /// The row of `key`, and whether it is new: then it is `row`.
    pub(crate) fn get_or_insert(&mut self, key: u64, row: u32) -> (u32, bool) {
        let slot = self.slot(key);
        if self.keys[slot] == key {
            return (self.rows[slot], false);
        }
        (self.keys[slot], self.rows[slot]) = (key, row);
        self.len += 1;
        if 4 * self.len > 3 * self.keys.len() {
            self.grow();
        }
        (row, true)
    }

    fn slot(&self, key: u64) -> usize {
        let mask = self.keys.len() - 1;
        // Fibonacci hashing: the high bits of the product mix all bits of the key.
        let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        while self.keys[slot] != FREE && self.keys[slot] != key {
            slot = (slot + 1) & mask;
        }
        slot
    }

    fn grow(&mut self) {
        let slots = 2 * self.keys.len();
        let keys = std::mem::replace(&mut self.keys, vec![FREE; slots]);
        let rows = std::mem::replace(&mut self.rows, vec![0; slots]);
        for (key, row) in keys.into_iter().zip(rows).filter(|&(key, _)| key != FREE) {
            let slot = self.slot(key);
            (self.keys[slot], self.rows[slot]) = (key, row);
        }
    }
}

/// The key of an unordered pair of rows.
pub(crate) fn pair(a: u32, b: u32) -> u64 {
    (u64::from(a.min(b)) << 32) | u64::from(a.max(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_keeps_its_first_row_while_the_map_grows() {
        let mut map = KeyMap::with_room_for(1);
        let key = |i: u32| pair(i * 7919, i);
        for i in 0..5000 {
            assert_eq!(map.get_or_insert(key(i), i), (i, true));
        }
        assert_eq!(map.get_or_insert(key(17), 9999), (17, false));
        assert!((0..5000).all(|i| map.get(key(i)) == Some(i)));
        assert_eq!(map.get(pair(1, 1)), None);
    }
}
