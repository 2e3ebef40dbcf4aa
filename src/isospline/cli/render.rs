//! Command `render`.

use crate::cli::failure::Failure;
use crate::cli::output::{note, say, size};
use isospline::ModelFolder;
use isospline_artifact::Container;
use isospline_artifact::kinds::{BaseMesh, G0Fit, Mesh, Network, Patches};
use isospline_pipeline::{RunOptions, State, Threads};
use isospline_render::{Job, Options, Picture, RenderError, Style, Surface, View};
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) const RENDER_EXAMPLES: &str = "\
Examples:
  isospline render out/deccube
  isospline render out/deccube --style gold --size 1920x1080 -o deccube.png
  isospline render out/deccube --style curvature --view z --perspective 0
  isospline render out/deccube --style error --range 1e-9,1e-5
  isospline render out/deccube --style zebra --stage g0_fit --view -60,25

zebra shows reflected stripes, which break where tangent planes do. curvature and gaussian show the
mean curvature, below 0 where convex, and the Gaussian; error shows the distance from the implicit
surface over the diagonal. Stages up to adapt make meshes, g0_fit patches that only meet, fairing
and relax the finished surface.";

#[derive(Debug, clap::Args)]
pub(crate) struct RenderArgs {
    /// The model folder
    dir: PathBuf,
    /// The picture; default DIR/<model name>.<style>.png, with --stage DIR/<model
    /// name>.<stage>.<style>.png
    #[arg(short, long, value_name = "FILE.png")]
    output: Option<PathBuf>,
    /// What the colours show
    #[arg(long, value_enum, default_value = "zebra")]
    style: StyleArg,
    /// Width and height in pixels, 16 to 8192
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// From where: iso, x, y, z, -x, -y, -z, or the eye's azimuth and elevation in degrees
    #[arg(long, value_name = "VIEW", default_value = "iso", allow_hyphen_values = true,
        value_parser = parse_view)]
    view: View,
    /// Angle at the eye that holds the surface, 0 to 90 degrees; 0 is parallel projection
    #[arg(long, value_name = "DEG", default_value_t = 20.0)]
    perspective: f64,
    /// Pairs of a black and a white stripe for zebra, 1 to 200
    #[arg(long, value_name = "N", default_value_t = 8)]
    stripes: u32,
    /// Ends of the legend; default: what 98 % of the values keep
    #[arg(long, value_name = "LO,HI", allow_hyphen_values = true, value_parser = parse_pair)]
    range: Option<[f64; 2]>,
    /// Draw what this stage made; default: the finished surface
    #[arg(long, value_name = "STAGE")]
    stage: Option<String>,
    /// Working threads; default: the processors. The picture does not depend on them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// Styles of `render`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum StyleArg {
    /// Reflected black and white stripes
    Zebra,
    /// Polished gold
    Gold,
    /// Mean curvature
    Curvature,
    /// Gaussian curvature
    Gaussian,
    /// Distance from the implicit surface
    Error,
    /// Patches, or triangles of a mesh, with their borders
    Patches,
    /// Control nets
    Net,
}

/// Draws a surface as a PNG picture.
pub(crate) fn render(args: &RenderArgs) -> Result<u8, Failure> {
    let folder = ModelFolder::open(&args.dir)?;
    let picture = match &args.stage {
        None => {
            warn_if_stale(&folder)?;
            let container = folder.patches()?;
            draw(args, &folder, Surface::from_patches(&container.view::<Patches>()?))?
        }
        Some(stage) => draw_stage(args, &folder, stage)?,
    };
    let path = args.output.clone().unwrap_or_else(|| default_path(args, &folder));
    isospline_render::write_png_file(&picture, &path).map_err(|error| {
        let message = format!("{}: {error}", path.display());
        match error {
            RenderError::NotRegular { .. } => {
                Failure::io(message).helped("give another path with -o")
            }
            _ => Failure::io(message).helped("see whether the folder is there"),
        }
    })?;
    let length = std::fs::metadata(&path).map_or(0, |data| data.len());
    let (width, height) = args.size;
    say(&format!("{} ({width} x {height}, {})", path.display(), size(length)))?;
    Ok(0)
}

/// The picture is that of the surface as it was made.
fn warn_if_stale(folder: &ModelFolder) -> Result<(), Failure> {
    let status = folder.status()?;
    if let Some(last) = status.last().filter(|last| matches!(last.state, State::Stale(_))) {
        note(&format!("warning: {last}; the picture is that of the surface as it was made"));
    }
    Ok(())
}

fn draw_stage(args: &RenderArgs, folder: &ModelFolder, stage: &str) -> Result<Picture, Failure> {
    let container = artifact(folder, stage)?;
    match container.header().kind.as_str() {
        "patches" => draw(args, folder, Surface::from_patches(&container.view::<Patches>()?)),
        "mesh" => {
            let mesh = container.view::<Mesh>()?;
            draw(args, folder, Surface::from_mesh(mesh.position, mesh.face))
        }
        "base_mesh" => {
            let mesh = container.view::<BaseMesh>()?;
            draw(args, folder, Surface::from_mesh(mesh.position, mesh.face))
        }
        "g0_fit" => {
            let (adapt, network) = (artifact(folder, "adapt")?, artifact(folder, "network")?);
            let base = adapt.view::<BaseMesh>()?;
            let curves = network.view::<Network>()?;
            let fit = container.view::<G0Fit>()?;
            draw(args, folder, Surface::from_g0_fit(&base, &curves, &fit))
        }
        kind => {
            let message = format!("stage {stage} makes {kind}, which is no surface");
            let help = "meshes come from the stages up to adapt, patches from g0_fit, fairing and \
                        relax";
            Err(Failure::usage(message).helped(help))
        }
    }
}

fn artifact(folder: &ModelFolder, stage: &str) -> Result<Arc<Container>, Failure> {
    let Some(opened) = folder.artifact(stage) else {
        let names: Vec<&str> = folder.stage_names().collect();
        let message = format!("this model has no stage {stage:?}");
        return Err(Failure::usage(message).helped(format!("it has {}", names.join(", "))));
    };
    Ok(opened?)
}

fn draw(
    args: &RenderArgs,
    folder: &ModelFolder,
    surface: Result<Surface<'_>, RenderError>,
) -> Result<Picture, Failure> {
    let surface = surface.map_err(|error| failure(&error))?;
    let model = folder.model();
    let unit = model.file.model.unit.and_then(|unit| serde_json::to_value(unit).ok());
    let job = Job {
        surface: &surface,
        field: &model.field,
        // A model without a unit has lengths all the same.
        unit: unit.as_ref().and_then(serde_json::Value::as_str).unwrap_or("length"),
        options: &Options {
            width: args.size.0,
            height: args.size.1,
            view: View { perspective_deg: args.perspective, ..args.view },
            style: style(args.style),
            stripes: args.stripes,
            range: args.range,
        },
    };
    let n_threads = args.threads.map_or(RunOptions::default().threads, |n| n as usize);
    let threads = Threads::new(n_threads);
    isospline_render::render(&job, &|n, body| threads.for_each(n, body))
        .map_err(|error| failure(&error))
}

fn failure(error: &RenderError) -> Failure {
    let message = error.to_string();
    match error {
        RenderError::Size { .. } => Failure::usage(message).helped("such as --size 1280x720"),
        RenderError::Stripes { .. } => Failure::usage(message),
        RenderError::View { .. } => Failure::usage(message).helped("such as --view -60,25"),
        RenderError::Range { .. } => {
            Failure::usage(message).helped("LO is below HI, and above 0 for errors")
        }
        _ => Failure::damaged(message),
    }
}

fn default_path(args: &RenderArgs, folder: &ModelFolder) -> PathBuf {
    let name = &folder.model().file.model.name;
    let stage = args.stage.as_ref().map_or(String::new(), |stage| format!(".{stage}"));
    folder.path().join(format!("{name}{stage}.{}.png", style(args.style).name()))
}

fn style(arg: StyleArg) -> Style {
    match arg {
        StyleArg::Zebra => Style::Zebra,
        StyleArg::Gold => Style::Gold,
        StyleArg::Curvature => Style::Curvature,
        StyleArg::Gaussian => Style::Gaussian,
        StyleArg::Error => Style::Error,
        StyleArg::Patches => Style::Patches,
        StyleArg::Net => Style::Net,
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    sides.ok_or_else(|| "two whole numbers with an x between, such as 1280x720".to_owned())
}

fn parse_pair(text: &str) -> Result<[f64; 2], String> {
    let pair = text.split_once(',').and_then(|(a, b)| Some([number(a)?, number(b)?]));
    pair.ok_or_else(|| "two numbers with a comma between".to_owned())
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok()
}

fn parse_view(text: &str) -> Result<View, String> {
    let [azimuth_deg, elevation_deg] = match text {
        "iso" => return Ok(View::default()),
        "x" => [0.0, 0.0],
        "-x" => [180.0, 0.0],
        "y" => [90.0, 0.0],
        "-y" => [-90.0, 0.0],
        // From above and below x points to the right.
        "z" => [-90.0, 90.0],
        "-z" => [-90.0, -90.0],
        _ => parse_pair(text).map_err(|_| {
            "iso, x, y, z, -x, -y, -z, or azimuth and elevation such as -60,25".to_owned()
        })?,
    };
    Ok(View { azimuth_deg, elevation_deg, ..View::default() })
}
