//! Any bytes as a model of SURFER.

#![no_main]

use isospline_tests::reliability::fuzz_targets::jsurf;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| jsurf(bytes));
