//! R8, freshness: what changed decides what runs again, and nothing else does.

#![expect(clippy::disallowed_methods, reason = "stores are touched and edited from outside")]

use crate::reliability::bumped_stage::{STAGES, run_bumped};
use crate::reliability::sample::{Artifacts, Sample, artifacts, computed};
use crate::reliability::{Scale, Tally};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// Other values of keys whose type does not suggest one.
const WORDS: [(&str, &[&str]); 11] = [
    ("model.name", &["other"]),
    ("model.formula", &["x^2 + y^2 + z^2 - r - 0.01"]),
    ("model.box", &["[[-1.2, 1.1], [-1.1, 1.1], [-1.1, 1.1]]"]),
    ("model.inside", &["negative"]),
    ("target.fit", &["full"]),
    ("adapt.improve", &["never"]),
    ("adapt.curves", &["normal"]),
    ("adapt.unfit_faces", &["[[[0.0, 0.0, 1.0]]]"]),
    ("adapt.vertices", &["free"]),
    ("network.method", &["paper"]),
    ("network.paper_faces", &["[[0.0, 0.0, 1.0]]"]),
];

/// Keys that `configs/reference.toml` has as comments, for they have no default, and one that
/// only a model can have. A tolerance, which makes rounds of runs, has tests of its own.
const WITHOUT_DEFAULT: [(&str, &str); 3] =
    [("model.unit", "mm"), ("model.parameters.r", "1.01"), ("check.error", "0.01")];

/// Stages that a key of `[model]` or `[target]` goes to; of a stage's own table, that stage.
const OWNERS: [(&str, &[&str]); 6] = [
    ("model.formula", &STAGES),
    ("model.level", &STAGES),
    ("model.box", &STAGES),
    ("model.parameters.r", &STAGES),
    ("target.faces", &["polygonize", "decimate", "adapt"]),
    ("target.fit", &["decimate", "adapt", "network", "relax"]),
];

/// Stages that the other value of a key leaves out.
const LEFT_OUT: [(&str, &str); 1] = [("network.method", "relax")];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let sample = Sample::new();
    let keys = keys(scale);
    let n_keys = keys.len();
    for (key, values) in keys {
        tally.case(&key, changed(&sample, &key, &values));
    }
    for stage in &STAGES[..scale.of(3, STAGES.len())] {
        tally.case(format!("{stage} of another version"), bumped(&sample, stage));
    }
    tally.case("everything touched", touched(&sample));
    tally.case("the formula edited, size and time as before", edited(&sample));
    tally.case("the base mesh edited, size and time as before", edited_mesh());
    tally.figure(format!("{n_keys} keys, each run's stages exactly those whose inputs changed"));
}

/// Every key of the reference with values to try; at the short scale some of them.
fn keys(scale: Scale) -> Vec<(String, Vec<String>)> {
    let path = crate::config_path("reference");
    let text = std::fs::read_to_string(path).expect("the reference can be read");
    let reference: toml::Table = text.parse().expect("the reference is TOML");
    let mut keys: Vec<(String, Vec<String>)> = Vec::new();
    for (table, content) in &reference {
        for (key, value) in content.as_table().into_iter().flatten() {
            let path = format!("{table}.{key}");
            // Parameters are those of the sample.
            if path != "model.parameters" {
                let values = other_values(&path, value);
                keys.push((path, values));
            }
        }
    }
    let more = WITHOUT_DEFAULT.iter().map(|(k, v)| ((*k).to_owned(), vec![(*v).to_owned()]));
    keys.extend(more);
    let step = scale.of(4, 1);
    keys.into_iter().step_by(step).collect()
}

fn other_values(path: &str, value: &toml::Value) -> Vec<String> {
    if let Some((_, words)) = WORDS.iter().find(|(key, _)| *key == path) {
        return words.iter().map(|word| (*word).to_owned()).collect();
    }
    match value {
        toml::Value::Integer(n) => [n + 1, n - 1, n + 8].map(|n| n.to_string()).to_vec(),
        toml::Value::Float(x) => {
            let others = [x * 0.75, x * 1.25, x + 0.01, x + 1.0].into_iter();
            others
                .filter(|other| other.to_bits() != x.to_bits())
                .map(|other| other.to_string())
                .collect()
        }
        toml::Value::Boolean(b) => vec![(!b).to_string()],
        _ => Vec::new(),
    }
}

/// Runs with another value of a key and holds the stages that ran against those that had to.
fn changed(sample: &Sample, key: &str, values: &[String]) -> Result<(), String> {
    let mut refusals = Vec::new();
    for value in values {
        let store = sample.copy("changed");
        let ran = sample.run(&store, &["--json", "--set", &format!("{key}={value}")]);
        // A check that does not pass is no matter here; a value that is refused is.
        if ran.outcome.code > 1 || ran.outcome.code < 0 {
            refusals.push(format!("{value}: {}", ran.told()));
            continue;
        }
        let table = key.split_once('.').map_or(key, |(table, _)| table);
        let own: &[&str] = STAGES.iter().find(|s| **s == table).map_or(&[], std::slice::from_ref);
        let owners = OWNERS.iter().find(|(k, _)| *k == key).map_or(own, |(_, owners)| owners);
        let left_out: Vec<&str> =
            LEFT_OUT.iter().filter(|(k, _)| *k == key).map(|(_, stage)| *stage).collect();
        return exact(sample, &store, &computed(&ran.outcome.stdout), owners, &left_out);
    }
    Err(format!("no value was taken: {}", refusals.join("; ")))
}

/// Runs with one stage of a higher version.
fn bumped(sample: &Sample, stage: &str) -> Result<(), String> {
    let store = sample.copy("bumped");
    let ran = run_bumped(&sample.model, &store, stage)?;
    exact(sample, &store, &ran, &[stage], &[])
}

/// Whether the stages that ran are `owners` and those of whose inputs one has other rows now.
fn exact(
    sample: &Sample,
    store: &Path,
    ran: &[String],
    owners: &[&str],
    left_out: &[&str],
) -> Result<(), String> {
    let (before, after) = (contents(&sample.sound), contents(&artifacts(store)));
    for stage in STAGES.into_iter().filter(|stage| !left_out.contains(stage)) {
        let inputs = inputs(store, stage)?;
        let input = inputs.iter().find(|input| before.get(*input) != after.get(*input));
        let due = owners.contains(&stage) || input.is_some();
        let did = ran.iter().any(|name| name == stage);
        match (due, did) {
            (true, false) => return Err(format!("{stage} had to run ({input:?}), only {ran:?}")),
            (false, true) => return Err(format!("{stage} ran without need")),
            _ => {}
        }
    }
    Ok(())
}

/// The content key of each stage's artifact: the first bytes of the footer.
fn contents(artifacts: &Artifacts) -> BTreeMap<String, Vec<u8>> {
    let content = |(name, bytes): (&String, &Vec<u8>)| {
        let stem = name.trim_end_matches(".isos");
        let stage = stem.split_once('-').map_or(stem, |(_, stage)| stage);
        let footer = bytes.len().saturating_sub(64);
        (stage.to_owned(), bytes[footer..].iter().take(32).copied().collect())
    };
    artifacts.iter().map(content).collect()
}

/// Stages that a stage reads, from its record.
fn inputs(store: &Path, stage: &str) -> Result<Vec<String>, String> {
    let suffix = format!("-{stage}.json");
    for entry in std::fs::read_dir(store).map_err(|error| error.to_string())?.flatten() {
        if entry.file_name().to_string_lossy().ends_with(&suffix) {
            let text = std::fs::read(entry.path()).map_err(|error| error.to_string())?;
            let record: serde_json::Value =
                serde_json::from_slice(&text).map_err(|error| error.to_string())?;
            let inputs = record["inputs"].as_array().into_iter().flatten();
            let label = |input: &serde_json::Value| input["label"].as_str().map(str::to_owned);
            return Ok(inputs.filter_map(label).collect());
        }
    }
    Err(format!("no record of {stage}"))
}

fn touched(sample: &Sample) -> Result<(), String> {
    let store = sample.copy("touched");
    let now = SystemTime::now();
    for (n, entry) in std::fs::read_dir(&store).into_iter().flatten().flatten().enumerate() {
        // Some become older than all, some younger, in no order.
        let hours = Duration::from_secs(3600 * (n as u64 * 7 % 11));
        set_time(&entry.path(), if n % 2 == 0 { now + hours } else { now - hours });
    }
    set_time(&sample.model, now + Duration::from_hours(24));
    let ran = sample.run(&store, &["--json"]);
    let ran = computed(&ran.outcome.stdout);
    if ran.is_empty() { Ok(()) } else { Err(format!("{ran:?} ran")) }
}

fn edited(sample: &Sample) -> Result<(), String> {
    let store = sample.copy("edited");
    let text = std::fs::read_to_string(&sample.model).map_err(|error| error.to_string())?;
    edit(&sample.model, &text.replace("r = 1.0", "r = 1.1"), &text)?;
    let ran = sample.run(&store, &["--json"]);
    let told = exact(sample, &store, &computed(&ran.outcome.stdout), &STAGES, &[]);
    edit(&sample.model, &text, &text)?;
    told
}

fn edited_mesh() -> Result<(), String> {
    let mesh = crate::root().join("tests/fixtures/meshes/icosphere_80.obj");
    let text = std::fs::read_to_string(mesh).map_err(|error| error.to_string())?;
    let model = "[model]\nformula = \"x^2 + y^2 + z^2 - 1\"\nbase_mesh = \"mesh.obj\"\n\
        box = [[-1.1, 1.1], [-1.1, 1.1], [-1.1, 1.1]]\n";
    let sandbox = crate::Sandbox::new();
    let (path, model) = (sandbox.write("mesh.obj", &text), sandbox.write("model.toml", model));
    let run = || {
        let model = model.display().to_string();
        computed(&sandbox.succeeds(&["run", &model, "--out", "out", "--json"]).stdout)
    };
    run();
    let other = text.replacen("0.5", "0.6", 1);
    edit(&path, &other, &text)?;
    let ran = run();
    let first = ran.first().map(String::as_str);
    if first == Some("import") { Ok(()) } else { Err(format!("{ran:?} ran")) }
}

/// Writes a file of the same size and gives it the time that it had.
fn edit(path: &Path, text: &str, old: &str) -> Result<(), String> {
    let time = std::fs::metadata(path).and_then(|m| m.modified());
    let time = time.map_err(|error| error.to_string())?;
    if text.len() != old.len() {
        return Err("the edit changes the size".to_owned());
    }
    std::fs::write(path, text).map_err(|error| error.to_string())?;
    set_time(path, time);
    Ok(())
}

fn set_time(path: &Path, time: SystemTime) {
    let file = std::fs::File::options().write(true).open(path).expect("a file of the sandbox");
    file.set_modified(time).expect("a time can be set");
}
