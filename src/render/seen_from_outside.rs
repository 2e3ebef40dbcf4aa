//! Pictures of surfaces with closed forms, looked at pixel by pixel.

use crate::camera::{Camera, Frame};
use crate::landing::{MET, land};
use crate::lent_threads::on_this_thread;
use crate::patch::Patch;
use crate::sample::{ball, creased, surface, two_bowls};
use crate::tile::{CHORD, NOTHING, SAMPLES, SIDE, TILE, Tile};
use crate::{Job, Options, Picture, RenderError, Style, Surface, View, render};
use isospline_artifact::kinds::Patches;
use isospline_geometry::Vec3;
use isospline_implicit::ClosureField;

fn ball_field() -> ClosureField {
    ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0).with_gradient(|p: Vec3| 2.0 * p)
}

fn draw(surface: &Surface<'_>, options: &Options) -> Result<Picture, RenderError> {
    let job = Job { surface, field: &ball_field(), unit: "mm", options };
    render(&job, &on_this_thread)
}

fn small(style: Style, view: View) -> Options {
    Options { width: 200, height: 160, style, view, ..Options::default() }
}

fn pixel(picture: &Picture, x: usize, y: usize) -> [u8; 3] {
    let at = 3 * (y * picture.width() as usize + x);
    picture.rgb()[at..at + 3].try_into().unwrap()
}

fn brightness(picture: &Picture, x: usize, y: usize) -> u32 {
    pixel(picture, x, y).iter().map(|&c| u32::from(c)).sum()
}

#[test]
fn a_ball_is_a_disc_of_its_radius() {
    let (position, face) = ball(40);
    let ball = Surface::from_mesh(&position, &face).unwrap();
    for perspective_deg in [0.0, 50.0] {
        let view = View { perspective_deg, ..View::default() };
        let picture = draw(&ball, &small(Style::Zebra, view)).unwrap();
        let camera = picture.camera();
        let [x0, y0] = camera.pixel(Vec3::zeros());
        // The silhouette lies before the middle: it is larger by one over the cosine of the
        // half angle that the ball fills.
        let radius = camera.scale() / (0.5 * perspective_deg.to_radians()).cos();
        for (y, x) in (0..160).flat_map(|y| (0..200).map(move |x| (y, x))) {
            let (dx, dy) = (x as f64 + 0.5 - x0, y as f64 + 0.5 - y0);
            let from_middle = (dx * dx + dy * dy).sqrt();
            let is_white = pixel(&picture, x, y) == [255; 3];
            assert!(is_white || from_middle < radius + 0.8, "{x} {y} {from_middle} {radius}");
            assert!(!is_white || from_middle > radius - 0.8, "{x} {y} {from_middle} {radius}");
        }
    }
}

/// Hands every sample that sees the surface to `take`, with its place in the picture.
fn each_hit(
    rows: &Patches,
    view: View,
    mut take: impl FnMut(&Camera, [f64; 2], crate::landing::Hit),
) {
    let surface = surface(rows);
    let frame = Frame { width: TILE as f64, height: TILE as f64 };
    let camera = Camera::fitted(view, &surface, frame, &on_this_thread).unwrap();
    let patches: Vec<Patch> = (0..surface.n_faces()).map(|f| Patch::new(&surface.net(f))).collect();
    let mut tile = Tile::new([0, 0]);
    for (place, patch) in (0u32..).zip(&patches) {
        tile.enter(&camera, place, patch);
    }
    for (j, i) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (j, i))) {
        let seen = tile.seen(i, j);
        if seen.patch != NOTHING {
            let (patch, start) = (&patches[seen.patch as usize], seen.at.map(f64::from));
            let at = tile.place(i, j);
            take(&camera, at, land(&camera, patch, seen.patch, at, start, seen.is_back));
        }
    }
}

#[test]
fn every_sample_shows_the_surface_at_its_own_place() {
    let rows = two_bowls(0.0);
    for perspective_deg in [0.0, 45.0] {
        let view = View { azimuth_deg: 30.0, elevation_deg: 75.0, perspective_deg };
        let mut n_hits = 0;
        let mut n_off = 0;
        let mut seen_by = None;
        each_hit(&rows, view, |camera, at, hit| {
            n_hits += 1;
            seen_by = Some(*camera);
            let found = camera.pixel(hit.point);
            let off = (found[0] - at[0]).abs().max((found[1] - at[1]).abs());
            // Samples that see the border by the reach of its triangles show the border.
            n_off += u32::from(off > MET);
            assert!(off < 2.5 * CHORD, "{off}");
            let [x, y] = [hit.point.x, hit.point.y];
            assert!((hit.point.z - 0.5 * (x * x + y * y)).abs() < 1e-13);
            let slope = 1.0 + x * x + y * y;
            let normal = Vec3::new(-x, -y, 1.0) / slope.sqrt();
            assert!((hit.normal - normal).norm() < 1e-12);
            let mean = (2.0 + x * x + y * y) / (2.0 * slope * slope.sqrt());
            assert!((hit.curvature.mean - mean).abs() < 1e-11);
            assert!((hit.curvature.gaussian - 1.0 / (slope * slope)).abs() < 1e-11);
        });
        // Along the border, as many samples as lie in the reach of triangles that are themselves
        // off the border by as much.
        let reach = 2.0 * border_length(seen_by.unwrap()) * CHORD * (SAMPLES * SAMPLES) as f64;
        assert!(n_hits > 20_000 && f64::from(n_off) < reach, "{n_off} of {n_hits}, {reach}");
    }
}

/// Length in the picture of the border of the bowl over the square, pixels.
fn border_length(camera: Camera) -> f64 {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let mut length = 0.0;
    for (from, to) in corners.iter().zip(&corners[1..]) {
        let at = |step: i32| {
            let t = f64::from(step) / 100.0;
            let [x, y] = [0, 1].map(|k| from[k] + t * (to[k] - from[k]));
            camera.pixel(Vec3::new(x, y, 0.5 * (x * x + y * y)))
        };
        for step in 0..100 {
            let ([x0, y0], [x1, y1]) = (at(step), at(step + 1));
            length += ((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)).sqrt();
        }
    }
    length
}

/// Part of the pixels along the shared diagonal whose stripe is another on its two sides.
fn broken_stripes(rows: &Patches) -> f64 {
    let view = View { azimuth_deg: 20.0, elevation_deg: 60.0, perspective_deg: 0.0 };
    let surface = surface(rows);
    let options = Options { width: 420, height: 420, ..small(Style::Zebra, view) };
    let picture = draw(&surface, &options).unwrap();
    let (mut differ, mut all) = (0.0, 0.0);
    for step in 1..200 {
        let s = -0.95 + 1.9 * f64::from(step) / 200.0;
        let [x, y] = picture.camera().pixel(Vec3::new(s, s, s * s));
        let [x1, y1] = picture.camera().pixel(Vec3::new(s + 0.01, s - 0.01, s * s));
        let length = ((x1 - x) * (x1 - x) + (y1 - y) * (y1 - y)).sqrt();
        let across = [1.4 * (x1 - x) / length, 1.4 * (y1 - y) / length];
        let at = |side: f64| {
            let [x, y] = [x + side * across[0], y + side * across[1]];
            brightness(&picture, x as usize, y as usize) > 330
        };
        all += 1.0;
        differ += f64::from(u32::from(at(1.0) != at(-1.0)));
    }
    differ / all
}

#[test]
fn stripes_run_on_where_tangent_planes_agree_and_break_where_they_do_not() {
    let [smooth, bent, broken] =
        [two_bowls(0.0), two_bowls(0.4), creased(0.4)].map(|rows| broken_stripes(&rows));
    assert!(smooth < 0.2 && bent < 0.2, "{smooth} {bent}");
    assert!(broken > 0.4, "{broken}");
}

#[test]
fn the_order_of_the_work_does_not_change_the_picture() {
    let rows = two_bowls(0.3);
    let surface = surface(&rows);
    let backwards = |n: usize, body: &(dyn Fn(usize) + Sync)| (0..n).rev().for_each(body);
    for style in Style::ALL {
        let options = Options { width: 300, height: 70, ..small(style, View::default()) };
        let job = Job { surface: &surface, field: &ball_field(), unit: "mm", options: &options };
        let [one, other] = [render(&job, &on_this_thread), render(&job, &backwards)];
        assert!(one.unwrap().rgb() == other.unwrap().rgb(), "{style:?}");
    }
}

#[test]
fn neighbours_cut_into_other_steps_leave_no_gap() {
    // Flat beside curved: one step beside many along the shared diagonal.
    let rows = two_bowls(2.0);
    let view = View { azimuth_deg: -90.0, elevation_deg: 90.0, perspective_deg: 0.0 };
    let picture = draw(&surface(&rows), &small(Style::Patches, view)).unwrap();
    for step in 1..400 {
        let s = -0.99 + 1.98 * f64::from(step) / 400.0;
        let [x, y] = picture.camera().pixel(Vec3::new(s, s, s * s));
        let found = pixel(&picture, x as usize, y as usize);
        // The border of the patches is drawn dark over the diagonal.
        assert!(found.iter().all(|&c| c < 200), "{s} {found:?}");
    }
}

#[test]
fn nets_are_hidden_by_the_surface_before_them() {
    // The control points of a bowl lie below it.
    let rows = two_bowls(0.0);
    let ink = |elevation_deg: f64| {
        let view = View { azimuth_deg: -90.0, elevation_deg, perspective_deg: 0.0 };
        let picture = draw(&surface(&rows), &small(Style::Net, view)).unwrap();
        let is_red = |c: &&[u8]| c[0] > 150 && c[1] < 100;
        picture.rgb().chunks_exact(3).filter(is_red).count()
    };
    let (above, below) = (ink(90.0), ink(-90.0));
    assert!(below > 3 * above && above > 0, "{above} {below}");
}

#[test]
fn a_legend_takes_its_room_off_the_surface() {
    let rows = two_bowls(0.0);
    let wide = |style| Options { width: 600, height: 300, ..small(style, View::default()) };
    let with = draw(&surface(&rows), &wide(Style::Curvature)).unwrap();
    let without = draw(&surface(&rows), &wide(Style::Gold)).unwrap();
    let right = |p: &Picture| (0..300).any(|y| (460..600).any(|x| pixel(p, x, y) != [255; 3]));
    assert!(right(&with));
    assert!(
        with.camera().pixel(Vec3::zeros())[0] + 50.0 < without.camera().pixel(Vec3::zeros())[0]
    );
}

#[test]
fn values_beyond_a_given_range_have_the_colour_of_its_end() {
    let rows = two_bowls(0.0);
    let with = |range| {
        let options = Options { range: Some(range), ..small(Style::Curvature, View::default()) };
        draw(&surface(&rows), &options).unwrap()
    };
    // All mean curvatures of the bowl lie between 0.3 and 1.
    let (far, near) = (with([-2.0, -1.0]), with([-2.0, 0.1]));
    assert!(far.rgb() == near.rgb());
    assert!(far.rgb() != with([0.0, 1.0]).rgb());
    let options = Options { range: Some([1.0, 1.0]), ..small(Style::Error, View::default()) };
    assert!(matches!(draw(&surface(&rows), &options), Err(RenderError::Range { .. })));
}

#[test]
fn what_is_not_a_number_is_left_out_or_refused() {
    let (mut position, face) = ball(4);
    position[5][1] = f64::NAN;
    let ball = Surface::from_mesh(&position, &face).unwrap();
    for style in Style::ALL {
        assert!(draw(&ball, &small(style, View::default())).is_ok(), "{style:?}");
    }
    let nowhere = vec![[f64::NAN; 3]; position.len()];
    let lost = Surface::from_mesh(&nowhere, &face).unwrap();
    assert!(matches!(draw(&lost, &Options::default()), Err(RenderError::Extent)));
    let point = vec![[1.0; 3]; position.len()];
    let small_surface = Surface::from_mesh(&point, &face).unwrap();
    assert!(matches!(draw(&small_surface, &Options::default()), Err(RenderError::Extent)));
}
