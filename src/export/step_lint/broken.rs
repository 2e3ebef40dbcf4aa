//! Files that a kernel would heal in silence, each with the defect that must be found in it.

use super::{StepDefect, StepSummary, lint_step};
use crate::{About, Format, LengthUnit, Options, StepOptions, StepSchema, sample, write};
use isospline_artifact::kinds::Patches;

fn text(options: &Options) -> String {
    text_of(&sample::hollow_ball_and_ring(), options)
}

fn text_of(patches: &Patches, options: &Options) -> String {
    let mut out = Vec::new();
    write(Format::Step, &patches.view(), options, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn summary(options: &Options) -> StepSummary {
    lint_step(&text(options)).unwrap_or_else(|defects| panic!("{defects:?}"))
}

#[test]
fn sound_files_of_every_form_pass_and_hold_what_was_written() {
    for (compact, pcurves) in [(false, false), (false, true), (true, false), (true, true)] {
        for schema in [StepSchema::Ap242, StepSchema::Ap214] {
            let step = StepOptions { schema, compact, pcurves };
            let found = summary(&Options { step, ..Options::default() });
            assert_eq!(found.solids, 2);
            let shells: Vec<_> = found.shells.iter().map(|s| (s.is_void, s.genus)).collect();
            assert_eq!(shells, [(false, 1), (false, 0), (true, 0)], "compact {compact}");
            let per_triangle = if compact { 1 } else { 3 };
            let faces: usize = found.shells.iter().map(|s| s.faces).sum();
            assert_eq!(faces, 208 * per_triangle);
            let ball = &found.shells[1..];
            assert!((ball[1].volume / ball[0].volume + 0.064).abs() < 1e-13);
        }
    }
}

#[test]
fn patches_of_degree_6_make_sound_files_three_quarters_the_size() {
    for (compact, pcurves) in [(false, false), (false, true), (true, false), (true, true)] {
        let step = StepOptions { compact, pcurves, ..StepOptions::default() };
        let options = Options { step, ..Options::default() };
        let septic = sample::hollow_ball_and_ring();
        let sizes = [sample::of_degree_six(septic.clone()), septic].map(|patches| {
            let text = text_of(&patches, &options);
            let found = lint_step(&text).unwrap_or_else(|defects| panic!("{defects:?}"));
            assert_eq!((found.solids, found.shells.len()), (2, 3));
            text.len() as f64
        });
        let ratio = sizes[0] / sizes[1];
        assert!(ratio > 0.7 && ratio < 0.85, "{ratio} of the size, compact {compact}");
    }
}

#[test]
fn units_are_read_back() {
    for (unit, metres) in [
        (LengthUnit::Micrometre, 1e-6),
        (LengthUnit::Millimetre, 1e-3),
        (LengthUnit::Centimetre, 1e-2),
        (LengthUnit::Metre, 1.0),
        (LengthUnit::Inch, 0.0254),
        (LengthUnit::Foot, 0.3048),
    ] {
        let about = About { unit, name: "it's #1; a \\ part".to_owned(), ..About::default() };
        let found = summary(&Options { about, ..Options::default() });
        assert!((found.unit_metres - metres).abs() < 1e-15, "{unit:?}");
    }
}

/// A text that can be spoiled, entity by entity.
struct Spoiled(String);

impl Spoiled {
    /// Number of the `k`-th entity of a kind.
    fn number(&self, kind: &str, k: usize) -> u64 {
        let opening = format!("={kind}(");
        let line = self.0.lines().filter(|line| line.contains(&opening)).nth(k).unwrap();
        line[1..].split_once('=').unwrap().0.parse().unwrap()
    }

    fn line(&self, number: u64) -> String {
        let start = format!("#{number}=");
        self.0.lines().find(|line| line.starts_with(&start)).unwrap().to_owned()
    }

    /// Changes an entity, which must make a difference.
    fn edit(mut self, number: u64, change: impl Fn(&str) -> String) -> Self {
        let line = self.line(number);
        let changed = change(&line);
        assert_ne!(line, changed);
        self.0 = self.0.replacen(&format!("\n{line}\n"), &format!("\n{changed}\n"), 1);
        self
    }

    fn edit_kind(self, kind: &str, k: usize, from: &str, to: &str) -> Self {
        let number = self.number(kind, k);
        self.edit(number, |line| line.replacen(from, to, 1))
    }

    fn replace(mut self, from: &str, to: &str) -> Self {
        assert!(self.0.contains(from), "{from}");
        self.0 = self.0.replace(from, to);
        self
    }

    fn replace_once(mut self, from: &str, to: &str) -> Self {
        assert!(self.0.contains(from), "{from}");
        self.0 = self.0.replacen(from, to, 1);
        self
    }

    fn remove(mut self, number: u64) -> Self {
        let line = self.line(number);
        self.0 = self.0.replacen(&format!("\n{line}\n"), "\n", 1);
        self
    }

    /// Adds an entity under a number that is free; it becomes the last but one line.
    fn add(mut self, entity: &str) -> (Self, u64) {
        let number = 9_000_000;
        self.0 = self.0.replacen("ENDSEC;\nEND", &format!("#{number}={entity};\nENDSEC;\nEND"), 1);
        (self, number)
    }

    /// Lets `user` name a copy of `point` with its first coordinate changed.
    fn moved(self, user: u64, point: u64, change: impl Fn(f64) -> f64) -> Self {
        let line = self.line(point);
        let (start, rest) = line.split_once("('',(").unwrap();
        let (x, rest) = rest.split_once(',').unwrap();
        let kind = start.split_once('=').unwrap().1;
        let changed = format!("{kind}('',({:?},{}", change(x.parse().unwrap()), rest);
        let (spoiled, number) = self.add(changed.trim_end_matches(';'));
        spoiled.edit(user, |line| line.replacen(&format!("#{point},"), &format!("#{number},"), 1))
    }

    /// Entities that an entity names.
    fn named(&self, number: u64) -> Vec<u64> {
        super::part21::references(self.line(number).split_once('=').unwrap().1).collect()
    }

    fn defects(&self) -> Vec<StepDefect> {
        lint_step(&self.0).expect_err("the file passes")
    }
}

const SURFACE: &str = "B_SPLINE_SURFACE_WITH_KNOTS";
const CURVE: &str = "B_SPLINE_CURVE_WITH_KNOTS";

/// What is done to a file, and the name of the defect that must be among those found.
type Case = (&'static str, &'static str, fn(Spoiled) -> Spoiled);

fn require_found(cases: &[Case], options: &Options) {
    let sound = text(options);
    for (what, expected, spoil) in cases {
        let defects = spoil(Spoiled(sound.clone())).defects();
        let name = |defect: &StepDefect| {
            let text = format!("{defect:?}");
            text.split([' ', '(']).next().unwrap().to_owned()
        };
        let names: Vec<String> = defects.iter().map(name).collect();
        assert!(names.iter().any(|name| name == expected), "{what}: {names:?}");
    }
}

#[test]
fn shells_that_do_not_close_are_found() {
    let cases: &[Case] = &[
        ("a face turned over", "TurnedFace", |s| s.edit_kind("ADVANCED_FACE", 9, ".T.", ".F.")),
        ("a bound turned over", "EdgeUse", |s| s.edit_kind("FACE_OUTER_BOUND", 9, ".T.", ".F.")),
        ("a face left out", "EdgeUse", |s| {
            let shell = s.number("CLOSED_SHELL", 0);
            let face = s.named(shell)[0];
            s.edit(shell, |line| line.replacen(&format!("#{face},"), "", 1)).remove(face)
        }),
        ("a face that no shell uses", "Use", |s| {
            let shell = s.number("CLOSED_SHELL", 0);
            let face = s.named(shell)[0];
            s.edit(shell, |line| line.replacen(&format!("#{face},"), "", 1))
        }),
        ("a face used twice", "Use", |s| {
            let shell = s.number("CLOSED_SHELL", 0);
            let face = s.named(shell)[0];
            s.edit(shell, |line| line.replacen("(#", &format!("(#{face},#"), 1))
        }),
        ("an edge doubled", "EdgeUse", |s| {
            let edge = s.number("EDGE_CURVE", 5);
            let entity = s.line(edge).split_once('=').unwrap().1.trim_end_matches(';').to_owned();
            let (s, copy) = s.add(&entity);
            s.replace_once(&format!(",#{edge},."), &format!(",#{copy},."))
        }),
        ("a side run the wrong way", "EdgeUse", |s| s.edit_kind("ORIENTED_EDGE", 1, ".T.", ".F.")),
        ("sides in the wrong order", "OpenLoop", |s| {
            let ring = s.number("EDGE_LOOP", 2);
            let [a, b] = [s.named(ring)[0], s.named(ring)[1]];
            s.edit(ring, |line| line.replacen(&format!("#{a},#{b}"), &format!("#{b},#{a}"), 1))
        }),
        ("two vertices that are one", "Pinched", |s| {
            let edges: Vec<u64> = (0..200).map(|k| s.number("EDGE_CURVE", k)).collect();
            let [a, b] = [s.named(edges[100])[0], s.named(edges[190])[0]];
            s.replace(&format!("('',#{b},"), &format!("('',#{a},"))
                .replace(&format!(",#{b},#"), &format!(",#{a},#"))
        }),
    ];
    require_found(cases, &Options::default());
}

#[test]
fn shells_that_are_turned_or_stray_are_found() {
    let cases: &[Case] = &[
        ("a void turned", "TurnedShell", |s| s.edit_kind("ORIENTED_CLOSED_SHELL", 0, ".T.", ".F.")),
        ("all turned inside out", "TurnedShell", |s| {
            let faces = s.replace(",.T.);\n", ",.X.);\n");
            let flip = |line: &str| match line {
                l if l.contains("=ADVANCED_FACE(") || l.contains("=FACE_OUTER_BOUND(") => {
                    l.replace(".X.", ".F.")
                }
                l => l.replace(".X.", ".T."),
            };
            Spoiled(faces.0.lines().map(|line| flip(line) + "\n").collect())
        }),
        ("a shell of two solids", "Use", |s| {
            let shells = [0, 1].map(|k| s.number("CLOSED_SHELL", k));
            s.replace(&format!("#{},", shells[1]), &format!("#{},", shells[0]))
        }),
        ("a solid left out", "Use", |s| {
            let solid = s.number("BREP_WITH_VOIDS", 0);
            s.edit_kind("ADVANCED_BREP_SHAPE_REPRESENTATION", 0, &format!(",#{solid}"), "")
        }),
    ];
    require_found(cases, &Options::default());
}

#[test]
fn borders_that_differ_in_a_bit_are_found() {
    let cases: &[Case] = &[
        ("a border of a net moved by 1e-9", "Border", |s| {
            let surface = s.number(SURFACE, 4);
            let point = s.named(surface)[3];
            s.moved(surface, point, |x| x + 1e-9)
        }),
        ("a border of a net moved by a bit", "Border", |s| {
            let surface = s.number(SURFACE, 4);
            let point = s.named(surface)[8];
            s.moved(surface, point, f64::next_up)
        }),
        ("a curve moved by a bit", "Border", |s| {
            let curve = s.number(CURVE, 4);
            let point = s.named(curve)[5];
            s.moved(curve, point, f64::next_up)
        }),
        ("a vertex elsewhere", "Ends", |s| {
            let [a, b] = [0, 1].map(|k| s.number("VERTEX_POINT", k));
            let [a, b] = [s.named(a)[0], s.named(b)[0]];
            s.edit_kind("VERTEX_POINT", 1, &format!("#{b}"), &format!("#{a}"))
        }),
        ("an inner point moved by a thousandth", "Volume", |s| {
            let surface = s.number(SURFACE, 4);
            let point = s.named(surface)[27];
            s.moved(surface, point, |x| x + 1e-3)
        }),
        ("another volume stated", "Volume", |s| {
            s.edit_kind("MEASURE_REPRESENTATION_ITEM", 0, "VOLUME_MEASURE(", "VOLUME_MEASURE(1")
        }),
    ];
    require_found(cases, &Options::default());
}

#[test]
fn broken_texts_are_found() {
    let cases: &[Case] = &[
        ("a point that is not there", "Dangling", |s| {
            let point = s.number("CARTESIAN_POINT", 40);
            s.remove(point)
        }),
        ("a number twice", "Repeated", |s| {
            let [a, b] = [40, 41].map(|k| s.number("CARTESIAN_POINT", k));
            s.edit(a, |line| line.replacen(&format!("#{a}="), &format!("#{b}="), 1))
        }),
        ("a point in place of a vertex", "Kind", |s| {
            let edge = s.number("EDGE_CURVE", 0);
            let vertex = s.named(edge)[0];
            let point = s.named(vertex)[0];
            s.edit(edge, |line| line.replacen(&format!("#{vertex},"), &format!("#{point},"), 1))
        }),
        ("a net with a point too few", "Count", |s| {
            let surface = s.number(SURFACE, 0);
            let point = s.named(surface)[0];
            s.edit(surface, |line| line.replacen(&format!("#{point},"), "", 1))
        }),
        ("a curve of another degree", "Count", |s| s.edit_kind(CURVE, 0, "'',7", "'',6")),
        ("a knot too few", "Argument", |s| s.edit_kind(CURVE, 0, "(8,8)", "(8,7)")),
        ("knots of another span", "Argument", |s| s.edit_kind(SURFACE, 0, "(0.,1.)", "(0.,2.)")),
        ("a point in a plane", "Argument", |s| {
            let point = s.named(s.number("VERTEX_POINT", 3))[0];
            s.edit(point, |line| format!("{}));", line.rsplit_once(',').unwrap().0))
        }),
        ("a coordinate that is no number", "Syntax", |s| {
            let point = s.named(s.number("VERTEX_POINT", 3))[0];
            s.edit(point, |line| line.replacen("('',(", "('',(NaN", 1))
        }),
        ("no unit", "Unsaid", |s| s.replace("LENGTH_UNIT()", "MASS_UNIT()")),
        ("no volume", "Unsaid", |s| s.replace("VOLUME_MEASURE(", "AREA_MEASURE(")),
        ("cut off", "Frame", |s| Spoiled(s.0[..s.0.len() / 2].to_owned())),
        ("no end of the data", "Frame", |s| s.replace("ENDSEC;\nEND-ISO", "END-ISO")),
        ("no schema", "Frame", |s| s.replace("FILE_SCHEMA", "FILE_SCHEM")),
        ("an empty file", "Frame", |_| Spoiled(String::new())),
    ];
    require_found(cases, &Options::default());
}

#[test]
fn curves_in_parameters_that_are_another_side_are_found() {
    let cases: &[Case] = &[
        ("another line", "Pcurve", |s| {
            let pcurve = s.number("PCURVE", 6);
            let line = s.named(pcurve)[1];
            s.edit(pcurve, |text| text.replacen(&format!("#{line}"), &format!("#{}", line + 10), 1))
        }),
        ("a line run backwards", "Pcurve", |s| {
            let pcurve = s.number("PCURVE", 4);
            let (line, first) = (s.named(pcurve)[1], s.number("DEFINITIONAL_REPRESENTATION", 0));
            let back = first + (((line - first) / 5) ^ 1) * 5;
            s.edit(pcurve, |text| text.replacen(&format!("#{line}"), &format!("#{back}"), 1))
        }),
        ("a face that the edge does not bound", "Pcurve", |s| {
            let [a, b] = [6, 90].map(|k| s.named(s.number("PCURVE", k))[0]);
            s.edit_kind("PCURVE", 6, &format!("#{a},"), &format!("#{b},"))
        }),
    ];
    let step = StepOptions { pcurves: true, ..StepOptions::default() };
    require_found(cases, &Options { step, ..Options::default() });
}

#[test]
fn no_change_of_bytes_makes_the_linter_panic() {
    let step = StepOptions { compact: true, pcurves: true, ..StepOptions::default() };
    let mut sound = Vec::new();
    let options = Options { step, ..Options::default() };
    write(Format::Step, &sample::flat_octahedron().view(), &options, &mut sound).unwrap();
    assert_eq!(lint_step(std::str::from_utf8(&sound).unwrap()).unwrap().solids, 1);
    let mut state = 1_u64;
    let mut roll = |n: usize| {
        // Numbers of Knuth's generator; its high bits are the good ones.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let mut n_refused = 0;
    for _ in 0..600 {
        let mut bytes = sound.clone();
        for _ in 0..=roll(3) {
            let at = roll(bytes.len());
            match roll(3) {
                0 => bytes[at] = b"()'#,;.=*$0AE-"[roll(14)],
                1 => drop(bytes.drain(at..(at + roll(40)).min(bytes.len()))),
                _ => bytes.truncate(at.max(bytes.len() / 2)),
            }
        }
        n_refused += usize::from(lint_step(&String::from_utf8_lossy(&bytes)).is_err());
    }
    assert!(n_refused > 400, "{n_refused} of 600 are refused");
}
