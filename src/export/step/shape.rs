//! Points, curves, surfaces and the topology that joins them.

use super::StepOptions;
use super::layout::{CurveNumbers, Layout};
use super::text::{Entities, Real, References};
use crate::ExportError;
use crate::quads::{Corners, QuadMap, halves};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{boundary_index, evaluate};

const SPAN: &str = "(0.,1.)";

/// The surface on its way into a file.
pub(super) struct Shape<'p> {
    patches: &'p PatchesView<'p>,
    options: StepOptions,
    degree: usize,
    layout: Layout,
    maps: Vec<QuadMap>,
    /// Of each edge, the half-edges that run up and down the vertex numbers.
    half_edges: Vec<[u32; 2]>,
    /// The straight lines of the sides of a square, forward and back.
    lines: u64,
}

/// A side of a quad: an edge, and whether it runs the way round that the loop does.
#[derive(Clone, Copy, Debug)]
struct Side {
    edge: u64,
    forward: bool,
}

/// Numbers of the control points of a quad, `[i][j]`.
type Net = Vec<Vec<u64>>;

impl<'p> Shape<'p> {
    /// Writes what all faces share and lays out the rest.
    pub(super) fn begin(
        patches: &'p PatchesView<'p>,
        options: StepOptions,
        entities: &mut Entities<'_>,
    ) -> Result<Self, ExportError> {
        let lines = entities.next() + 1;
        if options.pcurves {
            write_lines(entities)?;
        }
        let (n_vertices, n_edges) = (patches.position.len(), patches.boundary.len());
        let degree = patches.degree();
        let layout = Layout::new(options, degree, entities.next(), n_vertices, n_edges);
        let corners: Vec<Corners> = if options.compact {
            vec![Corners::collapsed()]
        } else {
            (0..3).map(Corners::at_corner).collect()
        };
        let maps = corners.iter().map(|corners| QuadMap::new(degree, corners)).collect();
        let half_edges = half_edges(patches);
        Ok(Self { patches, options, degree, layout, maps, half_edges, lines })
    }

    /// Numbers of the faces that triangle `f` becomes.
    pub(super) fn faces_of(&self, f: usize) -> impl Iterator<Item = u64> + Clone + use<'_> {
        (0..self.layout.quads()).map(move |quad| self.layout.face(f, quad))
    }

    pub(super) fn write_points_and_edges(
        &self,
        entities: &mut Entities<'_>,
    ) -> Result<(), ExportError> {
        for (v, &position) in self.patches.position.iter().enumerate() {
            debug_assert_eq!(entities.next(), self.layout.point(v));
            write_vertex(entities, Vec3::from(position))?;
        }
        (0..self.patches.boundary.len()).try_for_each(|e| self.write_edge(entities, e))
    }

    pub(super) fn write_faces(&self, entities: &mut Entities<'_>) -> Result<(), ExportError> {
        (0..self.patches.face.len()).try_for_each(|f| {
            let net = self.patches.own_net(f);
            if self.options.compact {
                return self.write_compact(entities, f, &net);
            }
            self.write_spokes(entities, f, &net)?;
            (0..3).try_for_each(|corner| self.write_quad(entities, f, corner, &net))
        })
    }

    fn write_edge(&self, entities: &mut Entities<'_>, e: usize) -> Result<(), ExportError> {
        debug_assert_eq!(entities.next(), self.layout.edge(e));
        let half_edge = self.half_edges[e][0] as usize;
        let (f, corner) = (half_edge / 3, half_edge % 3);
        let net = self.patches.own_net(f);
        let n = self.degree;
        let curve: Vec<Vec3> = (0..=n).map(|s| net[boundary_index(n, corner, s)]).collect();
        let face = self.patches.face[f];
        let [low, high] = [corner, (corner + 1) % 3].map(|k| self.layout.point(face[k] as usize));
        if self.options.compact {
            write_points(entities, &curve[1..n])?;
            let numbers = self.layout.whole(e);
            return self.write_curve(entities, numbers, [low, high], || self.whole_pcurves(e));
        }
        let [first, second] = halves(&curve);
        write_points(entities, &first[1..n])?;
        write_points(entities, &second[1..n])?;
        write_vertex(entities, second[0])?;
        let middle = self.layout.middle(e);
        for (half, ends) in [[low, middle], [middle, high]].into_iter().enumerate() {
            let numbers = self.layout.half(e, half as u64);
            self.write_curve(entities, numbers, ends, || self.half_pcurves(e, half))?;
        }
        Ok(())
    }

    /// The centre of face `f` and the curves that lead to it.
    fn write_spokes(
        &self,
        entities: &mut Entities<'_>,
        f: usize,
        net: &[Vec3],
    ) -> Result<(), ExportError> {
        debug_assert_eq!(entities.next(), self.layout.centre(f));
        write_vertex(entities, evaluate(self.degree, net, [1.0 / 3.0; 3]))?;
        for map in &self.maps {
            let n = self.degree;
            let inner: Vec<Vec3> = (1..n).map(|j| map.point(net, n, j)).collect();
            write_points(entities, &inner)?;
        }
        for corner in 0..3 {
            let numbers = self.layout.spoke(f, corner);
            let ends = [self.layout.middle(self.edge(f, corner as usize)), self.layout.centre(f)];
            let pcurves = || {
                let next = (corner + 1) % 3;
                [self.layout.pcurve(f, corner, 1), self.layout.pcurve(f, next, 2)]
            };
            self.write_curve(entities, numbers, ends, pcurves)?;
        }
        Ok(())
    }

    fn write_quad(
        &self,
        entities: &mut Entities<'_>,
        f: usize,
        corner: usize,
        net: &[Vec3],
    ) -> Result<(), ExportError> {
        let (quad, before) = (corner as u64, (corner + 2) % 3);
        debug_assert_eq!(entities.next(), self.layout.quad(f, quad));
        let start = self.layout.point(self.patches.face[f][corner] as usize);
        let [middle, middle_before] = [corner, before].map(|c| self.layout.middle(self.edge(f, c)));
        let centre = self.layout.centre(f);
        // The edge that starts at the corner, and the end of the one that leads to it.
        let (after, to) = (self.edge(f, corner), self.edge(f, before));
        let (up, up_before) = (self.runs_up(f, corner), self.runs_up(f, before));
        let first = self.layout.half(after, u64::from(!up));
        let last = self.layout.half(to, u64::from(up_before));
        let spoke = self.layout.spoke(f, quad);
        let spoke_before = self.layout.spoke(f, before as u64);
        let ids = self.net_of(
            entities.next(),
            &self.chain(start, first, up, middle),
            &self.chain(middle, spoke, true, centre),
            &self.chain(middle_before, spoke_before, true, centre),
            &self.chain(start, last, !up_before, middle_before),
        );
        let sides = [
            Side { edge: first.edge, forward: up },
            Side { edge: spoke.edge, forward: true },
            Side { edge: spoke_before.edge, forward: false },
            Side { edge: last.edge, forward: up_before },
        ];
        self.write_patch(entities, &self.maps[corner], net, &ids, &sides)
    }

    fn write_compact(
        &self,
        entities: &mut Entities<'_>,
        f: usize,
        net: &[Vec3],
    ) -> Result<(), ExportError> {
        debug_assert_eq!(entities.next(), self.layout.quad(f, 0));
        let ends = self.patches.face[f].map(|v| self.layout.point(v as usize));
        let curves: [CurveNumbers; 3] =
            std::array::from_fn(|corner| self.layout.whole(self.edge(f, corner)));
        let up: [bool; 3] = std::array::from_fn(|corner| self.runs_up(f, corner));
        let ids = self.net_of(
            entities.next(),
            &self.chain(ends[0], curves[0], up[0], ends[1]),
            &self.chain(ends[1], curves[1], up[1], ends[2]),
            &self.chain(ends[0], curves[2], !up[2], ends[2]),
            &vec![ends[0]; self.degree + 1],
        );
        let sides: [Side; 3] =
            std::array::from_fn(|k| Side { edge: curves[k].edge, forward: up[k] });
        self.write_patch(entities, &self.maps[0], net, &ids, &sides)
    }

    /// Inner points, surface, sides and face of a patch.
    fn write_patch(
        &self,
        entities: &mut Entities<'_>,
        map: &QuadMap,
        net: &[Vec3],
        ids: &Net,
        sides: &[Side],
    ) -> Result<(), ExportError> {
        let n = self.degree;
        for i in 1..n {
            let row: Vec<Vec3> = (1..n).map(|j| map.point(net, i, j)).collect();
            write_points(entities, &row)?;
        }
        let rows: Vec<String> =
            ids.iter().map(|row| format!("({})", References(row.iter().copied()))).collect();
        let surface = entities.add(format_args!(
            "B_SPLINE_SURFACE_WITH_KNOTS('',{n},{n},({}),.UNSPECIFIED.,.F.,.F.,.F.,\
             {knots},{knots},{SPAN},{SPAN},.UNSPECIFIED.)",
            rows.join(","),
            knots = self.knots()
        ))?;
        if self.options.pcurves {
            for (k, side) in sides.iter().enumerate() {
                let line = self.lines + LINE_STRIDE * (2 * k as u64 + u64::from(!side.forward));
                entities.add(format_args!("PCURVE('',#{surface},#{line})"))?;
            }
        }
        let oriented = entities.next();
        for Side { edge, forward } in sides {
            let sense = if *forward { 'T' } else { 'F' };
            entities.add(format_args!("ORIENTED_EDGE('',*,*,#{edge},.{sense}.)"))?;
        }
        let sides = References(oriented..oriented + sides.len() as u64);
        let ring = entities.add(format_args!("EDGE_LOOP('',({sides}))"))?;
        let bound = entities.add(format_args!("FACE_OUTER_BOUND('',#{ring},.T.)"))?;
        entities.add(format_args!("ADVANCED_FACE('',(#{bound}),#{surface},.T.)"))?;
        Ok(())
    }

    /// A curve through points that are written, and the edge on it.
    fn write_curve(
        &self,
        entities: &mut Entities<'_>,
        numbers: CurveNumbers,
        [from, to]: [u64; 2],
        pcurves: impl Fn() -> [u64; 2],
    ) -> Result<(), ExportError> {
        let points = self.chain(from, numbers, true, to);
        let mut curve = entities.add(format_args!(
            "B_SPLINE_CURVE_WITH_KNOTS('',{},({}),.UNSPECIFIED.,.F.,.F.,{},{SPAN},.UNSPECIFIED.)",
            self.degree,
            References(points.into_iter()),
            self.knots()
        ))?;
        if self.options.pcurves {
            let [a, b] = pcurves();
            curve =
                entities.add(format_args!("SURFACE_CURVE('',#{curve},(#{a},#{b}),.CURVE_3D.)"))?;
        }
        // The vertex of a point follows it.
        let (from, to) = (from + 1, to + 1);
        let edge = entities.add(format_args!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)"))?;
        debug_assert_eq!(edge, numbers.edge);
        Ok(())
    }

    fn whole_pcurves(&self, e: usize) -> [u64; 2] {
        self.half_edges[e].map(|h| self.layout.pcurve(h as usize / 3, 0, u64::from(h) % 3))
    }

    /// Half 0 starts the quad at the lower vertex of the face above and ends that of the face
    /// below; half 1 the other way round.
    fn half_pcurves(&self, e: usize, half: usize) -> [u64; 2] {
        let [up, down] = self.half_edges[e].map(|h| (h as usize / 3, u64::from(h) % 3));
        let start = |(f, corner)| self.layout.pcurve(f, corner, 0);
        let end = |(f, corner)| self.layout.pcurve(f, (corner + 1) % 3, 3);
        if half == 0 { [start(up), end(down)] } else { [end(up), start(down)] }
    }

    /// Multiplicities of the knots of one polynomial span.
    fn knots(&self) -> String {
        format!("({order},{order})", order = self.degree + 1)
    }

    /// Numbers of the control points of a curve, against its direction if not `forward`.
    fn chain(&self, from: u64, curve: CurveNumbers, forward: bool, to: u64) -> Vec<u64> {
        let mut inner: Vec<u64> = (curve.inner..curve.inner + self.layout.inner).collect();
        if !forward {
            inner.reverse();
        }
        std::iter::once(from).chain(inner).chain([to]).collect()
    }

    /// Numbers of a net `c_ij` from its inner points and its four borders, at v = 0, u = 1, v = 1
    /// and u = 0, each in ascending u or v.
    fn net_of(
        &self,
        first_inner: u64,
        bottom: &[u64],
        right: &[u64],
        top: &[u64],
        left: &[u64],
    ) -> Net {
        let (n, inner) = (self.degree, self.layout.inner);
        let number = |i: usize, j: usize| match (i, j) {
            (_, 0) => bottom[i],
            (_, j) if j == n => top[i],
            (0, _) => left[j],
            (i, _) if i == n => right[j],
            _ => first_inner + inner * (i as u64 - 1) + j as u64 - 1,
        };
        (0..=n).map(|i| (0..=n).map(|j| number(i, j)).collect()).collect()
    }

    fn edge(&self, f: usize, corner: usize) -> usize {
        self.patches.edge_of[3 * f + corner] as usize
    }

    fn runs_up(&self, f: usize, corner: usize) -> bool {
        let face = self.patches.face[f];
        face[corner] < face[(corner + 1) % 3]
    }
}

fn write_points(entities: &mut Entities<'_>, points: &[Vec3]) -> Result<(), ExportError> {
    points.iter().try_for_each(|p| {
        let [x, y, z] = [p.x, p.y, p.z].map(Real);
        entities.add(format_args!("CARTESIAN_POINT('',({x},{y},{z}))")).map(|_| ())
    })
}

/// A point and the vertex there.
fn write_vertex(entities: &mut Entities<'_>, at: Vec3) -> Result<(), ExportError> {
    let point = entities.next();
    write_points(entities, &[at])?;
    entities.add(format_args!("VERTEX_POINT('',#{point})"))?;
    Ok(())
}

/// Entities of one line in the parameters of a surface; its representation comes first.
const LINE_STRIDE: u64 = 5;

/// The sides of the unit square as curves in a surface's parameters, each forward and back, after
/// the context that they share.
fn write_lines(entities: &mut Entities<'_>) -> Result<(), ExportError> {
    let context = entities.add(format_args!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()\
         REPRESENTATION_CONTEXT('2D SPACE',''))"
    ))?;
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for side in 0..4 {
        let [a, b] = [corners[side], corners[(side + 1) % 4]];
        for [from, to] in [[a, b], [b, a]] {
            let next = entities.next();
            let [line, point, vector, direction] = [1, 2, 3, 4].map(|k| next + k);
            let way = [0, 1].map(|k| Real(to[k] - from[k]));
            let from = from.map(Real);
            entities.add(format_args!("DEFINITIONAL_REPRESENTATION('',(#{line}),#{context})"))?;
            entities.add(format_args!("LINE('',#{point},#{vector})"))?;
            entities.add(format_args!("CARTESIAN_POINT('',({},{}))", from[0], from[1]))?;
            entities.add(format_args!("VECTOR('',#{direction},1.)"))?;
            entities.add(format_args!("DIRECTION('',({},{}))", way[0], way[1]))?;
        }
    }
    Ok(())
}

fn half_edges(patches: &PatchesView<'_>) -> Vec<[u32; 2]> {
    let mut halves = vec![[0; 2]; patches.boundary.len()];
    for (h, &e) in patches.edge_of.iter().enumerate() {
        let (face, corner) = (patches.face[h / 3], h % 3);
        let up = face[corner] < face[(corner + 1) % 3];
        halves[e as usize][usize::from(!up)] = h as u32;
    }
    halves
}
