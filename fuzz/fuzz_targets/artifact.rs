//! Any bytes as an artifact.

#![no_main]

use isospline_tests::reliability::fuzz_targets::artifact;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| artifact(bytes));
