//! Patches that are unfit become places where the next surface is made otherwise, until none is.
//!
//! A patch folds where its face is too flat for the bulge of the curves about it, or where a side
//! is so short that its curve cannot have the curvatures of both ends, and a few may lie beyond a
//! tolerance that all others keep. Which faces do is seen for certain only when the patches are
//! made. Each is then edited: the ends of a very short side are merged, others are split across
//! their longest side. The rest of the mesh stays as it is but for as many vertices merged where
//! they are missed least, and the surface is made again.
//!
//! Where planes or cylinders are parts of the surface patches fold for another reason: curves of
//! least normal distance may run along a plane as they like, and where curvature jumps at its rim
//! they gain by that. There the curves of the paper are no farther away, so a face whose patch folds
//! gets those first, and is edited if it folds with them too.

use crate::config::StageParams;
use isospline_adapt::Improve;
use isospline_check::{Checked, DEFAULT_ERROR, Surface};
use isospline_fitting::shape::second_fundamental_form;
use isospline_geometry::Vec3;
use isospline_implicit::Field;
use isospline_network::Method;
use serde::{Deserialize, Serialize};

/// Middle of a face, model units.
type Place = [f64; 3];

/// Surfaces without fewer unfit patches than the best before them, after which that one is kept.
const PATIENCE: usize = 4;
/// Part of the faces that may have to be edited, and number of them in any case: where more are, it
/// is more faces that are wanted, not other ones.
const MOST_EDITED: f64 = 0.02;
const FEW_EDITED: usize = 4;
/// Principal curvature, of the larger one and 1/diagonal, that is rounding.
const NO_CURVATURE: f64 = 1e-9;
/// Part of the vertices in planes, cylinders and cones from which on those are parts of the surface:
/// by symmetry some vertices of any surface may lie on parabolic lines.
const MANY_DEVELOPABLE: f64 = 0.1;

/// A face whose patch was unfit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Unfit {
    middle: Place,
    /// Whether the patch folds on a surface with developable parts.
    by_developable: bool,
}

/// What is done about unfit patches.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Remedies {
    /// Faces that are split or, as needles, merged away, list after list.
    edits: Vec<Vec<Place>>,
    /// Faces whose sides keep the curves of the paper.
    paper_faces: Vec<Place>,
}

impl Remedies {
    /// Those for faces that were `unfit`, surface after surface.
    fn of(unfit: &[Vec<Unfit>]) -> Self {
        let mut remedies = Self::default();
        for unfit in unfit {
            let is_new =
                |face: &&Unfit| face.by_developable && !remedies.paper_faces.contains(&face.middle);
            let (new, others): (Vec<&Unfit>, _) = unfit.iter().partition(is_new);
            let middles = |faces: Vec<&Unfit>| faces.into_iter().map(|face| face.middle).collect();
            let (new, others): (Vec<Place>, Vec<Place>) = (middles(new), middles(others));
            remedies.paper_faces.extend(new);
            remedies.edits.push(others);
        }
        remedies
    }

    /// Adds them to what the user asks for.
    pub(crate) fn put_into(self, params: &mut StageParams) {
        params.adapt.unfit_faces.extend(self.edits.into_iter().filter(|faces| !faces.is_empty()));
        params.network.paper_faces.extend(self.paper_faces);
    }
}

/// The surfaces made for one number of faces, one after another, by the faces that were unfit in
/// each; something was done about all that were so in those before.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Mending(Vec<Vec<Unfit>>);

impl Mending {
    /// Whether the search is over when at most `most` further surfaces follow the first of
    /// `faces`.
    pub(crate) fn is_over(&self, most: u32, faces: u32) -> bool {
        if self.0.is_empty() {
            return false;
        }
        let n_made = self.0.len();
        let limit = ((MOST_EDITED * f64::from(faces)) as usize).max(FEW_EDITED);
        self.0[self.n_kept()].is_empty()
            || n_made > most as usize
            || n_made > self.n_kept() + PATIENCE
            || self.tried().edits.last().is_some_and(|faces| faces.len() > limit)
    }

    /// The first surface and at most `most` further ones: what a search of that length knows.
    pub(crate) fn up_to(mut self, most: u32) -> Self {
        self.0.truncate(most as usize + 1);
        self
    }

    /// Surfaces before the one to be made next.
    pub(crate) fn n_tried(&self) -> usize {
        self.0.len()
    }

    /// What is done in the surface to be made next.
    pub(crate) fn tried(&self) -> Remedies {
        Remedies::of(&self.0)
    }

    /// Surfaces before the best so far, the first with the fewest unfit faces.
    pub(crate) fn n_kept(&self) -> usize {
        (0..self.0.len()).min_by_key(|&k| self.0[k].len()).unwrap_or(0)
    }

    /// What is done in that one.
    pub(crate) fn kept(&self) -> Remedies {
        Remedies::of(&self.0[..self.n_kept()])
    }

    /// Takes in the unfit faces of the surface made last.
    pub(crate) fn add(&mut self, unfit: Vec<Unfit>) {
        self.0.push(unfit);
    }
}

/// Whether surfaces are mended at all: over a base mesh that may be improved.
pub(crate) fn applies(params: &StageParams, is_imported: bool) -> bool {
    match params.adapt.improve {
        Improve::Auto => !is_imported,
        Improve::Always => true,
        Improve::Never => false,
    }
}

/// The faces whose patches fold or lie beyond `tolerance`, relative to the diagonal; without one
/// beyond what a check allows.
pub(crate) fn unfit(
    surface: &Surface<'_>,
    field: &dyn Field,
    checked: &Checked,
    tolerance: Option<f64>,
    method: Method,
) -> Vec<Unfit> {
    let limit = tolerance.unwrap_or(DEFAULT_ERROR) * surface.diagonal();
    let found = checked.unfit_faces(limit);
    let may_have_other_curves = method == Method::Normal && !found.is_empty();
    let has_developable = may_have_other_curves && has_developable_parts(surface, field);
    let unfit = found.into_iter().map(|found| {
        let [a, b, c] =
            surface.faces()[found.face as usize].map(|v| surface.vertices()[v as usize]);
        // As adapt computes it.
        let middle = ((a + b + c) / 3.0).into();
        Unfit { middle, by_developable: found.folds && has_developable }
    });
    unfit.collect()
}

fn has_developable_parts(surface: &Surface<'_>, field: &dyn Field) -> bool {
    let vertices = surface.vertices();
    let is_in = |p: &&Vec3| is_developable(field, **p, surface.diagonal());
    vertices.iter().filter(is_in).count() as f64 >= MANY_DEVELOPABLE * vertices.len() as f64
}

/// Whether a principal curvature of the surface is zero at a place.
fn is_developable(field: &dyn Field, place: Vec3, diagonal: f64) -> bool {
    let [xx, xy, xz, yy, yz, zz] = second_fundamental_form(&field.hessian(place));
    // The product of the principal curvatures, and the root of the sum of their squares.
    let product = (xx * yy - xy * xy) + (yy * zz - yz * yz) + (zz * xx - xz * xz);
    let squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
    let size = squares.sqrt();
    product.abs() <= NO_CURVATURE * size * size.max(1.0 / diagonal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;

    fn face(k: u32, by_developable: bool) -> Unfit {
        Unfit { middle: [f64::from(k), 0.0, 0.0], by_developable }
    }

    fn after(folds: &[u32]) -> Mending {
        Mending(folds.iter().map(|&n| (0..n).map(|k| face(k, false)).collect()).collect())
    }

    #[test]
    fn a_surface_without_unfit_patches_is_kept_as_it_is() {
        assert!(!after(&[]).is_over(6, 1000));
        assert!(after(&[0]).is_over(6, 1000) && after(&[0]).n_kept() == 0);
        assert!(!after(&[3, 1]).is_over(6, 1000) && after(&[3, 1, 0]).is_over(6, 1000));
        assert_eq!(after(&[3, 1, 0]).kept(), after(&[3, 1]).tried());
        assert_eq!(after(&[3, 1, 0]).up_to(1), after(&[3, 1]));
    }

    #[test]
    fn the_search_ends_with_its_rounds_its_patience_or_too_many_faces_to_edit() {
        assert!(after(&[3]).is_over(0, 1000) && !after(&[3]).is_over(1, 1000));
        assert!(!after(&[4, 7, 5, 4]).is_over(6, 1000));
        assert!(after(&[4, 7, 5, 4, 4]).is_over(6, 1000));
        assert_eq!(after(&[4, 7, 5, 4, 4]).kept(), Remedies::default());
        assert!(after(&[21]).is_over(6, 1000) && !after(&[20]).is_over(6, 1000));
        assert!(after(&[5]).is_over(6, 100) && !after(&[4]).is_over(6, 100));
        let by_developable = Mending(vec![(0..300).map(|k| face(k, true)).collect()]);
        assert!(!by_developable.is_over(6, 1000));
    }

    #[test]
    fn beside_flat_parts_faces_get_curves_of_the_paper_first_and_are_edited_next() {
        let (flat, other) = (face(1, true), face(2, false));
        let remedies = Remedies::of(&[vec![flat, other], vec![flat, face(3, true)]]);
        assert_eq!(remedies.paper_faces, [flat.middle, face(3, true).middle]);
        assert_eq!(remedies.edits, [[other.middle], [flat.middle]]);
    }

    #[test]
    fn planes_and_cylinders_are_developable_and_spheres_and_saddles_are_not() {
        let at = Vec3::new(0.6, 0.8, 0.3);
        let of = |gradient: Vec3, hessian: [f64; 6]| {
            let field = ClosureField::new(2.0, |_: Vec3| 0.0)
                .with_gradient(move |_: Vec3| gradient)
                .with_hessian(move |_: Vec3| hessian);
            is_developable(&field, at, 3.0)
        };
        assert!(of(Vec3::new(0.3, 0.2, 0.7), [0.0; 6]));
        assert!(of(Vec3::new(0.6, 0.8, 0.0), [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
        assert!(!of(at, [1.0, 0.0, 0.0, 1.0, 0.0, 1.0]));
        assert!(!of(Vec3::z(), [1.0, 0.0, 0.0, -1e-3, 0.0, 0.0]));
        assert!(!of(Vec3::zeros(), [1.0; 6]));
    }
}
