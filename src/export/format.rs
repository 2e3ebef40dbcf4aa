//! The formats, and the one function that writes them all.

use crate::tessellation::{Density, Tessellation};
use crate::{
    About, ExportError, StepOptions, bezier_view, glb, msh, npz, obj, ply, step, stl, three_mf, vtu,
};
use isospline_artifact::kinds::PatchesView;
use std::fmt;
use std::io::{BufWriter, Write};
use std::str::FromStr;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// numpy archive: vertices, faces, control points, degree. Exact.
    Npz,
    /// VTK unstructured grid of Bézier triangles. Exact.
    Vtu,
    /// Gmsh 4.1 text: triangles of order 1 to 7 through points of the patches. Exact at order 7.
    Msh,
    /// `BezierView` text: Bézier triangles. Exact.
    Bv,
    /// ISO 10303 solids of polynomial patches. Exact.
    Step,
    /// Binary glTF: triangle mesh with normals and a material, f32.
    Glb,
    /// Wavefront text: triangle mesh with normals, shortest decimals that give back every bit.
    Obj,
    /// Binary PLY: triangle mesh, positions f64, normals f32.
    Ply,
    /// Binary STL: triangle soup whose shared corners agree in all bits, f32.
    Stl,
    /// 3MF: triangle mesh with its unit, for printing, f32.
    ThreeMf,
}

/// What may be chosen about an export.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How fine triangle meshes are. Exact formats and msh ignore it.
    pub density: Density,
    /// Order of the triangles in msh, 1 ..= 7; default 7.
    pub order: u32,
    /// Name, unit and origin, for the formats that have a place for them.
    pub about: About,
    /// Of STEP files.
    pub step: StepOptions,
}

/// No format has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown format {name:?}; formats are npz, vtu, msh, bv, step, glb, obj, ply, stl, 3mf")]
pub struct UnknownFormat {
    /// The name given.
    pub name: String,
}

/// Writes `patches` in `format`; equal patches and options give equal bytes.
///
/// # Errors
/// [`ExportError`]; what was written until then is not a whole file.
pub fn write(
    format: Format,
    patches: &PatchesView<'_>,
    options: &Options,
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    require_coherent(patches)?;
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let sampled = || Tessellation::new(patches, options.density);
    match format {
        Format::Npz => npz::write(patches, &mut out)?,
        Format::Vtu => vtu::write(patches, &mut out)?,
        Format::Msh => msh::write(patches, options.order, &mut out)?,
        Format::Bv => bezier_view::write(patches, &options.about, &mut out)?,
        Format::Step => step::write(patches, options, &mut out)?,
        Format::Glb => glb::write(&sampled()?, &mut out)?,
        Format::Obj => obj::write(&sampled()?, &mut out)?,
        Format::Ply => ply::write(&sampled()?, &mut out)?,
        Format::Stl => stl::write(&sampled()?, &mut out)?,
        Format::ThreeMf => three_mf::write(&sampled()?, &options.about, &mut out)?,
    }
    out.flush()?;
    Ok(())
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Npz,
        Self::Vtu,
        Self::Msh,
        Self::Bv,
        Self::Step,
        Self::Glb,
        Self::Obj,
        Self::Ply,
        Self::Stl,
        Self::ThreeMf,
    ];

    /// Name, which is also the file extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Npz => "npz",
            Self::Vtu => "vtu",
            Self::Msh => "msh",
            Self::Bv => "bv",
            Self::Step => "step",
            Self::Glb => "glb",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::ThreeMf => "3mf",
        }
    }

    /// The format of a file extension, without its dot, in upper or lower case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.extension().eq_ignore_ascii_case(extension))
    }
}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        Self::from_extension(name).ok_or_else(|| UnknownFormat { name: name.to_owned() })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

impl Default for Options {
    fn default() -> Self {
        let (density, step) = (Density::default(), StepOptions::default());
        Self { density, order: 7, about: About::default(), step }
    }
}

/// Refuses rows that name what does not exist: sound checksums do not exclude them.
fn require_coherent(patches: &PatchesView<'_>) -> Result<(), ExportError> {
    let meta = patches.meta.first().copied().unwrap_or_default();
    if !meta.is_known() {
        let (degree, boundary_degree) = (meta.degree, meta.boundary_degree);
        return Err(ExportError::Degree { degree, boundary_degree });
    }
    let incoherent = |what, row, defect| Err(ExportError::Incoherent { what, row, defect });
    let n_faces = patches.face.len();
    if patches.edge_of.len() != 3 * n_faces || patches.interior.len() != n_faces {
        return incoherent("face", n_faces, "without its edges or inner points");
    }
    let n_vertices = patches.position.len();
    let is_lost = |face: &[u32; 3]| face.iter().any(|&v| v as usize >= n_vertices);
    if let Some(f) = patches.face.iter().position(is_lost) {
        return incoherent("face", f, "at a vertex that does not exist");
    }
    let n_edges = patches.boundary.len();
    if let Some(h) = patches.edge_of.iter().position(|&e| e as usize >= n_edges) {
        return incoherent("half-edge", h, "on an edge that does not exist");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    fn bytes(format: Format) -> Vec<u8> {
        let patches = sample::ball_and_ring();
        let mut out = Vec::new();
        write(
            format,
            &patches.view(),
            &Options { density: Density::Samples(3), ..Options::default() },
            &mut out,
        )
        .unwrap();
        out
    }

    #[test]
    fn every_format_is_known_by_its_extension() {
        for format in Format::ALL {
            assert_eq!(format.extension().parse(), Ok(format));
            assert_eq!(Format::from_extension(&format.to_string().to_uppercase()), Some(format));
        }
        assert!("xyz".parse::<Format>().unwrap_err().to_string().contains("xyz"));
    }

    #[test]
    fn equal_patches_give_equal_bytes() {
        for format in Format::ALL {
            assert_eq!(bytes(format), bytes(format), "{format}");
        }
    }

    #[test]
    fn a_full_disk_is_an_error_in_every_format() {
        struct Full(usize);
        impl Write for Full {
            fn write(&mut self, chunk: &[u8]) -> std::io::Result<usize> {
                if chunk.len() > self.0 {
                    return Err(std::io::ErrorKind::StorageFull.into());
                }
                self.0 -= chunk.len();
                Ok(chunk.len())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let patches = sample::ball_and_ring();
        for format in Format::ALL {
            for space in [0, bytes(format).len() - 1] {
                let done = write(
                    format,
                    &patches.view(),
                    &Options { density: Density::Samples(3), ..Options::default() },
                    &mut Full(space),
                );
                let refused = done.unwrap_err();
                assert!(matches!(refused, ExportError::Io(_)), "{format}: {refused}");
            }
        }
    }

    #[test]
    fn rows_that_name_nothing_are_refused() {
        let sound = sample::ball_and_ring();
        let refused = |change: &dyn Fn(&mut isospline_artifact::kinds::Patches)| {
            let mut patches = sound.clone();
            change(&mut patches);
            write(Format::Npz, &patches.view(), &Options::default(), &mut Vec::new())
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&|p| p.face[2][1] = 999).contains("face 2"));
        assert!(refused(&|p| p.edge_of[5] = 999).contains("half-edge 5"));
        assert!(refused(&|p| p.meta[0].degree = 5).contains("degree 5"));
        assert!(refused(&|p| p.interior.clear()).contains("inner points"));
    }

    #[test]
    fn samples_out_of_range_are_refused() {
        let patches = sample::ball_and_ring();
        for samples in [0, 257] {
            let done = write(
                Format::Stl,
                &patches.view(),
                &Options { density: Density::Samples(samples), ..Options::default() },
                &mut Vec::new(),
            );
            assert!(done.unwrap_err().to_string().contains("samples"));
        }
    }
}
