//! The command, stopped and killed in the middle of a stage, goes on there.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};

const CONFIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/torus.toml");
/// Its stages stream; relaxation takes the whole surface.
const PAPER_FIT: &str = "target.fit=paper";
/// Enough faces for a few dozen tasks a stage.
const STREAMING: [&str; 2] = [PAPER_FIT, "target.faces=12000"];
/// Seconds of relaxation.
const RELAXING: [&str; 2] = ["target.faces=600", "relax.sweeps=60"];

struct Run {
    folder: tempfile::TempDir,
    keys: [&'static str; 2],
}

impl Run {
    fn new() -> Self {
        Self::with(STREAMING)
    }

    fn with(keys: [&'static str; 2]) -> Self {
        Self { folder: tempfile::tempdir().unwrap(), keys }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isospline"));
        let [fit, faces] = self.keys;
        command.args(["run", CONFIG, "--set", fit, "--set", faces, "--threads", "2", "--out"]);
        command.arg(self.out()).args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn ends(&self, more: &[&str]) -> Output {
        self.command(more).output().unwrap()
    }

    /// Starts it and waits until `stage` is done to 60 %.
    fn until_60_percent(&self, stage: &str) -> (Child, Lines<BufReader<ChildStdout>>) {
        let mut child = self.command(&["--json"]).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let far = |event: &Value| {
            let number = |name: &str| event[name].as_u64().unwrap_or(0);
            event["event"] == "progress"
                && event["stage"] == stage
                && 10 * number("done") >= 6 * number("of")
        };
        assert!(lines.any(|line| far(&parse(line.unwrap()))), "the run ended before");
        (child, lines)
    }

    fn status(&self) -> Vec<Value> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isospline"));
        let output = command.arg("status").arg(self.out()).arg("--json").output().unwrap();
        String::from_utf8(output.stdout).unwrap().lines().map(parse).collect()
    }
}

fn parse(line: impl AsRef<str>) -> Value {
    serde_json::from_str(line.as_ref()).unwrap()
}

fn events(output: &Output) -> Vec<Value> {
    std::str::from_utf8(&output.stdout).unwrap().lines().map(parse).collect()
}

fn artifacts(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of_rows = paths.filter(|path| path.extension().is_some_and(|e| e == "isos"));
    of_rows.map(|path| (path.display().to_string(), std::fs::read(&path).unwrap())).collect()
}

fn equal(a: &Run, b: &Run) -> bool {
    let bytes = |run: &Run| artifacts(&run.out()).into_values().collect::<Vec<_>>();
    bytes(a) == bytes(b)
}

#[expect(clippy::disallowed_methods, reason = "damage needs no commit")]
fn overwrite(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn killed_at_60_percent_of_g0_fit_the_next_run_continues_there() {
    let (killed, whole) = (Run::new(), Run::new());
    let (mut child, _lines) = killed.until_60_percent("g0_fit");
    child.kill().unwrap();
    child.wait().unwrap();
    let output = killed.ends(&["--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let events = events(&output);
    let resumed = events.iter().find(|e| e["event"] == "resumed" && e["stage"] == "g0_fit");
    let resumed = resumed.expect("g0_fit goes on");
    let (done, of) = (resumed["done"].as_u64().unwrap(), resumed["of"].as_u64().unwrap());
    assert!(10 * done >= 6 * of, "{done} of {of}");
    let again = events.iter().filter(|e| e["event"] == "progress" && e["stage"] == "g0_fit");
    assert_eq!(again.count() as u64, of - done, "a task that was done is computed again");
    let report = &events.last().unwrap()["report"];
    let stages = report["stages"].as_array().unwrap();
    let g0_fit = stages.iter().find(|s| s["stage"] == "g0_fit").unwrap();
    assert_eq!(g0_fit["resumed_tasks"].as_u64(), Some(done));
    assert!(whole.ends(&[]).status.success());
    assert!(equal(&killed, &whole), "an interruption changes the bytes");
}

#[test]
fn killed_within_relax_the_next_run_goes_on_from_the_state_it_kept() {
    let (killed, whole) = (Run::with(RELAXING), Run::with(RELAXING));
    let state = killed.out().join("12-relax.isos.state");
    // Nobody reads what it tells.
    let mut child = killed.command(&["--json"]).stdout(Stdio::null()).spawn().unwrap();
    while !state.exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run ended before");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let begun = killed.status().into_iter().find(|s| s["stage"] == "relax").unwrap();
    let done = begun["begun"]["done"].as_u64().unwrap();
    assert!(begun["begun"]["usable"] == true && done > 0, "{begun}");

    let resumed = events(&killed.ends(&["--json"]));
    let resumed = resumed.iter().find(|e| e["event"] == "resumed").unwrap();
    assert_eq!((&resumed["stage"], &resumed["done"]), (&"relax".into(), &done.into()));
    assert!(!state.exists());
    assert!(whole.ends(&[]).status.success());
    assert!(equal(&killed, &whole), "the way over a kept state changes the bytes");
}

#[test]
fn ctrl_c_says_what_is_kept_and_how_to_go_on() {
    let run = Run::new();
    let (child, lines) = run.until_60_percent("network");
    let stopping = std::time::Duration::from_secs(10);
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.unwrap().success());
    let last = lines.map(|line| parse(line.unwrap())).last().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "not within {stopping:?}");
    assert_eq!((&last["event"], &last["exit"]), (&Value::from("error"), &Value::from(130)));
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("what was finished is kept"), "{message}");
    assert!(message.contains("tasks of g0_fit"), "{message}");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("run the same command to go on"), "{told}");

    let status = run.status();
    let begun = status.iter().find(|s| s["stage"] == "fairing").unwrap();
    assert_eq!(begun["begun"]["usable"], true, "{begun}");
    let g0_fit = run.out().join("08-g0_fit.isos");
    let mut inspect = Command::new(env!("CARGO_BIN_EXE_isospline"));
    let output = inspect.arg("inspect").arg(&g0_fit).output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    for word in ["not finished", "are done", "interior", "recipe"] {
        assert!(told.contains(word), "no {word:?} in\n{told}");
    }
    assert!(run.ends(&[]).status.success());
    assert!(g0_fit.is_file());
}

#[test]
fn a_trace_is_written_and_verification_finds_what_a_fresh_run_does_not_read() {
    let run = Run::new();
    let trace = run.folder.path().join("trace.json");
    let path = trace.display().to_string();
    assert!(run.ends(&["--no-sync", "--trace", path.as_str()]).status.success());
    let text: Value = serde_json::from_slice(&std::fs::read(&trace).unwrap()).unwrap();
    let spans = text["traceEvents"].as_array().unwrap();
    assert!(spans.iter().any(|e| e["name"] == "g0_fit" && e["cat"] == "task"));

    let network = run.out().join("07-network.isos");
    let sound = std::fs::read(&network).unwrap();
    let mut damaged = sound.clone();
    damaged[sound.len() / 2] ^= 1;
    overwrite(&network, &damaged);
    assert!(run.ends(&[]).status.success());
    assert!(std::fs::read(&network).unwrap() == damaged, "a fresh run reads no rows");
    assert!(run.ends(&["--verify"]).status.success());
    assert!(std::fs::read(&network).unwrap() == sound);
}

#[test]
fn a_limit_of_file_sizes_is_an_error_with_the_path() {
    let run = Run::new();
    let mut shell = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_isospline");
    // 200 blocks of 512 or 1024 bytes: less than the largest artifact, more than a record.
    let limited = format!("ulimit -f 200; exec {program} \"$@\"");
    let args = [
        "-c",
        &limited,
        "sh",
        "run",
        CONFIG,
        "--set",
        PAPER_FIT,
        "--set",
        "target.faces=2000",
        "--out",
    ];
    let output = shell.args(args).arg(run.out()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(33), "{told}");
    assert!(told.contains(".isos.partial"), "{told}");
}
