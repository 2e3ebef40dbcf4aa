//! What the tests share: the built program, a folder of its own, model files.

pub mod reliability;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("invariant: this crate has a parent")
}

/// Arguments for the fit of the paper: for tests that are not about how near the patches come.
pub const PAPER_FIT: [&str; 2] = ["--set", "target.fit=paper"];

/// A folder that is removed at the end, in which the program is run.
#[derive(Debug)]
pub struct Sandbox {
    folder: TempDir,
}

/// What a run of the program left.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Exit code; -1 if a signal ended it.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Default for Sandbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Sandbox {
    /// An empty folder.
    ///
    /// # Panics
    /// If the system gives none.
    pub fn new() -> Self {
        Self { folder: TempDir::new().expect("a temporary folder") }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    ///
    /// # Panics
    /// If that fails.
    #[expect(clippy::disallowed_methods, reason = "a test's input needs no commit")]
    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).expect("the sandbox can be written");
        path
    }

    /// The program, to be run in the folder.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(program());
        command.args(args).current_dir(self.folder.path()).env("NO_COLOR", "1");
        command
    }

    /// Runs the program in the folder.
    ///
    /// # Panics
    /// If it cannot be built or started.
    pub fn isospline(&self, args: &[&str]) -> Outcome {
        let output = self.command(args).output().expect("the program starts");
        Outcome {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Runs the program, which has to exit with 0.
    ///
    /// # Panics
    /// If it exits otherwise, with all it said.
    pub fn succeeds(&self, args: &[&str]) -> Outcome {
        let outcome = self.isospline(args);
        assert_eq!(outcome.code, 0, "{args:?}\n{}\n{}", outcome.stdout, outcome.stderr);
        outcome
    }

    /// Converts a model of the repository's `configs` into `out`, with more arguments; fitted as in
    /// the paper, which takes a tenth of the time, unless they set the fit.
    ///
    /// # Panics
    /// If that does not succeed.
    pub fn converts(&self, config: &str, more: &[&str]) -> Outcome {
        let path = config_path(config);
        let mut args = vec!["run", path.as_str(), "--out", "out", "--no-sync"];
        if !more.iter().any(|arg| arg.contains("fit=") || arg.contains("method=")) {
            args.extend(PAPER_FIT);
        }
        args.extend(more);
        self.succeeds(&args)
    }

    /// The figures of `check --json` on `out`, whether it passes or not.
    ///
    /// # Panics
    /// If there are none.
    pub fn checked(&self) -> serde_json::Value {
        let outcome = self.isospline(&["check", "out", "--json"]);
        serde_json::from_str(&outcome.stdout).unwrap_or_else(|_| panic!("{outcome:?}"))
    }

    /// Every artifact in `out`, by name, with its bytes.
    ///
    /// # Panics
    /// If the folder cannot be read.
    pub fn artifacts(&self) -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(self.path("out")).expect("a model folder");
        let mut all: Vec<(String, Vec<u8>)> = entries
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path.extension().is_some_and(|e| e == "isos"))
            .map(|path| {
                let name = path.file_name().expect("a name").to_string_lossy().into_owned();
                (name, std::fs::read(&path).expect("a readable file"))
            })
            .collect();
        all.sort();
        all
    }
}

/// The path of a file in `configs`.
pub fn config_path(name: &str) -> String {
    root().join("configs").join(format!("{name}.toml")).display().to_string()
}

/// A number of a report.
///
/// # Panics
/// If it is not there.
pub fn number(report: &serde_json::Value, name: &str) -> f64 {
    report[name].as_f64().unwrap_or_else(|| panic!("{name} is {}", report[name]))
}

/// The built program, brought up to date first: a stale one would make tests pass or fail for
/// code that is not there.
///
/// # Panics
/// If it does not build.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // .../target/<profile>/deps/<test>, or .../target/<profile>/<binary>
        let test = std::env::current_exe().expect("a test has a path");
        let folder = test.parent().expect("a program lies in a folder");
        let above = folder.parent().filter(|_| folder.ends_with("deps"));
        let profile = above.unwrap_or(folder);
        let target = profile.parent().expect("a target folder");
        let release = profile.ends_with("release");
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["build", "--quiet", "--package", "isospline", "--bin", "isospline"]);
        cargo.args(release.then_some("--release")).arg("--target-dir").arg(target);
        let status = cargo.current_dir(root()).status().expect("cargo starts");
        assert!(status.success(), "the program does not build");
        profile.join(format!("isospline{}", std::env::consts::EXE_SUFFIX))
    })
}
