//! A projected mesh becomes a base mesh that is fit to carry patches.
//!
//! The gate: normals along an edge turn by no more than a limit, the chord rises no more than a
//! part of its length along a normal, and no face is folded against the normals of its corners.
//! Unfit places are repaired by flipping, sliding, collapsing and, where nothing else helps, splitting; every
//! repair is counted. A fit imported mesh passes in all bits of its positions.

mod curve_error;
mod error;
mod error_cache;
mod free_vertices;
pub mod freeze;
mod gate;
mod improve;
mod known_merges;
mod merging;
pub mod order;
mod params;
mod quartic;
mod ranking;
mod repair;
mod sampled;
mod surface_mesh;
mod unfit_faces;
mod vertex;

pub use error::AdaptError;
pub use params::{AdaptParams, Curves, Improve, Vertices};

use curve_error::Measure;
use error_cache::ErrorCache;
use gate::Gate;
use isospline_artifact::kinds::{BaseMesh, MeshView, TopologyProof};
use isospline_geometry::TriangleMesh;
use isospline_stage::{Counters, Ctx, Piece, Plan, Stage, Task};
use repair::Search;
use surface_mesh::SurfaceMesh;

/// Stage `adapt`.
#[derive(Clone, Debug)]
pub struct Adapt {
    params: AdaptParams,
}

impl Stage for Adapt {
    const NAME: &'static str = "adapt";
    const VERSION: u32 = 9;
    type Params = AdaptParams;
    type Whole<'a> = (MeshView<'a>,);
    type Rows<'a> = ();
    type Output = BaseMesh;
    type Error = AdaptError;

    fn prepare(_: &Ctx<'_>, params: &AdaptParams, _: (MeshView<'_>,)) -> Result<Self, AdaptError> {
        Ok(Self { params: params.clone() })
    }

    fn plan(&self, _: (MeshView<'_>,), _: usize) -> Plan {
        Plan::Whole
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh,): (MeshView<'_>,),
        (): (),
        _: &Task,
    ) -> Result<Piece<BaseMesh>, AdaptError> {
        let mut counters = Counters::default();
        let imported =
            mesh.topology.first().is_none_or(|t| t.proof == TopologyProof::Imported.code());
        let improving = match self.params.improve {
            Improve::Auto => !imported,
            Improve::Always => true,
            Improve::Never => false,
        };
        let fit = self.adapted(ctx, mesh.to_triangles(), improving, &mut counters)?;
        counters.count("faces_in", mesh.face.len() as u64);
        counters.count("faces_out", fit.faces.len() as u64);
        let excess = fit.faces.len().saturating_sub(mesh.face.len());
        counters.repair("faces_over_target", excess as u64);
        let mut rows = freeze::freeze(&fit, ctx.field, ctx.host)?;
        if self.params.vertices == Vertices::Free {
            free_vertices::settle(ctx, &mut rows, &mut counters)?;
        }
        Ok(Piece { rows, counters })
    }
}

impl Adapt {
    fn adapted(
        &self,
        ctx: &Ctx<'_>,
        mesh: TriangleMesh,
        improving: bool,
        counters: &mut Counters,
    ) -> Result<TriangleMesh, AdaptError> {
        let n_faces = mesh.faces.len();
        let mut surface = SurfaceMesh::new(ctx, mesh)?;
        let mut cache = ErrorCache::default();
        let error_in = improve::worst_curve_error_rel(&surface, &mut cache);
        counters.max("curve_error_rel_in", error_in);
        let mut search = Search::default();
        if improving {
            repair::soften(&mut surface, &self.params, &mut search, counters);
        }
        repair::make_fit(ctx, &mut surface, &self.params, &mut search, counters)?;
        let goal = (&self.params, n_faces);
        improve::trim(&mut surface, goal, &mut cache, counters);
        if improving {
            improve::improve(ctx, &mut surface, goal, &mut cache, counters)?;
        }
        counters.max("curve_error_rel", improve::worst_curve_error_rel(&surface, &mut cache));
        if improving && self.params.curves == Curves::Normal {
            self.improve_normal(ctx, &mut surface, n_faces, counters)?;
        }
        let mut cache = ErrorCache::default();
        for middles in &self.params.unfit_faces {
            unfit_faces::edit(&mut surface, &Gate::new(&self.params), middles, counters);
            improve::trim(&mut surface, goal, &mut cache, counters);
        }
        counters.count("slivers_left", surface.slivers(self.params.min_quality));
        Ok(surface.mesh.compact())
    }

    /// Further rounds, judged by curves of normal distance.
    fn improve_normal(
        &self,
        ctx: &Ctx<'_>,
        surface: &mut SurfaceMesh<'_>,
        n_faces: usize,
        counters: &mut Counters,
    ) -> Result<(), AdaptError> {
        // The rounds so far may have made room for slivers to go.
        repair::soften(surface, &self.params, &mut Search::default(), counters);
        surface.measure = Measure::normal();
        let mut cache = ErrorCache::default();
        let error_in = improve::worst_curve_error_rel(surface, &mut cache);
        counters.max("normal_score_rel_in", error_in);
        improve::improve(ctx, surface, (&self.params, n_faces), &mut cache, counters)?;
        let error = improve::worst_curve_error_rel(surface, &mut cache);
        counters.max("normal_score_rel", error);
        Ok(())
    }
}
