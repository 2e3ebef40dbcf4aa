//! Which build of the evaluators runs: AVX2 where the processor has it, plain code elsewhere.

use std::sync::atomic::{AtomicBool, Ordering};

static PLAIN: AtomicBool = AtomicBool::new(false);

/// Makes this process evaluate by plain code although the processor could do more: results have
/// the same bits either way, and this is how that is tested.
#[doc(hidden)]
pub fn use_plain_code(plain: bool) {
    PLAIN.store(plain, Ordering::Relaxed);
}

/// Whether evaluators run the code compiled for AVX2.
#[doc(hidden)]
pub fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    return !PLAIN.load(Ordering::Relaxed) && std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}
