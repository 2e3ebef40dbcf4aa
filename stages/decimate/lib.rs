//! A fine closed mesh becomes a coarse one of at most `faces` faces, of the same topology.
//!
//! Edges are collapsed in order of their quadric error [GH97, Sec. 4] until the wanted number of faces
//! is left. The quadrics are weighted by the curvature of the field, and a collapse is refused
//! that would leave edges or faces which the later stages cannot fit (MATH: base edges turn
//! too far). Vertices of the result are near the surface, not on it.

mod error;
mod guards;
mod heap;
mod params;
mod quadric;
mod queue;
mod refusals;
mod simplify;
mod surface;
mod tiles;

pub use error::DecimateError;
pub use params::DecimateParams;

use isospline_artifact::kinds::{Mesh, MeshView, TopologyProof};
use isospline_stage::{Counters, Ctx, Piece, Plan, Stage, Task};

/// Stage `decimate`.
#[derive(Clone, Debug)]
pub struct Decimate {
    params: DecimateParams,
}

impl Stage for Decimate {
    const NAME: &'static str = "decimate";
    const VERSION: u32 = 3;
    type Params = DecimateParams;
    type Whole<'a> = (MeshView<'a>,);
    type Rows<'a> = ();
    type Output = Mesh;
    type Error = DecimateError;

    fn prepare(
        _: &Ctx<'_>,
        params: &DecimateParams,
        _: (MeshView<'_>,),
    ) -> Result<Self, DecimateError> {
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
    ) -> Result<Piece<Mesh>, DecimateError> {
        let mut counters = Counters::default();
        counters.count("faces_in", mesh.face.len() as u64);
        if mesh.face.len() <= self.params.faces as usize {
            counters.count("faces_out", mesh.face.len() as u64);
            return Ok(Piece { rows: mesh.to_owned_rows(), counters });
        }
        let coarse = simplify::simplify(ctx, &self.params, mesh.to_triangles(), &mut counters)?;
        counters.count("faces_out", coarse.faces.len() as u64);
        let proof = mesh.topology.first().and_then(|t| TopologyProof::from_code(t.proof));
        let rows = Mesh::from_triangles(&coarse, proof.unwrap_or(TopologyProof::Observed))?;
        Ok(Piece { rows, counters })
    }
}
