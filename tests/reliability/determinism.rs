//! R7, determinism: threads, instruction sets, places; the bytes are the same.

use crate::reliability::sample::{Artifacts, Sample, artifacts, copy_folder, differ};
use crate::reliability::{Scale, Tally};
use crate::{Sandbox, config_path, program};
use isospline::config::ModelFile;
use isospline::{Model, ModelFolder};
use isospline_artifact::Durability;
use isospline_implicit::InstructionSet;
use isospline_pipeline::RunOptions;
use std::path::Path;
use std::process::Command;

/// Models, and the overrides that keep them small.
const MODELS: [(&str, &str); 4] = [
    ("torus", "target.faces=600"),
    ("deccube", "target.fit=fast"),
    ("double_torus", "target.faces=1800"),
    ("sphere_320", "check.gap=1e-14"),
];

/// What the evaluators are compiled for.
const SETS: [(&str, InstructionSet); 3] = [
    ("SSE2", InstructionSet::Plain),
    ("AVX2", InstructionSet::Avx2),
    ("AVX-512", InstructionSet::Avx512),
];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let mut bytes = 0;
    for (model, set) in &MODELS[..scale.of(1, MODELS.len())] {
        let sandbox = Sandbox::new();
        let expected = match made(&sandbox, model, set, "1") {
            Ok(expected) => expected,
            Err(reason) => {
                tally.case(format!("{model}, 1 thread"), Err(reason));
                continue;
            }
        };
        bytes += expected.values().map(Vec::len).sum::<usize>();
        for threads in ["2", "3", "8"] {
            let same =
                made(&sandbox, model, set, threads).and_then(|found| differ(&found, &expected));
            tally.case(format!("{model}, {threads} threads"), same);
        }
        for (name, instructions) in SETS {
            if !instructions.is_there() {
                tally.skip(name, "this processor has none");
                continue;
            }
            let same = in_process(&sandbox.path(name), model, set, instructions)
                .and_then(|found| differ(&found, &expected));
            tally.case(format!("{model}, {name}"), same);
        }
    }
    moved(tally);
    tally.figure(format!(
        "threads 1, 2, 3, 8; SSE2, AVX2, AVX-512; moved; {bytes} bytes compared each"
    ));
}

/// Artifacts of a run on so many threads.
fn made(sandbox: &Sandbox, model: &str, set: &str, threads: &str) -> Result<Artifacts, String> {
    let out = format!("threads-{threads}");
    let config = config_path(model);
    let args = ["run", &config, "--out", &out, "--no-sync", "--set", set, "--threads", threads];
    let outcome = sandbox.isospline(&args);
    if outcome.code != 0 {
        return Err(format!("exit {}: {}", outcome.code, outcome.stderr));
    }
    Ok(artifacts(&sandbox.path(&out)))
}

/// Artifacts of a run in this process, with the evaluators of one instruction set.
fn in_process(
    out: &Path,
    model: &str,
    set: &str,
    instructions: InstructionSet,
) -> Result<Artifacts, String> {
    isospline_implicit::use_at_most(instructions);
    let ran = || -> Result<(), String> {
        let file = ModelFile::open(config_path(model).as_ref(), &[set.to_owned()]);
        let model = Model::new(file.map_err(|error| error.to_string())?);
        let model = model.map_err(|error| error.to_string())?;
        let folder = ModelFolder::new(model, out, Durability::Fast);
        let report = folder.run(&RunOptions::default(), &|_| ());
        report.map(drop).map_err(|error| error.to_string())
    };
    let ran = ran();
    isospline_implicit::use_at_most(InstructionSet::Avx512);
    ran.map(|()| artifacts(out))
}

/// A store that was moved is fresh, and what is missing in it is made again in the same bytes.
fn moved(tally: &mut Tally) {
    let sample = Sample::new();
    let there = Sandbox::new();
    let store = there.path("a moved store");
    copy_folder(&sample.sandbox.path("sound"), &store);
    let ran = sample.run(&store, &[]);
    let idle = ran.outcome.code == 0 && ran.outcome.stdout.contains("nothing to do");
    tally.case("moved, all fresh", if idle { Ok(()) } else { Err(ran.told()) });
    for name in sample.sound.keys() {
        let removed = std::fs::remove_file(store.join(name)).map_err(|error| error.to_string());
        let same = removed.and_then(|()| sample.resumes(&store)).map(drop);
        tally.case(format!("moved, without {name}"), same);
    }
    // The store alone is enough to check it, for it holds its model.
    let mut check = Command::new(program());
    let ran = check.arg("check").arg(&store).output().expect("the program starts");
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    tally.case("moved, checked", if ran.status.success() { Ok(()) } else { Err(said) });
}
