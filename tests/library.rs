//! The library converts fields that are no formulas.

use isospline::{
    Aabb, CheckParams, CheckReport, ClosureField, ConvertError, Field, Options, Vec3, convert,
};
use std::sync::atomic::AtomicBool;

fn domain() -> Aabb {
    Aabb::new(Vec3::new(-2.2, -1.1, -1.1), Vec3::new(2.2, 1.1, 1.1))
}

fn value(p: Vec3) -> f64 {
    p.x * p.x / 4.0 + p.y * p.y + p.z * p.z - 1.0
}

fn checked(field: &dyn Field) -> Result<CheckReport, ConvertError> {
    let options = Options { faces: 400, ..Options::new(domain()) };
    convert(field, &options)?.check(&CheckParams::default())
}

#[test]
fn a_closure_with_derivatives_passes_the_check() {
    let field = ClosureField::new(2.0, value)
        .with_gradient(|p: Vec3| Vec3::new(p.x / 2.0, 2.0 * p.y, 2.0 * p.z))
        .with_hessian(|_| [0.5, 0.0, 0.0, 2.0, 0.0, 2.0]);
    let report = checked(&field).unwrap();
    assert!(report.pass, "{:?}", report.failures);
    assert_eq!(report.genus, Some(0));
    assert!(report.rel_error_max < 1e-4, "{:e}", report.rel_error_max);
}

#[test]
fn a_closure_with_a_value_alone_passes_the_check() {
    let report = checked(&ClosureField::new(2.0, value)).unwrap();
    assert!(report.pass, "{:?}", report.failures);
    assert!(report.rel_error_max < 1e-4, "{:e}", report.rel_error_max);
}

#[test]
fn a_closure_that_is_positive_inside_is_turned() {
    let field = ClosureField::new(2.0, |p| -value(p));
    let surface = convert(&field, &Options::new(domain())).unwrap();
    assert!(surface.field.flipped);
    assert_eq!(surface.check(&CheckParams::default()).unwrap().flipped_patches, 0);
}

#[test]
fn a_tolerance_is_met_by_few_faces() {
    let field = ClosureField::new(2.0, value)
        .with_gradient(|p: Vec3| Vec3::new(p.x / 2.0, 2.0 * p.y, 2.0 * p.z))
        .with_hessian(|_| [0.5, 0.0, 0.0, 2.0, 0.0, 2.0]);
    let options = Options { tolerance: Some(1e-6), ..Options::new(domain()) };
    let report = convert(&field, &options).unwrap().check(&CheckParams::default()).unwrap();
    assert!(report.pass, "{:?}", report.failures);
    // 66 are found; half as many again still are few.
    let (error, faces) = (report.rel_error_max, report.faces);
    assert!(error <= 1e-6 && faces <= 99, "{error:e} with {faces} faces");
}

#[test]
fn a_surface_that_leaves_the_box_is_an_error() {
    let small = Aabb::new(Vec3::repeat(-1.1), Vec3::repeat(1.1));
    let refused = convert(&ClosureField::new(2.0, value), &Options::new(small)).unwrap_err();
    assert!(refused.to_string().contains("leaves the box"), "{refused}");
}

#[test]
fn a_raised_stop_flag_ends_the_conversion() {
    let stop = AtomicBool::new(true);
    let mut options = Options::new(domain());
    options.run.stop = &stop;
    let stopped = convert(&ClosureField::new(2.0, value), &options).unwrap_err();
    assert!(stopped.to_string().contains("stopped"), "{stopped}");
}
