//! Command `inspect`.

use crate::cli::failure::Failure;
use crate::cli::output::{duration, say, size};
use isospline_artifact::header::SectionEntry;
use isospline_artifact::{Container, Draft, Durability, FolderStore, Store};
use isospline_pipeline::{Provenance, read_provenance};
use std::path::Path;

/// Prints what an artifact holds, finished or not.
pub(crate) fn inspect(file: &Path, verify: bool) -> Result<u8, Failure> {
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.ok_or_else(|| Failure::usage(format!("{} is no file", file.display())))?;
    let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let store = FolderStore::new(folder, Durability::Durable);
    let store: &dyn Store = &store;
    let stem = [".partial", ".journal"].iter().find_map(|suffix| name.strip_suffix(suffix));
    if stem.is_none()
        && let Some(container) = store.peek(&name)?
    {
        return whole(store, &name, &container, verify);
    }
    let name = stem.unwrap_or(&name);
    let missing = || Failure::damaged(format!("{} is not there", file.display()));
    let draft = Draft::read(store, name)?.ok_or_else(|| missing().helped("see the path"))?;
    say(&unfinished(&store.describe(name), &draft))?;
    Ok(0)
}

fn whole(
    store: &dyn Store,
    name: &str,
    container: &Container,
    verify: bool,
) -> Result<u8, Failure> {
    say(&header(container))?;
    if let Some(record) = read_provenance(store, name)? {
        say(&provenance(&record))?;
    }
    if verify {
        container.verify()?;
        let blocks: u64 = container.header().sections.iter().map(SectionEntry::blocks).sum();
        say(&format!("all rows agree with their {blocks} checksums"))?;
    }
    Ok(0)
}

fn unfinished(file: &str, draft: &Draft) -> String {
    let mut lines = vec![format!("{file}: not finished")];
    if let Some((done, of)) = draft.tasks() {
        let percent = 100.0 * done as f64 / of.max(1) as f64;
        lines.push(format!("tasks      {done} of {of} are done ({percent:.0} %)"));
    } else {
        lines.push("tasks      no journal: it cannot be gone on with".to_owned());
    }
    if let Some(recorded) = &draft.recorded {
        lines.push(format!("recipe     {}", recorded.head.recipe));
        lines.push(format!("plan       {}", recorded.head.plan));
    }
    if let Some(header) = &draft.header {
        lines.push(format!("kind       {} (schema {})", header.kind, header.schema));
        lines.push(format!("stage      {} (version {})", header.stage, header.stage_version));
        lines.push(format!("size       {}", size(draft.length)));
        lines.extend(sections(&header.sections));
    }
    lines.join("\n")
}

fn sections(sections: &[SectionEntry]) -> Vec<String> {
    let head = ["section", "rows", "stride", "size", "checksums"];
    let line = |cells: [&str; 5]| {
        let [name, rows, stride, size, blocks] = cells;
        format!("{name:<16}{rows:>10}{stride:>8}{size:>12}{blocks:>11}")
    };
    let row = |s: &SectionEntry| {
        let bytes = size(s.rows * u64::from(s.stride));
        let numbers = [s.rows.to_string(), s.stride.to_string(), s.blocks().to_string()];
        line([&s.name, &numbers[0], &numbers[1], &bytes, &numbers[2]])
    };
    std::iter::once(line(head)).chain(sections.iter().map(row)).collect()
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
    lines.extend(sections(&header.sections));
    lines.join("\n")
}

fn provenance(record: &Provenance) -> String {
    let mut lines = vec![format!(
        "made       of model {:?} by isospline {} in {}",
        record.model,
        record.program,
        duration(record.cost.seconds)
    )];
    let cost = &record.cost;
    if cost.resumed_tasks > 0 {
        let (n, of) = (cost.resumed_tasks, cost.tasks);
        lines.push(format!("resumed    {n} of {of} tasks were done by earlier runs"));
    }
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
