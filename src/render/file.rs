//! Pictures as PNG files, whole or not there.

use crate::{Picture, RenderError};
use isospline_artifact::{Durability, write_file_atomic};
use std::io::{self, Write};
use std::path::Path;

/// Writes a picture as PNG: 8 bits a channel, sRGB. Equal pictures give equal bytes.
///
/// # Errors
/// What `out` refuses.
pub fn write_png(picture: &Picture, out: &mut dyn Write) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(picture.rgb())?;
    writer.finish()?;
    Ok(())
}

/// Writes a picture to the file `path`, which is replaced only by a whole one; where `path` is a
/// symbolic link, the file that it leads to.
///
/// # Errors
/// [`RenderError::NotRegular`], [`RenderError::File`], [`RenderError::Io`]; the file is then as it
/// was before.
pub fn write_png_file(picture: &Picture, path: &Path) -> Result<(), RenderError> {
    let mut target = path.to_owned();
    if let Ok(data) = path.metadata() {
        if !data.is_file() {
            let what = if data.is_dir() { "a folder" } else { "a device or a pipe" };
            return Err(RenderError::NotRegular { what });
        }
        target = path.canonicalize()?;
    }
    Ok(write_file_atomic(&target, Durability::Fast, |out| write_png(picture, out))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lent_threads::on_this_thread;
    use crate::sample::{surface, two_bowls};
    use crate::{Job, Options, render};
    use isospline_geometry::Vec3;
    use isospline_implicit::ClosureField;

    fn picture() -> Picture {
        let rows = two_bowls(0.2);
        let options = Options { width: 61, height: 47, ..Options::default() };
        let field = ClosureField::new(1.0, |p: Vec3| p.z);
        let surface = surface(&rows);
        let job = Job { surface: &surface, field: &field, unit: "mm", options: &options };
        render(&job, &on_this_thread).unwrap()
    }

    #[test]
    fn a_reader_gets_back_the_pixels() {
        let (picture, mut bytes) = (picture(), Vec::new());
        write_png(&picture, &mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; 3 * 61 * 47];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!([info.width, info.height], [61, 47]);
        assert!(pixels == picture.rgb());
    }

    #[test]
    fn a_picture_replaces_files_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let picture = picture();
        write_png_file(&picture, &path).unwrap();
        write_png_file(&picture, &path).unwrap();
        assert!(path.metadata().unwrap().len() > 100);
        let refused = write_png_file(&picture, folder.path());
        assert!(matches!(refused, Err(RenderError::NotRegular { what: "a folder" })));
        let lost = write_png_file(&picture, &folder.path().join("none").join("a.png"));
        assert!(matches!(lost, Err(RenderError::File(_))));
    }
}
