//! The text of the program keeps its own rules: layers, sizes, comments, citations.

use isospline_tests::root;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Lines a file may have.
const LONGEST_FILE: usize = 600;

/// Crates by layer, lowest first; a crate uses lower layers only.
const LAYERS: [&[&str]; 5] = [
    &["geometry"],
    &["implicit", "artifact"],
    &["fitting"],
    &["stage"],
    &["pipeline", "check", "export", "render"],
];

/// Lower crates that a crate must not use although its layer would let it.
const FORBIDDEN: [(&str, &[&str]); 3] = [
    ("check", &["fitting", "stage"]),
    ("export", &["fitting", "stage"]),
    ("render", &["fitting", "stage"]),
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

fn rust_files() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for folder in ["src", "stages", "tests"] {
        files(&root().join(folder), &mut found);
    }
    found.retain(|path| path.extension().is_some_and(|e| e == "rs"));
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        (path.strip_prefix(root()).expect("below the root").display().to_string(), text)
    };
    let all: Vec<_> = found.into_iter().map(read).collect();
    assert!(all.len() > 60, "only {} files found: the search is broken", all.len());
    all
}

/// Manifests of `src/*` and `stages/*`: folder name, place, parsed text.
fn manifests() -> Vec<(String, &'static str, toml::Table)> {
    let mut all = Vec::new();
    for place in ["src", "stages"] {
        for entry in std::fs::read_dir(root().join(place)).expect("a folder") {
            let folder = entry.expect("an entry").path();
            let text = std::fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
            let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
            all.push((name, place, text.parse().expect("a manifest is TOML")));
        }
    }
    assert!(all.len() >= 20, "only {} manifests found", all.len());
    all
}

/// Folder names of the crates of this workspace that a manifest's table names.
fn own(manifest: &toml::Table, table: &str) -> Vec<String> {
    let keys = manifest.get(table).and_then(toml::Value::as_table);
    let names = keys.into_iter().flat_map(toml::Table::keys);
    names.filter_map(|n| n.strip_prefix("isospline-")).map(|n| n.replace('-', "_")).collect()
}

fn layer(name: &str, place: &str) -> usize {
    let of_src = LAYERS.iter().position(|names| names.contains(&name));
    match (place, of_src) {
        ("stages", _) => LAYERS.len() - 1,
        (_, Some(layer)) => layer,
        ("src", None) if name == "isospline" => LAYERS.len(),
        _ => panic!("{place}/{name} is in no layer"),
    }
}

#[test]
fn crates_use_lower_layers_only() {
    let manifests = manifests();
    let layers: BTreeMap<String, usize> =
        manifests.iter().map(|(name, place, _)| (name.clone(), layer(name, place))).collect();
    for (name, place, manifest) in &manifests {
        for table in ["dependencies", "dev-dependencies"] {
            for used in own(manifest, table) {
                let below = layers[&used] < layers[name];
                // The contract suite and the oracles of tests may come from above.
                assert!(below || table == "dev-dependencies", "{place}/{name} uses {used}");
            }
        }
    }
}

#[test]
fn no_stage_uses_another_not_even_in_tests() {
    let manifests = manifests();
    let stages: Vec<&String> =
        manifests.iter().filter(|m| m.1 == "stages").map(|(name, ..)| name).collect();
    for (name, _, manifest) in manifests.iter().filter(|m| m.1 == "stages") {
        let used = own(manifest, "dependencies");
        let sideways: Vec<_> = used.iter().filter(|u| stages.contains(u)).collect();
        assert!(sideways.is_empty(), "stages/{name} uses {sideways:?}");
    }
}

#[test]
fn checker_and_exports_share_only_mesh_and_file_types() {
    for (name, _, manifest) in manifests() {
        for (_, forbidden) in FORBIDDEN.iter().filter(|(crate_name, _)| *crate_name == name) {
            let used = own(&manifest, "dependencies");
            assert!(used.iter().all(|u| !forbidden.contains(&u.as_str())), "{name}: {used:?}");
        }
    }
}

#[test]
fn only_pipeline_names_thread_libraries() {
    for (name, _, manifest) in manifests() {
        let table = manifest.get("dependencies").and_then(toml::Value::as_table);
        let named = table.is_some_and(|t| t.contains_key("rayon") || t.contains_key("crossbeam"));
        assert!(!named || name == "pipeline", "{name} names a thread library");
    }
}

#[test]
fn unsafe_code_stands_in_artifact_and_implicit_only() {
    for (path, text) in rust_files() {
        let allowed = path.starts_with("src/artifact") || path.starts_with("src/implicit");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let found = code.filter(|line| line.contains(concat!("unsa", "fe "))).count();
        assert!(allowed || found == 0, "{path}");
    }
}

#[test]
fn every_file_opens_with_what_it_is_and_is_short() {
    for (path, text) in rust_files() {
        assert!(text.starts_with("//! "), "{path} has no module documentation");
        let n_lines = text.lines().count();
        assert!(n_lines <= LONGEST_FILE, "{path} has {n_lines} lines");
    }
}

#[test]
fn nothing_is_left_for_later() {
    let marks = [
        concat!("TO", "DO"),
        concat!("FIX", "ME"),
        concat!("todo", "!("),
        concat!("unimplemented", "!("),
    ];
    for (path, text) in rust_files() {
        for mark in marks {
            assert!(!text.contains(mark), "{path} contains {mark}");
        }
    }
}

#[test]
fn drawers_have_no_place() {
    for (path, _) in rust_files() {
        let stem = Path::new(&path).file_stem().expect("a name").to_string_lossy().into_owned();
        let drawer = ["utils", "common", "helpers", "types", "misc"].contains(&stem.as_str());
        assert!(!drawer, "{path}");
    }
}

#[test]
fn cited_keys_stand_in_the_references() {
    let references = std::fs::read_to_string(root().join("REFERENCES.md")).expect("REFERENCES.md");
    let mut n_citations = 0;
    for (path, text) in rust_files() {
        for key in citations(&text) {
            n_citations += 1;
            assert!(references.contains(&format!("**{key}**")), "{path} cites [{key}]");
        }
    }
    assert!(n_citations > 10, "only {n_citations} citations found: the search is broken");
}

/// Keys such as `TK` and `PV04` in comments: brackets, capitals, perhaps a year, perhaps a place.
fn citations(text: &str) -> Vec<String> {
    let comments = text.lines().filter_map(|line| Some(line.split_once("//")?.1));
    let mut keys = Vec::new();
    for comment in comments {
        // Every second part stands between backticks and is code.
        let comment: String = comment.split('`').step_by(2).collect();
        for inner in comment.split('[').skip(1).filter_map(|rest| Some(rest.split_once(']')?.0)) {
            let key = inner.split([',', ';']).next().expect("invariant: split yields a part");
            let letters = key.trim_end_matches(|c: char| c.is_ascii_digit());
            let is_key = (2..=4).contains(&letters.len())
                && letters.chars().all(|c| c.is_ascii_uppercase())
                && key.len() - letters.len() <= 2;
            if is_key {
                keys.push(key.to_owned());
            }
        }
    }
    keys
}

#[test]
fn a_citation_is_told_from_an_index() {
    let comment = concat!("/", "/");
    let text = format!(
        "{comment} [TK, Eq. (9)], [PV04]\n{comment} not [P,Q], `[n][AB]` nor [`X`]\na = b[AB]"
    );
    assert_eq!(citations(&text), ["TK", "PV04"]);
}
