//! The command line: commands, options and their help.

use crate::cli::export::{EXPORT_EXAMPLES, ExportArgs};
use crate::cli::habits::{
    COMPLETIONS_EXAMPLES, CompletionsArgs, MAN_EXAMPLES, ManArgs, SCHEMA_EXAMPLES,
};
use crate::cli::lint::{LINT_EXAMPLES, LintArgs};
use crate::cli::render::{RENDER_EXAMPLES, RenderArgs};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Implicit surfaces to watertight G1 triangular spline surfaces.
#[derive(Debug, Parser)]
#[command(name = "isospline", version, about, after_help = EXIT_CODES, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What `--help` says of exit codes; `failure.rs` gives them.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
    0  done; a check passed
    1  a check did not pass
    2  the command line is wrong
    3  of a batch, some models have no surface that passes
    4  of a batch, some runs failed: killed, too long, no room on the disk, a bug
   10  the model file (or a mesh it names) cannot be read
   11  the model file has a bad key or value
   12  the formula cannot be read
   20  the field is not a number somewhere on the surface
   21  the level set is empty
   22  the surface is singular somewhere
   23  the surface leaves the box
   24  the faces are too few for the topology
   25  the surface cannot be converted for another reason
   26  the base mesh cannot be used
   27  the formula lacks x, y or z
   28  the surface has a sharp edge
   29  the field does not change its sign
   30  an artifact is of another version of the program
   31  an artifact is damaged or missing
   32  the folder is in use by another isospline
   33  a file cannot be read or written
   34  memory ran out; what was finished is kept
   70  a bug of isospline
  130  stopped; what was finished is kept";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Convert a model: run every stage that is not fresh, then check the surface
    #[command(after_help = RUN_EXAMPLES)]
    Run(RunArgs),
    /// Convert many models, each in a process of its own; one that fails stops no other
    #[command(after_help = BATCH_EXAMPLES)]
    Batch(BatchArgs),
    /// Write the model file of a model of another program (.jsurf, .vm), to be edited
    #[command(after_help = IMPORT_EXAMPLES)]
    Import(ImportArgs),
    /// Run one stage alone; what it reads must be fresh
    #[command(after_help = STAGE_EXAMPLES)]
    Stage(StageArgs),
    /// Say of every stage of a model folder whether it is fresh, stale (and why), begun or missing
    #[command(after_help = STATUS_EXAMPLES)]
    Status {
        /// The model folder
        dir: PathBuf,
        /// Print one JSON value a stage
        #[arg(long)]
        json: bool,
    },
    /// Print what an artifact holds, finished or not: kind, keys, sections, tasks, counters
    #[command(after_help = INSPECT_EXAMPLES)]
    Inspect {
        /// An artifact (.isos), or what there is of it (.isos.partial)
        file: PathBuf,
        /// Verify the checksums of all rows
        #[arg(long)]
        verify: bool,
    },
    /// Measure a finished surface from outside and hold it against the limits of [check]
    #[command(after_help = CHECK_EXAMPLES)]
    Check(CheckArgs),
    /// Write a finished surface in another format
    #[command(after_help = EXPORT_EXAMPLES)]
    Export(ExportArgs),
    /// Look through the text of an exported STEP file for what CAD programs heal in silence
    #[command(after_help = LINT_EXAMPLES)]
    Lint(LintArgs),
    /// Print the completions of commands and options for a shell
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArgs),
    /// Print the manual page of a command, or write those of all
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArgs),
    /// Print the JSON Schema of model files, for editors
    #[command(after_help = SCHEMA_EXAMPLES)]
    Schema,
    /// Draw a surface as a PNG picture
    #[command(after_help = RENDER_EXAMPLES)]
    Render(RenderArgs),
}

const RUN_EXAMPLES: &str = "\
Examples:
  isospline run configs/deccube.toml
  isospline run configs/torus.toml --set target.faces=1000 --out out/torus_1000
  isospline run --formula \"x^2 + y^2 + z^2 - 1\" --set target.faces=100
  isospline run configs/chair.toml --from network --json
  isospline run configs/deccube.toml --trace deccube.trace.json

The folder is out/<model name>. A second run with nothing changed does nothing; after a change
only the stages that depend on it run again. A run that was stopped or killed in the middle of a
stage goes on there.";

const BATCH_EXAMPLES: &str = "\
Examples:
  isospline batch library
  isospline batch a.toml b.jsurf c.vm --out out/three --set target.faces=1000
  isospline batch library --jobs 4 --timeout 600
  isospline batch library --out out/library --emit slurm

Of a folder, all *.toml, *.jsurf and *.vm in it and below. DIR/summary.jsonl and DIR/summary.csv tell
what became of each model, and why. The same command goes on where a batch was stopped or killed;
models whose outcome is known and whose file is unchanged are not done again.";

const IMPORT_EXAMPLES: &str = "\
Examples:
  isospline import bear.vm
  isospline import kugel.jsurf -o kugel.toml";

const STAGE_EXAMPLES: &str = "\
Examples:
  isospline stage polygonize configs/deccube.toml
  isospline stage network configs/deccube.toml --set network.samples=24";

const STATUS_EXAMPLES: &str = "\
Examples:
  isospline status out/deccube
  isospline status out/deccube --json

On a terminal it is a table; elsewhere a sentence a stage.";

const INSPECT_EXAMPLES: &str = "\
Examples:
  isospline inspect out/deccube/11-fairing.isos
  isospline inspect --verify out/deccube/07-network.isos";

const CHECK_EXAMPLES: &str = "\
Examples:
  isospline check out/deccube
  isospline check out/deccube --json
  isospline check deccube.npz --model configs/deccube.toml

The exit code is 1 if the surface does not pass.";

/// Which model, and how to run it.
#[derive(Debug, Args)]
pub(crate) struct ModelArgs {
    /// The model file
    #[arg(value_name = "MODEL.toml", required_unless_present = "formula")]
    pub(crate) model: Option<PathBuf>,
    /// A formula in x, y, z in place of a model file
    #[arg(long, value_name = "TEXT", conflicts_with = "model", allow_hyphen_values = true)]
    pub(crate) formula: Option<String>,
    /// The model folder; default out/<model name>
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Sets a key of the model file, such as target.faces=2000; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Working threads; default: the processors. The output does not depend on them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
    /// Do not wait for the disk: survives a kill, not a power cut
    #[arg(long)]
    pub(crate) no_sync: bool,
    /// Print events as JSON, one a line
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// Run this stage and all after it even if they are fresh
    #[arg(long, value_name = "STAGE")]
    pub(crate) from: Option<String>,
    /// Compare all rows of fresh artifacts with their checksums too, and make damaged ones again
    #[arg(long)]
    pub(crate) verify: bool,
    /// Write who did what when, in the trace format of Chrome; ui.perfetto.dev opens it
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct BatchArgs {
    /// Model files, and folders of them
    #[arg(value_name = "DIR|FILE", required = true)]
    pub(crate) sources: Vec<PathBuf>,
    /// The folder of the batch; default out/<name of the folder of models>
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Models at work at the same time; default: the processors over --threads
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) jobs: Option<u32>,
    /// Working threads of each; default: the processors over --jobs
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
    /// Go on although the disk is full or no thread can be started
    #[arg(long)]
    pub(crate) keep_going: bool,
    /// End a model that takes longer; default: none is ended
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) timeout: Option<u64>,
    /// Sets a key of all model files, such as target.faces=2000; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Do not wait for the disk: survives a kill, not a power cut
    #[arg(long)]
    pub(crate) no_sync: bool,
    /// Print what became of each model as JSON, one a line
    #[arg(long)]
    pub(crate) json: bool,
    /// Only this model, named as in the summary, with a record of its own; may be repeated
    #[arg(long, value_name = "MODEL")]
    pub(crate) only: Vec<String>,
    /// Write a script that carries out the batch on a cluster, one model a task
    #[arg(long, value_enum, value_name = "SCHEDULER")]
    pub(crate) emit: Option<SchedulerArg>,
}

/// What carries out the tasks of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SchedulerArg {
    /// A job array, for sbatch
    Slurm,
    /// A Snakefile
    Snakemake,
}

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// The foreign file
    pub(crate) file: PathBuf,
    /// The model file; default: standard output
    #[arg(short, long, value_name = "FILE.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the model file if it is there
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct StageArgs {
    /// The stage
    pub(crate) name: String,
    #[command(flatten)]
    pub(crate) model: ModelArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// A model folder, or an .npz export
    pub(crate) path: PathBuf,
    /// The model file of an .npz export
    #[arg(long, value_name = "MODEL.toml")]
    pub(crate) model: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
