//! `configs/reference.toml` lists every key with its default, and every model file is valid.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline::config::{Document, ModelFile, StageParams};
use isospline_tests::{config_path, root};
use std::collections::BTreeSet;

fn reference() -> String {
    std::fs::read_to_string(config_path("reference")).unwrap()
}

fn read(text: &str) -> ModelFile {
    ModelFile::from_document(&Document::parse("reference.toml", text).unwrap()).unwrap()
}

/// Dotted paths of all keys and tables of a text.
fn paths(table: &toml::Table, above: &str, found: &mut BTreeSet<String>) {
    for (key, value) in table {
        let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        if let Some(inner) = value.as_table() {
            paths(inner, &path, found);
        }
        found.insert(path);
    }
}

#[test]
fn the_reference_states_the_defaults() {
    let stated = read(&reference());
    let bare = "[model]\nname = \"reference\"\nformula = \"x^2 + y^2 + z^2 - 1\"\n";
    assert_eq!(stated, read(bare));
}

#[test]
fn the_reference_has_every_key_that_the_canonical_file_writes() {
    // Of these one is given: the others take its place in turn.
    for target in ["faces", "tolerance", "tolerance_abs"] {
        has_every_key_with(target);
    }
}

fn has_every_key_with(target: &str) {
    // Keys without a default are commented out: bring them in, at the values that stand there.
    let mut text = reference().replace("\nfaces = ", "\n# faces = ");
    for key in ["base_mesh", "unit", "error", target] {
        let commented = format!("\n# {key} = ");
        assert_eq!(text.matches(&commented).count(), 1, "{key}");
        text = text.replace(&commented, &format!("\n{key} = "));
    }
    let (mut listed, mut written) = (BTreeSet::new(), BTreeSet::new());
    paths(&text.parse().unwrap(), "", &mut listed);
    paths(&read(&text).to_toml().parse().unwrap(), "", &mut written);
    let stages: BTreeSet<String> = StageParams::NAMES.iter().map(|s| (*s).to_owned()).collect();
    written.extend(stages);
    assert_eq!(listed, written);
}

#[test]
fn every_key_of_the_reference_is_explained_above_it() {
    let text = reference();
    let lines: Vec<&str> = text.lines().collect();
    for (k, line) in lines.iter().enumerate() {
        let is_key = line.contains(" = ") && !line.starts_with("# Named");
        let explained = k > 0 && lines[k - 1].starts_with("# ");
        assert!(!is_key || explained, "line {}: {line}", k + 1);
    }
}

#[test]
fn every_model_file_is_valid() {
    let mut n_files = 0;
    for entry in std::fs::read_dir(root().join("configs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let file = ModelFile::open(&path, &[]).unwrap();
            assert_eq!(Some(file.model.name.as_str()), path.file_stem().unwrap().to_str());
            assert!(file.model.base_mesh.is_none_or(|mesh| mesh.is_file()), "{path:?}");
            n_files += 1;
        }
    }
    assert!(n_files >= 11, "{n_files}");
}
