//! R11, self-check: defects in a finished surface, each found by `isospline check`.

use crate::program;
use crate::reliability::archive::Draft;
use crate::reliability::process::watched;
use crate::reliability::sample::{PATIENCE, Sample};
use crate::reliability::seal::{places, seal_rows};
use crate::reliability::{Scale, Tally};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{boundary_index, first_inner_index, interior_indices};
use std::path::PathBuf;
use std::process::Command;

const TORUS: &str = "[model]\nformula = \"(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16\"\n\
    box = [[-1.5, 1.5], [-1.5, 1.5], [-0.5, 0.5]]\n[target]\nfaces = 500\n";

/// The artifact that holds the finished surface.
const FINISHED: &str = "12-relax.isos";

/// A defect: its name, what the failure must say, and how it comes into face `f`.
type Defect = (&'static str, &'static str, fn(&mut Draft, usize));

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let sample = Sample::of(TORUS);
    let hunt = Hunt { places: scale.of(1, 6), sample: &sample };
    hunt.exported(tally);
    hunt.stored(tally);
    tally.figure("in exports and in stored patches whose checksums were put right");
}

struct Hunt<'a> {
    places: usize,
    sample: &'a Sample,
}

impl Hunt<'_> {
    /// Defects in an exported surface, checked against its model file.
    fn exported(&self, tally: &mut Tally) {
        let sandbox = &self.sample.sandbox;
        let args = ["export", "sound", "--format", "npz", "-o", "sound.npz"];
        let file = sandbox.path("sound.npz");
        sandbox.succeeds(&args);
        let sound = isospline_export::read_npz_file(&file).expect("our own export");
        let (vertices, faces) = (sound.vertices, sound.faces);
        let sound = Draft { vertices, faces, nets: sound.control_points };
        let check = |draft: &Draft| {
            let path = sandbox.write("defect.npz", draft.npz());
            let mut command = Command::new(program());
            command.arg("check").arg(path).arg("--model").arg(&self.sample.model);
            watched(command.env("NO_COLOR", "1"), PATIENCE)
        };
        let ran = check(&sound);
        let passes = if ran.outcome.code == 0 { Ok(()) } else { Err(ran.told()) };
        tally.case("the sound export passes", passes);
        for (name, sign, seed) in DEFECTS {
            for n in 0..self.places {
                let mut draft = sound.clone();
                seed(&mut draft, (41 + 97 * n) % sound.faces.len());
                let ran = check(&draft);
                let said = format!("{} {}", ran.outcome.stdout, ran.outcome.stderr);
                let found = ran.outcome.code == 1 && said.contains(sign);
                // Numbers that are no surface at all are refused before they are measured.
                let refused = ran.outcome.code == 31;
                let outcome = if found || refused { Ok(()) } else { Err(ran.told()) };
                tally.case(format!("{name}, place {n}"), outcome);
            }
        }
    }

    /// Defects in the rows of a store, with checksums that agree.
    fn stored(&self, tally: &mut Tally) {
        let sound = &self.sample.sound[FINISHED];
        let places = places(sound);
        for (section, sign, change) in ROWS {
            let Some(place) = places.iter().find(|p| p.name == *section) else {
                tally.case(section, Err("there is no such section".to_owned()));
                continue;
            };
            for n in 0..self.places {
                let row = (5 + 13 * n) % place.rows;
                let mut file = sound.clone();
                change(&mut file[place.offset + row * place.stride..][..place.stride], n);
                seal_rows(&mut file, &places);
                let ran = self.check_stored(&file);
                let said = format!("{} {}", ran.outcome.stdout, ran.outcome.stderr);
                let found = ran.outcome.code == 1 && said.contains(sign);
                let refused = ran.outcome.code == 31 && *sign == REFUSED;
                let outcome = if found || refused { Ok(()) } else { Err(ran.told()) };
                tally.case(format!("stored {section} {sign}, row {row}"), outcome);
            }
        }
    }

    fn check_stored(&self, file: &[u8]) -> crate::reliability::process::Ran {
        let store: PathBuf = self.sample.copy("defect");
        self.sample.sandbox.write(&format!("defect/{FINISHED}"), file);
        let mut command = Command::new(program());
        watched(command.arg("check").arg(store).env("NO_COLOR", "1"), PATIENCE)
    }
}

/// Defects of exported arrays.
const DEFECTS: &[Defect] = &[
    ("inner point far off", "error", |d, f| {
        // Along the normal: a step along the surface would leave it where it is.
        let (p, q, r) = (d.nets[f][0], d.nets[f][28], d.nets[f][35]);
        let shift = d.edge() * (q - p).cross(&(r - p)).normalize();
        d.nets[f][interior_indices()[7]] += shift;
    }),
    ("boundary point by one bit", "bits", |d, f| {
        let x = &mut d.nets[f][boundary_index(7, f % 3, 1 + f % 6)].x;
        *x = x.next_up();
    }),
    ("boundary point by 1e-12", "gap", |d, f| {
        d.nets[f][boundary_index(7, f % 3, 1 + f % 6)] += 1e-12 * ALONG;
    }),
    ("twist point by 1e-6", "angle", |d, f| {
        d.nets[f][first_inner_index(7, f % 3, 1)] += 1e-6 * ALONG;
    }),
    ("first inner row by 1e-6", "angle", |d, f| {
        d.nets[f][first_inner_index(7, f % 3, 2 + f % 3)] += 1e-6 * ALONG;
    }),
    ("vertex and all its corners off the surface", "vert", |d, f| {
        let v = d.faces[f][0];
        d.vertices[v as usize] += 1e-10 * ALONG;
        for (face, net) in d.faces.iter().zip(&mut d.nets) {
            for corner in (0..3).filter(|&c| face[c] == v) {
                net[boundary_index(7, corner, 0)] += 1e-10 * ALONG;
            }
        }
    }),
    ("not a number in a net", "finite", |d, f| d.nets[f][(5 * f) % 36].y = f64::NAN),
    ("infinity in a net", "finite", |d, f| d.nets[f][(7 * f) % 36].z = f64::NEG_INFINITY),
    ("face flipped without its net", "orient", |d, f| d.faces[f].swap(1, 2)),
    ("face missing", "one side", |d, f| {
        d.faces.remove(f);
        d.nets.remove(f);
    }),
    ("face twice", "more than two", |d, f| {
        d.faces.push(d.faces[f]);
        d.nets.push(d.nets[f]);
    }),
    ("vertex without faces", "no face", |d, f| d.vertices.push(d.vertices[f % 100])),
    ("two vertices taken for one", "gap", |d, f| {
        let [a, b, _] = d.faces[f];
        let all: Vec<usize> = (0..d.faces.len()).collect();
        d.relabel(a, b, &all);
    }),
    ("face cut off at a vertex", "one side", |d, f| {
        let (new, old) = (d.vertices.len() as u32, d.faces[f][0]);
        d.vertices.push(d.vertices[old as usize]);
        d.relabel(old, new, &[f]);
    }),
    ("two corners swapped", "gap", |d, f| d.nets[f].swap(0, 28)),
    ("nets of two faces exchanged", "gap", |d, f| {
        let other = (f + 5) % d.nets.len();
        d.nets.swap(f, other);
    }),
    ("patch drawn together to a point", "", |d, f| d.nets[f] = [d.nets[f][0]; 36]),
    ("patch folded over", "inward", |d, f| {
        let centre = (d.nets[f][0] + d.nets[f][28] + d.nets[f][35]) / 3.0;
        for i in interior_indices() {
            d.nets[f][i] = centre - 4.0 * (d.nets[f][i] - centre);
        }
    }),
    ("surface of another size", "error", |d, _| {
        d.vertices.iter_mut().for_each(|p| *p *= 1.1);
        d.nets.iter_mut().flatten().for_each(|p| *p *= 1.1);
    }),
];

const ALONG: Vec3 = Vec3::new(0.6, -0.48, 0.64);

/// For rows that are no surface at all: the program refuses them and names the file.
const REFUSED: &str = "refused";

/// Defects of stored rows: section, what the failure must say, and how a row is changed.
type StoredDefect = (&'static str, &'static str, fn(&mut [u8], usize));

const ROWS: &[StoredDefect] = &[
    ("interior", "error", |row, n| add(row, 3 * (n % 15), 0.3)),
    ("interior", "angle", |row, n| {
        // Points beside the boundary: the innermost, 4, 7 and 8, bear on no angle.
        let point = 3 * [0, 1, 3, 10, 14, 13][n % 6];
        add(row, point, 0.6e-5);
        add(row, point + 1, -0.48e-5);
        add(row, point + 2, 0.64e-5);
    }),
    ("interior", "finite", |row, n| set(row, 7 * n % 45, f64::NAN)),
    ("boundary", "angle", |row, n| add(row, n % 9, 1e-4)),
    ("boundary", "finite", |row, n| set(row, n % 9, f64::INFINITY)),
    ("position", "vert", |row, n| add(row, n % 3, 1e-6)),
    ("position", "finite", |row, n| set(row, n % 3, f64::NAN)),
    ("face", "orient", |row, _| {
        let (first, second) = row[4..].split_at_mut(4);
        first.swap_with_slice(second);
    }),
    ("face", REFUSED, |row, n| row[4 * (n % 3)..][..4].copy_from_slice(&u32::MAX.to_le_bytes())),
    ("edge_of", REFUSED, |row, _| row.copy_from_slice(&u32::MAX.to_le_bytes())),
    ("edge_of", "", |row, _| row[0] ^= 1),
];

fn set(row: &mut [u8], float: usize, value: f64) {
    row[8 * float..][..8].copy_from_slice(&value.to_le_bytes());
}

fn add(row: &mut [u8], float: usize, step: f64) {
    let old: [u8; 8] = row[8 * float..][..8].try_into().expect("invariant: eight bytes");
    set(row, float, f64::from_le_bytes(old) + step);
}
