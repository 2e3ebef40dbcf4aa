//! A field of your own becomes a checked surface: `cargo run --release --example convert`.
#![expect(clippy::print_stdout, reason = "an example tells what it does")]

use isospline::{Aabb, CheckParams, ClosureField, ConvertError, Options, Vec3, convert};

fn main() -> Result<(), ConvertError> {
    // A value is enough: missing derivatives are differences in steps of the model's size, and
    // cost digits. Here the gradient and the Hessian [xx, xy, xz, yy, yz, zz] are given too.
    let ellipsoid = ClosureField::new(2.0, |p: Vec3| p.x * p.x / 4.0 + p.y * p.y + p.z * p.z - 1.0)
        .with_gradient(|p: Vec3| Vec3::new(p.x / 2.0, 2.0 * p.y, 2.0 * p.z))
        .with_hessian(|_| [0.5, 0.0, 0.0, 2.0, 0.0, 2.0]);

    let domain = Aabb::new(Vec3::new(-2.2, -1.1, -1.1), Vec3::new(2.2, 1.1, 1.1));
    let surface = convert(&ellipsoid, &Options { faces: 400, ..Options::new(domain) })?;

    // 36 control points a patch, in storage order; patches.face names the corners.
    let patches = surface.patches()?;
    println!("{} patches, corner of the first: {:?}", patches.face.len(), patches.net(0)[0]);

    let report = surface.check(&CheckParams::default())?;
    println!("largest error {:.1e} of the diagonal", report.rel_error_max);
    println!("largest angle between neighbours {:.1e} degrees", report.g1_angle_deg_max);
    println!("{}", if report.pass { "check passed" } else { "check failed" });
    Ok(())
}
