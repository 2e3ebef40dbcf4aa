//! All that is measured face by face, from one look at each net.

use crate::distance::{Distances, Sampler};
use crate::grid::Grid;
use crate::lanes::LANES;
use crate::octet::Octet;
use crate::report::worse;
use crate::surface::{Net, Surface, same_bits};
use crate::volume::{Moment, Quadrature};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, boundary_index};
use isospline_implicit::Field;
use std::ops::Range;

/// What faces one after another show.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    pub(crate) distances: Distances,
    pub(crate) moments: Vec<Moment>,
    pub(crate) corners: Corners,
    /// Control points with a coordinate that is not a finite number.
    pub(crate) not_finite: u64,
}

/// Net corners against vertices.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Corners {
    /// Largest distance, model units.
    pub(crate) gap: f64,
    /// Corners that differ in some bit.
    pub(crate) bits_differ: u64,
}

/// What all faces are measured with.
pub(crate) struct Gauge<'a> {
    pub(crate) surface: &'a Surface<'a>,
    pub(crate) field: &'a dyn Field,
    pub(crate) grid: &'a Grid,
    pub(crate) quadrature: &'a Quadrature,
}

impl Gauge<'_> {
    /// Measures some faces.
    pub(crate) fn measure(&self, range: Range<usize>) -> Faces {
        let mut out = Faces::default();
        let (mut octet, mut sampler) = (Octet::new(), Sampler::new(self.field, self.grid));
        let faces: Vec<usize> = range.collect();
        for faces in faces.chunks(LANES) {
            let nets: Vec<Net> = faces.iter().map(|&f| self.surface.net(f)).collect();
            for (&face, net) in faces.iter().zip(&nets) {
                out.corners.enter(self.surface, face, net);
                out.not_finite += count_not_finite(net);
            }
            octet.set(&nets);
            sampler.enter(&octet, nets.len());
            out.moments.extend(&self.quadrature.moments(&octet)[..nets.len()]);
        }
        out.distances = sampler.found;
        out
    }
}

impl Faces {
    /// Takes in the faces that follow.
    pub(crate) fn append(&mut self, other: Self) {
        self.distances.append(other.distances);
        self.moments.extend(other.moments);
        self.corners.gap = worse(self.corners.gap, other.corners.gap);
        self.corners.bits_differ += other.corners.bits_differ;
        self.not_finite += other.not_finite;
    }
}

impl Corners {
    fn enter(&mut self, surface: &Surface<'_>, face: usize, net: &Net) {
        for (corner, &v) in surface.faces()[face].iter().enumerate() {
            let (p, q) = (net[boundary_index(DEGREE, corner, 0)], surface.vertices()[v as usize]);
            self.gap = worse(self.gap, (p - q).norm());
            self.bits_differ += u64::from(!same_bits(&p, &q));
        }
    }
}

/// Points with a coordinate that is not a finite number.
pub(crate) fn count_not_finite(points: &[Vec3]) -> u64 {
    points.iter().filter(|p| !p.iter().all(|x| x.is_finite())).count() as u64
}
