//! A surface becomes a picture, tile by tile.

use crate::camera::{Camera, Frame};
use crate::canvas::Canvas;
use crate::color::Light;
use crate::landing::land;
use crate::lent_threads::{ForEach, each, map};
use crate::net::{Ink, Mark, REACH};
use crate::patch::Patch;
use crate::shader::Shader;
use crate::tile::{NOTHING, SAMPLES, SIDE, TILE, Tile};
use crate::{Options, RenderError, Style, Surface, legend};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::N_CONTROL;
use isospline_implicit::Field;
use std::fmt;

/// What is drawn, and how.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The surface.
    pub surface: &'a Surface<'a>,
    /// The field whose zero set the surface is to be; [`Style::Error`] asks it.
    pub field: &'a dyn Field,
    /// Name of the unit of length, for legends.
    pub unit: &'a str,
    /// Size, view and style.
    pub options: &'a Options,
}

impl fmt::Debug for Job<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("Job");
        out.field("surface", self.surface).field("options", self.options).finish_non_exhaustive()
    }
}

/// A drawn picture.
#[derive(Clone, Debug)]
pub struct Picture {
    canvas: Canvas,
    camera: Camera,
}

impl Picture {
    /// Pixels a row.
    pub fn width(&self) -> u32 {
        self.canvas.width() as u32
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.canvas.height() as u32
    }

    /// Red, green and blue of each pixel, 0 to 255, row by row from above.
    pub fn rgb(&self) -> &[u8] {
        self.canvas.rgb()
    }

    /// Where points of the surface are in it.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }
}

/// Colour of what is not surface.
const BACKGROUND: Light = Light::WHITE;

/// Draws a surface; the same picture on any number of threads.
///
/// Each pixel is the mean of sixteen samples. A sample's line of sight is met with the patch that
/// it sees by Newton's method, and normal and curvatures are those of the patch at that point.
///
/// # Errors
/// [`RenderError`].
pub fn render(job: &Job<'_>, for_each: ForEach<'_>) -> Result<Picture, RenderError> {
    job.options.check()?;
    let (width, height) = (job.options.width as usize, job.options.height as usize);
    let style = job.options.style;
    let room = width - legend::width(style, width, height);
    let frame = Frame { width: room as f64, height: height as f64 };
    let camera = Camera::fitted(job.options.view, job.surface, frame, for_each)?;
    let shader = Shader::new(job, &camera, for_each)?;
    let lists = TileLists::new(job, &camera, for_each);
    let painter = Painter { job, camera: &camera, shader: &shader };
    let tiles =
        each(for_each, lists.faces.len(), |t| painter.paint(lists.corner(t), &lists.faces[t]));
    let mut canvas = Canvas::new(width, height);
    for (t, pixels) in tiles.iter().enumerate() {
        let [left, top] = lists.corner(t);
        for (p, &color) in pixels.iter().enumerate() {
            canvas.put(left + p % TILE, top + p / TILE, color);
        }
    }
    if let Some(values) = shader.legend().filter(|_| room < width) {
        legend::draw(&mut canvas, values, style, job.unit);
    }
    Ok(Picture { canvas, camera })
}

/// For each tile the faces that may be seen in it, ascending.
struct TileLists {
    columns: usize,
    faces: Vec<Vec<u32>>,
}

impl TileLists {
    fn new(job: &Job<'_>, camera: &Camera, for_each: ForEach<'_>) -> Self {
        let (width, height) = (job.options.width as usize, job.options.height as usize);
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let boxes = map(for_each, job.surface.n_faces(), |range| {
            range.map(|f| picture_box(camera, &job.surface.net(f))).collect()
        });
        let mut faces = vec![Vec::new(); columns * rows];
        let reach = REACH * job.options.line_scale();
        let tiles = |lo: f64, hi: f64, n: usize| {
            let tile = |x: f64| (x / TILE as f64).floor().clamp(0.0, n as f64);
            // Past the last tile, and for what has no extent, the range is empty.
            tile(lo - reach) as usize..(tile(hi + reach) as usize + 1).min(n)
        };
        for (f, [lo, hi]) in (0u32..).zip(boxes) {
            if hi[0] + reach < 0.0 || hi[1] + reach < 0.0 || hi[0] < lo[0] {
                continue;
            }
            for row in tiles(lo[1], hi[1], rows) {
                for column in tiles(lo[0], hi[0], columns) {
                    faces[row * columns + column].push(f);
                }
            }
        }
        Self { columns, faces }
    }

    /// Pixel of the upper left corner of a tile.
    fn corner(&self, tile: usize) -> [usize; 2] {
        [tile % self.columns * TILE, tile / self.columns * TILE]
    }
}

/// Box, in pixels, around the control points and so around the patch.
fn picture_box(camera: &Camera, net: &[Vec3; N_CONTROL]) -> [[f64; 2]; 2] {
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in net {
        let at = camera.pixel(*p);
        for k in 0..2 {
            lo[k] = lo[k].min(at[k]);
            hi[k] = hi[k].max(at[k]);
        }
    }
    [lo, hi]
}

struct Painter<'a> {
    job: &'a Job<'a>,
    camera: &'a Camera,
    shader: &'a Shader<'a>,
}

impl Painter<'_> {
    /// Colours of the pixels of a tile, row by row.
    fn paint(&self, corner: [usize; 2], faces: &[u32]) -> Vec<[u8; 3]> {
        let mut tile = Tile::new(corner);
        let net = |f: &u32| self.job.surface.net(*f as usize);
        let patches: Vec<Patch> = faces.iter().map(|f| Patch::new(&net(f))).collect();
        for (place, patch) in (0u32..).zip(&patches) {
            tile.enter(self.camera, place, patch);
        }
        let mut ink = Ink::new(self.job.options.line_scale());
        if self.job.options.style == Style::Net {
            for f in faces {
                ink.draw(self.camera, &tile, &net(f));
            }
        }
        (0..TILE).flat_map(|row| self.row(&tile, &ink, faces, &patches, row)).collect()
    }

    /// Colours of one row of pixels.
    fn row(
        &self,
        tile: &Tile,
        ink: &Ink,
        faces: &[u32],
        patches: &[Patch],
        row: usize,
    ) -> [[u8; 3]; TILE] {
        let mut sums = [Light::default(); TILE];
        let (mut hits, mut pixels) = (Vec::new(), Vec::new());
        for j in row * SAMPLES..(row + 1) * SAMPLES {
            for i in 0..SIDE {
                let mark = ink.mark(i, j);
                let seen = tile.seen(i, j);
                if mark != Mark::None {
                    sums[i / SAMPLES] += mark.color();
                } else if seen.patch == NOTHING {
                    sums[i / SAMPLES] += BACKGROUND;
                } else {
                    let place = seen.patch as usize;
                    let start = seen.at.map(f64::from);
                    let at = tile.place(i, j);
                    let (face, patch) = (faces[place], &patches[place]);
                    hits.push(land(self.camera, patch, face, at, start, seen.is_back));
                    pixels.push(i / SAMPLES);
                }
            }
        }
        for (pixel, light) in pixels.into_iter().zip(self.shader.shade(&hits)) {
            // Brighter than white would keep its edges from being smooth.
            sums[pixel] += Light(light.0.map(|c| c.clamp(0.0, 1.0)));
        }
        sums.map(|sum| (sum * (1.0 / (SAMPLES * SAMPLES) as f64)).to_screen())
    }
}
