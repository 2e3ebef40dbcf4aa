//! Binary glTF 2.0: one indexed mesh with normals and one material.

use crate::ExportError;
use crate::tessellation::Tessellation;
use isospline_geometry::Vec3;
use serde_json::json;
use std::io::{self, Write};

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

pub(crate) fn write(mesh: &Tessellation<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    let points = 12 * mesh.n_points();
    let indices = 12 * mesh.n_triangles();
    let binary = 2 * points + indices;
    let json = header(mesh, points, indices)?;
    // File header, and a header of 8 bytes before each of the two chunks.
    let whole = 12 + 8 + json.len() as u64 + 8 + binary;
    let too_large =
        ExportError::TooLarge { format: "glb", what: "bytes", count: whole, limit: LIMIT };
    let length = u32::try_from(whole).map_err(|_| too_large)?;
    out.write_all(b"glTF")?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    chunk(out, json.len() as u32, *b"JSON")?;
    out.write_all(&json)?;
    chunk(out, binary as u32, *b"BIN\0")?;
    mesh.for_each_point(|sample| write_f32(out, &sample.position))?;
    mesh.for_each_point(|sample| write_f32(out, &sample.normal))?;
    for f in 0..mesh.n_faces() {
        for v in mesh.triangles(f).flatten() {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

/// The format counts bytes in 32 bits.
const LIMIT: u64 = u32::MAX as u64;

fn chunk(out: &mut dyn Write, length: u32, kind: [u8; 4]) -> io::Result<()> {
    out.write_all(&length.to_le_bytes())?;
    out.write_all(&kind)
}

fn write_f32(out: &mut dyn Write, v: &Vec3) -> io::Result<()> {
    v.iter().try_for_each(|&x| out.write_all(&(x as f32).to_le_bytes()))
}

/// The JSON chunk, padded with spaces to a multiple of 4.
fn header(mesh: &Tessellation<'_>, points: u64, indices: u64) -> Result<Vec<u8>, ExportError> {
    let (min, max) = bounds_f32(mesh)?;
    let view = |offset: u64, length: u64, target: u32| json!({"buffer": 0, "byteOffset": offset, "byteLength": length, "target": target});
    let n_points = mesh.n_points();
    let vectors = |view: u32| json!({"bufferView": view, "componentType": FLOAT, "count": n_points, "type": "VEC3"});
    let mut positions = vectors(0);
    positions["min"] = json!(min);
    positions["max"] = json!(max);
    let tree = json!({
        "asset": {"version": "2.0", "generator": "isospline"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0
        }]}],
        // Metals mirror their surroundings: with the default factor of 1 and no environment the
        // surface renders black.
        "materials": [{"name": "surface", "pbrMetallicRoughness": {
            "baseColorFactor": [0.8, 0.75, 0.65, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5
        }}],
        "accessors": [positions, vectors(1), {
            "bufferView": 2, "componentType": UNSIGNED_INT, "count": 3 * mesh.n_triangles(),
            "type": "SCALAR"
        }],
        "bufferViews": [
            view(0, points, ARRAY_BUFFER),
            view(points, points, ARRAY_BUFFER),
            view(2 * points, indices, ELEMENT_ARRAY_BUFFER)
        ],
        "buffers": [{"byteLength": 2 * points + indices}],
    });
    let mut text = tree.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    Ok(text)
}

/// Bounds of the positions as they are written: readers compare them exactly.
fn bounds_f32(mesh: &Tessellation<'_>) -> Result<([f32; 3], [f32; 3]), ExportError> {
    let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    mesh.for_each_point(|sample| {
        for k in 0..3 {
            let x = sample.position[k] as f32;
            min[k] = min[k].min(x);
            max[k] = max[k].max(x);
        }
        Ok::<(), ExportError>(())
    })?;
    Ok((min, max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use crate::tessellation::Density;

    #[test]
    fn lengths_bounds_and_material_are_as_the_format_wants_them() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let mesh = Tessellation::new(&view, Density::Samples(3)).unwrap();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((u32_at(8), bytes.len() % 4), (bytes.len(), 0));
        let json_end = 20 + u32_at(12);
        let tree: serde_json::Value = serde_json::from_slice(&bytes[20..json_end]).unwrap();
        assert_eq!(tree["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 0.0);
        assert_eq!(tree["buffers"][0]["byteLength"], u32_at(json_end));
        assert_eq!(tree["accessors"][2]["count"], 3 * mesh.n_triangles());
        let first = f32::from_le_bytes(bytes[json_end + 8..json_end + 12].try_into().unwrap());
        let min = tree["accessors"][0]["min"][0].as_f64().unwrap();
        assert!(min <= f64::from(first));
        let binary = &bytes[json_end + 8..];
        let xs = binary[..12 * mesh.n_points() as usize].as_chunks::<12>().0;
        let x = |row: &[u8; 12]| f32::from_le_bytes(row[..4].try_into().unwrap());
        assert!(xs.iter().any(|row| (f64::from(x(row)) - min).abs() == 0.0));
    }
}
