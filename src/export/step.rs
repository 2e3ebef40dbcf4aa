//! STEP (ISO 10303-21): solids of polynomial patches, exact, AP242 or AP214.
//!
//! Every triangle becomes three quads of its degree both ways, regular everywhere, or one patch with a
//! collapsed side. Faces name the control points of their shared edges by number, so the borders
//! of neighbours agree in all bits because they are the same entities. Entity numbers follow from
//! a fixed layout; nothing is kept but two words an edge.

mod layout;
mod product;
mod shape;
mod text;

use crate::solids::{Solid, solids};
use crate::{ExportError, Options};
use isospline_artifact::kinds::PatchesView;
use product::{Product, write_validation};
use shape::Shape;
use std::io::Write;
use text::{Entities, References, quoted};

/// Application protocol of a STEP file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StepSchema {
    /// AP242, managed model based 3D engineering.
    #[default]
    Ap242,
    /// AP214, automotive design.
    Ap214,
}

/// What may be chosen about a STEP file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepOptions {
    /// Application protocol.
    pub schema: StepSchema,
    /// One patch a triangle with a collapsed side, in place of three quads: a third of the size,
    /// a singular corner.
    pub compact: bool,
    /// Whether edges also carry their curves in the parameters of both faces.
    pub pcurves: bool,
}

pub(crate) fn write(
    patches: &PatchesView<'_>,
    options: &Options,
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let solids = solids(patches);
    let product = Product { about: &options.about, options: options.step, patches };
    product.write_header(out)?;
    let mut entities = Entities::new(out);
    let frame = product.write_product(&mut entities)?;
    let shape = Shape::begin(patches, options.step, &mut entities)?;
    shape.write_points_and_edges(&mut entities)?;
    shape.write_faces(&mut entities)?;
    let mut breps = Vec::with_capacity(solids.len());
    for (k, solid) in solids.iter().enumerate() {
        let name = match solids.len() {
            1 => options.about.name.clone(),
            _ => format!("{}.{}", options.about.name, k + 1),
        };
        breps.push(write_solid(solid, &name, &shape, &mut entities)?);
    }
    product.write_representation(&frame, &breps, &mut entities)?;
    write_validation(&frame, &solids, &mut entities)?;
    out.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")?;
    Ok(())
}

/// A `MANIFOLD_SOLID_BREP`, or one with voids, whose shells' normals point out of the material.
fn write_solid(
    solid: &Solid,
    name: &str,
    shape: &Shape<'_>,
    entities: &mut Entities<'_>,
) -> Result<u64, ExportError> {
    let mut shell = |faces: &[usize]| {
        let faces = References(faces.iter().flat_map(|&f| shape.faces_of(f)));
        entities.add(format_args!("CLOSED_SHELL('',({faces}))"))
    };
    let outer = shell(&solid.outer.faces)?;
    let voids = solid.voids.iter().map(|v| shell(&v.faces)).collect::<Result<Vec<_>, _>>()?;
    let name = quoted(name);
    if voids.is_empty() {
        return entities.add(format_args!("MANIFOLD_SOLID_BREP({name},#{outer})"));
    }
    let mut oriented = Vec::with_capacity(voids.len());
    for shell in voids {
        oriented.push(entities.add(format_args!("ORIENTED_CLOSED_SHELL('',*,#{shell},.T.)"))?);
    }
    let voids = References(oriented.iter().copied());
    entities.add(format_args!("BREP_WITH_VOIDS({name},#{outer},({voids}))"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use std::collections::{BTreeMap, BTreeSet};

    fn lines(step: StepOptions) -> BTreeMap<u64, String> {
        let mut out = Vec::new();
        let options = Options { step, ..Options::default() };
        write(&sample::ball_and_ring().view(), &options, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let entities = text.lines().filter_map(|line| line.strip_prefix('#')?.split_once('='));
        entities.map(|(number, entity)| (number.parse().unwrap(), entity.to_owned())).collect()
    }

    fn references(entity: &str) -> impl Iterator<Item = u64> {
        let parts = entity.split('#').skip(1);
        parts.map(|part| {
            let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
            part[..end].parse().unwrap()
        })
    }

    #[test]
    fn every_form_names_what_is_there_and_uses_each_edge_once_each_way() {
        for (compact, pcurves) in [(false, false), (false, true), (true, false), (true, true)] {
            let lines = lines(StepOptions { compact, pcurves, ..StepOptions::default() });
            let mut uses = BTreeMap::<u64, BTreeSet<bool>>::new();
            let mut n_oriented = 0;
            for entity in lines.values() {
                assert!(references(entity).all(|n| lines.contains_key(&n)), "{entity}");
                if entity.starts_with("ORIENTED_EDGE") {
                    let edge = references(entity).next().unwrap();
                    assert!(lines[&edge].starts_with("EDGE_CURVE"), "{entity}");
                    uses.entry(edge).or_default().insert(entity.ends_with(".T.);"));
                    n_oriented += 1;
                }
            }
            // 200 faces with 300 edges, or three quads a face.
            assert_eq!(uses.len(), if compact { 300 } else { 1200 });
            assert_eq!(n_oriented, 2 * uses.len());
            assert!(uses.values().all(|ways| ways.len() == 2));
            let on_faces = lines.values().filter(|entity| entity.starts_with("PCURVE")).count();
            assert_eq!(on_faces, if pcurves { n_oriented } else { 0 });
        }
    }

    #[test]
    fn parameter_curves_of_an_edge_lie_on_the_two_faces_that_use_it() {
        let lines = lines(StepOptions { pcurves: true, ..StepOptions::default() });
        let curves = lines.values().filter(|entity| entity.starts_with("SURFACE_CURVE"));
        for curve in curves {
            let named: Vec<u64> = references(curve).collect();
            let points: BTreeSet<u64> = references(&lines[&named[0]]).collect();
            for pcurve in &named[1..] {
                let surface = references(&lines[pcurve]).next().unwrap();
                let net: BTreeSet<u64> = references(&lines[&surface]).collect();
                assert!(points.is_subset(&net), "{curve}");
            }
        }
    }
}
