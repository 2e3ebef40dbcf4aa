//! A batch as a script for a cluster: a job array of Slurm, or a Snakefile.
//!
//! Each task runs the program on one model. A task that is killed and begun again goes on where it
//! was, and one that has ended before does nothing, so all of them may be requeued at any time.

use crate::batch::BatchModel;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What carries the tasks out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheduler {
    /// `sbatch`
    Slurm,
    /// `snakemake`
    Snakemake,
}

impl Scheduler {
    /// The usual name of its script.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Slurm => "batch.slurm",
            Self::Snakemake => "Snakefile",
        }
    }
}

/// A batch, to be carried out elsewhere. All paths are absolute.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The program.
    pub program: PathBuf,
    /// Files and folders of models.
    pub sources: Vec<PathBuf>,
    /// Folder of the batch.
    pub out: PathBuf,
    /// More arguments of every run, such as `--set` and what it sets.
    pub arguments: Vec<String>,
    /// Threads a task.
    pub threads: u32,
    /// The models.
    pub models: Vec<BatchModel>,
}

/// Tasks of an array: a usual limit of Slurm is 1001. More models than that share tasks.
const MOST_TASKS: usize = 1000;

/// The script.
pub fn script(scheduler: Scheduler, plan: &Plan) -> String {
    match scheduler {
        Scheduler::Slurm => slurm(plan),
        Scheduler::Snakemake => snakefile(plan),
    }
}

impl Plan {
    /// The command that carries out the whole batch, quoted for a shell.
    fn command(&self) -> String {
        let mut words = vec![shell_path(&self.program), "batch".to_owned()];
        words.extend(self.sources.iter().map(|path| shell_path(path)));
        words.extend(["--out".to_owned(), shell_path(&self.out)]);
        words.extend(self.arguments.iter().map(|argument| shell(argument)));
        words.join(" ")
    }
}

fn slurm(plan: &Plan) -> String {
    let (command, n_models) = (plan.command(), plan.models.len());
    let n_tasks = n_models.min(MOST_TASKS);
    let (last, threads) = (n_tasks - 1, plan.threads);
    let log = plan.out.join(".batch/slurm-%a.log");
    let mut models = String::new();
    for model in &plan.models {
        writeln!(models, "  {}", shell(&model.name)).expect("invariant: a string takes all text");
    }
    format!(
        "#!/bin/bash\n\
         # {n_models} models, one a task of a job array. Submit it with sbatch. When the array has\n\
         # ended, this collects what became of the models, and does what may be missing:\n\
         #   {command}\n\
         #SBATCH --job-name=isospline\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --cpus-per-task={threads}\n\
         #SBATCH --requeue\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --output=\"{}\"\n\
         models=(\n{models})\n\
         status=0\n\
         for ((i = SLURM_ARRAY_TASK_ID; i < ${{#models[@]}}; i += {n_tasks})); do\n  \
         {command} --jobs 1 --threads \"${{SLURM_CPUS_PER_TASK:-{threads}}}\" --only \"${{models[i]}}\"\n  \
         code=$?\n  \
         # 3: the model was refused, which is a result.\n  \
         if ((code != 0 && code != 3)); then status=$code; fi\n\
         done\n\
         exit $status\n",
        log.display(),
    )
}

fn snakefile(plan: &Plan) -> String {
    let (command, threads) = (braced(&plan.command()), plan.threads);
    let out = python(&plan.out.display().to_string());
    let mut models = String::new();
    for model in &plan.models {
        let (folder, name) = (python(&model.folder), python(&model.name));
        writeln!(models, "    {folder}: {name},").expect("invariant: a string takes all text");
    }
    // 3: the model was refused, which is a result.
    let one = python(&format!(
        "{command} --jobs 1 --threads {{threads}} --only {{params.model:q}} || [ $? -eq 3 ]"
    ));
    let all = python(&format!("{command} || [ $? -eq 3 ]"));
    format!(
        "# Run with: snakemake --snakefile THIS_FILE --cores N, or with a profile of a cluster.\n\
         OUT = {out}\n\
         MODELS = {{\n{models}}}\n\n\n\
         rule all:\n    input:\n        OUT + \"/summary.csv\",\n\n\n\
         rule convert:\n    output:\n        OUT + \"/.batch/parts/{{folder}}.jsonl\",\n    \
         wildcard_constraints:\n        folder=\".+\",\n    \
         params:\n        model=lambda wildcards: MODELS[wildcards.folder],\n    \
         threads: {threads}\n    retries: 2\n    shell:\n        {one}\n\n\n\
         rule summary:\n    input:\n        \
         [OUT + \"/.batch/parts/\" + folder + \".jsonl\" for folder in MODELS],\n    \
         output:\n        OUT + \"/summary.csv\",\n    shell:\n        {all}\n"
    )
}

fn shell_path(path: &Path) -> String {
    shell(&path.display().to_string())
}

/// A word of a shell command.
fn shell(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+:,@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// A text of Python: that of JSON is one.
fn python(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Braces that Snakemake leaves alone.
fn braced(text: &str) -> String {
    text.replace('{', "{{").replace('}', "}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(n_models: usize) -> Plan {
        let model = |k: usize| BatchModel {
            name: format!("it's {k}.vm"),
            path: PathBuf::new(),
            folder: format!("{{{k}}}"),
        };
        Plan {
            program: PathBuf::from("/bin/iso spline"),
            sources: vec![PathBuf::from("/lib")],
            out: PathBuf::from("/out"),
            arguments: vec!["--set".into(), "model.formula=x & y".into()],
            threads: 2,
            models: (0..n_models).map(model).collect(),
        }
    }

    #[test]
    fn an_array_has_a_task_a_model_up_to_the_limit() {
        assert!(slurm(&plan(45)).contains("#SBATCH --array=0-44\n"));
        let many = slurm(&plan(2500));
        assert!(many.contains("#SBATCH --array=0-999\n") && many.contains("i += 1000)"), "{many}");
    }

    #[test]
    fn what_a_shell_would_take_apart_is_quoted() {
        let text = slurm(&plan(2));
        assert!(text.contains(r"'/bin/iso spline' batch /lib --out /out"), "{text}");
        assert!(text.contains(r"'it'\''s 1.vm'") && text.contains("'model.formula=x & y'"));
    }

    #[test]
    fn a_snakefile_doubles_the_braces_of_its_paths_only_where_they_are_replaced() {
        let mut plan = plan(2);
        plan.out = PathBuf::from("/o{u}t");
        let text = snakefile(&plan);
        assert!(text.contains("OUT = \"/o{u}t\"") && text.contains("--out '/o{{u}}t'"), "{text}");
        assert!(text.contains("    \"{1}\": \"it's 1.vm\",\n"), "{text}");
    }
}
