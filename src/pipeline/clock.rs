//! The one clock: times are recorded and shown, and never reach an artifact.

use std::time::Instant;

/// The time now.
#[expect(clippy::disallowed_methods, reason = "the pipeline measures what stages cost")]
pub(crate) fn now() -> Instant {
    Instant::now()
}
