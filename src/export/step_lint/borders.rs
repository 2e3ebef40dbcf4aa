//! Surfaces of one polynomial span, and their borders against the curves of the edges.

use super::StepDefect;
use super::entities::{Found, Model, Node};
use super::part21::Value;
use super::shells::{Face, Side};

type Point = [f64; 3];

/// The net of the surface of a face.
#[derive(Debug)]
pub(super) struct Net {
    /// Degree in u and v.
    pub(super) degree: [usize; 2],
    /// `(degree[0] + 1) (degree[1] + 1)` points, v running faster.
    pub(super) points: Vec<Point>,
    /// Whether u cross v points against the normal of the face.
    pub(super) is_turned: bool,
}

/// Reads the surface of a face and notes where its border is not the curves of the edges.
pub(super) fn judge(model: &Model<'_>, face: &Face, defects: &mut Vec<StepDefect>) -> Found<Net> {
    let net = read_net(model, face)?;
    let mut borders = net.borders();
    if net.is_turned {
        turned(&mut borders);
    }
    let curves = face.sides.iter().map(|side| read_curve(model, face, side, defects));
    let curves = curves.collect::<Found<Vec<_>>>()?;
    if curves.len() != borders.len() {
        let (found, expected) = (curves.len(), borders.len());
        return Err(StepDefect::Count { entity: face.number, what: "sides", found, expected });
    }
    let n = curves.len();
    let agree = |borders: &[Vec<Point>], turn: usize| -> Vec<bool> {
        (0..n).map(|k| same_bits(&curves[k], &borders[(k + turn) % n])).collect()
    };
    let count = |found: &[bool]| found.iter().filter(|same| **same).count();
    let best = |borders: &[Vec<Point>]| {
        let all = (0..n).map(|turn| agree(borders, turn));
        all.max_by_key(|found| count(found)).unwrap_or_default()
    };
    let found = best(&borders);
    let mut other_way = borders;
    turned(&mut other_way);
    if count(&best(&other_way)) > count(&found) {
        return Err(StepDefect::TurnedFace { face: face.number });
    }
    for (side, _) in face.sides.iter().zip(&found).filter(|(_, same)| !**same) {
        defects.push(StepDefect::Border { face: face.number, edge: side.edge });
    }
    Ok(net)
}

fn same_bits(a: &[Point], b: &[Point]) -> bool {
    let bits = |p: &Point| p.map(f64::to_bits);
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// Curves in reverse order and direction.
fn turned(curves: &mut [Vec<Point>]) {
    curves.reverse();
    for curve in curves {
        curve.reverse();
    }
}

impl Net {
    fn at(&self, i: usize, j: usize) -> Point {
        self.points[i * (self.degree[1] + 1) + j]
    }

    /// The sides of the net, counter-clockwise in u and v, without any that is a single point.
    fn borders(&self) -> Vec<Vec<Point>> {
        let [m, n] = self.degree;
        let mut sides: Vec<Vec<Point>> = vec![
            (0..=m).map(|i| self.at(i, 0)).collect(),
            (0..=n).map(|j| self.at(m, j)).collect(),
            (0..=m).rev().map(|i| self.at(i, n)).collect(),
            (0..=n).rev().map(|j| self.at(0, j)).collect(),
        ];
        sides.retain(|side| side.iter().any(|p| p.map(f64::to_bits) != side[0].map(f64::to_bits)));
        sides
    }
}

const SURFACE: &str = "B_SPLINE_SURFACE_WITH_KNOTS";
const CURVE: &str = "B_SPLINE_CURVE_WITH_KNOTS";

fn read_net(model: &Model<'_>, face: &Face) -> Found<Net> {
    let wanted = "a surface with knots";
    let node = model.get(face.number, face.surface, &[SURFACE], wanted)?;
    let degree = [degree(&node, 1)?, degree(&node, 2)?];
    let rows = node.list(3)?;
    require_count(&node, "rows of control points", rows.len(), degree[0] + 1)?;
    let mut points = Vec::with_capacity((degree[0] + 1) * (degree[1] + 1));
    for row in rows {
        let Value::List(row) = row else { return Err(node.wrong(3, "a list of lists")) };
        require_count(&node, "control points in a row", row.len(), degree[1] + 1)?;
        for value in row {
            let Value::Reference(point) = value else {
                return Err(node.wrong(3, "a list of lists of references"));
            };
            points.push(model.point(node.number, *point)?);
        }
    }
    for (k, degree) in degree.into_iter().enumerate() {
        require_one_span(&node, [8 + k, 10 + k], degree)?;
    }
    Ok(Net { degree, points, is_turned: !face.same_sense })
}

/// Points of the curve of a side, in the order of the loop.
fn read_curve(
    model: &Model<'_>,
    face: &Face,
    side: &Side,
    defects: &mut Vec<StepDefect>,
) -> Found<Vec<Point>> {
    let edge = model.get(face.number, side.edge, &["EDGE_CURVE"], "an edge")?;
    let kinds = [CURVE, "SURFACE_CURVE"];
    let mut curve = model.get(edge.number, edge.reference(3)?, &kinds, "a curve")?;
    if curve.kind == "SURFACE_CURVE" {
        let in_space = curve.reference(1)?;
        let points = read_points(model, &model.get(curve.number, in_space, &[CURVE], "a curve")?)?;
        if !is_side_of(model, &curve, face.surface, &points)? {
            defects.push(StepDefect::Pcurve { edge: side.edge });
        }
        curve = model.get(curve.number, in_space, &[CURVE], "a curve")?;
    }
    let mut points = read_points(model, &curve)?;
    if !edge.flag(4)? {
        points.reverse();
    }
    if !side.forward {
        points.reverse();
    }
    for (vertex, end) in side.ends.into_iter().zip([0, points.len() - 1]) {
        let vertex = model.get(edge.number, vertex, &["VERTEX_POINT"], "a vertex")?;
        let at = model.point(vertex.number, vertex.reference(1)?)?;
        if !same_bits(&[at], &points[end..=end]) {
            defects.push(StepDefect::Ends { edge: side.edge });
            break;
        }
    }
    Ok(points)
}

fn read_points(model: &Model<'_>, curve: &Node<'_>) -> Found<Vec<Point>> {
    let degree = degree(curve, 1)?;
    let points = curve.references(2)?;
    require_count(curve, "control points", points.len(), degree + 1)?;
    require_one_span(curve, [6, 7], degree)?;
    points.into_iter().map(|p| model.point(curve.number, p)).collect()
}

/// Whether one of the curves in parameters lies on `surface` and runs along the points.
fn is_side_of(model: &Model<'_>, curve: &Node<'_>, surface: u64, points: &[Point]) -> Found<bool> {
    for pcurve in curve.references(2)? {
        let pcurve = model.get(curve.number, pcurve, &["PCURVE"], "a curve in parameters")?;
        if pcurve.reference(1)? != surface {
            continue;
        }
        let ends = line_ends(model, &pcurve)?;
        let node = model.get(pcurve.number, surface, &[SURFACE], "a surface with knots")?;
        let rows = node.list(3)?;
        let corner = |[u, v]: [f64; 2]| -> Found<Option<Point>> {
            let pick = |at: f64, n: usize| if at > 0.5 { n.checked_sub(1) } else { Some(0) };
            let row = pick(u, rows.len()).and_then(|i| match rows.get(i)? {
                Value::List(row) => Some(row),
                _ => None,
            });
            let value = row.and_then(|row| row.get(pick(v, row.len())?));
            let Some(Value::Reference(point)) = value else { return Ok(None) };
            model.point(node.number, *point).map(Some)
        };
        let found = [corner(ends[0])?, corner(ends[1])?];
        let expected = [points.first().copied(), points.last().copied()];
        let bits = |ends: [Option<Point>; 2]| ends.map(|p| p.map(|p| p.map(f64::to_bits)));
        let at_corners = ends.as_flattened().iter().all(|x| [0.0, 1.0].contains(x));
        return Ok(at_corners && bits(found) == bits(expected));
    }
    Ok(false)
}

/// Parameters at 0 and 1 of the straight line of a curve in parameters.
fn line_ends(model: &Model<'_>, pcurve: &Node<'_>) -> Found<[[f64; 2]; 2]> {
    let kinds = ["DEFINITIONAL_REPRESENTATION"];
    let held = model.get(pcurve.number, pcurve.reference(2)?, &kinds, "a representation")?;
    let items = held.references(1)?;
    let line = *items.first().ok_or_else(|| held.wrong(1, "a line"))?;
    let line = model.get(held.number, line, &["LINE"], "a line")?;
    let start = model.get(line.number, line.reference(1)?, &["CARTESIAN_POINT"], "a point")?;
    let vector = model.get(line.number, line.reference(2)?, &["VECTOR"], "a vector")?;
    let way = model.get(vector.number, vector.reference(1)?, &["DIRECTION"], "a direction")?;
    let (length, start, way) = (vector.number(2)?, start.numbers(1)?, way.numbers(1)?);
    let (&[x, y], &[dx, dy]) = (&start[..], &way[..]) else {
        return Err(line.wrong(1, "a line in a plane"));
    };
    Ok([[x, y], [x + length * dx, y + length * dy]])
}

fn degree(node: &Node<'_>, k: usize) -> Found<usize> {
    let degree = node.number(k)?;
    let fits = (1.0..=64.0).contains(&degree) && degree.fract() == 0.0;
    if fits { Ok(degree as usize) } else { Err(node.wrong(k, "a degree from 1 to 64")) }
}

fn require_count(node: &Node<'_>, what: &'static str, found: usize, expected: usize) -> Found<()> {
    if found == expected {
        return Ok(());
    }
    Err(StepDefect::Count { entity: node.number, what, found, expected })
}

/// Two knots, 0 and 1, each `degree + 1` times.
fn require_one_span(node: &Node<'_>, [times, knots]: [usize; 2], degree: usize) -> Found<()> {
    let wanted = "the multiplicities of one span";
    if node.numbers(times)? != [degree as f64 + 1.0; 2] {
        return Err(node.wrong(times, wanted));
    }
    if node.numbers(knots)? != [0.0, 1.0] {
        return Err(node.wrong(knots, "the knots 0 and 1"));
    }
    Ok(())
}
