//! R1, kill -9: at random moments, and at every k-th system call; the next run goes on.

#![expect(clippy::disallowed_methods, reason = "processes are killed at chosen moments")]

use crate::reliability::dice::Dice;
use crate::reliability::sample::{Sample, computed, events, stage_of, stages};
use crate::reliability::strace::{self, Fault, faulted};
use crate::reliability::{Scale, Tally};
use isospline_artifact::Recorded;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

/// A model of several chunks a stage, quick because its mesh is given.
pub(crate) fn chunked() -> Sample {
    let mesh = crate::root().join("tests/fixtures/meshes/double_torus_1800.obj");
    let config = std::fs::read_to_string(crate::config_path("double_torus"));
    let config = config.expect("a model file of the repository");
    let value = |key: &str| {
        let table: toml::Table = config.parse().expect("a model file is TOML");
        let value = table["model"].get(key).cloned();
        value.map(|value| format!("{key} = {value}\n")).unwrap_or_default()
    };
    let keys: String = ["formula", "level", "box", "inside", "parameters"].map(value).concat();
    Sample::of(&format!(
        "[model]\n{keys}base_mesh = {:?}\n[target]\nfit = \"paper\"\n",
        mesh.display().to_string()
    ))
}

/// Calls at which the program is killed.
const CALLS: [&str; 14] = [
    "openat",
    "pwrite64",
    "write",
    "fsync",
    "fdatasync",
    "rename",
    "renameat",
    "fallocate",
    "ftruncate",
    "mmap",
    "munmap",
    "unlink",
    "flock",
    "mkdir",
];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let mut redone = Redone::default();
    at_random_moments(scale, tally, &mut redone);
    match strace::missing() {
        Some(why) => tally.skip("every k-th system call", why),
        None => at_every_call(scale, tally),
    }
    let Redone { committed, again, stages } = redone;
    tally.figure(format!(
        "{again} of {committed} committed chunks and 0 of {stages} stored stages redone"
    ));
}

/// What resumed runs found done, and did again all the same.
#[derive(Default)]
struct Redone {
    committed: u64,
    again: u64,
    stages: usize,
}

fn at_random_moments(scale: Scale, tally: &mut Tally, redone: &mut Redone) {
    let sample = chunked();
    let folder = sample.sandbox.path("killed");
    let mut dice = Dice::new(1);
    let mut early = 0;
    for n in 0..scale.of(20, 1000) {
        let _ = std::fs::remove_dir_all(&folder);
        // Up to three kills before the run that is let live.
        let mut outcome = Ok(());
        for _ in 0..=dice.below(3) {
            let moment = Duration::from_secs_f64(sample.seconds * dice.unit());
            let said = killed(&sample, &folder, moment);
            early += usize::from(!said.contains("\"report\""));
            outcome = outcome.and(committed(&sample, &folder, &said, redone));
        }
        outcome = outcome.and_then(|()| sample.resumes(&folder).map(drop));
        tally.case(format!("random moment {n}"), outcome);
    }
    tally.figure(format!("{early} kills of a run at work"));
}

/// Starts a run and kills it; what it had said until then.
pub(crate) fn killed(sample: &Sample, folder: &Path, moment: Duration) -> String {
    let path = sample.sandbox.path("said");
    let said = std::fs::File::create(&path).expect("a file of the sandbox");
    let mut command = sample.command(folder, &["--json"]);
    let mut child = command.stdout(said).stderr(Stdio::null()).spawn().expect("the program starts");
    std::thread::sleep(moment);
    child.kill().expect("a child can be killed");
    child.wait().expect("a child can be waited for");
    std::fs::read_to_string(path).unwrap_or_default()
}

/// Whether what a killed run had told to be done is there: its artifacts, and in the journals of
/// the others its chunks.
fn committed(
    sample: &Sample,
    folder: &Path,
    said: &str,
    redone: &mut Redone,
) -> Result<(), String> {
    let stored = stages(said, "stored");
    redone.stages += stored.len();
    for (name, done) in told(said) {
        let artifact = sample.sound.keys().find(|artifact| stage_of(artifact) == name);
        let artifact = artifact.ok_or_else(|| format!("no artifact is made by {name}"))?;
        if folder.join(artifact).exists() {
            continue;
        }
        if stored.contains(&name) {
            return Err(format!("{name} was told stored, but is gone"));
        }
        // Stages of one task tell progress in units of their own.
        if WHOLE.contains(&name.as_str()) {
            continue;
        }
        let journal = std::fs::read(folder.join(format!("{artifact}.journal")));
        let recorded = Recorded::decode(&journal.unwrap_or_default());
        let kept = recorded.map_or(0, |recorded| recorded.entries.len() as u64);
        redone.committed += done;
        redone.again += done.saturating_sub(kept);
        if kept < done {
            return Err(format!("{name}: {done} chunks were committed, {kept} are kept"));
        }
    }
    Ok(())
}

/// The most that each stage told to be done.
fn told(said: &str) -> BTreeMap<String, u64> {
    let mut told: BTreeMap<String, u64> = BTreeMap::new();
    for event in events(said, "progress") {
        let stage = event["stage"].as_str().unwrap_or_default().to_owned();
        let most = told.entry(stage).or_default();
        *most = event["done"].as_u64().unwrap_or(0).max(*most);
    }
    told
}

/// Stages of one task, whose progress counts something else.
const WHOLE: [&str; 5] = ["import", "polygonize", "decimate", "project", "adapt"];

fn at_every_call(scale: Scale, tally: &mut Tally) {
    let sample = Sample::new();
    let folder = sample.sandbox.path("killed");
    let mut n_kills = 0;
    for call in CALLS {
        // Without paths the k-th call of the first thread that gets so far; with the path of a
        // file, each call on it.
        let mut targets: Vec<Vec<PathBuf>> = vec![Vec::new()];
        let suffixes: &[&str] =
            if scale == Scale::Full { &["", ".partial", ".journal"] } else { &[] };
        for name in sample.sound.keys() {
            targets.extend(suffixes.iter().map(|s| vec![folder.join(format!("{name}{s}"))]));
        }
        for paths in &targets {
            n_kills += sweep(scale, tally, &sample, call, paths);
        }
    }
    tally.figure(format!("{n_kills} kills at system calls"));
}

fn sweep(scale: Scale, tally: &mut Tally, sample: &Sample, call: &str, paths: &[PathBuf]) -> usize {
    let folder = sample.sandbox.path("killed");
    let mut n_kills = 0;
    for k in (1..).step_by(scale.of(9, 1)) {
        let _ = std::fs::remove_dir_all(&folder);
        let fault = Fault { call, happens: "signal=KILL", k, paths };
        let Some(ran) = faulted(sample, &folder, &fault, &["--json"]) else { break };
        n_kills += 1;
        let stored = stages(&ran.outcome.stdout, "stored");
        let outcome = sample.resumes(&folder).and_then(|after| {
            let again = computed(&after.outcome.stdout);
            let twice = stored.iter().find(|stage| again.contains(stage));
            twice.map_or(Ok(()), |stage| Err(format!("{stage} was stored and is redone")))
        });
        let file = paths.first().and_then(|path| path.file_name()).unwrap_or_default();
        tally.case(format!("{call} {k} {}", file.to_string_lossy()), outcome);
    }
    n_kills
}
