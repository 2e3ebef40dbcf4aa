//! Axis-aligned boxes.

use crate::Vec3;

/// An axis-aligned box in model units; empty when a `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box that holds nothing; the neutral element of [`Aabb::including`].
    pub const EMPTY: Self = Self {
        min: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The box between two corners.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    /// The smallest box around all `points`.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |acc, p| acc.including(p))
    }

    /// The smallest box around `self` and `point`.
    #[must_use]
    pub fn including(&self, point: &Vec3) -> Self {
        Self { min: self.min.inf(point), max: self.max.sup(point) }
    }

    /// Side lengths.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Middle point.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Length of the main diagonal: the unit of every `_rel` figure.
    pub fn diagonal(&self) -> f64 {
        self.size().norm()
    }

    /// Whether `point` lies inside or on the box.
    pub fn contains(&self, point: &Vec3) -> bool {
        (0..3).all(|k| self.min[k] <= point[k] && point[k] <= self.max[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_around_points_contains_them_and_has_their_diagonal() {
        let points = [Vec3::new(1.0, -2.0, 0.0), Vec3::new(4.0, 2.0, 0.0)];
        let aabb = Aabb::around(&points);
        assert!(points.iter().all(|p| aabb.contains(p)));
        assert!(!aabb.contains(&Vec3::new(0.0, 0.0, 0.0)));
        assert!((aabb.diagonal() - 5.0).abs() < 1e-15);
    }
}
