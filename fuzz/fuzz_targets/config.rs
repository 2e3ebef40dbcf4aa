//! Any bytes as a model file.

#![no_main]

use isospline_tests::reliability::fuzz_targets::config;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| config(bytes));
