//! Command `batch`: many models, each in a process of its own.
//!
//! A panic, a kill or a hang of one run never touches the others. What a run says goes into a file
//! of its own, so nobody has to empty a pipe, and a run whose batch was killed goes on to its end.

mod running;
mod screen;

use crate::cli::args::{BatchArgs, SchedulerArg};
use crate::cli::failure::{Failure, STOPPED};
use crate::cli::interrupt::Interrupt;
use crate::cli::output::{note, say};
use isospline::batch::{
    BatchError, BatchModel, Ending, Outcome, Plan, Record, Scheduler, Summary, find, record_key,
    script, write_part,
};
use isospline_artifact::{Durability, FolderStore, Store, StoreError, write_file_atomic};
use running::{Patience, Running};
use screen::Screen;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Some models have no surface that passes.
const SOME_REFUSED: u8 = 3;
/// Some runs failed for a reason that lies outside of the model.
const SOME_FAILED: u8 = 4;

/// How often runs are looked at: far below the time of the shortest.
const TICK: Duration = Duration::from_millis(5);

/// Converts all models, or writes a script that does.
pub(crate) fn batch(args: &BatchArgs, interrupt: &Interrupt) -> Result<u8, Failure> {
    let out = args.out.clone().unwrap_or_else(|| default_out(&args.sources));
    let models = find(&args.sources, &out)?;
    let work = out.join(".batch");
    std::fs::create_dir_all(&work).map_err(StoreError::io("make", &work))?;
    match args.emit {
        Some(scheduler) => emit(args, scheduler, &out, models),
        None if args.only.is_empty() => whole(args, interrupt, &out, &models),
        None => alone(args, interrupt, &out, &models),
    }
}

fn default_out(sources: &[PathBuf]) -> PathBuf {
    let name = match sources {
        [folder] if folder.is_dir() => folder.canonicalize().ok(),
        _ => None,
    };
    let name = name.as_deref().and_then(Path::file_name);
    PathBuf::from("out").join(name.unwrap_or_else(|| "batch".as_ref()))
}

/// All models that have no record yet.
fn whole(
    args: &BatchArgs,
    interrupt: &Interrupt,
    out: &Path,
    models: &[BatchModel],
) -> Result<u8, Failure> {
    let _lock = FolderStore::new(out.join(".batch"), Durability::Fast).lock()?;
    let keys: BTreeMap<String, String> =
        models.iter().map(|m| (m.name.clone(), record_key(m, &args.overrides))).collect();
    let mut summary = Summary::open(out, &keys)?;
    let todo: VecDeque<BatchModel> =
        models.iter().filter(|m| summary.record(&m.name).is_none()).cloned().collect();
    let mut crew = Crew::new(args, out, &keys, models.len(), todo);
    let done = crew.work(interrupt, &mut |record| Ok(summary.add(record)?));
    // Also of a batch that was stopped or has failed.
    let table = summary.write_table()?;
    if done? == Done::Stopped {
        note(&format!("stopped; the same command goes on; so far: {}", table.display()));
        return Ok(STOPPED);
    }
    let records: Vec<&Record> = models.iter().filter_map(|m| summary.record(&m.name)).collect();
    note(&tally(&records));
    if !args.json {
        say(&table.display().to_string())?;
    }
    Ok(exit_code(&records))
}

/// Models by name, each with a record of its own: tasks of a cluster write no common file.
fn alone(
    args: &BatchArgs,
    interrupt: &Interrupt,
    out: &Path,
    models: &[BatchModel],
) -> Result<u8, Failure> {
    let mut chosen = VecDeque::new();
    for name in &args.only {
        let model = models.iter().find(|model| model.name == *name);
        let model = model.ok_or_else(|| BatchError::NoSuchModel { name: name.clone() })?;
        chosen.push_back(model.clone());
    }
    let keys = chosen.iter().map(|m| (m.name.clone(), record_key(m, &args.overrides))).collect();
    let mut records = Vec::new();
    let done = Crew::new(args, out, &keys, chosen.len(), chosen).work(interrupt, &mut |record| {
        write_part(out, &record)?;
        records.push(record);
        Ok(())
    });
    match done? {
        Done::Stopped => Ok(STOPPED),
        Done::All => Ok(exit_code(&records.iter().collect::<Vec<_>>())),
    }
}

fn emit(
    args: &BatchArgs,
    scheduler: SchedulerArg,
    out: &Path,
    models: Vec<BatchModel>,
) -> Result<u8, Failure> {
    let scheduler = match scheduler {
        SchedulerArg::Slurm => Scheduler::Slurm,
        SchedulerArg::Snakemake => Scheduler::Snakemake,
    };
    let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
    let mut arguments = Vec::new();
    for text in &args.overrides {
        arguments.extend(["--set".to_owned(), text.clone()]);
    }
    if let Some(seconds) = args.timeout {
        arguments.extend(["--timeout".to_owned(), seconds.to_string()]);
    }
    arguments.extend(args.no_sync.then(|| "--no-sync".to_owned()));
    let plan = Plan {
        program: program()?,
        sources: args.sources.iter().map(absolute).collect(),
        out: absolute(&out.to_owned()),
        arguments,
        threads: args.threads.unwrap_or(1),
        models,
    };
    let path = out.join(scheduler.file_name());
    let text = script(scheduler, &plan);
    write_file_atomic(&path, Durability::Durable, |file| file.write_all(text.as_bytes()))?;
    say(&path.display().to_string())?;
    Ok(0)
}

fn program() -> Result<PathBuf, Failure> {
    std::env::current_exe()
        .map_err(|error| Failure::io(format!("cannot tell where this program is: {error}")))
}

/// How a batch ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Done {
    All,
    Stopped,
}

/// Runs at work, and models that wait for one.
struct Crew<'a> {
    args: &'a BatchArgs,
    out: &'a Path,
    keys: &'a BTreeMap<String, String>,
    jobs: usize,
    threads: u32,
    todo: VecDeque<(BatchModel, Patience)>,
    running: Vec<Running>,
    screen: Screen,
}

impl<'a> Crew<'a> {
    fn new(
        args: &'a BatchArgs,
        out: &'a Path,
        keys: &'a BTreeMap<String, String>,
        n_models: usize,
        todo: VecDeque<BatchModel>,
    ) -> Self {
        let processors = std::thread::available_parallelism().map_or(1, |n| n.get() as u32);
        let jobs = args.jobs.unwrap_or_else(|| (processors / args.threads.unwrap_or(1)).max(1));
        let threads = args.threads.unwrap_or_else(|| (processors / jobs).max(1));
        let screen = Screen::new(args.json, n_models, n_models - todo.len());
        let todo = todo.into_iter().map(|model| (model, Patience::default())).collect();
        let (jobs, running) = (jobs as usize, Vec::new());
        Self { args, out, keys, jobs, threads, todo, running, screen }
    }

    /// Runs all models; `keep` takes each record as it comes.
    fn work(
        &mut self,
        interrupt: &Interrupt,
        keep: &mut dyn FnMut(Record) -> Result<(), Failure>,
    ) -> Result<Done, Failure> {
        let done = interrupt.heard_by(|stop| self.work_until(stop, keep));
        self.screen.end();
        done
    }

    fn work_until(
        &mut self,
        stop: &AtomicBool,
        keep: &mut dyn FnMut(Record) -> Result<(), Failure>,
    ) -> Result<Done, Failure> {
        let mut end = Ok(Done::All);
        loop {
            if stop.load(Ordering::SeqCst) && end.is_ok() {
                end = Ok(Done::Stopped);
                self.todo.clear();
            }
            self.start()?;
            for record in self.ended()? {
                self.screen.tell(&record)?;
                let trouble = (!self.args.keep_going).then(|| trouble_for_all(&record)).flatten();
                keep(record)?;
                if let Some(trouble) = trouble {
                    end = Err(trouble);
                    self.todo.clear();
                }
            }
            if self.todo.is_empty() && self.running.is_empty() {
                return end;
            }
            self.screen.show(&mut self.running);
            std::thread::sleep(TICK);
        }
    }

    /// Starts runs while there is room.
    fn start(&mut self) -> Result<(), Failure> {
        let mut waiting = VecDeque::new();
        while self.running.len() < self.jobs
            && let Some((model, patience)) = self.todo.pop_front()
        {
            if patience.is_over() {
                let (args, threads) = (self.args, self.threads);
                self.running.push(Running::start(args, self.out, model, threads)?);
            } else {
                waiting.push_back((model, patience));
            }
        }
        self.todo.extend(waiting);
        Ok(())
    }

    /// The records of runs that have ended.
    fn ended(&mut self) -> Result<Vec<Record>, Failure> {
        let mut records = Vec::new();
        let mut k = 0;
        while k < self.running.len() {
            let Some(ending) = self.running[k].ending(self.args.timeout)? else {
                k += 1;
                continue;
            };
            let run = self.running.remove(k);
            match ending {
                // Ctrl-C reached the run too: it is not over, the next batch goes on with it.
                Ending::Exit(code) if code == i32::from(STOPPED) => {}
                Ending::Exit(code) if code == i32::from(crate::cli::failure::LOCKED) => {
                    // A run that outlived its batch is at it: what it makes will be fresh.
                    self.todo.push_back((run.model, Patience::again()));
                }
                _ => records.push(run.record(self.keys, ending)),
            }
        }
        Ok(records)
    }
}

/// A reason that the next models would meet as well: the disk is full, no process can be started.
fn trouble_for_all(record: &Record) -> Option<Failure> {
    let is_common = ["input-output", "threads"].contains(&record.reason.as_str());
    is_common.then(|| {
        Failure::io(format!("{}: {}", record.model, record.sentence))
            .helped("the same command goes on; --keep-going does not stop for it")
    })
}

fn tally(records: &[&Record]) -> String {
    let kinds = [Outcome::Converted, Outcome::NotPassed, Outcome::Refused, Outcome::Failed];
    let count = |kind: Outcome| records.iter().filter(|r| r.outcome == kind).count();
    let told: Vec<String> =
        kinds.iter().map(|&kind| format!("{} {}", count(kind), kind.word())).collect();
    format!("{} models: {}", records.len(), told.join(", "))
}

fn exit_code(records: &[&Record]) -> u8 {
    match records.iter().map(|record| record.outcome).max() {
        None | Some(Outcome::Converted) => 0,
        Some(Outcome::NotPassed | Outcome::Refused) => SOME_REFUSED,
        Some(Outcome::Failed) => SOME_FAILED,
    }
}
