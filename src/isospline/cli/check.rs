//! Command `check`.

use crate::cli::args::CheckArgs;
use crate::cli::failure::{CHECK_FAILED, Failure};
use crate::cli::output::{note, say};
use crate::cli::tables;
use isospline::config::ModelFile;
use isospline::{Model, ModelFolder};
use isospline_check::{CheckReport, Expected, Job, Surface};
use isospline_export::NpzError;
use isospline_pipeline::{RunOptions, State, Threads};
use std::collections::BTreeMap;
use std::path::Path;

/// Measures a surface and holds it against its limits.
pub(crate) fn check(args: &CheckArgs) -> Result<u8, Failure> {
    let (report, file) = match &args.model {
        Some(_) if args.path.is_dir() => {
            let message = format!("{} is a folder, which has its own model", args.path.display());
            return Err(Failure::usage(message).helped("leave out --model"));
        }
        Some(model) => check_export(&args.path, model)?,
        None if args.path.is_file() => {
            let message = format!("{} is a file: its model is needed", args.path.display());
            return Err(Failure::usage(message).helped("add --model MODEL.toml"));
        }
        None => check_folder(&args.path)?,
    };
    if args.json {
        let text = serde_json::to_string_pretty(&report);
        say(&text.expect("invariant: a report is plain data"))?;
    } else {
        say(&tables::check(&report, &file))?;
    }
    Ok(if report.pass { 0 } else { CHECK_FAILED })
}

fn check_folder(path: &Path) -> Result<(CheckReport, ModelFile), Failure> {
    let folder = ModelFolder::open(path)?;
    let status = folder.status()?;
    if let Some(last) = status.last().filter(|last| matches!(last.state, State::Stale(_))) {
        note(&format!("warning: {last}; the figures are those of the surface as it was made"));
    }
    let report = folder.check(RunOptions::default().threads)?;
    Ok((report, folder.model().file.clone()))
}

fn check_export(path: &Path, model: &Path) -> Result<(CheckReport, ModelFile), Failure> {
    let model = Model::new(ModelFile::open(model, &[])?)?;
    let arrays = isospline_export::read_npz_file(path).map_err(|error| match error {
        NpzError::Io(_) => Failure::io(format!("{}: {error}", path.display())),
        _ => Failure::damaged(format!("{}: {error}", path.display())),
    })?;
    let surface = Surface::new(arrays.vertices, arrays.faces, arrays.control_points);
    let surface =
        surface.map_err(|error| Failure::damaged(format!("{}: {error}", path.display())))?;
    let tolerance = model.file.target.tolerance(surface.diagonal());
    let job = Job {
        surface: &surface,
        field: &model.field,
        expected: Expected { tolerance, ..Expected::default() },
        params: &model.file.check,
        repairs: BTreeMap::new(),
    };
    let threads = Threads::new(RunOptions::default().threads);
    let report = isospline_check::check(&job, &|n, body| threads.for_each(n, body));
    Ok((report, model.file))
}
