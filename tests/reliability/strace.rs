//! Faults put into the system calls of the program by strace.

use crate::reliability::process::{Ran, is_there, watched};
use crate::reliability::sample::{PATIENCE, Sample};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Why strace cannot be used here, if so.
pub(crate) fn missing() -> Option<&'static str> {
    if !is_there("strace") {
        return Some("no strace");
    }
    let mut probe = Command::new("strace");
    probe.args(["-qq", "-o", "/dev/null", "true"]).stderr(Stdio::null());
    let works = probe.status().is_ok_and(|status| status.success());
    (!works).then_some("strace may not trace here")
}

/// A fault of one system call.
#[derive(Clone, Debug)]
pub(crate) struct Fault<'a> {
    /// The call.
    pub(crate) call: &'a str,
    /// What happens to it: `error=EIO`, `signal=KILL`.
    pub(crate) happens: &'a str,
    /// To which call of a thread, from 1.
    pub(crate) k: usize,
    /// Only calls on these paths count, if there are any.
    pub(crate) paths: &'a [PathBuf],
}

/// Runs the model into `folder` with a fault; `None` if the program made fewer such calls.
pub(crate) fn faulted(
    sample: &Sample,
    folder: &Path,
    fault: &Fault<'_>,
    more: &[&str],
) -> Option<Ran> {
    let Fault { call, happens, k, paths } = fault;
    let log = sample.sandbox.path("strace.log").display().to_string();
    let inject = format!("inject={call}:{happens}:when={k}");
    let trace = format!("trace={call}");
    let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let mut under = vec!["strace", "-f", "-qq", "-o", &log];
    for path in &paths {
        under.extend(["-P", path]);
    }
    under.extend(["-e", &trace, "-e", &inject]);
    let ran = watched(&mut sample.command_under(&under, folder, more), PATIENCE);
    let log = std::fs::read_to_string(log).unwrap_or_default();
    (log.contains("(INJECTED)") || ran.signal.is_some()).then_some(ran)
}
