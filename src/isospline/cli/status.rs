//! Commands `status` and `inspect`.

use crate::cli::failure::Failure;
use crate::cli::output::{duration, say, size};
use isospline::ModelFolder;
use isospline_artifact::{Container, Durability, FolderStore, Store};
use isospline_pipeline::{Provenance, read_provenance};
use std::path::Path;

/// Says of every stage whether it is fresh.
pub(crate) fn status(dir: &Path) -> Result<u8, Failure> {
    let folder = ModelFolder::open(dir)?;
    for node in folder.status()? {
        say(&node.to_string())?;
    }
    Ok(0)
}

/// Prints what an artifact holds.
pub(crate) fn inspect(file: &Path, verify: bool) -> Result<u8, Failure> {
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.ok_or_else(|| Failure::usage(format!("{} is no file", file.display())))?;
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let store = FolderStore::new(folder, Durability::Durable);
    let store: &dyn Store = &store;
    let missing =
        || Failure::damaged(format!("{} is not there", file.display())).helped("see the path");
    let container = store.peek(&name)?.ok_or_else(missing)?;
    say(&header(&container))?;
    if let Some(record) = read_provenance(store, &name)? {
        say(&provenance(&record))?;
    }
    if verify {
        container.verify()?;
        say("all rows agree with their checksums")?;
    }
    Ok(0)
}

fn header(container: &Container) -> String {
    let header = container.header();
    let mut lines = vec![
        container.file().to_owned(),
        format!("kind       {} (schema {})", header.kind, header.schema),
        format!("stage      {} (version {})", header.stage, header.stage_version),
        format!("recipe     {}", header.recipe),
        format!("content    {}", container.content()),
        format!("size       {}", size(container.length())),
    ];
    lines.push(format!("{:<16}{:>10}{:>8}", "section", "rows", "stride"));
    for section in &header.sections {
        lines.push(format!("{:<16}{:>10}{:>8}", section.name, section.rows, section.stride));
    }
    lines.join("\n")
}

fn provenance(record: &Provenance) -> String {
    let mut lines = vec![format!(
        "made       of model {:?} by isospline {} in {}",
        record.model,
        record.program,
        duration(record.cost.seconds)
    )];
    lines.push(format!("params     {}", record.params));
    for input in &record.inputs {
        lines.push(format!("input      {} ({})", input.label, input.kind));
    }
    let counters = &record.counters;
    lines.extend(counters.repairs.iter().map(|(name, n)| format!("repairs    {name}: {n}")));
    lines.extend(counters.counts.iter().map(|(name, n)| format!("count      {name}: {n}")));
    lines.extend(counters.maxima.iter().map(|(name, x)| format!("maximum    {name}: {x:e}")));
    lines.join("\n")
}
