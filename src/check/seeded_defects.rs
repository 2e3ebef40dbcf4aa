//! A sound surface passes; each of a hundred and more seeded defects is found.

use crate::box_spline::{Knots, torus};
use crate::{CheckParams, CheckReport, Expected, Job, Net, Surface, check, on_this_thread};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    boundary_index, exponents, first_inner_index, index, interior_indices,
};
use isospline_implicit::{InstructionSet, use_at_most};
use std::collections::BTreeMap;

const EXPECTED: Expected =
    Expected { components: Some(1), euler_characteristic: Some(0), tolerance: None };

/// Arrays of a surface while a defect is put in.
#[derive(Clone)]
struct Draft {
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    nets: Vec<Net>,
}

impl Draft {
    fn sound() -> Self {
        let sound = Knots::surface(24, 12);
        let (vertices, faces) = (sound.vertices().to_vec(), sound.faces().to_vec());
        let nets = (0..faces.len()).map(|f| sound.net(f)).collect();
        Self { vertices, faces, nets }
    }

    fn report(self) -> CheckReport {
        report(&Surface::new(self.vertices, self.faces, self.nets).unwrap())
    }

    /// Length of a typical edge: defects of shape are sized by it.
    fn edge(&self) -> f64 {
        (self.nets[0][0] - self.nets[0][28]).norm()
    }

    fn relabel(&mut self, from: u32, to: u32, faces: &[usize]) {
        for &f in faces {
            self.faces[f] = self.faces[f].map(|v| if v == from { to } else { v });
        }
    }
}

fn report(surface: &Surface<'_>) -> CheckReport {
    let (params, field) = (CheckParams::default(), torus());
    let (expected, repairs) = (EXPECTED, BTreeMap::new());
    let job = Job { surface, field: &field, expected, params: &params, repairs };
    check(&job, &on_this_thread)
}

/// Puts a defect into several places of a sound surface and asks for a failure that names it.
struct Hunt {
    sound: Draft,
    found: usize,
}

impl Hunt {
    fn seed(&mut self, places: usize, name: &str, sign: &str, defect: impl Fn(&mut Draft, usize)) {
        for n in 0..places {
            let mut draft = self.sound.clone();
            // Faces far apart and of both diagonals, in no special position.
            defect(&mut draft, (41 + 97 * n) % self.sound.faces.len());
            let report = draft.report();
            assert!(!report.pass, "{name} {n} was not found");
            assert!(
                report.failures.iter().any(|f| f.contains(sign)),
                "{name} {n} was found, but not by {sign:?}: {:?}",
                report.failures
            );
            self.found += 1;
        }
    }
}

#[test]
fn a_sound_surface_passes_with_figures_near_rounding() {
    let found = report(&Knots::surface(24, 12));
    assert!(found.pass, "{:?}", found.failures);
    assert_eq!((found.faces, found.vertices, found.genus), (576, 288, Some(1)));
    assert_eq!((found.gap_max.to_bits(), found.shared_bits_differ), (0, 0));
    assert!(found.g1_angle_deg_max < 1e-11, "{}", found.g1_angle_deg_max);
    assert!(found.vertex_error_max < 1e-15, "{}", found.vertex_error_max);
    // All edges of a box spline have lambda = 1/2 throughout.
    assert!((found.lambda0_min - 0.5).abs() < 1e-11 && (found.lambda0_max - 0.5).abs() < 1e-11);
    assert!(found.rel_error_max < 5e-4 && found.rel_error_max > found.rel_error_rms);
    assert!(found.rel_error_max >= 0.99 * found.rel_error_grid_max);
}

#[test]
fn finer_knots_bring_the_error_down_by_their_fourth_power() {
    let [coarse, fine] = [1, 2].map(|k| report(&Knots::surface(24 * k, 12 * k)).rel_error_max);
    let order = libm::log2(coarse / fine);
    assert!((order - 4.0).abs() < 0.3, "order {order}");
}

#[test]
fn a_hundred_seeded_defects_are_all_found() {
    let mut hunt = Hunt { sound: Draft::sound(), found: 0 };
    moved_points(&mut hunt);
    broken_numbers(&mut hunt);
    broken_connectivity(&mut hunt);
    broken_unity(&mut hunt);
    broken_corners(&mut hunt);
    wrong_shape(&mut hunt);
    assert!(hunt.found >= 100, "only {} defects were seeded", hunt.found);
}

fn moved_points(hunt: &mut Hunt) {
    let along = Vec3::new(0.6, -0.48, 0.64);
    hunt.seed(6, "inner point far off", "rel_error_max", |d, f| {
        let shift = d.edge() * along;
        d.nets[f][index([3, 2, 2])] += shift;
    });
    hunt.seed(7, "boundary point by one bit", "differ in bits", |d, f| {
        let x = &mut d.nets[f][boundary_index(7, f % 3, 1 + f % 6)].x;
        *x = x.next_up();
    });
    hunt.seed(7, "boundary point by 1e-12", "gap_max", |d, f| {
        d.nets[f][boundary_index(7, f % 3, 1 + f % 6)] += 1e-12 * along;
    });
    hunt.seed(9, "twist point by 1e-6", "g1_angle_deg_max", |d, f| {
        d.nets[f][first_inner_index(7, f % 3, 1)] += 1e-6 * along;
    });
    hunt.seed(9, "first inner row by 1e-6", "g1_angle_deg_max", |d, f| {
        d.nets[f][first_inner_index(7, f % 3, 2 + f % 3)] += 1e-6 * along;
    });
    hunt.seed(5, "vertex and all its corners off the surface", "vertex_error_max", |d, f| {
        let v = d.faces[f][0];
        let shift = 1e-10 * along;
        d.vertices[v as usize] += shift;
        for (face, net) in d.faces.iter().zip(&mut d.nets) {
            for corner in (0..3).filter(|&c| face[c] == v) {
                net[boundary_index(7, corner, 0)] += shift;
            }
        }
    });
    hunt.seed(5, "vertex off its corners", "vertex_error_max", |d, f| {
        let v = d.faces[f][1] as usize;
        d.vertices[v] += 1e-11 * along;
    });
}

fn broken_numbers(hunt: &mut Hunt) {
    hunt.seed(7, "not a number in a net", "not finite", |d, f| {
        d.nets[f][(5 * f) % 36].y = f64::NAN;
    });
    hunt.seed(5, "infinity in a net", "not finite", |d, f| {
        d.nets[f][(7 * f) % 36].z = f64::NEG_INFINITY;
    });
    hunt.seed(3, "not a number in a vertex", "not finite", |d, f| {
        let v = d.faces[f][2] as usize;
        d.vertices[v].x = f64::NAN;
    });
}

fn broken_connectivity(hunt: &mut Hunt) {
    hunt.seed(5, "face flipped without its net", "opposite orientation", |d, f| {
        d.faces[f].swap(1, 2);
    });
    hunt.seed(5, "face flipped with its net", "opposite orientation", flip);
    hunt.seed(1, "all faces flipped", "face inward", |d, _| {
        (0..d.faces.len()).for_each(|f| flip(d, f));
    });
    hunt.seed(5, "face missing", "one side only", |d, f| {
        d.faces.remove(f);
        d.nets.remove(f);
    });
    hunt.seed(5, "face twice", "more than two faces", |d, f| {
        d.faces.push(d.faces[f]);
        d.nets.push(d.nets[f]);
    });
}

fn broken_unity(hunt: &mut Hunt) {
    hunt.seed(3, "vertex without faces", "no face", |d, f| {
        d.vertices.push(d.vertices[f % 200]);
    });
    hunt.seed(3, "two vertices taken for one", "gap_max", |d, f| {
        let [a, b, _] = d.faces[f];
        let all: Vec<usize> = (0..d.faces.len()).collect();
        d.relabel(a, b, &all);
    });
    hunt.seed(3, "face cut off at a vertex", "one side only", |d, f| {
        let new = d.vertices.len() as u32;
        let old = d.faces[f][0];
        d.vertices.push(d.vertices[old as usize]);
        d.relabel(old, new, &[f]);
    });
    hunt.seed(1, "everything twice", "components is 2", |d, _| {
        let n = d.vertices.len() as u32;
        d.vertices.extend_from_within(..);
        d.nets.extend_from_within(..);
        d.faces.extend_from_within(..);
        let half = d.faces.len() / 2;
        d.faces[half..].iter_mut().for_each(|face| *face = face.map(|v| v + n));
    });
    hunt.seed(1, "nothing at all", "no faces", |d, _| {
        *d = Draft { vertices: vec![], faces: vec![], nets: vec![] };
    });
}

fn broken_corners(hunt: &mut Hunt) {
    hunt.seed(5, "two corners swapped", "gap_max", |d, f| {
        d.nets[f].swap(0, 28);
    });
    hunt.seed(5, "net turned by a third against its face", "gap_max", |d, f| {
        let net = d.nets[f];
        for [i, j, k] in exponents(7) {
            d.nets[f][index([k, i, j])] = net[index([i, j, k])];
        }
    });
    hunt.seed(5, "nets of two faces exchanged", "gap_max", |d, f| {
        let other = (f + 5) % d.nets.len();
        d.nets.swap(f, other);
    });
    hunt.seed(5, "inner points of two faces exchanged", "g1_angle_deg_max", |d, f| {
        let other = (f + 7) % d.nets.len();
        for i in interior_indices() {
            let p = d.nets[f][i];
            d.nets[f][i] = d.nets[other][i];
            d.nets[other][i] = p;
        }
    });
}

fn wrong_shape(hunt: &mut Hunt) {
    hunt.seed(3, "sector of more than half a turn", "lambda0", |d, f| {
        // The edge's first control point on both sides goes to the far side of its vertex.
        let (a, b) = (d.faces[f][0], d.faces[f][1]);
        for (face, net) in d.faces.iter().zip(&mut d.nets) {
            for c in 0..3 {
                let ends = (face[c], face[(c + 1) % 3]);
                let (s, origin) = if ends == (a, b) { (1, 0) } else { (6, 7) };
                if ends == (a, b) || ends == (b, a) {
                    let vertex = net[boundary_index(7, c, origin)];
                    let p = &mut net[boundary_index(7, c, s)];
                    *p = vertex - (*p - vertex);
                }
            }
        }
    });
    hunt.seed(3, "patch folded over", "face inward", |d, f| {
        let centre = (d.nets[f][0] + d.nets[f][28] + d.nets[f][35]) / 3.0;
        for i in interior_indices() {
            d.nets[f][i] = centre - 4.0 * (d.nets[f][i] - centre);
        }
    });
    hunt.seed(3, "patch drawn together to a point", "no tangent plane", |d, f| {
        d.nets[f] = [d.nets[f][0]; 36];
    });
    hunt.seed(1, "surface of another size", "rel_error_max", |d, _| {
        d.vertices.iter_mut().for_each(|p| *p *= 1.1);
        d.nets.iter_mut().flatten().for_each(|p| *p *= 1.1);
    });
}

/// Turns a face and its net over.
fn flip(d: &mut Draft, f: usize) {
    d.faces[f].swap(1, 2);
    let net = d.nets[f];
    for [i, j, k] in exponents(7) {
        d.nets[f][index([i, k, j])] = net[index([i, j, k])];
    }
}

#[test]
fn the_report_is_the_same_in_all_bits_whatever_order_the_blocks_run_in() {
    let surface = Knots::surface(24, 12);
    let backwards = |n: usize, body: &(dyn Fn(usize) + Sync)| (0..n).rev().for_each(body);
    let (params, field) = (CheckParams::default(), torus());
    let (expected, repairs) = (EXPECTED, BTreeMap::from([("adapt.edges_split".to_owned(), 3)]));
    let job = Job { surface: &surface, field: &field, expected, params: &params, repairs };
    let json = |report: CheckReport| serde_json::to_string(&report).unwrap();
    let found = json(check(&job, &backwards));
    assert_eq!(found, json(check(&job, &on_this_thread)));
    assert!(found.contains(r#""repairs":{"adapt.edges_split":3}"#), "{found}");
}

#[test]
fn a_kink_is_named_where_it_is() {
    for (n, f) in [5, 263, 575].into_iter().enumerate() {
        let mut draft = Draft::sound();
        let step = 2 + n;
        let moved = first_inner_index(7, n, step);
        draft.nets[f][moved] += 1e-4 * Vec3::new(0.6, -0.48, 0.64);
        let edge = [draft.nets[f][boundary_index(7, n, 0)], draft.nets[f][boundary_index(7, n, 7)]];
        let at = draft.report().worst_g1_angle.unwrap();
        // B6 of the step is largest at step / 6.
        let t = step as f64 / 6.0;
        let expected = (1.0 - t) * edge[0] + t * edge[1];
        let apart = (Vec3::from(at.point) - expected).norm();
        assert!(apart < 0.1 * (edge[1] - edge[0]).norm(), "{apart} {at:?}");
    }
}

#[test]
fn the_report_is_the_same_in_all_bits_for_every_instruction_set() {
    let mut draft = Draft::sound();
    // Not the same everywhere, and with figures that are not numbers.
    draft.nets[7][20].x += 0.1;
    draft.nets[100][17].z = f64::NAN;
    let reports =
        [InstructionSet::Plain, InstructionSet::Avx2, InstructionSet::Avx512].map(|set| {
            use_at_most(set);
            serde_json::to_string(&draft.clone().report()).unwrap()
        });
    assert_eq!(reports[0], reports[1]);
    assert_eq!(reports[0], reports[2]);
}

#[test]
fn a_promise_about_topology_that_is_not_kept_fails() {
    let surface = Knots::surface(24, 12);
    let (params, field) = (CheckParams::default(), torus());
    let expected = Expected { euler_characteristic: Some(2), ..EXPECTED };
    let job = Job {
        surface: &surface,
        field: &field,
        expected,
        params: &params,
        repairs: BTreeMap::new(),
    };
    let failures = check(&job, &on_this_thread).failures;
    assert_eq!(failures, ["euler_characteristic is 0, but the surface was found to have 2"]);
}
