//! Command `export`.

use crate::cli::args::{ExportArgs, FormatArg};
use crate::cli::failure::Failure;
use crate::cli::output::{say, size};
use isospline::ModelFolder;
use isospline_artifact::kinds::Patches;
use isospline_export::{ExportError, Format, Options};

/// Writes a finished surface in another format.
pub(crate) fn export(args: &ExportArgs) -> Result<u8, Failure> {
    let folder = ModelFolder::open(&args.dir)?;
    let format = format(args.format);
    let name = format!("{}.{format}", folder.model().file.model.name);
    let path = args.output.clone().unwrap_or_else(|| folder.path().join(name));
    let container = folder.patches()?;
    let options = Options { samples: args.samples };
    isospline_export::write_file(format, &container.view::<Patches>()?, &options, &path)
        .map_err(|error| failure(&error, &path))?;
    let length = std::fs::metadata(&path).map_or(0, |data| data.len());
    say(&format!("{} ({})", path.display(), size(length)))?;
    Ok(0)
}

fn failure(error: &ExportError, path: &std::path::Path) -> Failure {
    let message = format!("{}: {error}", path.display());
    match error {
        ExportError::Io(_) | ExportError::File(_) => {
            Failure::io(message).helped("see whether the folder is there")
        }
        ExportError::NotRegular { .. } => Failure::io(message).helped("give another path with -o"),
        ExportError::Samples { .. } | ExportError::TooLarge { .. } => Failure::usage(message),
        ExportError::Degree { .. } | ExportError::Incoherent { .. } => Failure::damaged(message),
    }
}

fn format(arg: FormatArg) -> Format {
    match arg {
        FormatArg::Vtu => Format::Vtu,
        FormatArg::Glb => Format::Glb,
        FormatArg::Obj => Format::Obj,
        FormatArg::Ply => Format::Ply,
        FormatArg::Stl => Format::Stl,
        FormatArg::Npz => Format::Npz,
    }
}
