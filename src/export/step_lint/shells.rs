//! Solids, shells, faces and loops: who uses whom how often, and whether shells are closed.

use super::StepDefect;
use super::entities::{Found, Model, Node};
use std::collections::{BTreeMap, BTreeSet};

/// The shells of all solids.
#[derive(Debug, Default)]
pub(super) struct Solids {
    pub(super) count: usize,
    /// Each shell, and whether it bounds a void.
    pub(super) shells: Vec<(Shell, bool)>,
}

#[derive(Debug)]
pub(super) struct Shell {
    pub(super) number: u64,
    pub(super) faces: Vec<Face>,
}

#[derive(Debug)]
pub(super) struct Face {
    pub(super) number: u64,
    pub(super) surface: u64,
    /// Whether the normal of the face is that of its surface.
    pub(super) same_sense: bool,
    /// Edges in the order of the loop, which runs counter-clockwise about the face's normal.
    pub(super) sides: Vec<Side>,
}

/// An edge as a loop uses it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) edge: u64,
    /// Whether the loop runs from the start of the edge to its end.
    pub(super) forward: bool,
    /// Vertices in the order of the loop.
    pub(super) ends: [u64; 2],
}

/// Numbers of the parts of a closed shell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Census {
    pub(super) vertices: usize,
    pub(super) edges: usize,
}

/// Reads all solids; what cannot be read, and what nothing or too much uses, is noted.
pub(super) fn read(model: &Model<'_>, defects: &mut Vec<StepDefect>) -> Solids {
    let mut solids = Solids::default();
    let mut uses = BTreeMap::new();
    let mut note = |found: Found<()>| defects.extend(found.err());
    for representation in model.all("ADVANCED_BREP_SHAPE_REPRESENTATION") {
        note(representation.and_then(|node| count_items(model, &node, &mut uses)));
    }
    for kind in ["MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS"] {
        for solid in model.all(kind) {
            note(solid.and_then(|node| read_solid(model, &node, &mut uses, &mut solids)));
        }
    }
    let used = [
        ("MANIFOLD_SOLID_BREP", "solid"),
        ("BREP_WITH_VOIDS", "solid"),
        ("CLOSED_SHELL", "shell"),
        ("ADVANCED_FACE", "face"),
        ("EDGE_LOOP", "loop"),
        ("ORIENTED_EDGE", "oriented edge"),
    ];
    for (kind, what) in used {
        for entity in model.entities.iter().filter(|entity| entity.kind == kind) {
            let (entity, times) = (entity.number, uses.get(&entity.number).copied().unwrap_or(0));
            if times != 1 {
                defects.push(StepDefect::Use { entity, what, times });
            }
        }
    }
    if solids.count == 0 && defects.is_empty() {
        defects.push(StepDefect::NoSolid);
    }
    solids
}

/// How often an entity is used.
type Uses = BTreeMap<u64, usize>;

fn count_items(model: &Model<'_>, node: &Node<'_>, uses: &mut Uses) -> Found<()> {
    let kinds = ["MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "AXIS2_PLACEMENT_3D"];
    for item in node.references(1)? {
        model.get(node.number, item, &kinds, "a solid or a placement")?;
        *uses.entry(item).or_default() += 1;
    }
    Ok(())
}

fn read_solid(
    model: &Model<'_>,
    node: &Node<'_>,
    uses: &mut Uses,
    solids: &mut Solids,
) -> Found<()> {
    solids.count += 1;
    let outer = node.reference(1)?;
    solids.shells.push((read_shell(model, node.number, outer, uses)?, false));
    if node.kind == "MANIFOLD_SOLID_BREP" {
        return Ok(());
    }
    for oriented in node.references(2)? {
        let kinds = ["ORIENTED_CLOSED_SHELL"];
        let oriented = model.get(node.number, oriented, &kinds, "an oriented closed shell")?;
        let mut shell = read_shell(model, oriented.number, oriented.reference(2)?, uses)?;
        if !oriented.flag(3)? {
            shell.turn();
        }
        solids.shells.push((shell, true));
    }
    Ok(())
}

fn read_shell(model: &Model<'_>, from: u64, number: u64, uses: &mut Uses) -> Found<Shell> {
    let node = model.get(from, number, &["CLOSED_SHELL"], "a closed shell")?;
    *uses.entry(number).or_default() += 1;
    let faces = node.references(1)?.into_iter().map(|face| read_face(model, number, face, uses));
    Ok(Shell { number, faces: faces.collect::<Found<Vec<_>>>()? })
}

fn read_face(model: &Model<'_>, from: u64, number: u64, uses: &mut Uses) -> Found<Face> {
    let node = model.get(from, number, &["ADVANCED_FACE"], "a face")?;
    *uses.entry(number).or_default() += 1;
    let bounds = node.references(1)?;
    let &[bound] = bounds.as_slice() else {
        let found = bounds.len();
        return Err(StepDefect::Count { entity: number, what: "bounds", found, expected: 1 });
    };
    let kinds = ["FACE_OUTER_BOUND", "FACE_BOUND"];
    let bound = model.get(number, bound, &kinds, "the bound of a face")?;
    let ring = model.get(bound.number, bound.reference(1)?, &["EDGE_LOOP"], "a loop")?;
    *uses.entry(ring.number).or_default() += 1;
    let sides = ring.references(1)?;
    for side in &sides {
        *uses.entry(*side).or_default() += 1;
    }
    let sides = sides.into_iter().map(|side| read_side(model, ring.number, side));
    let mut sides = sides.collect::<Found<Vec<Side>>>()?;
    if !bound.flag(2)? {
        turn(&mut sides);
    }
    Ok(Face { number, surface: node.reference(2)?, same_sense: node.flag(3)?, sides })
}

fn read_side(model: &Model<'_>, from: u64, number: u64) -> Found<Side> {
    let node = model.get(from, number, &["ORIENTED_EDGE"], "an oriented edge")?;
    let edge = model.get(number, node.reference(3)?, &["EDGE_CURVE"], "an edge")?;
    let mut ends = [edge.reference(1)?, edge.reference(2)?];
    for end in ends {
        model.get(edge.number, end, &["VERTEX_POINT"], "a vertex")?;
    }
    let forward = node.flag(4)?;
    if !forward {
        ends.reverse();
    }
    Ok(Side { edge: edge.number, forward, ends })
}

fn turn(sides: &mut [Side]) {
    sides.reverse();
    for side in sides {
        side.forward = !side.forward;
        side.ends.reverse();
    }
}

impl Shell {
    fn turn(&mut self) {
        for face in &mut self.faces {
            face.same_sense = !face.same_sense;
            turn(&mut face.sides);
        }
    }

    /// Whether loops close, edges have a face on either side and vertices one fan of faces.
    pub(super) fn close(&self, defects: &mut Vec<StepDefect>) -> Census {
        let mut uses: BTreeMap<u64, [Vec<usize>; 2]> = BTreeMap::new();
        let sides: Vec<Side> = self.faces.iter().flat_map(|face| face.sides.clone()).collect();
        for (use_of, side) in sides.iter().enumerate() {
            uses.entry(side.edge).or_default()[usize::from(!side.forward)].push(use_of);
        }
        let before = defects.len();
        for face in &self.faces {
            let next = face.sides.iter().cycle().skip(1);
            let open = face.sides.iter().zip(next).filter(|(a, b)| a.ends[1] != b.ends[0]);
            let number = face.number;
            defects.extend(open.map(|(a, _)| StepDefect::OpenLoop { face: number, edge: a.edge }));
        }
        for (&edge, [along, against]) in &uses {
            let (forward, backward) = (along.len(), against.len());
            if (forward, backward) != (1, 1) {
                defects.push(StepDefect::EdgeUse { edge, forward, backward });
            }
        }
        let vertices: BTreeSet<u64> = sides.iter().map(|side| side.ends[0]).collect();
        if defects.len() == before {
            self.require_single_fans(&sides, &uses, defects);
        }
        Census { vertices: vertices.len(), edges: uses.len() }
    }

    fn require_single_fans(
        &self,
        sides: &[Side],
        uses: &BTreeMap<u64, [Vec<usize>; 2]>,
        defects: &mut Vec<StepDefect>,
    ) {
        // Of each side, the one after it in its loop.
        let mut next = Vec::with_capacity(sides.len());
        for face in &self.faces {
            let (first, n) = (next.len(), face.sides.len());
            next.extend((0..n).map(|k| first + (k + 1) % n));
        }
        let mut seen = vec![false; sides.len()];
        let mut fans = BTreeSet::new();
        for start in 0..sides.len() {
            if seen[start] {
                continue;
            }
            let vertex = sides[start].ends[0];
            if !fans.insert(vertex) {
                defects.push(StepDefect::Pinched { shell: self.number, vertex });
            }
            // Around the vertex: from a side that leaves it to the next one that does.
            let mut at = start;
            while !seen[at] {
                seen[at] = true;
                let twins = &uses[&sides[at].edge];
                at = next[twins[usize::from(sides[at].forward)][0]];
            }
        }
    }
}
