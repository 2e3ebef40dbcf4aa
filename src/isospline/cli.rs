//! Commands: each takes its arguments and gives an exit code or a failure.

pub(crate) mod args;
mod batch;
mod check;
mod excerpt;
pub(crate) mod exhausted;
mod export;
pub(crate) mod failure;
mod habits;
mod import;
mod inspect;
pub(crate) mod interrupt;
mod lint;
mod numbers;
pub(crate) mod output;
mod progress;
mod render;
mod run;
mod status;
mod tables;

use args::{Cli, Command};
use failure::Failure;
use interrupt::Interrupt;

/// Carries out a command; failures are shown on standard error.
pub(crate) fn dispatch(args: &Cli, interrupt: &Interrupt) -> u8 {
    let (outcome, json) = match &args.command {
        Command::Run(args) => {
            interrupt.tells_json(args.model.json);
            (run::run(args, interrupt), args.model.json)
        }
        Command::Batch(args) => {
            interrupt.tells_json(args.json);
            (batch::batch(args, interrupt), args.json)
        }
        Command::Import(args) => (import::import(args), false),
        Command::Stage(args) => {
            interrupt.tells_json(args.model.json);
            (run::stage(args, interrupt), args.model.json)
        }
        Command::Status { dir, json } => (status::status(dir, *json), *json),
        Command::Inspect { file, verify } => (inspect::inspect(file, *verify), false),
        Command::Check(args) => (check::check(args), args.json),
        Command::Export(args) => (export::export(args), false),
        Command::Lint(args) => (lint::lint(args), args.json),
        Command::Completions(args) => (habits::completions(args), false),
        Command::Man(args) => (habits::man(args), false),
        Command::Schema => (habits::schema(), false),
        Command::Render(args) => (render::render(args), false),
    };
    outcome.unwrap_or_else(|failure| report(failure, json))
}

/// Shows a failure; with `--json` it also ends the lines of standard output.
fn report(failure: Failure, json: bool) -> u8 {
    let exit = failure.exit();
    if json {
        // The failure itself is what counts; a closed pipe cannot be told anything.
        let _ = output::say(&failure.to_json().to_string());
    }
    output::note(&format!("{:?}", miette::Report::new(failure)));
    exit
}
