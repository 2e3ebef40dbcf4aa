//! Everything that reads bytes from outside, as functions of bytes: none may panic, hang or ask
//! for memory without measure.
//!
//! The fuzzer of this package and the targets in `fuzz/` call the same functions.

use crate::reliability::held::Held;
use isospline::config::{Document, ModelFile};
use isospline_artifact::kinds::{
    BaseMesh, Curvature, EdgeSystems, G0Fit, Mesh, Network, Patches, VertexSystems,
};
use isospline_artifact::{Artifact, Container, Recorded};
use isospline_check::Surface;
use isospline_geometry::Vec3;
use isospline_implicit::{Field, ForeignFormat, Formula, Interval};
use std::collections::BTreeMap;

/// A function of bytes under test, and the folder of its corpus in `tests/fixtures/fuzz`.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name.
    pub name: &'static str,
    /// Reads bytes that may be anything.
    pub read: fn(&[u8]),
    /// Words that its language has.
    pub words: &'static [&'static str],
}

/// All targets but the kinds of artifacts, which share [`artifact`].
pub const TEXTS: [Target; 7] = [
    Target { name: "formula", read: formula, words: FORMULA_WORDS },
    Target { name: "config", read: config, words: CONFIG_WORDS },
    Target { name: "obj", read: obj, words: OBJ_WORDS },
    Target { name: "jsurf", read: jsurf, words: FOREIGN_WORDS },
    Target { name: "vm", read: vm, words: FOREIGN_WORDS },
    Target { name: "npz", read: npz, words: NPZ_WORDS },
    Target { name: "journal", read: journal, words: &["\0\0\0\0", "ISOJ\r\n", "\u{1a}"] },
];

const FORMULA_WORDS: &[&str] = &[
    "x",
    "y",
    "z",
    "a",
    "(",
    ")",
    "+",
    "-",
    "*",
    "/",
    "^",
    ",",
    "=",
    ";",
    "\n",
    "#",
    "1e308",
    "1e-308",
    "0",
    "0.5",
    "64",
    "1e9",
    "-1",
    "pi",
    "e",
    "sqrt(",
    "exp(",
    "ln(",
    "abs(",
    "sin(",
    "min(x,",
    "max(",
    "smin(x,y,",
    "smax(",
    "pow(",
    "clamp(",
    "mod(",
    "atan2(",
    "floor(",
    "^^",
    "1/0",
    "0^0",
    "\u{3c0}",
    "x2 = x",
    "1e",
    ".",
    "..",
    "((((((((",
    "--------",
];

const CONFIG_WORDS: &[&str] = &[
    "[model]",
    "[target]",
    "[check]",
    "[adapt]",
    "formula = ",
    "faces = ",
    "box = ",
    "\"auto\"",
    "level",
    "inf",
    "nan",
    "-1",
    "1e400",
    "true",
    "\"\"",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    "\n",
    "\r\n",
    "'''",
    "\"\"\"",
    "\u{feff}",
    "0x7fffffffffffffff",
    "1979-05-27",
    "a.b.c = 1",
    "\\u0000",
    "#",
];

const OBJ_WORDS: &[&str] = &[
    "v ",
    "f ",
    "vn 0 0 1",
    "vt 0 0",
    "\n",
    "1/1/1",
    "1//1",
    "-1",
    "0",
    "4294967296",
    "1e309",
    "nan",
    "inf",
    "f 1 2 3\n",
    "v 0 0 0\n",
    "\\\n",
    "#",
    "o a",
    "99999999999999999999",
];

const FOREIGN_WORDS: &[&str] = &[
    "x", "y", "z", "a", "0.5", "=", ";", "\n", "+", "*", "^", "(", ")", "sqrt", "mul", "add",
    "const", "var-x", "_0", "_1", "_ff", "#", "nan", "1e308", "surface", "root",
];

const NPZ_WORDS: &[&str] = &[
    "PK\u{3}\u{4}",
    "PK\u{1}\u{2}",
    "PK\u{5}\u{6}",
    "NUMPY",
    "<f8",
    "<u4",
    "|O",
    "(1, 3)",
    "(99999999999, 3)",
    "fortran_order': True",
    "vertices.npy",
    "faces.npy",
    "{",
    "}",
];

/// Reads a formula; of one that can be read, evaluates values, derivatives and enclosures.
pub fn formula(bytes: &[u8]) {
    let parameters = BTreeMap::from([("a".to_owned(), 0.5)]);
    let Ok(formula) = Formula::parse(&String::from_utf8_lossy(bytes), &parameters) else { return };
    let canonical = formula.canonical();
    formula.value(Vec3::new(0.3, -0.2, 0.1));
    formula.value_enclosure([Interval::new(-1.0, 1.0); 3]);
    // Derivatives of a formula of many operations are another test's matter.
    if canonical.len() < 4_000 {
        formula.hessian(Vec3::new(0.3, -0.2, 0.1));
        formula.gradient_enclosure([Interval::new(-1.0, 1.0); 3]);
        let again = Formula::parse(&canonical, &parameters);
        assert!(again.is_ok(), "the canonical form cannot be read: {canonical:?}");
    }
}

/// Reads a model file; the canonical text of one that is taken reads back as an equal one.
pub fn config(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let read =
        |text: &str| ModelFile::from_document(&Document::parse("fuzz.toml", text).ok()?).ok();
    if let Some(file) = read(&text) {
        let canonical = file.to_toml();
        assert_eq!(read(&canonical).as_ref(), Some(&file), "{canonical}");
    }
}

/// Reads an OBJ; the corners of one that is taken name vertices.
pub fn obj(bytes: &[u8]) {
    if let Ok((positions, faces)) = isospline_import::parse_obj(&String::from_utf8_lossy(bytes)) {
        assert!(faces.iter().flatten().all(|&v| (v as usize) < positions.len()));
        assert!(positions.iter().flatten().all(|x| x.is_finite()));
    }
}

/// Reads a model of SURFER.
pub fn jsurf(bytes: &[u8]) {
    foreign(ForeignFormat::Jsurf, bytes);
}

/// Reads a shape of fidget.
pub fn vm(bytes: &[u8]) {
    foreign(ForeignFormat::Vm, bytes);
}

fn foreign(format: ForeignFormat, bytes: &[u8]) {
    if let Ok(model) = format.read(&String::from_utf8_lossy(bytes)) {
        // What a reader makes of a model may be refused as a formula, but not by a panic.
        let _ = Formula::parse(&model.formula, &model.parameters);
    }
}

/// Reads a numpy archive as a surface.
pub fn npz(bytes: &[u8]) {
    if let Ok(surface) = isospline_export::read_npz(&mut &*bytes) {
        let _ = Surface::new(surface.vertices, surface.faces, surface.control_points);
    }
}

/// Reads the journal of an unfinished artifact; entries name tasks that its head knows.
pub fn journal(bytes: &[u8]) {
    if let Some(recorded) = Recorded::decode(bytes) {
        assert!(recorded.entries.iter().all(|entry| entry.task < recorded.head.tasks));
        assert!(recorded.length <= bytes.len() as u64);
    }
}

/// Reads an artifact of any kind, its rows verified.
pub fn artifact(bytes: &[u8]) {
    let opened = Container::new("fuzz.isos".to_owned(), Held::copy_of(bytes));
    let Ok(container) = opened else { return };
    if container.verify().is_err() {
        return;
    }
    fn viewed<A: Artifact>(container: &Container) {
        let _ = container.view::<A>();
    }
    viewed::<Mesh>(&container);
    viewed::<BaseMesh>(&container);
    viewed::<Curvature>(&container);
    viewed::<Network>(&container);
    viewed::<G0Fit>(&container);
    viewed::<VertexSystems>(&container);
    viewed::<EdgeSystems>(&container);
    if let Ok(patches) = container.view::<Patches>() {
        let _ = Surface::from_patches(&patches);
    }
}
