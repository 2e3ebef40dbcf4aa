//! Header, product, units and validation properties of a STEP file.

use super::text::{Entities, Real, References, quoted};
use super::{StepOptions, StepSchema};
use crate::mass::Mass;
use crate::solids::Solid;
use crate::{About, ExportError, LengthUnit};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::{Aabb, Vec3};
use std::io::Write;

/// Distance below which points count as one, relative to the diagonal: far above rounding, far
/// below any error of the surface that a user asks for.
const UNCERTAINTY: f64 = 1e-9;

/// What the file says besides its geometry.
pub(super) struct Product<'a> {
    pub(super) about: &'a About,
    pub(super) options: StepOptions,
    pub(super) patches: &'a PatchesView<'a>,
}

/// Numbers of the entities that the rest refers to.
pub(super) struct Frame {
    shape: u64,
    length: u64,
    context: u64,
    placement: u64,
}

impl Product<'_> {
    pub(super) fn write_header(&self, out: &mut dyn Write) -> Result<(), ExportError> {
        let (name, provenance) = (quoted(&self.about.name), quoted(&self.about.provenance));
        let program = quoted(concat!("isospline ", env!("CARGO_PKG_VERSION")));
        let schema = match self.options.schema {
            StepSchema::Ap242 => {
                "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
            }
            StepSchema::Ap214 => "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 }",
        };
        // No time of day: equal surfaces give equal bytes.
        write!(
            out,
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(({provenance}),'2;1');\n\
             FILE_NAME({name},'1970-01-01T00:00:00',(''),(''),{program},{program},'');\n\
             FILE_SCHEMA(('{schema}'));\nENDSEC;\nDATA;\n"
        )?;
        Ok(())
    }

    pub(super) fn write_product(&self, e: &mut Entities<'_>) -> Result<Frame, ExportError> {
        let (application, year, protocol) = match self.options.schema {
            StepSchema::Ap242 => (
                "managed model based 3d engineering",
                2014,
                "ap242_managed_model_based_3d_engineering",
            ),
            StepSchema::Ap214 => {
                ("core data for automotive mechanical design processes", 2000, "automotive_design")
            }
        };
        let name = quoted(&self.about.name);
        let provenance = quoted(&self.about.provenance);
        let context = e.add(format_args!("APPLICATION_CONTEXT('{application}')"))?;
        e.add(format_args!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','{protocol}',{year},#{context})"
        ))?;
        let field = e.add(format_args!("PRODUCT_CONTEXT('',#{context},'mechanical')"))?;
        let product = e.add(format_args!("PRODUCT({name},{name},{provenance},(#{field}))"))?;
        e.add(format_args!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"))?;
        let formation = e.add(format_args!("PRODUCT_DEFINITION_FORMATION('','',#{product})"))?;
        let design = e.add(format_args!(
            "PRODUCT_DEFINITION_CONTEXT('part definition',#{context},'design')"
        ))?;
        let definition =
            e.add(format_args!("PRODUCT_DEFINITION('design','',#{formation},#{design})"))?;
        let shape = e.add(format_args!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))?;
        let (length, context) = self.write_context(e)?;
        let origin = e.add(format_args!("CARTESIAN_POINT('',(0.,0.,0.))"))?;
        let z = e.add(format_args!("DIRECTION('',(0.,0.,1.))"))?;
        let x = e.add(format_args!("DIRECTION('',(1.,0.,0.))"))?;
        let placement = e.add(format_args!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"))?;
        Ok(Frame { shape, length, context, placement })
    }

    /// Units and accuracy: numbers of the unit of length and of the context.
    fn write_context(&self, e: &mut Entities<'_>) -> Result<(u64, u64), ExportError> {
        let length = write_length(e, self.about.unit)?;
        let angle = e.add(format_args!("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))"))?;
        let solid =
            e.add(format_args!("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())"))?;
        let points = self.patches.position.iter().map(|&p| Vec3::from(p));
        let bounds = points.fold(Aabb::EMPTY, |bounds, p| bounds.including(&p));
        let distance = Real(UNCERTAINTY * bounds.diagonal());
        let accuracy = e.add(format_args!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({distance}),#{length},\
             'distance_accuracy_value','points nearer than this are one')"
        ))?;
        let context = e.add(format_args!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)\
             GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))\
             REPRESENTATION_CONTEXT('',''))"
        ))?;
        Ok((length, context))
    }

    pub(super) fn write_representation(
        &self,
        frame: &Frame,
        breps: &[u64],
        e: &mut Entities<'_>,
    ) -> Result<(), ExportError> {
        let Frame { shape, context, placement, .. } = frame;
        let (name, breps) = (quoted(&self.about.name), References(breps.iter().copied()));
        let shape_of = e.add(format_args!(
            "ADVANCED_BREP_SHAPE_REPRESENTATION({name},(#{placement},{breps}),#{context})"
        ))?;
        e.add(format_args!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{shape_of})"))?;
        Ok(())
    }
}

/// Volume, area and centroid, by which a reader can tell whether it understood the solid.
pub(super) fn write_validation(
    frame: &Frame,
    solids: &[Solid],
    e: &mut Entities<'_>,
) -> Result<(), ExportError> {
    let shells = solids.iter().flat_map(|s| std::iter::once(&s.outer).chain(&s.voids));
    let mass = Mass::sum(shells.map(|shell| shell.mass));
    let mut derived = |power: &str| {
        let length = frame.length;
        let element = e.add(format_args!("DERIVED_UNIT_ELEMENT(#{length},{power})"))?;
        e.add(format_args!("DERIVED_UNIT((#{element}))"))
    };
    let (square, cube) = (derived("2.")?, derived("3.")?);
    let (volume, area) = (Real(mass.volume), Real(mass.area));
    let volume = e.add(format_args!(
        "MEASURE_REPRESENTATION_ITEM('volume measure',VOLUME_MEASURE({volume}),#{cube})"
    ))?;
    let area = e.add(format_args!(
        "MEASURE_REPRESENTATION_ITEM('surface area measure',AREA_MEASURE({area}),#{square})"
    ))?;
    let centre = mass.centroid();
    let [x, y, z] = [centre.x, centre.y, centre.z].map(Real);
    let centre = e.add(format_args!("CARTESIAN_POINT('centre point',({x},{y},{z}))"))?;
    for (what, item) in [("volume", volume), ("surface area", area), ("centroid", centre)] {
        let Frame { shape, context, .. } = frame;
        let property = e.add(format_args!(
            "PROPERTY_DEFINITION('geometric validation property','{what}',#{shape})"
        ))?;
        let item = e.add(format_args!("REPRESENTATION('{what}',(#{item}),#{context})"))?;
        e.add(format_args!("PROPERTY_DEFINITION_REPRESENTATION(#{property},#{item})"))?;
    }
    Ok(())
}

fn write_length(e: &mut Entities<'_>, unit: LengthUnit) -> Result<u64, ExportError> {
    let si = |prefix: &str| format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))");
    let metres = match unit {
        LengthUnit::Micrometre => return e.add(format_args!("{}", si(".MICRO."))),
        LengthUnit::Millimetre => return e.add(format_args!("{}", si(".MILLI."))),
        LengthUnit::Centimetre => return e.add(format_args!("{}", si(".CENTI."))),
        LengthUnit::Metre => return e.add(format_args!("{}", si("$"))),
        LengthUnit::Inch => ("INCH", "0.0254"),
        LengthUnit::Foot => ("FOOT", "0.3048"),
    };
    let (name, size) = metres;
    let metre = e.add(format_args!("{}", si("$")))?;
    let measure =
        e.add(format_args!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({size}),#{metre})"))?;
    let exponents = e.add(format_args!("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)"))?;
    e.add(format_args!(
        "(CONVERSION_BASED_UNIT('{name}',#{measure})LENGTH_UNIT()NAMED_UNIT(#{exponents}))"
    ))
}
