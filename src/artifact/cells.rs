//! Bytes in memory that are written at some places while they are read at others.

#![expect(unsafe_code, reason = "rows that are done are read while others are written")]

use crate::Bytes;
use std::cell::UnsafeCell;
use std::fmt;

/// Bytes aligned to 8, of a fixed length.
pub(crate) struct Cells {
    words: Box<[UnsafeCell<u64>]>,
    length: usize,
}

// SAFETY: `write_at` is called by the one writer of the file (`Partial::write_at` takes it
// exclusively, and no two writers share cells). A reader in another thread looks only at rows whose
// writing happened before it was given them: the pipeline starts a task when the tasks that write
// the rows it names have reported, through a channel, that they did; the contract suite of stages
// poisons all other rows. Every bit pattern is a valid row. Gain: a stage runs behind the one
// before it without a copy of its rows.
unsafe impl Sync for Cells {}

impl Cells {
    /// Zeros.
    pub(crate) fn zeros(length: usize) -> Self {
        // A vector of zeros comes from the system as zero pages; it is not written here.
        let words = vec![0_u64; length.div_ceil(8)].into_boxed_slice();
        let words = Box::into_raw(words) as *mut [UnsafeCell<u64>];
        // SAFETY: the pointer was just taken from a box, and the cell has its content's layout.
        let words = unsafe { Box::from_raw(words) };
        Self { words, length }
    }

    /// A copy of `bytes`.
    pub(crate) fn copy_of(bytes: &[u8]) -> Self {
        let out = Self::zeros(bytes.len());
        out.write_at(0, bytes);
        out
    }

    /// Writes at an offset; the place must lie in the cells.
    pub(crate) fn write_at(&self, offset: usize, bytes: &[u8]) {
        let end = offset.checked_add(bytes.len()).expect("invariant: lengths fit memory");
        assert!(end <= self.length, "invariant: layouts are within their file");
        let start = self.words.as_ptr().cast::<u8>().cast_mut();
        // SAFETY: `offset <= length`, checked above, and the words hold `length` bytes.
        let target = unsafe { start.add(offset) };
        // SAFETY: the target has room for `bytes`, checked above; the caller's slice is elsewhere,
        // since no part of the cells is lent for writing; nobody reads the place yet (see `Sync`).
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), target, bytes.len()) };
    }
}

impl Bytes for Cells {
    fn bytes(&self) -> &[u8] {
        // SAFETY: the words hold `length` bytes and live as long as `self`; what is still being
        // written is not looked at (see `Sync`).
        unsafe { std::slice::from_raw_parts(self.words.as_ptr().cast::<u8>(), self.length) }
    }
}

impl fmt::Debug for Cells {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cells").field("length", &self.length).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_written_at_an_offset_are_read_there() {
        let cells = Cells::zeros(13);
        let lent = cells.bytes();
        assert_eq!(lent, [0; 13]);
        cells.write_at(5, &[1, 2, 3]);
        cells.write_at(12, &[9]);
        assert_eq!(cells.bytes(), [0, 0, 0, 0, 0, 1, 2, 3, 0, 0, 0, 0, 9]);
        assert_eq!(cells.bytes().as_ptr() as usize % 8, 0);
        assert_eq!(Cells::copy_of(b"abc").bytes(), b"abc");
    }
}
