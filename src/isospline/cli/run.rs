//! Commands `run` and `stage`.

use crate::cli::args::{ModelArgs, RunArgs, StageArgs};
use crate::cli::failure::{CHECK_FAILED, Failure};
use crate::cli::interrupt::Interrupt;
use crate::cli::output::{duration, note, say};
use crate::cli::progress::Progress;
use crate::cli::tables;
use isospline::config::{ConfigError, ModelFile};
use isospline::report::{ConversionReport, fingerprint};
use isospline::{Model, ModelFolder, REPORT_NOTE};
use isospline_artifact::{Durability, StoreError, write_file_atomic};
use isospline_pipeline::{RunOptions, RunReport, Trace};
use std::path::PathBuf;

/// Converts a model and checks the surface.
pub(crate) fn run(args: &RunArgs, interrupt: &Interrupt) -> Result<u8, Failure> {
    let folder = folder(&args.model)?;
    let trace = args.trace.as_ref().map(|_| Trace::new());
    let (from, verify) = (args.from.as_deref(), args.verify);
    let options = RunOptions { from, verify, trace: trace.as_ref(), ..options(&args.model) };
    let outcome = convert(&folder, options, interrupt, args.model.json);
    if let (Some(path), Some(trace)) = (&args.trace, &trace) {
        // Of a run that failed too: then it is of most use.
        write_file_atomic(path, Durability::Fast, |out| out.write_all(&trace.to_json()))?;
    }
    outcome
}

fn convert(
    folder: &ModelFolder,
    options: RunOptions<'_>,
    interrupt: &Interrupt,
    json: bool,
) -> Result<u8, Failure> {
    let mut report = execute(folder, options, interrupt, json)?;
    if matches!(folder.patches(), Err(StoreError::Damaged { .. })) {
        // Fresh by their headers, but not whole: what is damaged is found and made again.
        let options = RunOptions { verify: true, ..options };
        report = execute(folder, options, interrupt, json)?;
    }
    if report.all_fresh()
        && let Some(code) = last_verdict(folder, &report, json)?
    {
        return Ok(code);
    }
    let check = folder.check(options.threads)?;
    let report = ConversionReport::new(folder, &report, options.threads, check)?;
    let bytes = serde_json::to_vec_pretty(&report).expect("invariant: a report is plain data");
    folder.write_note(REPORT_NOTE, &bytes)?;
    show(folder, &report, json)?;
    Ok(verdict(report.check.pass))
}

/// Runs one stage alone.
pub(crate) fn stage(args: &StageArgs, interrupt: &Interrupt) -> Result<u8, Failure> {
    let folder = folder(&args.model)?;
    let options = RunOptions { only: Some(&args.name), ..options(&args.model) };
    let report = execute(&folder, options, interrupt, args.model.json)?;
    if !args.model.json {
        for node in &report.nodes {
            let file = folder.path().join(&node.artifact);
            let done = if report.all_fresh() { "is fresh" } else { "is written" };
            say(&format!("{} {done}: {}", node.stage, file.display()))?;
        }
    }
    Ok(0)
}

fn folder(args: &ModelArgs) -> Result<ModelFolder, Failure> {
    let file = model_file(args)?;
    let default = || PathBuf::from("out").join(&file.model.name);
    let path = args.out.clone().unwrap_or_else(default);
    let durability = if args.no_sync { Durability::Fast } else { Durability::Durable };
    let model = Model::new(file)?;
    for remark in model.remarks() {
        note(&remark);
    }
    Ok(ModelFolder::new(model, path, durability))
}

fn model_file(args: &ModelArgs) -> Result<ModelFile, ConfigError> {
    match (&args.formula, &args.model) {
        (Some(formula), _) => ModelFile::from_formula(formula, &args.overrides),
        (None, path) => {
            let path = path.as_ref().expect("invariant: clap asks for a model or a formula");
            ModelFile::open(path, &args.overrides)
        }
    }
}

fn options<'a>(args: &ModelArgs) -> RunOptions<'a> {
    let defaults = RunOptions::default();
    let threads = args.threads.map_or(defaults.threads, |n| n as usize);
    RunOptions { threads, ..defaults }
}

fn execute(
    folder: &ModelFolder,
    options: RunOptions<'_>,
    interrupt: &Interrupt,
    json: bool,
) -> Result<RunReport, Failure> {
    let progress = Progress::new(json);
    let outcome = interrupt.heard_by(|stop| {
        folder.run(&RunOptions { stop, ..options }, &|event| progress.show(event))
    });
    progress.end();
    Ok(outcome?)
}

/// The exit code of the last check, if that was of the same surface and limits; tells so.
fn last_verdict(
    folder: &ModelFolder,
    report: &RunReport,
    json: bool,
) -> Result<Option<u8>, Failure> {
    let Some(bytes) = folder.note(REPORT_NOTE)? else { return Ok(None) };
    let Ok(last) = serde_json::from_slice::<serde_json::Value>(&bytes) else { return Ok(None) };
    let same = last["fingerprint"].as_str() == Some(&fingerprint(folder, report));
    let Some(pass) = last["check"]["pass"].as_bool().filter(|_| same) else { return Ok(None) };
    if json {
        say(&serde_json::json!({ "event": "report", "report": last }).to_string())?;
    } else {
        let verdict = if pass { "passed" } else { "did not pass" };
        let (path, time) = (folder.path().display(), duration(report.seconds));
        say(&format!("{path} is up to date, nothing to do ({time}); its check {verdict}"))?;
    }
    Ok(Some(verdict(pass)))
}

fn show(folder: &ModelFolder, report: &ConversionReport, json: bool) -> Result<(), Failure> {
    if json {
        return say(&serde_json::json!({ "event": "report", "report": report }).to_string());
    }
    say(&tables::stages(report))?;
    say("")?;
    if let Some(topology) = report.topology {
        say(&format!("topology: {topology}"))?;
    }
    if let Some(rounds) = &report.rounds {
        say(&tables::rounds(rounds))?;
    }
    say(&tables::check(&report.check, &folder.model().file))?;
    let path = folder.path().display();
    say(&format!(
        "\nartifacts, {MODEL} and {REPORT_NOTE} are in {path}",
        MODEL = isospline::MODEL_NOTE
    ))?;
    say(&format!("to look at it: isospline export {path} --format glb"))
}

fn verdict(pass: bool) -> u8 {
    if pass { 0 } else { CHECK_FAILED }
}
