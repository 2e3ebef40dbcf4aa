//! Command `lint`.

use crate::cli::failure::{CHECK_FAILED, Failure};
use crate::cli::output::say;
use clap::Args;
use isospline_export::{StepDefect, StepSummary, lint_step_file};
use std::fmt::Write as _;
use std::path::PathBuf;

/// What `lint --help` ends with.
pub(crate) const LINT_EXAMPLES: &str = "\
Examples:
  isospline lint deccube.step
  isospline lint deccube.step --json

It reads the text as it stands, where CAD programs heal what they read: references, kinds, loops,
borders equal to the last bit, edges used once each way, shells closed and turned outward, the
volume as stated, the unit. It knows the entities that `isospline export` writes and no others. The
exit code is 1 if anything is wrong.";

#[derive(Debug, Args)]
pub(crate) struct LintArgs {
    /// The STEP file
    #[arg(value_name = "FILE.step")]
    pub(crate) file: PathBuf,
    /// Print the findings as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Looks through a STEP file.
pub(crate) fn lint(args: &LintArgs) -> Result<u8, Failure> {
    let unreadable =
        |error: std::io::Error| Failure::io(format!("{}: {error}", args.file.display()));
    let found = lint_step_file(&args.file).map_err(unreadable)?;
    let code = if found.is_ok() { 0 } else { CHECK_FAILED };
    if args.json {
        let defects = found.as_ref().err().into_iter().flatten().map(ToString::to_string);
        let defects: Vec<String> = defects.collect();
        let pass = found.is_ok();
        let value = serde_json::json!({ "pass": pass, "summary": found.ok(), "defects": defects });
        say(&serde_json::to_string_pretty(&value).expect("invariant: a report is plain data"))?;
        return Ok(code);
    }
    match found {
        Ok(summary) => say(&sound(&summary))?,
        Err(defects) => say(&broken(&defects))?,
    }
    Ok(code)
}

fn sound(summary: &StepSummary) -> String {
    let mut text = String::new();
    for shell in &summary.shells {
        let what = if shell.is_void { "void" } else { "shell" };
        let (faces, edges, genus, volume) = (shell.faces, shell.edges, shell.genus, shell.volume);
        writeln!(text, "{what}: {faces} faces, {edges} edges, genus {genus}, volume {volume:e}")
            .expect("invariant: a string takes all text");
    }
    let (solids, volume, unit) = (summary.solids, summary.volume, summary.unit_metres);
    write!(text, "{solids} solids, volume {volume:e}, unit {unit} m; lint passed")
        .expect("invariant: a string takes all text");
    text
}

fn broken(defects: &[StepDefect]) -> String {
    let mut lines: Vec<String> = defects.iter().map(|d| format!("FAILED: {d}")).collect();
    lines.push("lint FAILED".to_owned());
    lines.join("\n")
}
