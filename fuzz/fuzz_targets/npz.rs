//! Any bytes as a numpy archive.

#![no_main]

use isospline_tests::reliability::fuzz_targets::npz;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| npz(bytes));
