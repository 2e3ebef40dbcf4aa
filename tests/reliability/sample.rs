//! A small model that passes through every stage, and what an undisturbed run makes of it.

use crate::reliability::process::{Ran, watched};
use crate::{Sandbox, program};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The model file: a sphere of a hundred faces.
const SPHERE: &str = "[model]\nformula = \"x^2 + y^2 + z^2 - r\"\nparameters = { r = 1.0 }\n\
    box = [[-1.1, 1.1], [-1.1, 1.1], [-1.1, 1.1]]\n[target]\nfaces = 100\nfit = \"fast\"\n";

/// Longest that a run of a small model may take on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);

/// Artifacts by name.
pub(crate) type Artifacts = BTreeMap<String, Vec<u8>>;

/// A small model and its sound store.
#[derive(Debug)]
pub(crate) struct Sample {
    pub(crate) sandbox: Sandbox,
    /// The model file.
    pub(crate) model: PathBuf,
    /// The artifacts of an undisturbed run.
    pub(crate) sound: Artifacts,
    /// Wall time of that run.
    pub(crate) seconds: f64,
}

impl Sample {
    /// Runs the small model into `sound`, durably.
    pub(crate) fn new() -> Self {
        Self::of(SPHERE)
    }

    /// Runs a model file into `sound`, durably.
    pub(crate) fn of(text: &str) -> Self {
        let sandbox = Sandbox::new();
        let model = sandbox.write("model.toml", text);
        let mut sample = Self { sandbox, model, sound: Artifacts::new(), seconds: 0.0 };
        let folder = sample.sandbox.path("sound");
        let ran = sample.run(&folder, &[]);
        assert_eq!(ran.outcome.code, 0, "an undisturbed run: {}", ran.told());
        (sample.sound, sample.seconds) = (artifacts(&folder), ran.seconds);
        sample
    }

    /// The command that runs the model into `folder`.
    pub(crate) fn command(&self, folder: &Path, more: &[&str]) -> Command {
        let mut command = Command::new(program());
        self.arguments(&mut command, folder, more);
        command
    }

    /// The same command under another program: its name, its arguments.
    pub(crate) fn command_under(&self, under: &[&str], folder: &Path, more: &[&str]) -> Command {
        let mut command = Command::new(under[0]);
        command.args(&under[1..]).arg(program());
        self.arguments(&mut command, folder, more);
        command
    }

    /// Runs the model into `folder` to its end.
    pub(crate) fn run(&self, folder: &Path, more: &[&str]) -> Ran {
        watched(&mut self.command(folder, more), PATIENCE)
    }

    /// Runs the model into `folder`, which must end well with the artifacts of an undisturbed
    /// run.
    ///
    /// # Errors
    /// What is not so.
    pub(crate) fn resumes(&self, folder: &Path) -> Result<Ran, String> {
        let ran = self.run(folder, &["--json"]);
        if ran.outcome.code != 0 {
            return Err(format!("the run after it: {}", ran.told()));
        }
        self.is_sound(folder)?;
        Ok(ran)
    }

    /// Whether the artifacts in `folder` are those of an undisturbed run.
    ///
    /// # Errors
    /// The first that is not.
    pub(crate) fn is_sound(&self, folder: &Path) -> Result<(), String> {
        differ(&artifacts(folder), &self.sound)
    }

    /// A copy of the sound store.
    pub(crate) fn copy(&self, name: &str) -> PathBuf {
        let copy = self.sandbox.path(name);
        let _ = std::fs::remove_dir_all(&copy);
        copy_folder(&self.sandbox.path("sound"), &copy);
        copy
    }

    fn arguments(&self, command: &mut Command, folder: &Path, more: &[&str]) {
        command.arg("run").arg(&self.model).arg("--out").arg(folder).args(more);
        command.current_dir(self.sandbox.path("")).env("NO_COLOR", "1");
    }
}

/// Every artifact of a folder.
pub(crate) fn artifacts(folder: &Path) -> Artifacts {
    let mut all = Artifacts::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|e| e == "isos") {
            let name = entry.file_name().to_string_lossy().into_owned();
            all.insert(name, std::fs::read(&path).unwrap_or_default());
        }
    }
    all
}

/// The first difference between artifacts found and expected.
///
/// # Errors
/// That difference.
pub(crate) fn differ(found: &Artifacts, expected: &Artifacts) -> Result<(), String> {
    if !found.keys().eq(expected.keys()) {
        let (found, expected): (Vec<_>, Vec<_>) =
            (found.keys().collect(), expected.keys().collect());
        return Err(format!("artifacts {found:?}, not {expected:?}"));
    }
    match found.iter().find(|(name, bytes)| expected[*name] != **bytes) {
        Some((name, _)) => Err(format!("{name} has other bytes")),
        None => Ok(()),
    }
}

/// Copies the files of a folder.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder of the sandbox");
    for entry in std::fs::read_dir(from).expect("a model folder") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), to.join(entry.file_name())).expect("a copy");
    }
}

/// Stages that a run computed, from its `--json` events.
pub(crate) fn computed(stdout: &str) -> Vec<String> {
    stages(stdout, "stage_started")
}

/// Stages that an event of this name tells of, in order.
pub(crate) fn stages(stdout: &str, name: &str) -> Vec<String> {
    events(stdout, name).filter_map(|e| Some(e["stage"].as_str()?.to_owned())).collect()
}

/// Events of a name among the lines of `--json`; a line that was cut off is no event.
pub(crate) fn events<'a>(
    stdout: &'a str,
    name: &'a str,
) -> impl Iterator<Item = serde_json::Value> + 'a {
    let all = stdout.lines().filter_map(|line| serde_json::from_str(line).ok());
    all.filter(move |event: &serde_json::Value| event["event"] == name)
}

/// The stage of an artifact's name.
pub(crate) fn stage_of(artifact: &str) -> &str {
    let stem = artifact.trim_end_matches(".isos");
    stem.split_once('-').expect("invariant: a numbered name").1
}
