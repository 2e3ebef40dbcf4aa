//! Model files that are hostile: fields without a surface, scales, texts.

use crate::reliability::hostile::{Case, Expected};
use Expected::{Exit, Passes, PassesOrExit};

const NAN: Expected = Exit(20, &["not-a-number"]);
const EMPTY: Expected = Exit(21, &["empty-level-set"]);
const SINGULAR: Expected = Exit(22, &["singular-point"]);
const TWO_DIMENSIONAL: Expected = Exit(27, &["two-dimensional"]);
const NO_SIGN_CHANGE: Expected = Exit(29, &["no-sign-change"]);
const LEAVES: Expected = Exit(23, &["leaves-box"]);

/// A formula in the box [-1.5, 1.5]^3, and more of the model file.
type Field = (&'static str, &'static str, &'static str, Expected);

const FIELDS: &[Field] = &[
    ("not a number at a corner", "x^2+y^2+z^2-1+1e-9*ln(4.4+x+y+z)", "", NAN),
    ("infinite at a corner", "x^2+y^2+z^2-1+1e-9/(x+y+z+4.5)^2", "", Passes),
    ("not a number on the surface", "x^2+y^2+z^2-1+0.001*sqrt(x)", "", NAN),
    ("not a number inside alone", "x^2+y^2+z^2-1+0*x+1e-3*sqrt(x^2+y^2+z^2-0.01)", "", NAN),
    ("a pole inside", "1/(x^2+y^2+z^2)-1", "", Passes),
    ("no sign change, positive", "x^2+y^2+z^2+3", "", Exit(21, &["empty-level-set", "[3"])),
    ("no sign change, negative", "-3-x^2", "", EMPTY),
    ("zero everywhere", "x-x", "", TWO_DIMENSIONAL),
    ("constant at its level", "5", "level = 5.0", LEAVES),
    ("constant", "1", "", EMPTY),
    ("touches the box", "x^2+y^2+z^2-2.25", "", PassesOrExit(23, &["leaves-box"])),
    ("leaves the box: cylinder", "x^2+y^2-1", "", TWO_DIMENSIONAL),
    ("leaves the box: plane", "z", "", TWO_DIMENSIONAL),
    ("leaves the box at a corner", "(x-1)^2+(y-1)^2+(z-1)^2-1", "", LEAVES),
    ("cone in the box", "x^2+y^2-z^2*(1-z^2)", "", SINGULAR),
    ("cone", "x^2+y^2-z^2", "", LEAVES),
    ("Whitney umbrella", "x^2-y^2*z", "", LEAVES),
    ("Whitney umbrella in a ball", "smax(x^2-y^2*z, x^2+y^2+z^2-1, 0.1)", "", SINGULAR),
    ("a square", "(x^2+y^2+z^2-1)^2", "", NO_SIGN_CHANGE),
    ("a cube", "(x^2+y^2+z^2-1)^3", "", Exit(22, &["level-not-regular"])),
    (
        "two spheres that touch",
        "min((x-0.5)^2+y^2+z^2-0.25,(x+0.5)^2+y^2+z^2-0.25)",
        "",
        PassesOrExit(28, &["sharp-edge"]),
    ),
    ("two spheres that cross", "((x-0.4)^2+y^2+z^2-0.5)*((x+0.4)^2+y^2+z^2-0.5)", "", SINGULAR),
    ("level at a point", "x^2+y^2+z^2", "", NO_SIGN_CHANGE),
    ("level at a saddle", "((x-1)^2+y^2+z^2)*((x+1)^2+y^2+z^2)-1", "", SINGULAR),
    (
        "shell thinner than the grid",
        "(sqrt(x^2+y^2+z^2)-1)^2-1e-8",
        "",
        Exit(25, &["topology-unresolved"]),
    ),
    ("sheet thinner than the grid", "x^2+y^2+(z/1e-4)^2-1", "", Exit(25, &["thinner-than-grid"])),
    ("needle", "(x/1e-3)^2+(y/1e-3)^2+z^2-1", "", Exit(25, &[])),
    ("a speck in a large box", "x^2+y^2+z^2-1e-6", "", Passes),
    ("flat and umbilic parts", "x^8+y^8+z^8-1", "", Passes),
    ("umbilic everywhere", "x^2+y^2+z^2-1", "", Passes),
    ("exactly planar parts", "smax(smax(abs(x),abs(y),0.4),abs(z),0.4)-1", "", Passes),
    ("kinks", "max(max(abs(x),abs(y)),abs(z))-1", "", Exit(28, &["sharp-edge", "max"])),
    ("jumps", "x^2+y^2+z^2-1+0.1*floor(3*x)", "", Exit(25, &[])),
    (
        "overflow beside the surface",
        "exp(1000*x)+x^2+y^2+z^2-1",
        "",
        Exit(25, &["base-mesh-unfit", "turns by 89"]),
    ),
    (
        "noise finer than any grid",
        "x^2+y^2+z^2-1+0.3*sin(1e5*x)*sin(1e5*y)*sin(1e5*z)",
        "",
        Exit(25, &[]),
    ),
    ("a huge power", "x^1e9+y^2+z^2-1", "", Exit(28, &["sharp-edge"])),
    ("one over zero", "x^2+y^2+z^2-1+1/0", "", Exit(21, &["empty-level-set", "[inf, inf]"])),
    ("root of minus one", "x^2+y^2+z^2-1+sqrt(-1)", "", NAN),
    ("logarithm of zero", "x^2+y^2+z^2-1+ln(0)", "", EMPTY),
    ("zero to the zero", "x^2+y^2+z^2-0^0", "", Passes),
    ("does not depend on a place", "a", "parameters = { a = 0.0 }", LEAVES),
];

/// Model files, written out.
type File = (&'static str, &'static str, Expected);

const SPHERE: &str = "[model]\nformula = \"x^2+y^2+z^2-1\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 200\nfit = \"paper\"\n";

const FILES: &[File] = &[
    (
        "scale 1e9",
        "[model]\nformula = \"x^2+y^2+z^2-1e18\"\nbox = [[-1.5e9,1.5e9],[-1.5e9,1.5e9],[-1.5e9,1.5e9]]\n[target]\nfaces = 200\n",
        Passes,
    ),
    (
        "scale 1e-9",
        "[model]\nformula = \"x^2+y^2+z^2-1e-18\"\nbox = [[-1.5e-9,1.5e-9],[-1.5e-9,1.5e-9],[-1.5e-9,1.5e-9]]\n[target]\nfaces = 200\n",
        Passes,
    ),
    (
        "offset 1e9",
        "[model]\nformula = \"(x-1e9)^2+y^2+z^2-1\"\nbox = [[999999998.5,1000000001.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 200\n",
        Exit(25, &["projection-failed"]),
    ),
    (
        "exactly planar parts, twice the faces",
        "[model]\nformula = \"smax(smax(abs(x),abs(y),0.4),abs(z),0.4)-1\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 1200\nfit = \"paper\"\n",
        Passes,
    ),
    (
        "exactly planar parts, fitted by normal distance",
        "[model]\nformula = \"smax(smax(abs(x),abs(y),0.4),abs(z),0.4)-1\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 1200\nfit = \"fast\"\n",
        Passes,
    ),
    (
        "a thousand spheres",
        "[model]\nformula = \"cos(2*pi*x)+cos(2*pi*y)+cos(2*pi*z)-2\"\nbox = [[0.5,10.5],[0.5,10.5],[0.5,10.5]]\n[target]\nfaces = 40000\nfit = \"paper\"\n",
        Passes,
    ),
    (
        "a thousand spheres, too few faces",
        "[model]\nformula = \"cos(2*pi*x)+cos(2*pi*y)+cos(2*pi*z)-2.5\"\nbox = [[0.5,10.5],[0.5,10.5],[0.5,10.5]]\n[target]\nfaces = 2000\nfit = \"paper\"\n",
        Exit(24, &["too-few-faces"]),
    ),
    (
        "box the wrong way round",
        "[model]\nformula = \"x\"\nbox = [[1,-1],[-1,1],[-1,1]]\n",
        Exit(11, &["model.box", "smaller first"]),
    ),
    (
        "box of not a number",
        "[model]\nformula = \"x\"\nbox = [[nan,1],[-1,1],[-1,1]]\n",
        Exit(11, &["model.box"]),
    ),
    (
        "box without volume",
        "[model]\nformula = \"x\"\nbox = [[0,0],[-1,1],[-1,1]]\n",
        Exit(11, &["model.box"]),
    ),
    (
        "box without end",
        "[model]\nformula = \"x\"\nbox = [[-inf,inf],[-1,1],[-1,1]]\n",
        Exit(11, &["model.box"]),
    ),
    (
        "box of two sides",
        "[model]\nformula = \"x\"\nbox = [[-1,1],[-1,1]]\n",
        Exit(11, &["model.box"]),
    ),
    (
        "box below the digits of its place",
        "[model]\nformula = \"x\"\nbox = [[1,1.0000000000000002],[-1,1],[-1,1]]\n",
        EMPTY,
    ),
    ("no faces", "[model]\nformula = \"x\"\n[target]\nfaces = 0\n", Exit(11, &["target.faces"])),
    ("one face", "[model]\nformula = \"x\"\n[target]\nfaces = 1\n", Exit(11, &["target.faces"])),
    ("three faces", "[model]\nformula = \"x\"\n[target]\nfaces = 3\n", Exit(11, &["target.faces"])),
    (
        "a billion faces",
        "[model]\nformula = \"x\"\n[target]\nfaces = 1000000000\n",
        Exit(11, &["target.faces"]),
    ),
    (
        "minus one face",
        "[model]\nformula = \"x\"\n[target]\nfaces = -1\n",
        Exit(11, &["target.faces"]),
    ),
    ("unknown key", "[model]\nformula = \"x\"\ncolour = 3\n", Exit(11, &["colour"])),
    ("unknown table", "[model]\nformula = \"x\"\n[paint]\n", Exit(11, &["paint"])),
    ("wrong type", "[model]\nformula = 3\n", Exit(11, &["model.formula", "wrong-type"])),
    (
        "key given twice",
        "[model]\nformula = \"x\"\nformula = \"y\"\n",
        Exit(11, &["duplicate key"]),
    ),
    ("no end of a string", "[model]\nformula = \"x\n", Exit(11, &["toml-syntax"])),
    ("nothing in it", "", Exit(11, &["model.formula"])),
    (
        "level of not a number",
        "[model]\nformula = \"x\"\nlevel = nan\n",
        Exit(11, &["model.level"]),
    ),
    (
        "name that climbs out",
        "[model]\nname = \"../../x\"\nformula = \"x\"\n",
        Exit(11, &["model.name"]),
    ),
    (
        "mesh that is not there",
        "[model]\nformula = \"x^2+y^2+z^2-0.5\"\nbase_mesh = \"none.obj\"\nbox = [[-1,1],[-1,1],[-1,1]]\n",
        Exit(10, &["none.obj"]),
    ),
];

/// A sphere on a mesh that is no base mesh.
const MESHES: &[File] = &[
    ("mesh with a hole", "hole.obj", Exit(26, &[])),
    ("mesh of valence 3 and 10", "triakis.obj", Passes),
    ("mesh of valence 12", "globe.obj", Passes),
    ("tetrahedron for a sphere", "tetrahedron.obj", Exit(1, &[])),
    ("mesh with not a number", "nan.obj", Exit(26, &["line 1"])),
    ("mesh beyond all numbers", "huge.obj", SINGULAR),
    ("mesh of quads", "quads.obj", Exit(26, &["line 5"])),
    ("mesh with a corner too far", "index.obj", Exit(26, &["line 4"])),
    ("empty mesh", "empty.obj", Exit(26, &[])),
    ("mesh with a face twice", "twice.obj", Exit(26, &[])),
    ("mesh of one point", "flat.obj", Exit(25, &["base-mesh-unfit"])),
    ("mesh that is a folder", ".", Exit(10, &[])),
    ("mesh without end", "/dev/zero", Exit(10, &["/dev/zero"])),
];

/// Fields that have no surface, or an odd one.
pub(crate) fn fields() -> Vec<Case> {
    let case = |&(name, formula, more, expected): &Field| {
        let text = format!(
            "[model]\nformula = \"{formula}\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n{more}\n\
             [target]\nfaces = 600\nfit = \"paper\"\n"
        );
        Case { name, model: text.into_bytes(), expected }
    };
    FIELDS.iter().map(case).collect()
}

/// Model files that are odd as texts or name odd things.
pub(crate) fn files() -> Vec<Case> {
    let case = |&(name, text, expected): &File| Case { name, model: text.into(), expected };
    let mut all: Vec<Case> = FILES.iter().map(case).collect();
    let on_mesh = |&(name, mesh, expected): &File| {
        let text = format!(
            "[model]\nformula = \"x^2+y^2+z^2-1\"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n\
             base_mesh = \"{mesh}\"\n[adapt]\nmax_turning_deg = 120\nmax_slope = 1.0\n\
             [target]\nfit = \"paper\"\n"
        );
        Case { name, model: text.into_bytes(), expected }
    };
    all.extend(MESHES.iter().map(on_mesh));
    all.extend(long_files());
    all.extend(encodings());
    all
}

/// Texts whose length is the matter.
fn long_files() -> Vec<Case> {
    let sphere = "x^2+y^2+z^2-1";
    let given = "box = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n[target]\nfaces = 100\n";
    let model = |formula: &str, more: &str| {
        format!("[model]\nformula = \"{formula}\"\n{more}").into_bytes()
    };
    let terms: Vec<String> = (0..1_000_000).map(|k| format!("+1e-9*{k}.5*x")).collect();
    let terms = terms.concat();
    let open = "(".repeat(100_000);
    let (close, minus) = (")".repeat(100_000), "-".repeat(100_000));
    let roots = "abs(".repeat(50_000);
    let case = |name, model, expected| Case { name, model, expected };
    vec![
        case(
            "a million terms, one unknown",
            model(&format!("{sphere}{terms}+q"), given),
            Exit(12, &["unknown name `q`"]),
        ),
        case(
            "a million terms, no box",
            model(&format!("{sphere}{terms}"), ""),
            Exit(11, &["no-box", "too long to find its box"]),
        ),
        case("100 000 parentheses", model(&format!("{open}{sphere}{close}"), given), Exit(12, &[])),
        case("100 000 signs", model(&format!("{minus}({sphere})"), given), Passes),
        case(
            "50 000 nested calls",
            model(&format!("{roots}{sphere}{}", &close[..50_000]), given),
            Exit(12, &[]),
        ),
        case(
            "100 000 brackets of TOML",
            format!("a = {}", "[".repeat(100_000)).into_bytes(),
            Exit(11, &[]),
        ),
        case(
            "a name of a million letters",
            model(&"q".repeat(1_000_000), given),
            Exit(12, &["unknown name"]),
        ),
        case(
            "ten megabytes of a comment",
            model(&format!("{sphere}\"\n#{}\nunit=\"m", "c".repeat(10 << 20)), given),
            Passes,
        ),
    ]
}

/// Texts whose bytes are the matter.
fn encodings() -> Vec<Case> {
    let case = |name, model: Vec<u8>, expected| Case { name, model, expected };
    let sphere = SPHERE.as_bytes();
    vec![
        case("byte order mark", [b"\xef\xbb\xbf", sphere].concat(), Passes),
        case("line ends of Windows", SPHERE.replace('\n', "\r\n").into_bytes(), Passes),
        case("bad UTF-8", [sphere, b"# \xff\xfe\n"].concat(), Exit(10, &["UTF-8"])),
        case("a zero byte", [sphere, b"\0\n"].concat(), Exit(11, &["toml-syntax"])),
        case("UTF-16", SPHERE.encode_utf16().flat_map(u16::to_le_bytes).collect(), Exit(11, &[])),
        case(
            "a formula in other letters",
            SPHERE.replace("x^2", "\u{445}^2").into_bytes(),
            Exit(12, &["unexpected character"]),
        ),
    ]
}
