//! Hostile surroundings: odd paths, full disks, folders that vanish, signals, closed pipes.

#![expect(clippy::disallowed_methods, reason = "surroundings are made hostile from outside")]

use crate::reliability::hostile::{System, flat, limited};
use crate::reliability::mount::Mount;
use crate::reliability::process::{Ran, done, watched, watched_with};
use crate::{Sandbox, program};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const SPHERE: &str = "[model]\nformula = \"x^2+y^2+z^2-1\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 200\nfit = \"paper\"\n";

/// A model that takes a second or two.
const SLOW: &str = "[model]\nformula = \"cos(2*pi*x)+cos(2*pi*y)+cos(2*pi*z)-1.2\"\nbox = [[0.5,2.5],[0.5,2.5],[0.5,2.5]]\n[target]\nfaces = 12000\nfit = \"paper\"\n";

const LIMIT: Duration = Duration::from_mins(2);

/// All of them.
pub(crate) const SYSTEMS: [System; 21] = [
    System { name: "path with spaces", needs_root: false, tried: |s| odd_path(s, b"a b  c") },
    System { name: "path with a newline", needs_root: false, tried: |s| odd_path(s, b"a\nb") },
    System { name: "path of bad UTF-8", needs_root: false, tried: |s| odd_path(s, b"a\xff\xfe") },
    System { name: "path with quotes", needs_root: false, tried: |s| odd_path(s, b"a'b\"$c") },
    System { name: "path like an option", needs_root: false, tried: |s| odd_path(s, b"./--out") },
    System { name: "folder in a loop of links", needs_root: false, tried: link_loop },
    System { name: "model file in a loop of links", needs_root: false, tried: model_loop },
    System { name: "folder that is a file", needs_root: false, tried: folder_is_a_file },
    System { name: "model file that is a folder", needs_root: false, tried: model_is_a_folder },
    System { name: "model file without end", needs_root: false, tried: model_without_end },
    System { name: "an artifact that is a folder", needs_root: false, tried: artifact_is_a_folder },
    System { name: "read-only store", needs_root: true, tried: read_only },
    System { name: "full disk", needs_root: true, tried: |s| full_disk(s, "size=20k") },
    System {
        name: "no more files",
        needs_root: true,
        tried: |s| full_disk(s, "size=1m,nr_inodes=4"),
    },
    System { name: "folder removed while running", needs_root: false, tried: folder_removed },
    System { name: "Ctrl-C once", needs_root: false, tried: |s| interrupted(s, 1) },
    System { name: "Ctrl-C twice", needs_root: false, tried: |s| interrupted(s, 2) },
    System { name: "stdout closed", needs_root: false, tried: |s| redirected(s, ">&-", 0) },
    System {
        name: "stdout and stderr closed",
        needs_root: false,
        tried: |s| redirected(s, ">&- 2>&-", 0),
    },
    System {
        name: "stdout read by nobody",
        needs_root: false,
        tried: |s| redirected(s, "| true; exit ${PIPESTATUS[0]}", 0),
    },
    System {
        name: "stdout on a full disk",
        needs_root: false,
        tried: |s| redirected(s, ">/dev/full", 33),
    },
];

fn ended(ran: &Ran, code: i32, words: &[&str]) -> Result<(), String> {
    let said = flat(&ran.outcome.stderr);
    let right = ran.outcome.code == code && words.iter().all(|word| said.contains(word));
    if right { Ok(()) } else { Err(format!("{}, but exit {code} with {words:?}", ran.told())) }
}

fn run(sandbox: &Sandbox, model: impl AsRef<OsStr>, out: impl AsRef<OsStr>) -> Ran {
    let mut command = limited(&sandbox.path(""));
    command.arg("run").arg(model).arg("--out").arg(out);
    watched(&mut command, LIMIT)
}

fn sphere(sandbox: &Sandbox) -> std::path::PathBuf {
    sandbox.write("model.toml", SPHERE)
}

/// Model file and store below an odd name.
fn odd_path(sandbox: &Sandbox, name: &[u8]) -> Result<(), String> {
    let folder = sandbox.path("").join(OsStr::from_bytes(name));
    std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    std::fs::write(folder.join("model.toml"), SPHERE).map_err(|error| error.to_string())?;
    let store = folder.join("out");
    ended(&run(sandbox, folder.join("model.toml"), &store), 0, &[])?;
    let mut check = limited(&sandbox.path(""));
    ended(&watched(check.arg("check").arg(&store), LIMIT), 0, &[])?;
    let mut export = limited(&sandbox.path(""));
    ended(&watched(export.arg("export").arg(&store).args(["--format", "stl"]), LIMIT), 0, &[])
}

fn link(sandbox: &Sandbox, from: &str, to: &str) {
    std::os::unix::fs::symlink(to, sandbox.path(from)).expect("a link in the sandbox");
}

fn link_loop(sandbox: &Sandbox) -> Result<(), String> {
    link(sandbox, "a", "b");
    link(sandbox, "b", "a");
    ended(&run(sandbox, sphere(sandbox), sandbox.path("a")), 33, &["/a", "os error"])
}

fn model_loop(sandbox: &Sandbox) -> Result<(), String> {
    link(sandbox, "a.toml", "b.toml");
    link(sandbox, "b.toml", "a.toml");
    ended(&run(sandbox, sandbox.path("a.toml"), "out"), 10, &["a.toml", "symbolic links"])
}

fn folder_is_a_file(sandbox: &Sandbox) -> Result<(), String> {
    sandbox.write("out", "text");
    ended(&run(sandbox, sphere(sandbox), "out"), 33, &["out"])
}

fn model_is_a_folder(sandbox: &Sandbox) -> Result<(), String> {
    ended(&run(sandbox, sandbox.path(""), "out"), 10, &["directory"])
}

fn model_without_end(sandbox: &Sandbox) -> Result<(), String> {
    ended(&run(sandbox, "/dev/zero", "out"), 10, &["/dev/zero"])
}

fn artifact_is_a_folder(sandbox: &Sandbox) -> Result<(), String> {
    let path = sandbox.path("out/03-decimate.isos");
    std::fs::create_dir_all(path).map_err(|error| error.to_string())?;
    ended(&run(sandbox, sphere(sandbox), "out"), 33, &["03-decimate.isos"])
}

fn read_only(sandbox: &Sandbox) -> Result<(), String> {
    let model = sphere(sandbox);
    let mount = Mount::memory(&sandbox.path("disk"), "size=4m")?;
    let store = sandbox.path("disk/out");
    ended(&run(sandbox, &model, &store), 0, &[])?;
    mount.remount("ro")?;
    let mut check = limited(&sandbox.path(""));
    ended(&watched(check.arg("check").arg(&store), LIMIT), 0, &[])?;
    let mut stale = limited(&sandbox.path(""));
    stale.arg("run").arg(&model).arg("--out").arg(&store).args(["--set", "fairing.grid=10"]);
    ended(&watched(&mut stale, LIMIT), 33, &["disk/out", "ead-only"])
}

fn full_disk(sandbox: &Sandbox, options: &str) -> Result<(), String> {
    let model = sphere(sandbox);
    let mount = Mount::memory(&sandbox.path("disk"), options)?;
    let store = sandbox.path("disk/out");
    ended(&run(sandbox, &model, &store), 33, &["disk/out", "No space left"])?;
    mount.remount("size=16m,nr_inodes=200")?;
    ended(&run(sandbox, &model, &store), 0, &[])
}

fn folder_removed(sandbox: &Sandbox) -> Result<(), String> {
    sandbox.write("model.toml", SLOW);
    let mut removed = false;
    let mut command = limited(&sandbox.path(""));
    command.args(["run", "model.toml", "--out", "out"]);
    let ran = watched_with(&mut command, LIMIT, |_, _| {
        let begun = sandbox.path("out/02-polygonize.isos").exists();
        if begun && !removed {
            removed = std::fs::remove_dir_all(sandbox.path("out")).is_ok();
        }
    });
    if !removed {
        return Err(format!("the folder was never there: {}", ran.told()));
    }
    ended(&ran, 33, &["out"])?;
    ended(&run(sandbox, "model.toml", "out"), 0, &[])
}

/// The interrupted run keeps what is done, says how to go on, and the next one does.
fn interrupted(sandbox: &Sandbox, times: usize) -> Result<(), String> {
    sandbox.write("model.toml", SLOW);
    let (mut sent, mut at) = (0, Duration::ZERO);
    let mut command = limited(&sandbox.path(""));
    command.args(["run", "model.toml", "--out", "out"]);
    let ran = watched_with(&mut command, LIMIT, |child, age| {
        let begun = sandbox.path("out/03-decimate.isos").exists();
        if begun && sent < times && (sent == 0 || age > at + Duration::from_millis(5)) {
            let _ = done("kill", &["-INT", &child.id().to_string()]);
            (sent, at) = (sent + 1, if sent == 0 { age } else { at });
        }
    });
    let took = ran.seconds - at.as_secs_f64();
    ended(&ran, 130, if times == 1 { &["same command"] } else { &[] })?;
    if took > 2.0 {
        return Err(format!("{took:.1} s from Ctrl-C to the end"));
    }
    let resumed = run(sandbox, "model.toml", "out");
    ended(&resumed, 0, &[])?;
    whole(sandbox)
}

fn whole(sandbox: &Sandbox) -> Result<(), String> {
    let mut check = Command::new(program());
    ended(&watched(check.arg("check").arg(sandbox.path("out")), LIMIT), 0, &[])
}

/// A run whose output goes where the shell sends it.
fn redirected(sandbox: &Sandbox, to: &str, code: i32) -> Result<(), String> {
    sphere(sandbox);
    let line = format!("\"$0\" run model.toml --out out --no-sync {to}");
    let mut shell = Command::new("bash");
    shell.arg("-c").arg(line).arg(program()).current_dir(sandbox.path(""));
    shell.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let status = shell.status().map_err(|error| error.to_string())?;
    let finished = Path::exists(&sandbox.path("out/11-fairing.isos"));
    match (status.code(), finished) {
        (Some(found), true) if found == code => Ok(()),
        (found, finished) => Err(format!("exit {found:?}, finished: {finished}; expected {code}")),
    }
}
