//! Prints the scoreboard: `scoreboard [--short] [R3 R9 ...]`. Fails if a row does.

use isospline_tests::reliability::{HEAD, ROWS, Scale};
use std::process::ExitCode;

#[expect(clippy::print_stdout, reason = "the board is what this program is for")]
fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let scale = if args.iter().any(|a| a == "--short") { Scale::Short } else { Scale::Full };
    let wanted: Vec<&String> = args.iter().filter(|a| !a.starts_with("--")).collect();
    // Panics of code under test are caught and told by the row.
    std::panic::set_hook(Box::new(|_| ()));
    println!("{HEAD}");
    let mut failed = false;
    for row in ROWS {
        if wanted.is_empty() || wanted.iter().any(|id| *id == row.id) {
            let tally = row.tried(scale);
            println!("{}", tally.line(row.property));
            failed |= !tally.failures().is_empty();
        }
    }
    ExitCode::from(u8::from(failed))
}
