//! R4, I/O faults: every k-th call fails once; disks of many sizes; files that may not grow.

use crate::reliability::hostile::flat;
use crate::reliability::mount::Mount;
use crate::reliability::process::{Ran, is_there, watched};
use crate::reliability::sample::{PATIENCE, Sample};
use crate::reliability::strace::{self, Fault, faulted};
use crate::reliability::{Scale, Tally};
use std::path::{Path, PathBuf};

/// Exit codes of a file that cannot be read or written: the model file, any other.
const UNREADABLE: i32 = 10;
const IO: i32 = 33;

/// Calls, errors that they may give, and whether only those on files of the run count: the
/// loader's own calls are not ours to handle.
const FAULTS: [(&str, &[&str], bool); 11] = [
    ("pwrite64", &["EIO", "ENOSPC", "EINTR"], false),
    ("fsync", &["EIO", "EINTR"], false),
    ("fallocate", &["EIO", "ENOSPC", "EINTR"], false),
    ("rename", &["EIO", "ENOSPC"], false),
    ("renameat", &["EIO", "ENOSPC"], false),
    ("ftruncate", &["EIO", "EINTR"], false),
    ("mkdir", &["EIO", "ENOSPC"], false),
    ("flock", &["EIO"], false),
    ("openat", &["EIO", "EMFILE", "ENOSPC", "EINTR"], true),
    ("read", &["EIO", "EINTR"], true),
    ("write", &["EIO", "ENOSPC", "EINTR"], true),
];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let sample = Sample::new();
    match strace::missing() {
        Some(why) => tally.skip("every k-th call", why),
        None => every_call(scale, tally, &sample),
    }
    match Mount::missing() {
        Some(why) => tally.skip("full disks", &why),
        None => disks(scale, tally, &sample),
    }
    if is_there("prlimit") {
        files_that_may_not_grow(scale, tally, &sample);
    } else {
        tally.skip("files that may not grow", "no prlimit");
    }
}

fn every_call(scale: Scale, tally: &mut Tally, sample: &Sample) {
    let folder = sample.sandbox.path("faulted");
    let mut own = vec![sample.model.clone(), folder.clone()];
    for name in ["model.toml", "report.json", ".lock"] {
        own.push(folder.join(name));
    }
    for name in sample.sound.keys() {
        let stem = name.trim_end_matches(".isos");
        own.extend(
            ["isos", "isos.partial", "isos.journal", "json"]
                .map(|suffix| folder.join(format!("{stem}.{suffix}"))),
        );
    }
    let (mut told, mut unseen) = (0, 0);
    for (call, errors, on_own) in FAULTS {
        let paths: &[PathBuf] = if on_own { &own } else { &[] };
        for error in errors {
            let happens = format!("error={error}");
            for k in (1..).step_by(scale.of(11, 1)) {
                let _ = std::fs::remove_dir_all(&folder);
                let fault = Fault { call, happens: &happens, k, paths };
                let Some(ran) = faulted(sample, &folder, &fault, &[]) else { break };
                told += usize::from(ran.outcome.code != 0);
                unseen += usize::from(ran.outcome.code == 0);
                let outcome = specific(sample, &folder, &ran, *error == "EINTR");
                tally.case(
                    format!("{call} {k} {error}"),
                    outcome.and_then(|()| sample.resumes(&folder).map(drop)),
                );
            }
        }
    }
    tally.figure(format!("{told} faults told with their path, {unseen} without effect"));
}

/// A fault ends in an error with a path, or in a sound store.
fn specific(sample: &Sample, folder: &Path, ran: &Ran, invisible: bool) -> Result<(), String> {
    let said = flat(&ran.outcome.stderr);
    match ran.outcome.code {
        0 => sample.is_sound(folder),
        _ if invisible => Err(format!("seen: {}", ran.told())),
        IO if names(&said, folder) => Ok(()),
        UNREADABLE if said.contains("model.toml") => Ok(()),
        _ => Err(ran.told()),
    }
}

/// Whether a message names the folder or a file in it; the frame may break a path.
fn names(said: &str, folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    said.replace(' ', "").contains(&name)
}

/// A run on a disk of every size, from too small for anything to large enough.
fn disks(scale: Scale, tally: &mut Tally, sample: &Sample) {
    let path = sample.sandbox.path("disk");
    let bytes: usize = sample.sound.values().map(Vec::len).sum();
    let n_sizes = scale.of(5, 30);
    let mut full = 0;
    for n in 1..=n_sizes {
        let kilobytes = 4 + bytes * 2 * n / n_sizes / 1024;
        let mount = match Mount::memory(&path, &format!("size={kilobytes}k")) {
            Ok(mount) => mount,
            Err(why) => return tally.skip("full disks", &why),
        };
        let folder = path.join("out");
        let ran = sample.run(&folder, &[]);
        full += usize::from(ran.outcome.code != 0);
        let outcome = specific(sample, &folder, &ran, false).and_then(|()| {
            mount.remount("size=8m")?;
            sample.resumes(&folder).map(drop)
        });
        tally.case(format!("disk of {kilobytes} kB"), outcome);
    }
    tally.figure(format!("{n_sizes} disks, {full} of them full"));
}

/// A file that reaches its limit takes part of a write and refuses the rest.
fn files_that_may_not_grow(scale: Scale, tally: &mut Tally, sample: &Sample) {
    let folder = sample.sandbox.path("limited");
    let longest = sample.sound.values().map(Vec::len).max().unwrap_or(0);
    let n_sizes = scale.of(4, 40);
    for n in 0..n_sizes {
        let _ = std::fs::remove_dir_all(&folder);
        let limit = 100 + longest * n * 9 / 8 / n_sizes;
        let under = ["prlimit", &format!("--fsize={limit}")];
        let ran = watched(&mut sample.command_under(&under, &folder, &[]), PATIENCE);
        let outcome = specific(sample, &folder, &ran, false);
        tally.case(
            format!("files of {limit} bytes"),
            outcome.and_then(|()| sample.resumes(&folder).map(drop)),
        );
    }
    tally.figure(format!("{n_sizes} limits of file size"));
}
