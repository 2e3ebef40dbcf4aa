//! One model at work: a process, and files of what it says.

use crate::cli::args::BatchArgs;
use crate::cli::failure::Failure;
use isospline::batch::{BatchModel, Ending, Record};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long a model waits before it is tried again.
const PAUSE: Duration = Duration::from_millis(500);

/// When a model may be tried.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Patience {
    not_before: Option<Instant>,
}

impl Patience {
    pub(super) fn is_over(self) -> bool {
        self.not_before.is_none_or(|then| now() >= then)
    }

    /// Of a model that is tried again.
    pub(super) fn again() -> Self {
        Self { not_before: Some(now() + PAUSE) }
    }
}

/// One model at work.
#[derive(Debug)]
pub(super) struct Running {
    pub(super) model: BatchModel,
    child: Child,
    since: Instant,
    is_over_time: bool,
    said: PathBuf,
    noted: PathBuf,
    /// Bytes of `said` that were looked at.
    seen: u64,
    stage: String,
}

impl Running {
    /// Starts the run of a model.
    ///
    /// # Errors
    /// If the process or its files cannot be made.
    pub(super) fn start(
        args: &BatchArgs,
        out: &Path,
        model: BatchModel,
        threads: u32,
    ) -> Result<Self, Failure> {
        let logs = out.join(".batch/logs");
        let said = logs.join(format!("{}.jsonl", model.folder));
        let noted = logs.join(format!("{}.txt", model.folder));
        let folder = said.parent().expect("invariant: the file is in a folder");
        let failed = |error| Failure::io(format!("cannot start {}: {error}", model.name));
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut command = Command::new(super::program()?);
        command.arg("run").arg("--out").arg(out.join(&model.folder)).arg("--json");
        command.args(["--threads", &threads.to_string()]).args(args.no_sync.then_some("--no-sync"));
        command.args(args.overrides.iter().flat_map(|text| ["--set", text]));
        command.arg("--").arg(&model.path).stdin(Stdio::null());
        command.stdout(log(&said).map_err(failed)?).stderr(log(&noted).map_err(failed)?);
        let child = command.spawn().map_err(failed)?;
        let (since, stage) = (now(), String::new());
        Ok(Self { model, child, since, is_over_time: false, said, noted, seen: 0, stage })
    }

    /// How the run ended, if it has; it is ended after `limit` seconds.
    ///
    /// # Errors
    /// If the system does not tell.
    pub(super) fn ending(&mut self, limit: Option<u64>) -> Result<Option<Ending>, Failure> {
        let lost = |error| Failure::io(format!("cannot wait for a run: {error}"));
        if let Some(status) = self.child.try_wait().map_err(lost)? {
            return Ok(Some(match (self.is_over_time, status.code()) {
                (true, _) => Ending::TimeLimit(limit.unwrap_or_default()),
                (false, Some(code)) => Ending::Exit(code),
                (false, None) => Ending::Signal(signal(status)),
            }));
        }
        if limit.is_some_and(|limit| self.seconds() > limit as f64) && !self.is_over_time {
            self.is_over_time = true;
            // It may have ended meanwhile.
            drop(self.child.kill());
        }
        Ok(None)
    }

    /// Its record.
    pub(super) fn record(&self, keys: &BTreeMap<String, String>, ending: Ending) -> Record {
        let said = std::fs::read(&self.said).unwrap_or_default();
        let last = String::from_utf8_lossy(&said);
        let last = last.lines().rev().find_map(|line| serde_json::from_str(line).ok());
        let noted = std::fs::read(&self.noted).unwrap_or_default();
        let key = keys.get(&self.model.name).cloned().unwrap_or_default();
        let stderr = String::from_utf8_lossy(&noted);
        let record = Record::new(&self.model, key, ending, last.as_ref(), &stderr);
        Record { seconds: self.seconds(), ..record }
    }

    pub(super) fn seconds(&self) -> f64 {
        now().duration_since(self.since).as_secs_f64()
    }

    /// The stage at work, as far as the run has told.
    pub(super) fn stage(&mut self) -> &str {
        let mut new = String::new();
        let read = File::open(&self.said).and_then(|mut file| {
            file.seek(SeekFrom::Start(self.seen))?;
            file.read_to_string(&mut new)
        });
        // What cannot be read is told later; a line that is not whole is read again.
        if let (Ok(_), Some(end)) = (read, new.rfind('\n')) {
            self.seen += end as u64 + 1;
            let mut lines =
                new[..end].lines().rev().filter_map(|line| serde_json::from_str(line).ok());
            let started = |event: &serde_json::Value| event["event"] == "stage_started";
            if let Some(event) = lines.find(started) {
                event["stage"].as_str().unwrap_or_default().clone_into(&mut self.stage);
            }
        }
        &self.stage
    }
}

/// A new file: a run that outlived its batch goes on writing to the one that was there.
#[expect(clippy::disallowed_methods, reason = "a log is read while it is written")]
fn log(path: &Path) -> std::io::Result<File> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => File::create(path),
    }
}

#[expect(clippy::disallowed_methods, reason = "times of runs are told, they change no output")]
fn now() -> Instant {
    Instant::now()
}

#[cfg(unix)]
fn signal(status: std::process::ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal(_: std::process::ExitStatus) -> Option<i32> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    #[test]
    fn what_an_earlier_run_still_says_is_not_taken_for_the_word_of_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.jsonl");
        let mut earlier = log(&path).unwrap();
        writeln!(earlier, "begun").unwrap();
        writeln!(log(&path).unwrap(), "report").unwrap();
        writeln!(earlier, "another stage").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "report\n");
    }
}
