//! Command `export`.

use crate::cli::args::{ExportArgs, FormatArg, SchemaArg};
use crate::cli::failure::Failure;
use crate::cli::output::{say, size};
use isospline::ModelFolder;
use isospline_artifact::kinds::Patches;
use isospline_export::{About, ExportError, Format, Options, StepOptions, StepSchema};

/// Writes a finished surface in another format.
pub(crate) fn export(args: &ExportArgs) -> Result<u8, Failure> {
    let folder = ModelFolder::open(&args.dir)?;
    let format = format(args.format);
    let name = format!("{}.{format}", folder.model().file.model.name);
    let path = args.output.clone().unwrap_or_else(|| folder.path().join(name));
    let container = folder.patches()?;
    let patches = container.view::<Patches>()?;
    let about = about(&folder, patches.face.len());
    let options = Options { samples: args.samples, about, step: step_options(args) };
    isospline_export::write_file(format, &patches, &options, &path)
        .map_err(|error| failure(&error, &path))?;
    let length = std::fs::metadata(&path).map_or(0, |data| data.len());
    say(&format!("{} ({})", path.display(), size(length)))?;
    Ok(0)
}

/// Characters of a formula that go into a line about it.
const FORMULA_SHOWN: usize = 200;

fn about(folder: &ModelFolder, n_faces: usize) -> About {
    let model = &folder.model().file.model;
    let formula = model.formula.split_whitespace().collect::<Vec<_>>().join(" ");
    let shown: String = formula.chars().take(FORMULA_SHOWN).collect();
    let cut = if shown.len() < formula.len() { "..." } else { "" };
    let level = model.level;
    let provenance = format!("{n_faces} triangular patches of {shown}{cut} = {level}");
    About { name: model.name.clone(), unit: model.unit.unwrap_or_default(), provenance }
}

fn step_options(args: &ExportArgs) -> StepOptions {
    let schema = match args.schema {
        SchemaArg::Ap242 => StepSchema::Ap242,
        SchemaArg::Ap214 => StepSchema::Ap214,
    };
    StepOptions { schema, compact: args.compact, pcurves: args.pcurves }
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
        FormatArg::Step => Format::Step,
        FormatArg::Glb => Format::Glb,
        FormatArg::Obj => Format::Obj,
        FormatArg::Ply => Format::Ply,
        FormatArg::Stl => Format::Stl,
        FormatArg::Npz => Format::Npz,
    }
}
