//! The outside checker: continuity, distance, watertightness and topology of finished patches
