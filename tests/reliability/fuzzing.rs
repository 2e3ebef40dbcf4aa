//! R6, fuzz: every reader on thousands of changed inputs; no panic, no hang, little memory.

#![expect(clippy::disallowed_methods, reason = "cases are timed, and watched from a thread")]

use crate::reliability::dice::Dice;
use crate::reliability::fuzz_targets::{TEXTS, artifact};
use crate::reliability::mutation::{changed, changed_artifact};
use crate::reliability::process::resident_mb;
use crate::reliability::sample::Sample;
use crate::reliability::{Scale, Tally};
use isospline_artifact::{Journal, JournalEntry, JournalHead, Key, MemoryStore, Store};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Longest that a case may take, and most memory that the process may have.
const SECONDS: f64 = 1.0;
const MEGABYTES: f64 = 256.0;

/// After this a case counts as one that never ends.
const HANG: Duration = Duration::from_secs(30);

type Cases = Box<dyn FnMut(usize) -> Vec<u8> + Send>;

/// Cases of one reader, made one after the other.
struct Campaign {
    name: String,
    read: fn(&[u8]),
    n_cases: usize,
    /// The n-th case.
    case: Cases,
}

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let n_cases = scale.of(300, 10_000);
    let sample = Sample::new();
    let mut worst = Worst::default();
    let campaigns = texts(&sample, n_cases).into_iter().chain(artifacts(&sample, n_cases));
    let campaigns: Vec<Campaign> = campaigns.collect();
    let n_campaigns = campaigns.len();
    for campaign in campaigns {
        run(campaign, tally, &mut worst);
    }
    let Worst { seconds, megabytes } = worst;
    tally.figure(format!(
        "{n_campaigns} readers; worst {:.0} ms, {megabytes:.0} MB resident",
        1e3 * seconds
    ));
}

#[derive(Default)]
struct Worst {
    seconds: f64,
    megabytes: f64,
}

/// Regressions as they are, then changed copies of them and of the corpus.
fn texts(sample: &Sample, n_cases: usize) -> Vec<Campaign> {
    let campaign = |target: crate::reliability::fuzz_targets::Target| {
        let mut corpus = regressions(target.name);
        let kept = corpus.len();
        corpus.extend(more(target.name, sample));
        assert!(!corpus.is_empty(), "no corpus of {}", target.name);
        let mut dice = Dice::new(6);
        let case = move |n: usize| match corpus.get(n) {
            Some(seed) if n < kept => seed.clone(),
            _ => changed(&mut dice, &corpus, target.words),
        };
        let name = target.name.to_owned();
        Campaign { name, read: target.read, n_cases, case: Box::new(case) }
    };
    TEXTS.into_iter().map(campaign).collect()
}

/// One campaign for each kind of artifact of the small model.
fn artifacts(sample: &Sample, n_cases: usize) -> Vec<Campaign> {
    let campaign = |(name, sound): (&String, &Vec<u8>)| {
        let (mut dice, sound) = (Dice::new(66), sound.clone());
        let case = move |_| changed_artifact(&mut dice, &sound);
        Campaign { name: name.clone(), read: artifact, n_cases, case: Box::new(case) }
    };
    sample.sound.iter().map(campaign).collect()
}

/// Inputs that found a bug once, and small ones to begin with: `tests/fixtures/fuzz/<target>`.
fn regressions(target: &str) -> Vec<Vec<u8>> {
    let folder = crate::root().join("tests/fixtures/fuzz").join(target);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("a corpus file can be read")).collect()
}

/// Corpus that lies elsewhere in the repository, or is made.
fn more(target: &str, sample: &Sample) -> Vec<Vec<u8>> {
    let read = |path: PathBuf| std::fs::read(path).expect("a file of the repository");
    match target {
        "config" => {
            let configs = std::fs::read_dir(crate::root().join("configs")).expect("configs");
            let paths = configs.map(|entry| entry.expect("an entry").path());
            let mut paths: Vec<_> = paths.filter(|path| path.is_file()).collect();
            paths.sort();
            paths.into_iter().map(read).collect()
        }
        "obj" => vec![read(crate::root().join("tests/fixtures/meshes/icosphere_80.obj"))],
        "npz" => {
            let args = ["export", "sound", "--format", "npz", "-o", "fuzz.npz"];
            sample.sandbox.succeeds(&args);
            vec![read(sample.sandbox.path("fuzz.npz"))]
        }
        "journal" => vec![journal()],
        _ => Vec::new(),
    }
}

/// A journal of ten tasks.
fn journal() -> Vec<u8> {
    let store = MemoryStore::new();
    let head = JournalHead { recipe: Key([1; 32]), plan: Key([2; 32]), tasks: 10 };
    let mut journal = Journal::begin(&store, "a.isos", &head).expect("memory takes all");
    for task in 0..10 {
        let entry = JournalEntry { task, rows: 7, note: vec![5; 9 * task as usize] };
        journal.append(&entry).expect("memory takes all");
    }
    let read = store.read_journal("a.isos").expect("memory gives all");
    read.expect("invariant: begun above")
}

/// What a case did.
struct Done {
    bytes: Vec<u8>,
    seconds: f64,
    panic: Option<String>,
}

fn run(campaign: Campaign, tally: &mut Tally, worst: &mut Worst) {
    let Campaign { name, read, n_cases, mut case } = campaign;
    let (sender, receiver) = mpsc::channel();
    // Deep recursion has to fit the stack of a thread, which is smaller than that of `main`.
    let worker = std::thread::spawn(move || {
        for n in 0..n_cases {
            let bytes = case(n);
            if sender.send(Err(bytes.clone())).is_err() {
                return;
            }
            let mut done = tried(read, bytes);
            if done.seconds > SECONDS {
                // The machine may have been busy: the better of two counts.
                done.seconds = done.seconds.min(tried(read, done.bytes.clone()).seconds);
            }
            if sender.send(Ok(done)).is_err() {
                return;
            }
        }
    });
    let mut current = Vec::new();
    loop {
        match receiver.recv_timeout(HANG) {
            Ok(Err(started)) => current = started,
            Ok(Ok(done)) => judge(&name, &done, tally, worst),
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                // The thread is left behind: it cannot be ended.
                return tally.case(&name, Err(format!("no end; {}", kept(&current))));
            }
        }
    }
    worker.join().expect("the cases are caught");
}

fn tried(read: fn(&[u8]), bytes: Vec<u8>) -> Done {
    let start = Instant::now();
    let ended = catch_unwind(AssertUnwindSafe(|| read(&bytes)));
    let seconds = start.elapsed().as_secs_f64();
    let panic = ended.err().map(|payload| {
        let text = payload.downcast_ref::<String>().cloned();
        text.or_else(|| payload.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_default()
    });
    Done { bytes, seconds, panic }
}

fn judge(name: &str, done: &Done, tally: &mut Tally, worst: &mut Worst) {
    let before = worst.megabytes;
    worst.seconds = worst.seconds.max(done.seconds);
    worst.megabytes = worst.megabytes.max(resident_mb(std::process::id()));
    let outcome = if let Some(message) = &done.panic {
        Err(format!("panic {message:?}; {}", kept(&done.bytes)))
    } else if done.seconds > SECONDS {
        Err(format!("{:.1} s; {}", done.seconds, kept(&done.bytes)))
    } else if worst.megabytes > MEGABYTES && before <= MEGABYTES {
        Err(format!("{:.0} MB; {}", worst.megabytes, kept(&done.bytes)))
    } else {
        return tally.passed(1);
    };
    tally.case(name, outcome);
}

/// Keeps a failing input, to become a regression.
fn kept(bytes: &[u8]) -> String {
    let path = std::env::temp_dir().join(format!("isospline-fuzz-{:08x}", crc32fast::hash(bytes)));
    match std::fs::write(&path, bytes) {
        Ok(()) => format!("input in {}", path.display()),
        Err(error) => format!("the input cannot be kept: {error}"),
    }
}
