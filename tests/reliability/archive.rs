//! Surfaces as numpy archives, written without our own code so that any surface can be written.

use isospline_geometry::Vec3;

/// Arrays of a surface, as an export holds them.
#[derive(Clone, Debug)]
pub(crate) struct Draft {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) nets: Vec<[Vec3; 36]>,
}

impl Draft {
    /// The archive.
    pub(crate) fn npz(&self) -> Vec<u8> {
        let floats = |points: &mut dyn Iterator<Item = &Vec3>| -> Vec<u8> {
            points.flat_map(|p| [p.x, p.y, p.z]).flat_map(f64::to_le_bytes).collect()
        };
        let corners = self.faces.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let (n_vertices, n_faces) = (self.vertices.len(), self.faces.len());
        let arrays = [
            ("vertices", "<f8", format!("({n_vertices}, 3)"), floats(&mut self.vertices.iter())),
            ("faces", "<u4", format!("({n_faces}, 3)"), corners),
            (
                "control_points",
                "<f8",
                format!("({n_faces}, 36, 3)"),
                floats(&mut self.nets.iter().flatten()),
            ),
        ];
        archive(&arrays.map(|(name, kind, shape, data)| (name, array(kind, &shape, &data))))
    }

    /// Length of a typical edge: defects of shape are sized by it.
    pub(crate) fn edge(&self) -> f64 {
        (self.nets[0][0] - self.nets[0][28]).norm()
    }

    pub(crate) fn relabel(&mut self, from: u32, to: u32, faces: &[usize]) {
        for &f in faces {
            self.faces[f] = self.faces[f].map(|v| if v == from { to } else { v });
        }
    }
}

/// An array in version 1.0 of numpy's format.
fn array(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((head.len() as u16).to_le_bytes());
    out.extend(head.as_bytes());
    out.extend(data);
    out
}

/// A zip archive of stored entries.
fn archive(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let (mut out, mut central) = (Vec::new(), Vec::new());
    for (name, data) in entries {
        let (at, name) = (out.len() as u32, format!("{name}.npy"));
        // Version, flags, method, time and date; then checksum and sizes.
        let mut record: Vec<u8> = [20_u16, 0, 0, 0, 33].map(u16::to_le_bytes).concat();
        let size = (data.len() as u32).to_le_bytes();
        record.extend([crc32fast::hash(data).to_le_bytes(), size, size].concat());
        record.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
        out.extend(0x0403_4b50_u32.to_le_bytes());
        out.extend(&record);
        out.extend(name.as_bytes());
        out.extend(data);
        central.extend(0x0201_4b50_u32.to_le_bytes());
        central.extend(20_u16.to_le_bytes());
        central.extend(&record);
        central.extend([0; 10]);
        central.extend(at.to_le_bytes());
        central.extend(name.as_bytes());
    }
    let (start, n) = (out.len() as u32, (entries.len() as u16).to_le_bytes());
    out.extend(&central);
    out.extend(0x0605_4b50_u32.to_le_bytes());
    out.extend([[0; 2], [0; 2], n, n].concat());
    out.extend([(central.len() as u32).to_le_bytes(), start.to_le_bytes()].concat());
    out.extend([0; 2]);
    out
}
