//! Patches that are unfit become places where the base mesh is split, until none is.
//!
//! A patch folds where its face is too flat for the bulge of the curves about it, and a few may lie
//! beyond a tolerance that all others keep. Which faces do is seen for certain only when the patches
//! are made. Each is then split across its longest side, the rest of the mesh stays as it is but for
//! as many vertices merged where they are missed least, and the surface is made again.

use crate::config::StageParams;
use isospline_adapt::Improve;
use isospline_check::{Surface, unfit_faces};
use isospline_implicit::Field;
use isospline_network::Method;
use isospline_pipeline::Threads;
use serde::{Deserialize, Serialize};

/// Middle of a face, model units.
pub(crate) type Place = [f64; 3];

/// Surfaces without fewer unfit patches than the best before them, after which that one is kept.
const PATIENCE: usize = 3;
/// Part of the faces that may be unfit, and number of them in any case: where more are, it is more
/// faces that are wanted, not other ones.
const MOST_UNFIT: f64 = 0.02;
const FEW_UNFIT: usize = 4;

/// The surfaces made for one number of faces, one after another, by the middles of the faces that
/// were unfit in each; all that were so in those before are split in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Mending(Vec<Vec<Place>>);

impl Mending {
    /// Whether the search is over when at most `most` further surfaces follow the first of
    /// `faces`.
    pub(crate) fn is_over(&self, most: u32, faces: u32) -> bool {
        let Some(last) = self.0.last() else { return false };
        let n_made = self.0.len();
        let limit = ((MOST_UNFIT * f64::from(faces)) as usize).max(FEW_UNFIT);
        self.0[self.best()].is_empty()
            || n_made > most as usize
            || n_made > self.best() + PATIENCE
            || last.len() > limit
    }

    /// The first surface and at most `most` further ones: what a search of that length knows.
    pub(crate) fn up_to(mut self, most: u32) -> Self {
        self.0.truncate(most as usize + 1);
        self
    }

    /// What is split in the surface to be made next: the unfit faces, surface after surface.
    pub(crate) fn tried(&self) -> &[Vec<Place>] {
        &self.0
    }

    /// What is split in the best surface so far, the first with the fewest unfit faces.
    pub(crate) fn kept(&self) -> &[Vec<Place>] {
        &self.0[..self.best()]
    }

    /// Takes in the unfit faces of the surface made last.
    pub(crate) fn add(&mut self, unfit: Vec<Place>) {
        self.0.push(unfit);
    }

    fn best(&self) -> usize {
        (0..self.0.len()).min_by_key(|&k| self.0[k].len()).unwrap_or(0)
    }
}

/// Whether surfaces are mended at all: of relaxed patches, over a base mesh that may be improved.
pub(crate) fn applies(params: &StageParams, is_imported: bool) -> bool {
    let may_improve = match params.adapt.improve {
        Improve::Auto => !is_imported,
        Improve::Always => true,
        Improve::Never => false,
    };
    may_improve && params.network.method == Method::Normal
}

/// Middles of the faces whose patches fold or lie beyond `tolerance`, relative to the diagonal.
pub(crate) fn unfit_places(
    surface: &Surface<'_>,
    field: &dyn Field,
    tolerance: Option<f64>,
    threads: usize,
) -> Vec<Place> {
    let threads = Threads::new(threads);
    let limit = tolerance.map_or(f64::INFINITY, |tolerance| tolerance * surface.diagonal());
    let unfit = unfit_faces(surface, field, limit, &|n, body| threads.for_each(n, body));
    // As adapt computes it.
    let middle = |face: u32| {
        let [a, b, c] = surface.faces()[face as usize].map(|v| surface.vertices()[v as usize]);
        ((a + b + c) / 3.0).into()
    };
    unfit.into_iter().map(middle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(folds: &[usize]) -> Mending {
        Mending(folds.iter().map(|&n| vec![[0.0; 3]; n]).collect())
    }

    #[test]
    fn a_surface_without_unfit_patches_is_kept_as_it_is() {
        assert!(!after(&[]).is_over(6, 1000));
        assert!(after(&[0]).is_over(6, 1000) && after(&[0]).kept().is_empty());
        assert!(!after(&[3, 1]).is_over(6, 1000) && after(&[3, 1, 0]).is_over(6, 1000));
        assert_eq!(after(&[3, 1, 0]).kept().len(), 2);
        assert_eq!(after(&[3, 1, 0]).up_to(1), after(&[3, 1]));
    }

    #[test]
    fn the_search_ends_with_its_rounds_its_patience_or_too_many_unfit_patches() {
        assert!(after(&[3]).is_over(0, 1000) && !after(&[3]).is_over(1, 1000));
        assert!(!after(&[4, 7, 5]).is_over(6, 1000) && after(&[4, 7, 5, 4]).is_over(6, 1000));
        assert!(after(&[4, 7, 5, 4]).kept().is_empty());
        assert!(after(&[21]).is_over(6, 1000) && !after(&[20]).is_over(6, 1000));
        assert!(after(&[5]).is_over(6, 100) && !after(&[4]).is_over(6, 100));
    }
}
