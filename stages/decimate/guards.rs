//! Which collapses leave a mesh that later stages can fit.

use crate::DecimateParams;
use isospline_geometry::{EditMesh, HalfEdge, Vec3};

/// Number of levels of [`Guards::at_level`].
pub(crate) const LEVELS: u32 = 3;

/// Thresholds of the guards at one level of strictness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guards {
    limits: Shape,
    max_valence: usize,
    /// Least valence of a vertex that loses an edge.
    min_valence: usize,
}

/// A collapse about to be made: the edge, and the vertex that its ends become.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merge {
    pub(crate) edge: HalfEdge,
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

/// The worst figures of some faces and their edges.
#[derive(Clone, Copy, Debug)]
struct Shape {
    /// Least quality, 1 if equilateral.
    quality: f64,
    /// Cosine of the largest angle between the normals of an edge's ends.
    cos_turning: f64,
    /// Square of the largest part of a chord along the normal at an end.
    slope_sq: f64,
    /// Cosine of the largest angle between a face and the normal of one of its corners.
    cos_tilt: f64,
}

impl Guards {
    /// Level 0 as the parameters say, 1 relaxed, 2 only what keeps faces from turning over.
    pub(crate) fn at_level(params: &DecimateParams, level: u32) -> Self {
        let cos_turning = libm::cos(params.max_turning_deg.to_radians());
        let quality = params.min_quality;
        let slope_sq = params.max_slope * params.max_slope;
        let limits = Shape { quality, cos_turning, slope_sq, cos_tilt: 0.4 };
        let max_valence = params.max_valence as usize;
        match level {
            0 => Self { limits, max_valence, min_valence: 4 },
            1 => {
                // Turning half way to a right angle, in the cosine.
                let cos_turning = cos_turning.min(0.5 * cos_turning);
                let slope_sq = f64::midpoint(1.0, slope_sq);
                let limits = Shape { quality: 0.5 * quality, cos_turning, slope_sq, cos_tilt: 0.1 };
                Self { limits, max_valence: 2 * max_valence, min_valence: 4 }
            }
            _ => {
                let limits =
                    Shape { quality: 0.0, cos_turning: -1.0, slope_sq: 1.0, cos_tilt: 0.0 };
                Self { limits, max_valence: usize::MAX, min_valence: 3 }
            }
        }
    }

    /// Whether the mesh around the merged vertex keeps to the limits, or is not worse than it was.
    pub(crate) fn allow(&self, mesh: &EditMesh, normals: &[Vec3], merge: &Merge) -> bool {
        let h = merge.edge;
        let Some(o) = mesh.opposite(h) else { return false };
        let (a, b) = (mesh.origin(h), mesh.origin(o));
        let (c, d) = (mesh.origin(h.prev()), mesh.origin(o.prev()));
        if mesh.valence(a) + mesh.valence(b) - 4 > self.max_valence
            || mesh.valence(c) <= self.min_valence
            || mesh.valence(d) <= self.min_valence
        {
            return false;
        }
        let removed = [h.face(), o.face()];
        let kept = |v| mesh.spokes(v).filter(|s| !removed.contains(&s.face()));
        let at = (merge.position, merge.normal);
        let new = || [a, b].into_iter().flat_map(kept).map(|s| Corner::of(mesh, normals, s, at));
        new().all(|corner| corner.keeps(&self.limits)) || {
            let old = [a, b].into_iter().flat_map(|v| mesh.spokes(v)).map(|s| {
                let v = mesh.origin(s) as usize;
                Corner::of(mesh, normals, s, (mesh.positions[v], normals[v]))
            });
            let limits = old.fold(self.limits, |worst, corner| worst.with(&corner.shape()));
            new().all(|corner| corner.keeps(&limits))
        }
    }
}

impl Shape {
    /// The worst of both; figures that are not numbers do not count.
    fn with(&self, other: &Self) -> Self {
        Self {
            quality: self.quality.min(other.quality),
            cos_turning: self.cos_turning.min(other.cos_turning),
            slope_sq: self.slope_sq.max(other.slope_sq),
            cos_tilt: self.cos_tilt.min(other.cos_tilt),
        }
    }
}

/// A face seen from one of its corners, with its two edges there; nothing is divided yet.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Square of twice the area.
    area_sq: f64,
    /// Sum of the squared sides.
    sides_sq: f64,
    cos_turning: f64,
    /// Squared chords of the two edges, and their squared parts along a normal.
    chords_sq: [f64; 2],
    rises_sq: [f64; 2],
    /// Least of the products of twice the vector area with the normals of the corners.
    tilt: f64,
}

impl Corner {
    /// The face of `spoke`, whose origin is taken to have the position and normal `at`.
    #[inline]
    fn of(mesh: &EditMesh, normals: &[Vec3], spoke: HalfEdge, at: (Vec3, Vec3)) -> Self {
        let (v, w) = (mesh.target(spoke) as usize, mesh.origin(spoke.prev()) as usize);
        let (position, normal) = at;
        let (x, y) = (mesh.positions[v] - position, mesh.positions[w] - position);
        let (x_sq, y_sq) = (x.norm_squared(), y.norm_squared());
        let area = x.cross(&y);
        let rise = |chord: &Vec3, far: &Vec3| chord.dot(&normal).abs().max(chord.dot(far).abs());
        let (rise_x, rise_y) = (rise(&x, &normals[v]), rise(&y, &normals[w]));
        Self {
            area_sq: area.norm_squared(),
            sides_sq: x_sq + y_sq + (y - x).norm_squared(),
            cos_turning: normal.dot(&normals[v]).min(normal.dot(&normals[w])),
            chords_sq: [x_sq, y_sq],
            rises_sq: [rise_x * rise_x, rise_y * rise_y],
            tilt: area.dot(&normal).min(area.dot(&normals[v])).min(area.dot(&normals[w])),
        }
    }

    /// Whether no figure is worse than `limits`; false if one is not a number.
    #[inline]
    fn keeps(&self, limits: &Shape) -> bool {
        let quality_sq = limits.quality * limits.quality * self.sides_sq * self.sides_sq;
        12.0 * self.area_sq >= quality_sq
            && self.tilt >= limits.cos_tilt * self.area_sq.sqrt()
            && self.cos_turning >= limits.cos_turning
            && self.rises_sq[0] <= limits.slope_sq * self.chords_sq[0]
            && self.rises_sq[1] <= limits.slope_sq * self.chords_sq[1]
    }

    fn shape(&self) -> Shape {
        let slope = |k: usize| self.rises_sq[k] / self.chords_sq[k];
        Shape {
            // symbols: quality = 4 sqrt(3) area / (sum of squared sides)
            quality: (12.0 * self.area_sq).sqrt() / self.sides_sq,
            cos_turning: self.cos_turning,
            slope_sq: slope(0).max(slope(1)),
            // A face without area has no direction: as bad as a right angle.
            cos_tilt: if self.area_sq > 0.0 { self.tilt / self.area_sq.sqrt() } else { 0.0 },
        }
    }
}
