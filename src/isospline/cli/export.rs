//! Command `export`.

use crate::cli::failure::Failure;
use crate::cli::output::{say, size};
use clap::Args;
use isospline::ModelFolder;
use isospline_artifact::kinds::Patches;
use isospline_export::{About, Density, ExportError, Format, Options, StepOptions, StepSchema};
use std::path::PathBuf;

/// What `export --help` ends with.
pub(crate) const EXPORT_EXAMPLES: &str = "\
Examples:
  isospline export out/deccube --format step
  isospline export out/deccube --format step --compact --schema ap214
  isospline export out/deccube --format glb
  isospline export out/deccube --format stl --tolerance 1e-5 -o deccube.stl
  isospline export out/deccube --format 3mf --chord 0.01
  isospline export out/deccube --format msh --order 3

step, vtu, msh, bv and npz hold the patches exactly (msh up to order 7); glb, obj, ply, stl and 3mf
hold triangles, no farther from the patches than --tolerance. `isospline lint` looks through a STEP
file.";

/// What to write, and how.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The model folder
    pub(crate) dir: PathBuf,
    /// The format
    #[arg(long, value_enum)]
    pub(crate) format: FormatArg,
    /// The file; default DIR/<model name>.<format>
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Triangles: largest distance of the patches from them, of the diagonal of the box around the
    /// vertices [default: 1e-4]
    #[arg(long, value_name = "X", conflicts_with_all = ["chord", "samples"])]
    pub(crate) tolerance: Option<f64>,
    /// Triangles: the same as a length in model units
    #[arg(long, value_name = "LENGTH", conflicts_with = "samples")]
    pub(crate) chord: Option<f64>,
    /// Triangles: as many segments along every edge in place of a tolerance
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) samples: Option<u32>,
    /// MSH: order of the curved triangles; 7 is exact
    #[arg(long, value_name = "N", default_value_t = 7,
        value_parser = clap::value_parser!(u32).range(1..=7))]
    pub(crate) order: u32,
    /// STEP: one patch a triangle with a collapsed side in place of three quads
    #[arg(long)]
    pub(crate) compact: bool,
    /// STEP: curves in the parameters of the faces too
    #[arg(long)]
    pub(crate) pcurves: bool,
    /// STEP: the application protocol
    #[arg(long, value_enum, default_value = "ap242")]
    pub(crate) schema: SchemaArg,
}

/// Application protocols of STEP files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SchemaArg {
    /// Managed model based 3D engineering
    Ap242,
    /// Automotive design
    Ap214,
}

/// Formats of `export`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum FormatArg {
    /// STEP solids of exact patches, for CAD programs
    Step,
    /// Gmsh mesh of curved triangles, for simulation
    Msh,
    /// VTK unstructured grid with exact Bézier cells
    Vtu,
    /// 3MF with its unit, for printing
    #[value(name = "3mf")]
    ThreeMf,
    /// Binary STL
    Stl,
    /// Binary glTF, to look at
    Glb,
    /// Wavefront OBJ
    Obj,
    /// Stanford PLY
    Ply,
    /// Text of the viewer bview, with exact patches
    Bv,
    /// Arrays for numpy: vertices, faces, control points
    Npz,
}

/// Writes a finished surface in another format.
pub(crate) fn export(args: &ExportArgs) -> Result<u8, Failure> {
    let folder = ModelFolder::open(&args.dir)?;
    let format = format(args.format);
    let name = format!("{}.{format}", folder.model().file.model.name);
    let path = args.output.clone().unwrap_or_else(|| folder.path().join(name));
    let container = folder.patches()?;
    let patches = container.view::<Patches>()?;
    let about = about(&folder, patches.face.len());
    let options =
        Options { density: density(args), order: args.order, about, step: step_options(args) };
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

fn density(args: &ExportArgs) -> Density {
    let samples = args.samples.map(Density::Samples);
    let length = args.chord.map(Density::Length);
    samples.or(length).or(args.tolerance.map(Density::Relative)).unwrap_or_default()
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
        ExportError::Samples { .. }
        | ExportError::Order { .. }
        | ExportError::ToleranceRange { .. }
        | ExportError::TooLarge { .. } => Failure::usage(message),
        ExportError::Tolerance { .. } => Failure::usage(message).helped("give a larger tolerance"),
        ExportError::Degree { .. } | ExportError::Incoherent { .. } => Failure::damaged(message),
    }
}

fn format(arg: FormatArg) -> Format {
    match arg {
        FormatArg::Step => Format::Step,
        FormatArg::Msh => Format::Msh,
        FormatArg::Vtu => Format::Vtu,
        FormatArg::ThreeMf => Format::ThreeMf,
        FormatArg::Stl => Format::Stl,
        FormatArg::Glb => Format::Glb,
        FormatArg::Obj => Format::Obj,
        FormatArg::Ply => Format::Ply,
        FormatArg::Bv => Format::Bv,
        FormatArg::Npz => Format::Npz,
    }
}
