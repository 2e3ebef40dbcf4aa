//! Any bytes as an OBJ mesh.

#![no_main]

use isospline_tests::reliability::fuzz_targets::obj;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| obj(bytes));
