//! The scoreboard of reliability at its short scale: each row is a test.

use isospline_tests::reliability::{Row, Scale};

/// Tries a row. Under `CI=true` what could not be tried for want of a program is a failure.
#[expect(clippy::print_stdout, reason = "the row's line, for who looks")]
fn holds(id: &str) {
    let row = Row::numbered(id);
    let tally = row.tried(Scale::Short);
    println!("{}", tally.line(row.property));
    assert!(tally.failures().is_empty(), "{:#?}", tally.failures());
    let wanting: Vec<&String> = tally.skips().iter().filter(|s| s.contains(": no ")).collect();
    let strict = std::env::var("CI").is_ok_and(|ci| ci == "true");
    assert!(!strict || wanting.is_empty(), "{wanting:?}");
}

#[test]
fn a_killed_run_goes_on_where_it_was() {
    holds("R1");
}

#[test]
fn a_power_cut_loses_nothing_acknowledged() {
    holds("R2");
}

#[test]
fn every_changed_byte_is_found_and_repaired() {
    holds("R3");
}

#[test]
fn every_fault_of_the_disk_is_told_with_its_path() {
    holds("R4");
}

#[test]
fn processes_on_one_store_do_not_disturb_each_other() {
    holds("R5");
}

#[test]
fn readers_take_any_bytes_without_panic_or_delay() {
    holds("R6");
}

#[test]
fn bytes_do_not_depend_on_threads_processors_or_places() {
    holds("R7");
}

#[test]
fn what_changed_decides_what_runs_again() {
    holds("R8");
}

#[test]
fn hostile_input_has_its_result_or_its_own_error() {
    holds("R9");
}

#[test]
fn little_memory_is_enough_or_told() {
    holds("R10");
}

#[test]
fn seeded_defects_are_found_by_the_check() {
    holds("R11");
}
