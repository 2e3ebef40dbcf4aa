//! Any bytes as a shape of fidget.

#![no_main]

use isospline_tests::reliability::fuzz_targets::vm;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| vm(bytes));
