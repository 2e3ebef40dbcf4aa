//! Meshes of a sphere with vertices of few and of many edges.

use std::fmt::Write;

type Point = [f64; 3];

/// An icosahedron with a vertex over each face: valence 3 there, 10 at the others.
pub(crate) fn triakis_icosahedron() -> String {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points: Vec<Point> = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        points.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    let near = |i: usize, j: usize| {
        let d = minus(points[i], points[j]);
        (dot(d, d) - 4.0).abs() < 1e-9
    };
    let corners = (0..12).flat_map(|i| (0..i).flat_map(move |j| (0..j).map(move |k| [i, j, k])));
    let (mut tips, mut faces) = (Vec::new(), String::new());
    for [i, j, k] in corners.filter(|&[i, j, k]| near(i, j) && near(j, k) && near(k, i)) {
        let [p, q, r] = [points[i], points[j], points[k]];
        let tip: Point = std::array::from_fn(|a| (p[a] + q[a] + r[a]) / 3.0);
        let outward = dot(cross(minus(q, p), minus(r, p)), tip) > 0.0;
        let [a, b, c] = if outward { [i + 1, j + 1, k + 1] } else { [i + 1, k + 1, j + 1] };
        tips.push(tip);
        let t = points.len() + tips.len();
        let _ = write!(faces, "f {a} {b} {t}\nf {b} {c} {t}\nf {c} {a} {t}\n");
    }
    let mut text = String::new();
    for p in points.iter().chain(&tips) {
        let length = dot(*p, *p).sqrt();
        let _ = writeln!(text, "v {} {} {}", p[0] / length, p[1] / length, p[2] / length);
    }
    text + &faces
}

/// A globe of `sides` meridians and `rings` circles of latitude: the poles have valence `sides`.
pub(crate) fn globe(sides: usize, rings: usize) -> String {
    let (mut text, mut faces) = ("v 0 0 1\n".to_owned(), String::new());
    for ring in 1..=rings {
        let down = std::f64::consts::PI * ring as f64 / (rings + 1) as f64;
        for side in 0..sides {
            let turn = std::f64::consts::TAU * side as f64 / sides as f64;
            let (s, c) = (down.sin(), down.cos());
            let _ = writeln!(text, "v {} {} {c}", s * turn.cos(), s * turn.sin());
        }
    }
    text += "v 0 0 -1\n";
    let at = |ring: usize, side: usize| 2 + ring * sides + side % sides;
    let south = 2 + rings * sides;
    for side in 0..sides {
        let _ = writeln!(faces, "f 1 {} {}", at(0, side), at(0, side + 1));
        for ring in 1..rings {
            let [a, b] = [at(ring - 1, side), at(ring - 1, side + 1)];
            let [c, d] = [at(ring, side), at(ring, side + 1)];
            let _ = write!(faces, "f {a} {c} {d}\nf {a} {d} {b}\n");
        }
        let _ = writeln!(faces, "f {south} {} {}", at(rings - 1, side + 1), at(rings - 1, side));
    }
    text + &faces
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
