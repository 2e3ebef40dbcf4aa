//! Bytes in memory that a reader takes for a file's: aligned as those of a map are.

use isospline_artifact::Bytes;
use std::sync::Arc;

/// A file's bytes.
#[derive(Debug)]
pub(crate) struct Held {
    words: Vec<u64>,
    length: usize,
}

impl Held {
    /// A copy of `bytes`.
    pub(crate) fn copy_of(bytes: &[u8]) -> Arc<Self> {
        let mut words = vec![0; bytes.len().div_ceil(8)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Arc::new(Self { words, length: bytes.len() })
    }
}

impl Bytes for Held {
    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }
}
