//! Any bytes as the journal of an unfinished artifact.

#![no_main]

use isospline_tests::reliability::fuzz_targets::journal;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| journal(bytes));
