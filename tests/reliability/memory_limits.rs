//! R10, memory: 5 000 faces with little of it; then the rest of the work with enough.

#![expect(clippy::disallowed_methods, reason = "limits are set through files of the system")]

use crate::reliability::process::{Ran, is_root, is_there, watched};
use crate::reliability::sample::{Sample, artifacts};
use crate::reliability::{Scale, Tally};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Limits, in megabytes; the first must do.
const LIMITS: [usize; 4] = [256, 128, 64, 48];

/// Address space is what is set aside, not what is used: glibc sets 64 MB aside for each thread that
/// allocates, a gigabyte in all, unless it is told to use few arenas.
const FEW_ARENAS: &str = "MALLOC_ARENA_MAX=2";

/// Exit codes of a clean error: a file, a map or a thread that cannot be had; a failed allocation.
const CLEAN: [i32; 2] = [33, 34];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let model = if scale == Scale::Full { "deccube" } else { "torus" };
    let config = std::fs::read_to_string(crate::config_path(model));
    let config = config.expect("a model file of the repository");
    // Every stage runs in this fit, in seconds; its table `[target]` is the last of these files.
    let sample = Sample::of(&format!("{config}fit = \"fast\"\n"));
    let free = sample.run(&sample.sandbox.path("free"), &[]);
    tally.figure(format!("{model}: {:.0} MB resident without a limit", free.peak_mb));
    for limit in &LIMITS[..scale.of(1, LIMITS.len())] {
        if is_there("prlimit") {
            let under = ["env", FEW_ARENAS, "prlimit", &format!("--as={}", limit << 20)];
            tried(tally, &sample, *limit, "address space", &under.map(str::to_owned));
        } else {
            tally.skip("address space", "no prlimit");
        }
        match Group::new(*limit) {
            Ok(group) => tried(tally, &sample, *limit, "cgroup", &group.under()),
            Err(why) => tally.skip("cgroup", &why),
        }
    }
}

fn tried(tally: &mut Tally, sample: &Sample, limit: usize, what: &str, under: &[String]) {
    let folder = sample.sandbox.path("limited");
    let _ = std::fs::remove_dir_all(&folder);
    let under: Vec<&str> = under.iter().map(String::as_str).collect();
    let mut command = sample.command_under(&under, &folder, &[]);
    let ran = watched(&mut command, Duration::from_mins(5));
    let made = artifacts(&folder).len();
    let resumed = sample.resumes(&folder).map(drop);
    let outcome = judged(&ran, limit).and(resumed);
    let (all, code) = (sample.sound.len(), ran.outcome.code);
    tally.figure(format!("{what} {limit} MB: exit {code}, {made} of {all} stages"));
    tally.case(format!("{what} of {limit} MB"), outcome);
}

/// Enough, or an end that says what was missing and what to do.
fn judged(ran: &Ran, limit: usize) -> Result<(), String> {
    let is_told = ran.outcome.stderr.contains("help: ");
    match ran.outcome.code {
        0 => Ok(()),
        code if limit < LIMITS[0] && CLEAN.contains(&code) && is_told => Ok(()),
        _ => Err(ran.told()),
    }
}

/// A memory cgroup of version 1; removed at the end.
struct Group {
    path: PathBuf,
}

impl Group {
    fn new(megabytes: usize) -> Result<Self, String> {
        if !is_root() {
            return Err("not root".to_owned());
        }
        let root = Path::new("/sys/fs/cgroup/memory");
        if !root.join("memory.limit_in_bytes").exists() {
            return Err("the system has none of version 1".to_owned());
        }
        let path = root.join(format!("isospline-test-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|error| error.to_string())?;
        let group = Self { path };
        let limit = (megabytes << 20).to_string();
        let set = std::fs::write(group.path.join("memory.limit_in_bytes"), limit);
        set.map_err(|error| error.to_string()).map(|()| group)
    }

    /// The words that put a command into the group.
    fn under(&self) -> [String; 4] {
        let line = format!("echo $$ > {}/cgroup.procs; exec \"$@\"", self.path.display());
        ["sh".to_owned(), "-c".to_owned(), line, "sh".to_owned()]
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir(&self.path);
    }
}
