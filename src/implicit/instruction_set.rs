//! Which build of the evaluators runs: that for the widest vectors the processor has.

use std::sync::atomic::{AtomicU8, Ordering};

/// What the evaluators are compiled for, the least first. Results have the same bits in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum InstructionSet {
    /// What every processor of the architecture has.
    Plain,
    /// Vectors of four floats.
    Avx2,
    /// Vectors of eight floats; enclosures alone are compiled for it.
    Avx512,
}

static MOST: AtomicU8 = AtomicU8::new(InstructionSet::Avx512 as u8);

/// Makes this process use no more than `most` although the processor could do more: this is how
/// equal bits are tested.
pub fn use_at_most(most: InstructionSet) {
    MOST.store(most as u8, Ordering::Relaxed);
}

impl InstructionSet {
    /// The best that the processor has and [`use_at_most`] allows.
    #[inline]
    pub fn best() -> Self {
        let most = MOST.load(Ordering::Relaxed);
        [Self::Avx512, Self::Avx2]
            .into_iter()
            .find(|set| *set as u8 <= most && set.is_there())
            .unwrap_or(Self::Plain)
    }

    /// Whether the processor has it.
    #[cfg(target_arch = "x86_64")]
    pub fn is_there(self) -> bool {
        match self {
            Self::Plain => true,
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            Self::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Whether the processor has it.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn is_there(self) -> bool {
        self == Self::Plain
    }
}
