//! `BezierView` text: a triangular Bézier patch (kind 3) a face, in one group.
//!
//! Control points stand by rows from the base, the edge from corner 0 to corner 1, up to corner 2.
//! Numbers are the shortest decimals that give back every bit.

use crate::{About, ExportError};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::index;
use std::io::Write;

/// Kind of a triangular patch of a total degree.
const TRIANGLE: u32 = 3;

pub(crate) fn write(
    patches: &PatchesView<'_>,
    about: &About,
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let degree = patches.degree();
    writeln!(out, "Group 0 {}", word(&about.name))?;
    for f in 0..patches.face.len() {
        let net = patches.own_net(f);
        writeln!(out, "{TRIANGLE}\n{degree}")?;
        for row in 0..=degree {
            for step in 0..=degree - row {
                let p = net[index([degree - row - step, step, row])];
                writeln!(out, "{:?} {:?} {:?}", p.x, p.y, p.z)?;
            }
        }
    }
    Ok(())
}

/// A name as one word of plain characters: the format has no quotes.
fn word(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    if name.is_empty() { "surface".to_owned() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn rows_run_from_the_first_edge_to_the_last_corner() {
        let patches = sample::ball_and_ring();
        let about = About { name: "a ball & ring".to_owned(), ..About::default() };
        let mut out = Vec::new();
        write(&patches.view(), &about, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[..3], ["Group 0 a_ball___ring", "3", "7"]);
        assert_eq!(lines.len(), 1 + 200 * 38);
        let corner = |k: usize| {
            let [x, y, z] = patches.position[patches.face[1][k] as usize];
            format!("{x:?} {y:?} {z:?}")
        };
        // The second patch: its base has eight points, the last point is alone in its row.
        let patch = &lines[1 + 38 + 2..][..36];
        assert_eq!([patch[0], patch[7], patch[35]], [corner(0), corner(1), corner(2)]);
    }

    #[test]
    fn patches_of_degree_6_have_28_points() {
        let patches = sample::of_degree_six(sample::ball_and_ring());
        let mut out = Vec::new();
        write(&patches.view(), &About::default(), &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines[2], lines.len()), ("6", 1 + 200 * 30));
    }
}
