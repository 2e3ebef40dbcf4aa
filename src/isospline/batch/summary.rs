//! The summary of a batch: a line of JSON a model, appended as models end, and read on resume.
//!
//! A line is written by one call and synced, so whatever ends a batch leaves whole lines and at
//! most one piece of a line at the end, which the next batch cuts off. Models run alone on a
//! cluster write files of one record beside it, which the next batch takes in.

use crate::batch::{BatchError, BatchModel, Record, csv};
use crate::config::ModelFile;
use crate::stages;
use isospline_artifact::{Durability, KeyHasher, StoreError, write_file_atomic};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Name of the summary in lines of JSON.
const LINES: &str = "summary.jsonl";
/// Name of the summary as a table.
const TABLE: &str = "summary.csv";
/// Folder of the records of models that ran alone.
const PARTS: &str = ".batch/parts";

/// The summary in a folder.
#[derive(Debug)]
pub struct Summary {
    folder: PathBuf,
    lines: File,
    records: BTreeMap<String, Record>,
}

impl Summary {
    /// Opens the summary in `folder`, which is there, for models with these keys.
    ///
    /// Records of other keys, and those worth another try, are forgotten; records of models that
    /// are not in `keys` are kept.
    ///
    /// # Errors
    /// [`BatchError::Store`].
    pub fn open(folder: &Path, keys: &BTreeMap<String, String>) -> Result<Self, BatchError> {
        let path = folder.join(LINES);
        let mut records: BTreeMap<String, Record> = BTreeMap::new();
        let is_of_use = |record: &Record| {
            let key = keys.get(&record.model);
            key.is_none_or(|key| {
                *key == record.key && !record.is_worth_another_try() && is_there(folder, record)
            })
        };
        for record in records_of(&path)?.into_iter().chain(parts(folder)?) {
            if is_of_use(&record) {
                records.insert(record.model.clone(), record);
            }
        }
        let mut text = String::new();
        for record in records.values() {
            text.push_str(&line(record));
        }
        write_file_atomic(&path, Durability::Durable, |out| out.write_all(text.as_bytes()))?;
        #[expect(
            clippy::disallowed_methods,
            reason = "grows line by line: replacing it for each of many models would take longer and longer"
        )]
        let lines = std::fs::OpenOptions::new().append(true).open(&path);
        let lines = lines.map_err(StoreError::io("open", &path))?;
        Ok(Self { folder: folder.to_owned(), lines, records })
    }

    /// What became of a model, if that is known.
    pub fn record(&self, model: &str) -> Option<&Record> {
        self.records.get(model)
    }

    /// Adds a record; it survives a power cut.
    ///
    /// # Errors
    /// [`BatchError::Store`].
    pub fn add(&mut self, record: Record) -> Result<(), BatchError> {
        let path = self.folder.join(LINES);
        let written = self.lines.write_all(line(&record).as_bytes());
        written.and_then(|()| self.lines.sync_data()).map_err(StoreError::io("write", path))?;
        self.records.insert(record.model.clone(), record);
        Ok(())
    }

    /// Writes the table of all records, and says where.
    ///
    /// # Errors
    /// [`BatchError::Store`].
    pub fn write_table(&self) -> Result<PathBuf, BatchError> {
        let path = self.folder.join(TABLE);
        let table = csv(&self.records.values().collect::<Vec<_>>());
        write_file_atomic(&path, Durability::Durable, |out| out.write_all(table.as_bytes()))?;
        Ok(path)
    }
}

/// The key of all that may change what becomes of a model: its file, the overrides, the program.
///
/// Comments and order of keys do not count where the file can be read.
pub fn record_key(model: &BatchModel, overrides: &[String]) -> String {
    let mut key = KeyHasher::new("isospline batch");
    key.field(env!("CARGO_PKG_VERSION").as_bytes());
    for (name, version) in stages::versions() {
        key.field(name.as_bytes());
        key.number(u64::from(version));
    }
    if let Ok(file) = ModelFile::open(&model.path, overrides) {
        key.field(file.to_toml().as_bytes());
        let mesh = file.model.base_mesh.and_then(|path| std::fs::read(path).ok());
        key.field(&mesh.unwrap_or_default());
    } else {
        key.field(&std::fs::read(&model.path).unwrap_or_default());
        for text in overrides {
            key.field(text.as_bytes());
        }
    }
    key.finish().to_string()
}

/// Writes the record of a model that ran alone, and says where.
///
/// # Errors
/// [`BatchError::Store`].
pub fn write_part(folder: &Path, record: &Record) -> Result<PathBuf, BatchError> {
    let path = folder.join(PARTS).join(format!("{}.jsonl", record.folder));
    let parent = path.parent().expect("invariant: the file is in a folder");
    std::fs::create_dir_all(parent).map_err(StoreError::io("make", parent))?;
    let text = line(record);
    write_file_atomic(&path, Durability::Durable, |out| out.write_all(text.as_bytes()))?;
    Ok(path)
}

/// Whether what a record tells of is still there: somebody may have removed the model's folder.
fn is_there(folder: &Path, record: &Record) -> bool {
    record.faces.is_none() || folder.join(&record.folder).join(crate::REPORT_NOTE).is_file()
}

fn line(record: &Record) -> String {
    let text = serde_json::to_string(record).expect("invariant: a record is plain data");
    text + "\n"
}

/// The whole records of a file; none if it is not there.
fn records_of(path: &Path) -> Result<Vec<Record>, BatchError> {
    let text = match std::fs::read(path) {
        Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(StoreError::io("read", path)(error).into()),
    };
    Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}

/// Records of models that ran alone.
fn parts(folder: &Path) -> Result<Vec<Record>, BatchError> {
    let mut found = Vec::new();
    let mut folders = vec![folder.join(PARTS)];
    while let Some(folder) = folders.pop() {
        let entries = match std::fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            Err(error) => return Err(StoreError::io("read", &folder)(error).into()),
        };
        for entry in entries {
            let path = entry.map_err(StoreError::io("read", &folder))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "jsonl") {
                found.extend(records_of(&path)?);
            }
        }
    }
    // The order in which a folder is read is the system's.
    found.sort_by(|a, b| a.model.cmp(&b.model));
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::Ending;
    use std::path::PathBuf;

    fn model(name: &str) -> BatchModel {
        BatchModel { name: name.into(), path: PathBuf::from(name), folder: name.into() }
    }

    fn refused(name: &str, key: &str) -> Record {
        let line = serde_json::json!({"event": "error", "code": "empty-level-set"});
        Record::new(&model(name), key.into(), Ending::Exit(21), Some(&line), "")
    }

    fn keys(names: &[&str]) -> BTreeMap<String, String> {
        names.iter().map(|name| ((*name).to_owned(), "k".to_owned())).collect()
    }

    #[test]
    fn a_torn_last_line_costs_one_record() {
        let folder = tempfile::tempdir().unwrap();
        let mut summary = Summary::open(folder.path(), &keys(&["a", "b"])).unwrap();
        summary.add(refused("a", "k")).unwrap();
        summary.add(refused("b", "k")).unwrap();
        let path = folder.path().join(LINES);
        let whole = std::fs::read(&path).unwrap();
        for cut in 1..whole.len() / 2 {
            let torn = &whole[..whole.len() - cut];
            write_file_atomic(&path, Durability::Fast, |out| out.write_all(torn)).unwrap();
            let summary = Summary::open(folder.path(), &keys(&["a", "b"])).unwrap();
            assert!(summary.record("a").is_some());
            // Without its newline the record is whole.
            assert_eq!(summary.record("b").is_some(), cut == 1);
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.ends_with('\n') && text.lines().count() == 2 - usize::from(cut > 1));
            write_file_atomic(&path, Durability::Fast, |out| out.write_all(&whole)).unwrap();
        }
    }

    #[test]
    fn records_of_another_key_and_failures_are_forgotten() {
        let folder = tempfile::tempdir().unwrap();
        let mut summary = Summary::open(folder.path(), &keys(&[])).unwrap();
        summary.add(refused("a", "k")).unwrap();
        summary.add(refused("b", "old")).unwrap();
        summary.add(Record::new(&model("c"), "k".into(), Ending::Signal(None), None, "")).unwrap();
        summary.add(refused("of another batch", "any")).unwrap();
        drop(summary);
        let summary = Summary::open(folder.path(), &keys(&["a", "b", "c"])).unwrap();
        let known = ["a", "b", "c", "of another batch"].map(|name| summary.record(name).is_some());
        assert_eq!(known, [true, false, false, true]);
    }

    #[test]
    fn records_of_models_that_ran_alone_are_taken_in_once() {
        let folder = tempfile::tempdir().unwrap();
        write_part(folder.path(), &refused("jsurf/a", "k")).unwrap();
        for _ in 0..2 {
            let summary = Summary::open(folder.path(), &keys(&["jsurf/a"])).unwrap();
            assert!(summary.record("jsurf/a").is_some());
        }
        let text = std::fs::read_to_string(folder.path().join(LINES)).unwrap();
        assert_eq!(text.lines().count(), 1);
    }
}
