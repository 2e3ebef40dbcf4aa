//! Gmsh MSH 4.1, text: triangles of order 1 to 7 through points of the patches.
//!
//! Order 7 is exact: a polynomial of degree 7 is given by its values at the nodes. Every component
//! is a surface entity, every solid a volume entity bounded by its shells. Nodes on an edge are
//! one for both of its faces. Numbers are the shortest decimals that give back every bit.

use crate::ExportError;
use crate::node_order::corners_edges_inside;
use crate::solids::{Shell, Solid, solids};
use crate::tessellation::{Density, Sample, Tessellation};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::Aabb;
use std::io::{self, Write};
use std::ops::Range;

/// Gmsh's number of the triangle of each order from 1.
const TRIANGLES: [u32; 7] = [2, 9, 21, 23, 25, 42, 43];
/// Dimensions of entities.
const SURFACE: u32 = 2;

pub(crate) fn write(
    patches: &PatchesView<'_>,
    order: u32,
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let max = TRIANGLES.len() as u32;
    if !(1..=max).contains(&order) {
        return Err(ExportError::Order { order, max });
    }
    let mesh = Tessellation::new(patches, Density::Samples(order))?;
    let solids = solids(patches);
    let parts: Vec<Part<'_>> = shells(&solids).map(|shell| Part::new(patches, shell)).collect();
    writeln!(out, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
    write_entities(&mesh, &solids, &parts, out)?;
    write_nodes(&mesh, &parts, out)?;
    write_elements(&mesh, order, &parts, out)
}

fn shells(solids: &[Solid]) -> impl Iterator<Item = &Shell> {
    solids.iter().flat_map(|solid| std::iter::once(&solid.outer).chain(&solid.voids))
}

/// A component: what of the surface belongs to it, ascending.
struct Part<'a> {
    vertices: Vec<u32>,
    edges: Vec<u32>,
    faces: &'a [usize],
}

impl<'a> Part<'a> {
    fn new(patches: &PatchesView<'_>, shell: &'a Shell) -> Self {
        let sorted = |mut rows: Vec<u32>| {
            rows.sort_unstable();
            rows.dedup();
            rows
        };
        let faces = &shell.faces;
        let vertices = faces.iter().flat_map(|&f| patches.face[f]).collect();
        let edges = faces.iter().flat_map(|&f| 3 * f..3 * f + 3).map(|h| patches.edge_of[h]);
        Self { vertices: sorted(vertices), edges: sorted(edges.collect()), faces }
    }

    /// Hands on all points of the component, in the order of [`Self::numbers`].
    fn for_each_point(
        &self,
        mesh: &Tessellation<'_>,
        mut take: impl FnMut(Sample) -> io::Result<()>,
    ) -> io::Result<()> {
        self.vertices.iter().try_for_each(|&v| take(mesh.at_vertex(v as usize)))?;
        for &e in &self.edges {
            mesh.on_edge(e as usize).try_for_each(&mut take)?;
        }
        self.faces.iter().try_for_each(|&f| mesh.in_face(f).try_for_each(&mut take))
    }

    /// Numbers of all points of the component.
    fn numbers(&self, mesh: &Tessellation<'_>) -> impl Iterator<Item = u32> {
        let vertices: Vec<Range<u32>> = self.vertices.iter().map(|&v| v..v + 1).collect();
        let edges = self.edges.iter().map(|&e| mesh.numbers_on_edge(e as usize));
        let faces = self.faces.iter().map(|&f| mesh.numbers_in_face(f));
        let all: Vec<Range<u32>> = vertices.into_iter().chain(edges).chain(faces).collect();
        all.into_iter().flatten()
    }
}

fn write_entities(
    mesh: &Tessellation<'_>,
    solids: &[Solid],
    parts: &[Part<'_>],
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    writeln!(out, "$Entities\n0 0 {} {}", parts.len(), solids.len())?;
    let mut boxes = Vec::with_capacity(parts.len());
    for (k, part) in parts.iter().enumerate() {
        let mut bounds = Aabb::EMPTY;
        part.for_each_point(mesh, |sample| {
            bounds = bounds.including(&sample.position);
            Ok(())
        })?;
        write_box(out, k + 1, &bounds)?;
        writeln!(out, " 0 0")?;
        boxes.push(bounds);
    }
    let mut first = 0;
    for (k, solid) in solids.iter().enumerate() {
        let n_shells = 1 + solid.voids.len();
        write_box(out, k + 1, &boxes[first])?;
        write!(out, " 0 {n_shells}")?;
        for tag in first + 1..=first + n_shells {
            write!(out, " {tag}")?;
        }
        writeln!(out)?;
        first += n_shells;
    }
    writeln!(out, "$EndEntities")?;
    Ok(())
}

fn write_box(out: &mut dyn Write, tag: usize, bounds: &Aabb) -> io::Result<()> {
    let (a, b) = (bounds.min, bounds.max);
    write!(out, "{tag} {:?} {:?} {:?} {:?} {:?} {:?}", a.x, a.y, a.z, b.x, b.y, b.z)
}

fn write_nodes(
    mesh: &Tessellation<'_>,
    parts: &[Part<'_>],
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let n = mesh.n_points();
    writeln!(out, "$Nodes\n{} {n} 1 {n}", parts.len())?;
    for (k, part) in parts.iter().enumerate() {
        let count = part.numbers(mesh).count();
        writeln!(out, "{SURFACE} {} 0 {count}", k + 1)?;
        part.numbers(mesh).try_for_each(|number| writeln!(out, "{}", number + 1))?;
        part.for_each_point(mesh, |sample| {
            let p = sample.position;
            writeln!(out, "{:?} {:?} {:?}", p.x, p.y, p.z)
        })?;
    }
    writeln!(out, "$EndNodes")?;
    Ok(())
}

fn write_elements(
    mesh: &Tessellation<'_>,
    order: u32,
    parts: &[Part<'_>],
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let (kind, n) = (TRIANGLES[order as usize - 1], mesh.n_faces());
    let nodes = corners_edges_inside(order as usize);
    writeln!(out, "$Elements\n{} {n} 1 {n}", parts.len())?;
    for (k, part) in parts.iter().enumerate() {
        writeln!(out, "{SURFACE} {} {kind} {}", k + 1, part.faces.len())?;
        for &f in part.faces {
            write!(out, "{}", f + 1)?;
            let numbers = mesh.grid_numbers(f);
            nodes.iter().try_for_each(|&q| write!(out, " {}", numbers[q] + 1))?;
            writeln!(out)?;
        }
    }
    writeln!(out, "$EndElements")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use isospline_geometry::Vec3;
    use isospline_geometry::bezier_triangle::{DEGREE, evaluate, grid};

    fn section<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
        let (_, rest) = text.split_once(&format!("${name}\n")).unwrap();
        rest.split_once(&format!("\n$End{name}\n")).unwrap().0.lines().collect()
    }

    fn numbers<T: std::str::FromStr<Err: std::fmt::Debug>>(line: &str) -> Vec<T> {
        line.split(' ').map(|x| x.parse().unwrap()).collect()
    }

    fn text(order: u32) -> String {
        let mut out = Vec::new();
        write(&sample::hollow_ball_and_ring().view(), order, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn nodes_of_every_element_are_points_of_its_patch_in_gmsh_order() {
        let patches = sample::hollow_ball_and_ring();
        for order in [1, 2, 3, 7] {
            let text = text(order);
            let mut lines = section(&text, "Nodes").into_iter();
            let head: Vec<usize> = numbers(lines.next().unwrap());
            let mut points = vec![None; head[1] + 1];
            while let Some(block) = lines.next() {
                let count = numbers::<usize>(block)[3];
                let tags: Vec<usize> =
                    lines.by_ref().take(count).map(|tag| tag.parse().unwrap()).collect();
                for tag in tags {
                    let row: Vec<f64> = numbers(lines.next().unwrap());
                    assert_eq!(points[tag].replace(Vec3::from_column_slice(&row)), None);
                }
            }
            let at: Vec<[f64; 3]> = grid(order as usize).collect();
            let nodes = corners_edges_inside(order as usize);
            let mut n_elements = 0;
            let mut rest = 0;
            for line in section(&text, "Elements").into_iter().skip(1) {
                let row: Vec<usize> = numbers(line);
                if rest == 0 {
                    rest = row[3];
                    continue;
                }
                rest -= 1;
                let net = patches.view().net(row[0] - 1);
                for (&tag, &q) in row[1..].iter().zip(&nodes) {
                    let expected = evaluate(DEGREE, &net, at[q]);
                    assert!((points[tag].unwrap() - expected).norm() < 1e-14);
                }
                n_elements += 1;
            }
            assert_eq!(n_elements, 208);
        }
    }

    #[test]
    fn shells_are_surfaces_and_solids_are_volumes_within_them() {
        let text = text(7);
        let entities = section(&text, "Entities");
        assert_eq!(entities[0], "0 0 3 2");
        assert!(entities[4].ends_with(" 0 2 1 2"), "{}", entities[4]);
        assert!(entities[5].ends_with(" 0 1 3"), "{}", entities[5]);
    }

    #[test]
    fn orders_out_of_range_are_refused() {
        for order in [0, 8] {
            let patches = sample::ball_and_ring();
            let refused = write(&patches.view(), order, &mut Vec::new()).unwrap_err();
            assert!(matches!(refused, ExportError::Order { .. }), "{refused}");
        }
    }
}
