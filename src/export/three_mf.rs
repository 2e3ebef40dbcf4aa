//! 3MF for printing: a zip archive around XML with the unit, the name and one mesh, f32.

use crate::tessellation::Tessellation;
use crate::zip_archive::{self, Content};
use crate::{About, ExportError, LengthUnit};
use std::io::{self, Write};

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Id="rel0" Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;
const MODEL: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";

pub(crate) fn write(
    mesh: &Tessellation<'_>,
    about: &About,
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let types: Content<'_> = &|out| out.write_all(CONTENT_TYPES.as_bytes());
    let relations: Content<'_> = &|out| out.write_all(RELATIONS.as_bytes());
    let model: Content<'_> = &|out| write_model(mesh, about, out);
    let entries =
        [("[Content_Types].xml", types), ("_rels/.rels", relations), ("3D/3dmodel.model", model)];
    zip_archive::write("3mf", &entries, out)
}

fn write_model(mesh: &Tessellation<'_>, about: &About, out: &mut dyn Write) -> io::Result<()> {
    let (name, provenance) = (escaped(&about.name), escaped(&about.provenance));
    let (unit, version) = (unit(about.unit), env!("CARGO_PKG_VERSION"));
    writeln!(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <model unit=\"{unit}\" xml:lang=\"en-US\" xmlns=\"{MODEL}\">\n\
         <metadata name=\"Title\">{name}</metadata>\n\
         <metadata name=\"Description\">{provenance}</metadata>\n\
         <metadata name=\"Application\">isospline {version}</metadata>\n\
         <resources><object id=\"1\" type=\"model\" name=\"{name}\"><mesh>\n<vertices>"
    )?;
    mesh.for_each_point(|sample| {
        // Debug output of f32 is the shortest that reads back to the same bits.
        let [x, y, z] = [0, 1, 2].map(|k| sample.position[k] as f32);
        writeln!(out, "<vertex x=\"{x:?}\" y=\"{y:?}\" z=\"{z:?}\"/>")
    })?;
    writeln!(out, "</vertices>\n<triangles>")?;
    for f in 0..mesh.n_faces() {
        for [a, b, c] in mesh.triangles(f) {
            writeln!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?;
        }
    }
    writeln!(
        out,
        "</triangles>\n</mesh></object></resources>\n<build><item objectid=\"1\"/></build>\n</model>"
    )
}

fn unit(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Micrometre => "micron",
        LengthUnit::Millimetre => "millimeter",
        LengthUnit::Centimetre => "centimeter",
        LengthUnit::Metre => "meter",
        LengthUnit::Inch => "inch",
        LengthUnit::Foot => "foot",
    }
}

/// Text between tags or in quotes; what XML cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ if c.is_control() => out.push(' '),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use crate::tessellation::Density;

    #[test]
    fn the_model_names_its_unit_and_every_corner_of_its_triangles() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let mesh = Tessellation::new(&view, Density::Samples(3)).unwrap();
        let about =
            About { name: "a < \"b\" & c".to_owned(), unit: LengthUnit::Inch, ..About::default() };
        let mut out = Vec::new();
        write_model(&mesh, &about, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert!(text.contains("unit=\"inch\""));
        assert!(text.contains("name=\"a &lt; &quot;b&quot; &amp; c\""));
        assert_eq!(text.matches("<vertex ").count() as u64, mesh.n_points());
        assert_eq!(text.matches("<triangle ").count() as u64, mesh.n_triangles());
        let corners = text.split("v1=\"").skip(1).map(|s| s.split_once('"').unwrap().0);
        let highest = corners.map(|c| c.parse::<u64>().unwrap()).max().unwrap();
        assert!(highest < mesh.n_points());
    }
}
