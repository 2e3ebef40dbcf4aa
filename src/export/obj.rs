//! Wavefront OBJ: points, normals, triangles, in text.
//!
//! Numbers are the shortest decimals (at most 17 digits) that give back every bit.

use crate::ExportError;
use crate::tessellation::Tessellation;
use isospline_geometry::Vec3;
use std::io::{self, Write};

pub(crate) fn write(mesh: &Tessellation<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    writeln!(out, "# isospline: {} points, {} triangles", mesh.n_points(), mesh.n_triangles())?;
    mesh.for_each_point(|sample| row(out, "v", &sample.position))?;
    mesh.for_each_point(|sample| row(out, "vn", &sample.normal))?;
    for f in 0..mesh.n_faces() {
        for triangle in mesh.triangles(f) {
            let [a, b, c] = triangle.map(|v| u64::from(v) + 1);
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    Ok(())
}

fn row(out: &mut dyn Write, tag: &str, p: &Vec3) -> io::Result<()> {
    // Debug output of f64 is the shortest that reads back to the same bits.
    writeln!(out, "{tag} {:?} {:?} {:?}", p.x, p.y, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use crate::tessellation::Density;

    #[test]
    fn every_coordinate_reads_back_to_the_same_bits() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let mesh = Tessellation::new(&view, Density::Samples(3)).unwrap();
        let mut text = Vec::new();
        write(&mesh, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let rows = |tag: &'static str| {
            text.lines().filter_map(move |line| line.strip_prefix(tag)?.strip_prefix(' '))
        };
        let mut points = rows("v");
        let all_agree = mesh.for_each_point(|sample| {
            let row = points.next().unwrap();
            let found: Vec<f64> = row.split(' ').map(|x| x.parse().unwrap()).collect();
            let same = (0..3).all(|k| found[k].to_bits() == sample.position[k].to_bits());
            if same { Ok(()) } else { Err(row.to_owned()) }
        });
        assert_eq!(all_agree, Ok(()));
        assert_eq!(points.next(), None);
        assert_eq!(rows("vn").count() as u64, mesh.n_points());
        assert_eq!(rows("f").count() as u64, mesh.n_triangles());
        let corners = rows("f").flat_map(|row| row.split(' '));
        let highest = corners.map(|c| c.split_once("//").unwrap().0.parse::<u64>().unwrap()).max();
        assert_eq!(highest, Some(mesh.n_points()));
    }
}
