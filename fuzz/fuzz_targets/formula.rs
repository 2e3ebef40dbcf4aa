//! Any bytes as a formula.

#![no_main]

use isospline_tests::reliability::fuzz_targets::formula;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| formula(bytes));
