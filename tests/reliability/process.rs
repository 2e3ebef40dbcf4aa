//! Processes that are watched: time, memory, exit.

#![expect(clippy::disallowed_methods, reason = "processes are timed from outside")]

use crate::Outcome;
use std::io::{Read, Seek};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How a process ended.
#[derive(Clone, Debug)]
pub(crate) struct Ran {
    /// Exit code and what it said.
    pub(crate) outcome: Outcome,
    /// The signal that ended it.
    pub(crate) signal: Option<i32>,
    /// Wall time.
    pub(crate) seconds: f64,
    /// Time of processors, seen about every millisecond.
    pub(crate) processor_seconds: f64,
    /// Largest resident memory that was seen.
    pub(crate) peak_mb: f64,
    /// Whether it was ended for taking too long.
    pub(crate) too_long: bool,
}

impl Ran {
    /// One line for messages.
    pub(crate) fn told(&self) -> String {
        let Outcome { code, stderr, stdout } = &self.outcome;
        let said: Vec<&str> = stderr.split_whitespace().collect();
        let mut said = said.join(" ");
        if said.is_empty() {
            stdout.lines().last().unwrap_or_default().clone_into(&mut said);
        }
        said.truncate(said.char_indices().nth(300).map_or(said.len(), |(at, _)| at));
        let (seconds, peak) = (self.seconds, self.peak_mb);
        match (self.too_long, self.signal) {
            (true, _) => format!("still running after {seconds:.1} s, {peak:.0} MB: {said}"),
            (_, Some(signal)) => format!("signal {signal} after {seconds:.2} s: {said}"),
            _ => format!("exit {code} after {seconds:.2} s: {said}"),
        }
    }
}

/// Runs a command to its end, or for `limit` at most.
pub(crate) fn watched(command: &mut Command, limit: Duration) -> Ran {
    watched_with(command, limit, |_, _| ())
}

/// The same; `meanwhile` is called about every millisecond with the process and its age.
pub(crate) fn watched_with(
    command: &mut Command,
    limit: Duration,
    mut meanwhile: impl FnMut(&mut Child, Duration),
) -> Ran {
    let mut stdout = tempfile::tempfile().expect("a temporary file");
    let mut stderr = tempfile::tempfile().expect("a temporary file");
    let twin = |file: &std::fs::File| Stdio::from(file.try_clone().expect("a second handle"));
    command.stdin(Stdio::null()).stdout(twin(&stdout)).stderr(twin(&stderr));
    let start = Instant::now();
    let mut child = command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let (mut peak_mb, mut processor_seconds, mut too_long) = (0.0_f64, 0.0_f64, false);
    let status = loop {
        peak_mb = peak_mb.max(resident_mb(child.id()));
        processor_seconds = processor_seconds.max(processor(child.id()));
        if let Some(status) = child.try_wait().expect("a child can be waited for") {
            break status;
        }
        if start.elapsed() > limit {
            too_long = true;
            child.kill().expect("a child can be killed");
        }
        meanwhile(&mut child, start.elapsed());
        std::thread::sleep(Duration::from_millis(1));
    };
    let seconds = start.elapsed().as_secs_f64();
    let outcome = outcome(status, text(&mut stdout), text(&mut stderr));
    Ran { outcome, signal: status.signal(), seconds, processor_seconds, peak_mb, too_long }
}

/// Most memory that a process ever had resident; 0 where that cannot be told.
pub(crate) fn resident_mb(id: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

/// Time of processors that a process took; 0 where that cannot be told.
fn processor(id: u32) -> f64 {
    // Ticks of a hundredth second, the 14th and 15th field; the name before them ends in `)`.
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Whether this process may mount and limit.
pub(crate) fn is_root() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let uid = status.lines().find_map(|line| line.strip_prefix("Uid:"));
    uid.is_some_and(|ids| ids.split_whitespace().nth(1) == Some("0"))
}

/// Whether a program can be started.
pub(crate) fn is_there(program: &str) -> bool {
    let mut probe = Command::new(program);
    probe.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    probe.status().is_ok()
}

/// Runs a command that must succeed.
///
/// # Errors
/// What it said.
pub(crate) fn done(program: &str, args: &[&str]) -> Result<(), String> {
    let output = Command::new(program).args(args).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(format!("{program} {args:?}: {}", said.trim()))
}

fn outcome(status: ExitStatus, stdout: String, stderr: String) -> Outcome {
    Outcome { code: status.code().unwrap_or(-1), stdout, stderr }
}

fn text(file: &mut std::fs::File) -> String {
    let mut bytes = Vec::new();
    file.rewind().expect("a temporary file can be read");
    file.read_to_end(&mut bytes).expect("a temporary file can be read");
    String::from_utf8_lossy(&bytes).into_owned()
}
