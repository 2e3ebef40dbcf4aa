//! Gauss-Newton steps of one tile with the rest of the surface fixed.

use crate::degree::Degree;
use crate::element::{Element, Equations, Pull};
use crate::envelope::Envelope;
use crate::face_moves::{FaceMoves, REACHING};
use crate::functionals::Values;
use crate::moves::Moves;
use crate::numbering::Numbering;
use crate::progress::Progress;
use crate::rim::{Rim, RimFace};
use crate::samples::{Interior, Samples};
use crate::ties::TileTie;
use crate::tiling::Tile;
use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, boundary_index};
use isospline_implicit::{Field, Jet1};

/// Damping of a tile's first step, beside mean squared values of Bernstein polynomials; 1e-6
/// needs three sweeps more, 1e-9 folds the first steps of coarse meshes.
pub(crate) const FIRST_DAMPING: f64 = 1e-8;
/// Least damping; with 1e-12 a sphere of 320 patches stops at ten times the error.
const LEAST_DAMPING: f64 = 1e-15;
/// Factor on the damping after a step that helped. 1/8 needs more sweeps, 1/32 more retries; so
/// does a factor that heeds how much of its promise the step kept, with less gained a sweep.
const RELIEF: f64 = 1.0 / 16.0;
/// Factor after one that did not.
const TIGHTENING: f64 = 10.0;
/// Steps tried a visit; more than three never paid.
const ATTEMPTS: usize = 3;
/// Weight of even nets against the normal distance while folds are mended.
const UNFOLDING: f64 = 1e-2;
/// Longest shift of a control point, times the mean side of its face.
const SHIFT_CAP: f64 = 0.1;
/// Damping of the amounts themselves, times that of control points, for moves that shift nothing.
const AMOUNT_DAMPING: f64 = 1e-3;

/// What all tiles share.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub(crate) mesh: BaseMeshView<'a>,
    pub(crate) network: NetworkView<'a>,
    pub(crate) moves: &'a Moves,
    pub(crate) samples: &'a Samples,
    pub(crate) rim: &'a Rim,
    pub(crate) field: &'a dyn Field,
    pub(crate) degree: Degree,
}

/// What a visit leaves behind.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// Interior points of the tile's faces; `None` if no step helped.
    pub(crate) interior: Option<Vec<Interior>>,
    /// Change of `nu` of the tile's edges.
    pub(crate) nu: Vec<f64>,
    /// Change of the gaps of the tile's ties.
    pub(crate) gap: Vec<f64>,
    /// Damping of the next visit.
    pub(crate) damping: f64,
    /// Part by which the squared distance fell.
    pub(crate) gain: f64,
}

impl Problem<'_> {
    /// One step that lowers the squared distance of the tile's samples, or mends its folds, if one
    /// of a few does; none if all are within `goal`, in model units.
    pub(crate) fn visit(&self, tile: &Tile, at: &Progress, damping: f64, goal: f64) -> Outcome {
        let interior: Vec<Interior> = tile.faces.iter().map(|&f| at.interior[f as usize]).collect();
        let faces = self.faces(tile);
        let here = self.measure(&faces, &interior);
        let nu = vec![0.0; tile.edges.len()];
        let idle = Outcome { interior: None, nu, gap: Vec::new(), damping, gain: 0.0 };
        if here.unsound + here.tilted == 0 && here.largest() <= goal {
            return idle;
        }
        let numbering = Numbering::new(&self.mesh, tile, self.degree);
        let ties = TileTie::all(&self.mesh, &self.moves.ties, &at.gap, tile, &numbering);
        let visit = Visit { tile, numbering, ties, faces, interior, here };
        let unfolded = (visit.here.unsound > 0).then(|| self.unfolded(&visit, damping)).flatten();
        unfolded.unwrap_or_else(|| self.nearer(&visit, idle))
    }

    /// A step that lowers the squared distance and adds no fold.
    fn nearer(&self, visit: &Visit<'_>, mut outcome: Outcome) -> Outcome {
        let here = &visit.here;
        let no_pull = vec![None; visit.faces.len()];
        for _ in 0..ATTEMPTS {
            if let Some(step) = self.step(visit, &no_pull, outcome.damping) {
                let trial = step.applied(&visit.interior);
                let there = self.measure(&visit.faces, &trial);
                if there.is_better_than(here) {
                    outcome.interior = Some(trial);
                    outcome.nu = step.nu;
                    outcome.gap = step.gap;
                    outcome.damping = (outcome.damping * RELIEF).max(LEAST_DAMPING);
                    outcome.gain = 1.0 - there.cost / here.cost;
                    break;
                }
            }
            outcome.damping *= TIGHTENING;
        }
        outcome
    }

    /// A step that draws folded faces to even nets and leaves fewer folds, or as many and the faces
    /// nearer to those nets. The distance may grow: without folds, later steps lower it further.
    fn unfolded(&self, visit: &Visit<'_>, damping: f64) -> Option<Outcome> {
        let here = &visit.here;
        let pulls = self.pulls(visit, &visit.interior, here);
        let stiffer = std::iter::successors(Some(damping), |d| Some(d * TIGHTENING));
        for stiffer in stiffer.take(ATTEMPTS) {
            let Some(step) = self.step(visit, &pulls, stiffer) else { continue };
            let trial = step.applied(&visit.interior);
            let there = self.measure(&visit.faces, &trial);
            let is_nearer = || strength(&self.pulls(visit, &trial, &there)) < strength(&pulls);
            if there.unsound < here.unsound || there.unsound == here.unsound && is_nearer() {
                let Step { nu, gap, .. } = step;
                return Some(Outcome { interior: Some(trial), nu, gap, damping, gain: 1.0 });
            }
        }
        None
    }

    /// For each face that is folded at the start of the visit, what draws it to an even net.
    fn pulls(&self, visit: &Visit<'_>, interior: &[Interior], at: &Measured) -> Vec<Option<Pull>> {
        let (samples, n) = (self.samples, self.samples.len());
        let pull = |i: usize| {
            let face = &visit.faces[i];
            let [here, even] = [&interior[i], &samples.even(&face.net)]
                .map(|interior| samples.of(&face.boundary, interior));
            let normals = &at.normal[i * n..(i + 1) * n];
            let offsets = samples.points(&here).zip(samples.points(&even)).zip(normals);
            let aside = offsets.map(|((p, e), n)| (p - e) - (p - e).dot(n) * n).collect();
            Pull { weight: UNFOLDING, aside }
        };
        let folds = visit.here.folds.iter().enumerate();
        folds.map(|(i, &folds)| (folds > 0).then(|| pull(i))).collect()
    }

    fn faces(&self, tile: &Tile) -> Vec<Face> {
        let net = |&f: &u32| self.degree.boundary_net(&self.mesh, &self.network, f as usize);
        let nets: Vec<_> = tile.faces.iter().map(net).collect();
        let places: Vec<Vec3> = nets.iter().flat_map(|net| self.rim.places(net)).collect();
        let rim = Measured::of(&self.jets(&places)).normal;
        let places: Vec<Vec3> = nets.iter().flat_map(|net| self.samples.border(net)).collect();
        let border = Measured::of(&self.jets(&places)).distance;
        let part = |i: usize, n: usize| i * n / nets.len()..(i + 1) * n / nets.len();
        let face = |(i, net): (usize, &[Vec3; N_CONTROL])| Face {
            boundary: self.samples.of_boundary(net),
            rim: self.rim.of_boundary(net, &rim[part(i, rim.len())]),
            moves: FaceMoves::new(&self.mesh, self.moves, tile.faces[i] as usize),
            border: border[part(i, border.len())].to_vec(),
            net: *net,
        };
        nets.iter().enumerate().map(face).collect()
    }

    fn jets(&self, points: &[Vec3]) -> Vec<Jet1> {
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        self.field.gradients(points, &mut jets);
        jets
    }

    fn measure(&self, faces: &[Face], interior: &[Interior]) -> Measured {
        let values: Vec<Values> = faces
            .iter()
            .zip(interior)
            .map(|(face, interior)| self.samples.of(&face.boundary, interior))
            .collect();
        let points: Vec<Vec3> = values.iter().flat_map(|v| self.samples.points(v)).collect();
        let mut out = Measured::of(&self.jets(&points));
        for (i, (face, values)) in faces.iter().zip(&values).enumerate() {
            let rows = i * self.samples.len()..(i + 1) * self.samples.len();
            let rough = self.samples.roughness.of(&out.distance[rows.clone()], &face.border);
            out.force.extend(rough.force);
            out.cost += rough.sum_sq;
            let [folds, tilted] = self.samples.folded(values, &out.normal[rows]);
            out.folds.push(folds + self.rim.folds(&face.rim, &interior[i]));
            out.tilted += tilted;
        }
        out.unsound += out.folds.iter().sum::<usize>();
        out
    }

    /// The damped step; `None` where the equations have no finite solution.
    fn step(&self, visit: &Visit<'_>, pulls: &[Option<Pull>], damping: f64) -> Option<Step> {
        let Visit { tile, faces, numbering, ties, here, .. } = visit;
        let n = self.samples.len();
        let mut elements = vec![Element::zero(); faces.len()];
        for (i, element) in elements.iter_mut().enumerate() {
            let rows = i * n..(i + 1) * n;
            let (force, normal) = (&here.force[rows.clone()], &here.normal[rows]);
            let (samples, moves, pull) = (self.samples, &faces[i].moves, pulls[i].as_ref());
            if !element.set(Equations { samples, moves, force, normal, pull, damping }) {
                return None;
            }
        }
        let amounts = solve(numbering, &elements, ties, damping)?;
        let shift = |i: usize| -> Interior {
            let amounts = numbering.columns[i].map(|c| c.map_or(0.0, |c| amounts[c as usize]));
            elements[i].shifts(&faces[i].moves.apply(&amounts))
        };
        let shifts: Vec<Interior> = (0..faces.len()).map(shift).collect();
        let scale = shifts.iter().zip(faces).fold(1.0, |acc: f64, (s, f)| acc.min(f.cap(s)));
        let nu =
            tile.edges.iter().zip(&numbering.nu).map(|(&e, &unknown)| {
                scale * amounts[unknown] * self.moves.edges[e as usize].nu_scale
            });
        let nu: Vec<f64> = nu.collect();
        let gap = ties.iter().map(|tie| scale * tie.change(&amounts)).collect();
        let is_finite = shifts.iter().flatten().flatten().all(|x| x.is_finite());
        is_finite.then_some(Step { shifts, scale, nu, gap })
    }
}

/// A tile as a visit finds it.
struct Visit<'a> {
    tile: &'a Tile,
    numbering: Numbering,
    ties: Vec<TileTie>,
    faces: Vec<Face>,
    interior: Vec<Interior>,
    here: Measured,
}

/// Sum of the squared distances from the places that samples are drawn to.
fn strength(pulls: &[Option<Pull>]) -> f64 {
    pulls.iter().flatten().flat_map(|pull| &pull.aside).map(Vec3::norm_squared).sum()
}

/// A face of the tile.
struct Face {
    /// Boundary in place, zero inside.
    net: [Vec3; N_CONTROL],
    /// What the boundary adds to all that is sampled.
    boundary: Values,
    moves: FaceMoves,
    rim: RimFace,
    /// Distances at the places on the boundary that differences between samples reach.
    border: Vec<f64>,
}

impl Face {
    /// The part of these shifts that keeps within the cap.
    fn cap(&self, shifts: &Interior) -> f64 {
        let longest = shifts.iter().fold(0.0, |acc: f64, s| acc.max(s.norm()));
        let limit = SHIFT_CAP * self.size();
        if longest > limit { limit / longest } else { 1.0 }
    }

    /// Mean side.
    fn size(&self) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|corner| self.net[boundary_index(DEGREE, corner, 0)]);
        ((a - b).norm() + (b - c).norm() + (c - a).norm()) / 3.0
    }
}

/// A capped step.
struct Step {
    shifts: Vec<Interior>,
    scale: f64,
    nu: Vec<f64>,
    gap: Vec<f64>,
}

impl Step {
    fn applied(&self, interior: &[Interior]) -> Vec<Interior> {
        let moved = |(points, shifts): (&Interior, &Interior)| {
            std::array::from_fn(|i| points[i] + self.scale * shifts[i])
        };
        interior.iter().zip(&self.shifts).map(moved).collect()
    }
}

/// Distances and unit normals at the samples of all faces.
struct Measured {
    distance: Vec<f64>,
    normal: Vec<Vec3>,
    /// Derivative of half the cost by each distance.
    force: Vec<f64>,
    /// Sum of squared distances, and of what their roughness adds.
    cost: f64,
    /// Folds of each face.
    folds: Vec<usize>,
    /// Samples without a distance, and all folds.
    unsound: usize,
    /// Samples whose normal is far off.
    tilted: usize,
}

impl Measured {
    /// Samples whose distance is not a number weigh nothing, but are counted.
    fn of(jets: &[Jet1]) -> Self {
        let n = jets.len();
        let (distance, normal) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let (force, folds) = (Vec::with_capacity(n), Vec::new());
        let mut out = Self { distance, normal, force, cost: 0.0, folds, unsound: 0, tilted: 0 };
        for jet in jets {
            let slope = jet.gradient.norm();
            let distance = jet.value / slope;
            let is_sound = distance.is_finite() && slope.is_finite();
            out.unsound += usize::from(!is_sound);
            let (d, normal) =
                if is_sound { (distance, jet.gradient / slope) } else { (0.0, Vec3::zeros()) };
            out.distance.push(d);
            out.normal.push(normal);
            out.cost += d * d;
        }
        out
    }

    fn largest(&self) -> f64 {
        self.distance.iter().fold(0.0, |acc: f64, d| acc.max(d.abs()))
    }

    fn is_better_than(&self, other: &Self) -> bool {
        self.unsound <= other.unsound && self.cost < other.cost
    }
}

/// Amounts of the tile's moves.
fn solve(
    numbering: &Numbering,
    elements: &[Element],
    ties: &[TileTie],
    damping: f64,
) -> Option<Vec<f64>> {
    let n = numbering.lowest.len();
    let mut matrix = Envelope::default();
    matrix.reset(&numbering.lowest);
    let mut amounts = vec![0.0; n];
    (0..n).for_each(|i| matrix.add(i, i, AMOUNT_DAMPING * damping));
    for (element, columns) in elements.iter().zip(&numbering.columns) {
        let rows = columns.iter().zip(&element.matrix);
        for (row, entries) in rows.filter_map(|(row, entries)| Some(((*row)? as usize, entries))) {
            amounts[row] -= entries[REACHING];
            for (column, x) in columns.iter().zip(entries) {
                if let Some(column) = column.filter(|c| *c as usize <= row) {
                    matrix.add(row, column as usize, *x);
                }
            }
        }
    }
    for tie in ties {
        for &(row, x) in &tie.terms {
            amounts[row] -= tie.weight * tie.gap * x;
            for &(column, y) in tie.terms.iter().filter(|(column, _)| *column <= row) {
                matrix.add(row, column, tie.weight * x * y);
            }
        }
    }
    if !matrix.factorise() {
        return None;
    }
    matrix.solve(&mut amounts);
    Some(amounts)
}
