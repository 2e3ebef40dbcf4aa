//! Files and folders become models, each with a name and a folder of its own.

use crate::batch::BatchError;
use isospline_implicit::ForeignFormat;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// A model of a batch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchModel {
    /// What tells it from the others: its path below the folder that was given, with `/`.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// Its folder, below that of the batch.
    pub folder: String,
}

/// The models in `sources`, files and folders, in the order of their names.
///
/// Of a folder, all files `*.toml`, `*.jsurf` and `*.vm` in it and below; hidden files and `out`
/// are passed over. A file that is named is taken whatever it is called. Names and folders depend
/// on the set of models alone.
///
/// # Errors
/// [`BatchError::Source`], [`BatchError::NoModels`].
pub fn find(sources: &[PathBuf], out: &Path) -> Result<Vec<BatchModel>, BatchError> {
    let out = out.canonicalize().ok();
    let mut found = BTreeMap::new();
    for source in sources {
        let unreadable = |error| BatchError::Source { path: source.clone(), source: error };
        if std::fs::metadata(source).map_err(unreadable)?.is_dir() {
            let mut below = Vec::new();
            walk(source, out.as_deref(), &mut below)?;
            for path in below {
                let name = path.strip_prefix(source).unwrap_or(&path).to_owned();
                found.entry(path).or_insert(name);
            }
        } else {
            let name = source.file_name().map_or_else(|| source.clone(), PathBuf::from);
            found.entry(source.clone()).or_insert(name);
        }
    }
    if found.is_empty() {
        let path = sources.first().cloned().unwrap_or_default();
        return Err(BatchError::NoModels { path });
    }
    Ok(named(&found))
}

fn walk(folder: &Path, out: Option<&Path>, found: &mut Vec<PathBuf>) -> Result<(), BatchError> {
    let unreadable = |source| BatchError::Source { path: folder.to_owned(), source };
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let path = entry.path();
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        // Links to folders are not followed: they may lead in a circle.
        if entry.file_type().map_err(unreadable)?.is_dir() {
            let is_out = out.is_some_and(|out| path.canonicalize().is_ok_and(|p| p == out));
            if !is_out {
                walk(&path, out, found)?;
            }
        } else if is_model(&path) {
            found.push(path);
        }
    }
    Ok(())
}

fn is_model(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    is_toml || ForeignFormat::of(path).is_some()
}

/// Names by the paths below their sources, or by whole paths where two would be the same.
fn named(found: &BTreeMap<PathBuf, PathBuf>) -> Vec<BatchModel> {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for name in found.values() {
        *count.entry(plain(name)).or_default() += 1;
    }
    let name = |path: &PathBuf, short: &PathBuf| match count[&plain(short)] {
        1 => plain(short),
        _ => plain(path),
    };
    let mut models: Vec<BatchModel> = found
        .iter()
        .map(|(path, short)| BatchModel {
            name: name(path, short),
            path: path.clone(),
            folder: String::new(),
        })
        .collect();
    models.sort_by(|a, b| (&a.name, &a.path).cmp(&(&b.name, &b.path)));
    give_folders(&mut models);
    models
}

/// The normal parts of a path, joined by `/`.
fn plain(path: &Path) -> String {
    let parts = path.components().filter_map(|part| match part {
        Component::Normal(part) => Some(part.to_string_lossy()),
        _ => None,
    });
    parts.collect::<Vec<_>>().join("/")
}

/// The name without its extension, or with it where two would be the same.
fn give_folders(models: &mut [BatchModel]) {
    let stem = |name: &str| match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() && !extension.contains('/') => stem.to_owned(),
        _ => name.to_owned(),
    };
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for model in models.iter() {
        *count.entry(stem(&model.name)).or_default() += 1;
    }
    let mut taken = BTreeSet::new();
    for model in models {
        let short = stem(&model.name);
        let wanted = if count[&short] == 1 { short } else { model.name.clone() };
        let numbered = (2..).map(|k| format!("{wanted}~{k}"));
        let mut folders = std::iter::once(wanted.clone()).chain(numbered);
        let free = folders.find(|folder| !taken.contains(folder));
        model.folder = free.expect("invariant: numbers do not end");
        taken.insert(model.folder.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(names: &[(&str, &str)]) -> Vec<[String; 2]> {
        let found = names.iter().map(|(path, name)| (path.into(), name.into())).collect();
        named(&found).into_iter().map(|model| [model.name, model.folder]).collect()
    }

    #[test]
    fn a_model_is_named_by_its_path_below_the_folder_given() {
        let found = listed(&[("../lib/b/x.vm", "b/x.vm"), ("../lib/a.toml", "a.toml")]);
        assert_eq!(found, [["a.toml", "a"], ["b/x.vm", "b/x"]]);
    }

    #[test]
    fn no_two_models_share_a_name_or_a_folder() {
        let found = listed(&[
            ("p/a.vm", "a.vm"),
            ("q/a.vm", "a.vm"),
            ("q/b.vm", "b.vm"),
            ("q/b.toml", "b.toml"),
            ("../r/c.toml", "c.toml"),
        ]);
        let names: BTreeSet<_> = found.iter().map(|[name, _]| name).collect();
        let folders: BTreeSet<_> = found.iter().map(|[_, folder]| folder).collect();
        assert_eq!((names.len(), folders.len()), (5, 5), "{found:?}");
        assert!(found.contains(&["b.vm".to_owned(), "b.vm".to_owned()]), "{found:?}");
        assert!(found.contains(&["p/a.vm".to_owned(), "p/a".to_owned()]), "{found:?}");
    }
}
