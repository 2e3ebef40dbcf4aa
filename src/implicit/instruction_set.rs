//! Which build of hot loops runs: that for the widest vectors the processor has.

use std::sync::atomic::{AtomicU8, Ordering};

/// What hot loops are compiled for, the least first. Results have the same bits in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum InstructionSet {
    /// What every processor of the architecture has.
    Plain,
    /// Vectors of four floats.
    Avx2,
    /// Vectors of eight floats; point evaluators are not compiled for it.
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

/// Work that wide vectors speed up. [`Kernel::run`] and what it calls are to be
/// `#[inline(always)]`: what is not inlined stays compiled for any processor.
pub trait Kernel {
    /// What the work yields.
    type Output;

    /// Does the work.
    fn run(self) -> Self::Output;
}

/// Runs a kernel in the build for [`InstructionSet::best`]; the bits are the same in all.
#[cfg(target_arch = "x86_64")]
#[inline]
pub fn run_widest<K: Kernel>(kernel: K) -> K::Output {
    match InstructionSet::best() {
        InstructionSet::Avx512 => {
            #[expect(unsafe_code, reason = "calls code compiled for AVX-512")]
            // SAFETY: the processor has it, as `best` checks.
            unsafe {
                run_avx512(kernel)
            }
        }
        InstructionSet::Avx2 => {
            #[expect(unsafe_code, reason = "calls code compiled for AVX2")]
            // SAFETY: the processor has it, as `best` checks.
            unsafe {
                run_avx2(kernel)
            }
        }
        InstructionSet::Plain => kernel.run(),
    }
}

/// Runs a kernel; the bits are the same whatever it is compiled for.
#[cfg(not(target_arch = "x86_64"))]
#[inline]
pub fn run_widest<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
pub(crate) fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
