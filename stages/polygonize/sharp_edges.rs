//! Sharp edges and tips of the surface: places where its normal jumps.
//!
//! Kinks of `min`, `max` and `abs` away from the surface do no harm, so the formula alone tells
//! nothing. Here an edge of the mesh whose ends have other normals is halved again and again, the
//! middle moved onto the surface and the half kept that turns more: where the surface is smooth the
//! angle falls with the length, and where it stays though the length is next to nothing, there is
//! an edge of the surface between the ends.

use crate::{PolygonizeError, bulk};
use isospline_geometry::{TriangleMesh, Vec3};
use isospline_implicit::{Field, Jet1};
use isospline_stage::{Ctx, Serial, map};

/// Angle that counts: patches over a smaller one miss the surface by less than they do elsewhere.
const LEAST_ANGLE_DEG: f64 = 3.0;
/// After one halving a smooth edge keeps about half of its angle; those that keep more than this
/// are looked at further.
const SUSPECT: f64 = 0.7;
/// Halvings at most. Middles that are moved may take more than a half.
const MOST_HALVINGS: usize = 60;
/// Length, of the edge of the mesh, below which an angle that stayed is one of the surface: a
/// rounding as narrow as this would count as sharp.
const SHORT: f64 = 1e-7;
/// Newton steps that move a middle onto the surface.
const STEPS: usize = 3;
/// Faces whose edges are looked at in a task.
const FACES_A_TASK: usize = 512;
/// Length of the gradient, of the median over the mesh, below which a place is singular, not sharp.
const LEAST_SLOPE: f64 = 1e-6;

/// Whether the surface near `mesh` has no sharp edge.
///
/// # Errors
/// [`PolygonizeError::SharpEdge`] with the sharpest that was found.
pub(crate) fn none_on(ctx: &Ctx<'_>, mesh: &TriangleMesh) -> Result<(), PolygonizeError> {
    let ends = gradients(ctx, &mesh.positions);
    let mut chords = suspects(ctx, mesh, &ends);
    for _ in 0..MOST_HALVINGS {
        chords.retain(Chord::turns);
        if chords.iter().all(Chord::is_short) {
            break;
        }
        halve(ctx, &mut chords, STEPS);
    }
    let least_slope = LEAST_SLOPE * median_slope(&ends);
    let is_sharp = |c: &&Chord| c.turns() && c.is_short() && c.is_on_surface(least_slope);
    let sharpest = chords.iter().filter(is_sharp).max_by(|a, b| a.turn().total_cmp(&b.turn()));
    sharpest.map_or(Ok(()), |chord| Err(chord.told(ctx.field)))
}

/// Halves of the edges of a mesh whose ends have other normals, where they keep most of the angle;
/// in the order of the faces.
fn suspects(ctx: &Ctx<'_>, mesh: &TriangleMesh, ends: &[Jet1]) -> Vec<Chord> {
    let normals: Vec<Vec3> = ends.iter().map(|jet| jet.gradient / jet.gradient.norm()).collect();
    // A little less than the angle that counts: the chord of it on the unit circle, squared.
    let least = 2.0 - 2.0 * libm::cos((0.99 * LEAST_ANGLE_DEG).to_radians());
    let shares: Vec<_> = mesh.faces.chunks(FACES_A_TASK).collect();
    let found: Vec<Vec<Chord>> = map(ctx.host, shares.len(), |share| {
        let sides = shares[share].iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        // The face on the other side has the edge the other way round.
        let turning = sides.filter(|[a, b]| {
            a < b && (normals[*a as usize] - normals[*b as usize]).norm_squared() >= least
        });
        let end = |v: u32| End { at: mesh.positions[v as usize], jet: ends[v as usize] };
        let edges = turning.map(|[a, b]| Chord::new(end(a), end(b))).filter(Chord::turns);
        let edges: Vec<Chord> = edges.collect();
        let mut halves = edges.clone();
        halve(&Ctx { host: &Serial, ..*ctx }, &mut halves, 0);
        let pairs = halves.into_iter().zip(&edges);
        pairs.filter(|(half, edge)| half.keeps_angle_of(edge)).map(|(half, _)| half).collect()
    });
    found.concat()
}

/// Halves chords, keeping the half that turns more; middles are moved onto the surface by so many
/// steps.
fn halve(ctx: &Ctx<'_>, chords: &mut [Chord], steps: usize) {
    let mut middles: Vec<Vec3> = chords.iter().map(|c| 0.5 * (c.a.at + c.b.at)).collect();
    for _ in 0..steps {
        let jets = gradients(ctx, &middles);
        for (at, jet) in middles.iter_mut().zip(jets) {
            let step = jet.gradient * (jet.value / jet.gradient.norm_squared());
            // Not onto another sheet, and nowhere where the gradient is no number or zero.
            if step.iter().all(|x| x.is_finite()) {
                *at -= step;
            }
        }
    }
    let jets = gradients(ctx, &middles);
    for ((chord, at), jet) in chords.iter_mut().zip(middles).zip(jets) {
        let middle = End { at, jet };
        let halves = [Chord { b: middle, ..*chord }, Chord { a: middle, ..*chord }];
        *chord = if halves[0].turn() >= halves[1].turn() { halves[0] } else { halves[1] };
    }
}

fn gradients(ctx: &Ctx<'_>, points: &[Vec3]) -> Vec<Jet1> {
    bulk::shares(ctx.host, points, |points| {
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        ctx.field.gradients(points, &mut jets);
        jets
    })
}

fn median_slope(jets: &[Jet1]) -> f64 {
    let mut slopes: Vec<f64> = jets.iter().map(|jet| jet.gradient.norm()).collect();
    let middle = slopes.len() / 2;
    if slopes.is_empty() { 0.0 } else { *slopes.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[derive(Clone, Copy)]
struct End {
    at: Vec3,
    jet: Jet1,
}

/// A part of an edge of the mesh, or of the way along the surface beside it.
#[derive(Clone, Copy)]
struct Chord {
    a: End,
    b: End,
    /// Length of the edge of the mesh.
    whole: f64,
}

impl Chord {
    fn new(a: End, b: End) -> Self {
        Self { a, b, whole: (a.at - b.at).norm() }
    }

    fn length(&self) -> f64 {
        (self.a.at - self.b.at).norm()
    }

    fn is_short(&self) -> bool {
        self.length() <= SHORT * self.whole
    }

    /// Grows with the angle between the normals, from 0 to 4; NaN counts as none.
    fn turn(&self) -> f64 {
        let unit = |end: &End| end.jet.gradient / end.jet.gradient.norm();
        let turn = (unit(&self.a) - unit(&self.b)).norm_squared();
        if turn.is_nan() { 0.0 } else { turn }
    }

    fn angle_deg(&self) -> f64 {
        // The chord of the unit circle: exact for small angles too. 2 asin(t / 2) by the tangent.
        let half_sq = 0.25 * self.turn().min(4.0);
        2.0 * libm::atan2(half_sq.sqrt(), (1.0 - half_sq).max(0.0).sqrt()).to_degrees()
    }

    /// Whether it has so much of the angle of another that it may lie on a sharp edge.
    fn keeps_angle_of(&self, whole: &Self) -> bool {
        // Of two angles below 180 degrees the chords on the unit circle have the larger ratio
        // to 1: most edges are told by them, without arcs.
        let falls = self.turn() < 0.999 * SUSPECT * SUSPECT * whole.turn();
        !falls && self.angle_deg() > SUSPECT * whole.angle_deg()
    }

    fn turns(&self) -> bool {
        self.angle_deg() >= LEAST_ANGLE_DEG
    }

    /// Whether both ends are on the surface, as near as counts, and not singular.
    fn is_on_surface(&self, least_slope: f64) -> bool {
        [&self.a, &self.b].into_iter().all(|end| {
            let slope = end.jet.gradient.norm();
            slope >= least_slope && end.jet.value.abs() <= 10.0 * SHORT * self.whole * slope
        })
    }

    fn told(&self, field: &dyn Field) -> PolygonizeError {
        PolygonizeError::SharpEdge {
            at: 0.5 * (self.a.at + self.b.at),
            angle_deg: self.angle_deg(),
            kinks: field.kinks_between(self.a.at, self.b.at),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{PolygonizeError, PolygonizeParams, polygonize, sharp_edges};
    use isospline_geometry::{Aabb, Vec3};
    use isospline_implicit::{Field, Formula};
    use isospline_stage::{Counters, Ctx, Serial};

    fn look(text: &str) -> Result<(), PolygonizeError> {
        let field = Formula::parse(text, &std::collections::BTreeMap::new()).unwrap();
        let domain = Aabb::new(Vec3::repeat(-1.6), Vec3::repeat(1.61));
        let ctx = Ctx { field: &field, domain, host: &Serial };
        let params = PolygonizeParams { faces: 1000, ..PolygonizeParams::default() };
        let (mesh, _) = polygonize(&ctx, &params, &mut Counters::default()).unwrap();
        let found = sharp_edges::none_on(&ctx, &mesh);
        if let Err(PolygonizeError::SharpEdge { at, .. }) = &found {
            assert!(field.value(*at).abs() < 1e-6, "{at}");
        }
        found
    }

    #[track_caller]
    fn is_sharp(text: &str, angle: f64, names: &[&str]) {
        let Err(PolygonizeError::SharpEdge { angle_deg, kinks, .. }) = look(text) else {
            panic!("{text} is not sharp")
        };
        assert!((angle_deg - angle).abs() < 0.5, "{text}: {angle_deg}");
        assert_eq!(kinks, names, "{text}");
    }

    #[test]
    fn edges_of_min_max_and_abs_are_found_with_their_angle() {
        is_sharp("max(x^2+y^2+z^2-1, z-0.5)", 60.0, &["max"]);
        is_sharp("min((x-0.5)^2+y^2+z^2-1, (x+0.5)^2+y^2+z^2-1)", 60.0, &["min"]);
        is_sharp("x^2+y^2+(abs(z)+0.5)^2-1", 60.0, &["abs"]);
    }

    #[test]
    fn an_edge_of_five_degrees_is_found_and_one_of_one_degree_is_let_pass() {
        // Spheres about x = +-d meet at twice the angle whose sine is d.
        let lens = |d: f64| format!("max((x-{d})^2+y^2+z^2-1, (x+{d})^2+y^2+z^2-1)");
        is_sharp(&lens(0.0436194), 5.0, &["max"]);
        look(&lens(0.0087265)).unwrap();
    }

    #[test]
    fn kinks_off_the_surface_and_narrow_bends_are_no_edges() {
        for text in [
            "max(x^2+y^2+z^2-1, z-1.5)",
            "x^2+y^2+z^2-1+0.1*abs(z-1.3)",
            "min((x-0.8)^2+y^2+z^2-0.2, (x+0.8)^2+y^2+z^2-0.2)",
            "smax(x^2+y^2+z^2-1, z-0.5, 0.05)",
            "x^10+y^10+z^10-1",
        ] {
            look(text).unwrap();
        }
    }
}
