//! R9, hostile input: each case has the right result or its specific error, soon and in little
//! memory.

use crate::Sandbox;
use crate::reliability::hostile_systems::SYSTEMS;
use crate::reliability::hostile_texts::{fields, files};
use crate::reliability::mount::Mount;
use crate::reliability::odd_meshes::{globe, triakis_icosahedron};
use crate::reliability::process::{Ran, watched};
use crate::reliability::{Scale, Tally};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Longest that a case may take; at the short scale the program is not optimised.
const SECONDS: f64 = 10.0;

/// Most memory that a case may have: the system refuses more, and the largest seen is told.
const MEGABYTES: usize = 512;

/// What must come of a case.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Expected {
    /// A surface that passes its check.
    Passes,
    /// An exit code, and words of the message.
    Exit(i32, &'static [&'static str]),
    /// Either: both are right, and which one comes depends on rounding.
    PassesOrExit(i32, &'static [&'static str]),
}

/// A model file and what must come of it.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) model: Vec<u8>,
    pub(crate) expected: Expected,
}

/// Something done to the program beyond its model file.
pub(crate) struct System {
    pub(crate) name: &'static str,
    /// Whether it mounts file systems.
    pub(crate) needs_root: bool,
    pub(crate) tried: fn(&Sandbox) -> Result<(), String>,
}

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let (mut longest, mut largest) = ((0.0, ""), (0.0, ""));
    let texts: Vec<Case> = fields().into_iter().chain(files()).collect();
    // Whole surfaces take longest; every third does for a test.
    let kept = |(n, case): &(usize, &Case)| match case.expected {
        Expected::Passes => scale == Scale::Full || n % 3 == 0,
        _ => true,
    };
    for (_, case) in texts.iter().enumerate().filter(kept) {
        let ran = run(&case.model);
        longest = max(longest, (ran.seconds.min(ran.processor_seconds), case.name));
        largest = max(largest, (ran.peak_mb, case.name));
        tally.case(case.name, judged(&ran, case.expected, scale));
    }
    let unmountable = Mount::missing();
    for system in &SYSTEMS {
        if let Some(why) = unmountable.as_ref().filter(|_| system.needs_root) {
            tally.skip(system.name, why);
            continue;
        }
        tally.case(system.name, (system.tried)(&Sandbox::new()));
    }
    tally.figure(format!("longest {:.1} s ({})", longest.0, longest.1));
    tally.figure(format!("largest {:.0} MB ({})", largest.0, largest.1));
}

fn max<'a>(a: (f64, &'a str), b: (f64, &'a str)) -> (f64, &'a str) {
    if b.0 > a.0 { b } else { a }
}

fn run(model: &[u8]) -> Ran {
    let sandbox = Sandbox::new();
    for (name, text) in MESHES {
        sandbox.write(name, text);
    }
    sandbox.write("triakis.obj", triakis_icosahedron());
    sandbox.write("globe.obj", globe(12, 7));
    sandbox.write("model.toml", model);
    let mut command = limited(&sandbox.path(""));
    command.args(["run", "model.toml", "--out", "out", "--no-sync"]);
    watched(&mut command, Duration::from_mins(2))
}

/// The program with no more memory than a case may have.
pub(crate) fn limited(folder: &Path) -> Command {
    let program = crate::program();
    let mut command = if crate::reliability::process::is_there("prlimit") {
        let mut command = Command::new("prlimit");
        command.arg(format!("--data={}", MEGABYTES << 20)).arg(program);
        command
    } else {
        Command::new(program)
    };
    command.current_dir(folder).env("NO_COLOR", "1");
    command
}

fn judged(ran: &Ran, expected: Expected, scale: Scale) -> Result<(), String> {
    let said = flat(&ran.outcome.stderr);
    let is = |code: i32, words: &[&str]| {
        ran.outcome.code == code && words.iter().all(|word| said.contains(word))
    };
    let right = match expected {
        Expected::Passes => is(0, &[]),
        Expected::Exit(code, words) => is(code, words),
        Expected::PassesOrExit(code, words) => is(0, &[]) || is(code, words),
    };
    // On a busy machine the wall clock tells of others.
    let seconds = ran.seconds.min(ran.processor_seconds);
    let quick = seconds <= SECONDS * scale.of(6, 1) as f64;
    match (right, quick, ran.peak_mb <= MEGABYTES as f64) {
        (true, true, true) => Ok(()),
        _ => Err(format!("{}, {:.0} MB, but {expected:?}", ran.told(), ran.peak_mb)),
    }
}

/// A message without its frame and line breaks.
pub(crate) fn flat(text: &str) -> String {
    text.replace(['│', '\n'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Meshes that the model files of [`files`] name.
const MESHES: [(&str, &str); 9] = [
    (
        "tetrahedron.obj",
        "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n",
    ),
    ("hole.obj", "v 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\n"),
    ("nan.obj", "v nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"),
    (
        "huge.obj",
        "v 1e308 1e308 0\nv -1e308 1 0\nv 0 0 1e308\nv 0 0 -1e308\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n",
    ),
    ("quads.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"),
    ("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n"),
    ("empty.obj", ""),
    ("twice.obj", "v 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 3\nf 1 3 2\n"),
    ("flat.obj", "v 1 0 0\nv 1 0 0\nv 1 0 0\nv 1 0 0\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n"),
];
