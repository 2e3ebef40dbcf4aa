//! The figures of a check, as `--json` prints them.

use serde::Serialize;
use std::collections::BTreeMap;

/// All figures of a check and its verdict.
///
/// Figures named `rel_` and `gap_max`, `vertex_error_max` are relative to the diagonal of the box
/// around the vertices; angles are in degrees. A figure that could not be measured is NaN (`null`
/// in JSON) and fails the check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// Number of faces.
    pub faces: u64,
    /// Number of vertices.
    pub vertices: u64,
    /// `V - E + F` over all components.
    pub euler_characteristic: i64,
    /// Connected components.
    pub components: u32,
    /// Sum of the genera of all components; absent unless all are closed.
    pub genus: Option<i64>,
    /// Each component, in order of its lowest face.
    pub component_list: Vec<Component>,
    /// What keeps the faces from being a closed, oriented manifold.
    pub edge_defects: EdgeDefects,
    /// Diagonal of the box around the vertices, in model units.
    pub diagonal: f64,
    /// Largest distance between the control points of two patches along their shared edge, or
    /// of a net's corner from its vertex.
    pub gap_max: f64,
    /// Shared edges whose control points, and corners whose vertices, differ in some bit.
    pub shared_bits_differ: u64,
    /// Largest angle between the normals of two patches along their edge.
    pub g1_angle_deg_max: f64,
    /// 99th percentile over edges of the largest angle of each.
    pub g1_angle_deg_p99: f64,
    /// Median over edges of the largest jump of normal curvature across each, over the largest
    /// curvature there and `1e-3 / diagonal`; along the direction normal to the edge.
    pub curvature_jump_median: f64,
    /// 99th percentile of the same.
    pub curvature_jump_p99: f64,
    /// Largest distance from the surface: local maximum sought, confirmed by its foot point.
    pub rel_error_max: f64,
    /// Largest first-order distance `|f| / |grad f|` on the sample grid.
    pub rel_error_grid_max: f64,
    /// Root mean square of the first-order distance on the sample grid.
    pub rel_error_rms: f64,
    /// Mean of the first-order distance on the sample grid.
    pub rel_error_mean: f64,
    /// Largest angle between patch normal and `grad f` on the sample grid.
    pub normal_error_deg_max: f64,
    /// Patches whose normal points inward (against `grad f`) somewhere on the sample grid.
    pub flipped_patches: u64,
    /// Sampled points of patches where no tangent plane exists.
    pub degenerate_normals: u64,
    /// Largest distance of a vertex from the surface, or of a net's corner from its vertex.
    pub vertex_error_max: f64,
    /// Half-edge ends whose weight `lambda0` is not in (0, 1).
    pub lambda0_out_of_range: u64,
    /// Smallest `lambda0`.
    pub lambda0_min: f64,
    /// Largest `lambda0`.
    pub lambda0_max: f64,
    /// Least quality of a triangle of vertices: 1 if equilateral, 0 if flat.
    pub quality_min: f64,
    /// Control points, vertices and samples whose coordinates, field value or gradient are not
    /// finite numbers, or whose gradient vanishes.
    pub not_finite: u64,
    /// Counters of every fallback that any stage took; never fails the check.
    pub repairs: BTreeMap<String, u64>,
    /// Where `rel_error_max` was found.
    pub worst_error: Option<Place>,
    /// Where `g1_angle_deg_max` was found.
    pub worst_g1_angle: Option<Place>,
    /// Where `normal_error_deg_max` was found.
    pub worst_normal: Option<Place>,
    /// Whether no figure exceeds its limit.
    pub pass: bool,
    /// One sentence a broken limit: figure, value, limit, place.
    pub failures: Vec<String>,
}

/// One connected component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Component {
    /// Number of faces.
    pub faces: u64,
    /// Number of vertices.
    pub vertices: u64,
    /// `V - E + F`.
    pub euler_characteristic: i64,
    /// Genus; absent unless the component is closed.
    pub genus: Option<i64>,
    /// Volume that it encloses, model units cubed; negative around a hollow.
    pub volume: f64,
    /// Components around it: odd for a hollow, even and not 0 for a part within one.
    pub depth: u32,
}

/// What keeps faces from being a closed, oriented manifold; all zero on a sound surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct EdgeDefects {
    /// Edges with one face.
    pub border: u64,
    /// Edges with two faces that run along it in the same direction.
    pub misoriented: u64,
    /// Edges with three faces or more.
    pub non_manifold: u64,
    /// Vertices whose faces form more than one fan.
    pub pinched_vertices: u64,
    /// Vertices that no face uses.
    pub loose_vertices: u64,
    /// Faces that name a vertex twice.
    pub repeated_corners: u64,
}

/// A place on the surface and the figure found there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// The face.
    pub face: u32,
    /// Barycentric coordinates of the point.
    pub barycentric: [f64; 3],
    /// The point, in model units.
    pub point: [f64; 3],
    /// The figure, in its own unit.
    pub value: f64,
}

/// The worse of two figures; not-a-number is the worst of all.
pub(crate) fn worse(acc: f64, x: f64) -> f64 {
    if acc.is_nan() || x <= acc { acc } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn not_a_number_is_the_worst_of_all() {
        assert!(worse(f64::NAN, 1.0).is_nan());
        assert!(worse(1.0, f64::NAN).is_nan());
        assert!((worse(1.0, 2.0) - 2.0).abs() < 1e-15);
    }
}
