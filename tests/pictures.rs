//! Pictures as a user gets them: the program's PNG files, decoded.

use isospline_tests::Sandbox;
use std::io::Cursor;
use std::path::Path;

/// A decoded picture.
struct Decoded {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Decoded {
    fn open(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the picture is there");
        let decoder = png::Decoder::new(Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a PNG file");
        let mut rgb = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut rgb).expect("whole");
        assert_eq!(info.color_type, png::ColorType::Rgb);
        Self { width: info.width as usize, height: info.height as usize, rgb }
    }

    fn is_white(&self, x: usize, y: usize) -> bool {
        let at = 3 * (y * self.width + x);
        self.rgb[at..at + 3] == [255; 3]
    }
}

fn ball() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.converts("sphere_80", &["--set", "target.fit=paper"]);
    sandbox
}

#[test]
fn a_ball_is_drawn_as_a_disc_on_any_number_of_threads() {
    let sandbox = ball();
    let draw = |threads: &str, name: &str| {
        let view = ["--size", "300x200", "--perspective", "0", "--view", "33,21"];
        let args = ["render", "out", "-o", name, "--threads", threads];
        sandbox.succeeds(&[&args[..], &view].concat());
        std::fs::read(sandbox.path(name)).expect("the picture is there")
    };
    let one = draw("1", "one.png");
    assert!(one == draw("2", "two.png") && one == draw("3", "three.png"));
    let picture = Decoded::open(&sandbox.path("one.png"));
    assert_eq!([picture.width, picture.height], [300, 200]);
    // The margin is four hundredths of the shorter side.
    let radius = 100.0 - 8.0;
    for (y, x) in (0..200).flat_map(|y| (0..300).map(move |x| (y, x))) {
        let (dx, dy) = (x as f64 - 149.5, y as f64 - 99.5);
        let from_middle = (dx * dx + dy * dy).sqrt();
        // The patches of 80 faces bulge by less than a hundredth of the radius.
        if (from_middle - radius).abs() > 2.0 {
            assert_eq!(picture.is_white(x, y), from_middle > radius, "{x} {y}");
        }
    }
}

#[test]
fn every_style_and_every_stage_with_a_surface_has_its_picture() {
    let sandbox = ball();
    let mut seen: Vec<Vec<u8>> = Vec::new();
    for style in ["zebra", "gold", "curvature", "gaussian", "error", "patches", "net"] {
        sandbox.succeeds(&["render", "out", "--style", style, "--size", "480x120"]);
        let picture = Decoded::open(&sandbox.path(&format!("out/sphere_80.{style}.png")));
        assert!(seen.iter().all(|other| *other != picture.rgb), "{style}");
        seen.push(picture.rgb);
    }
    for stage in ["import", "g0_fit"] {
        sandbox.succeeds(&["render", "out", "--stage", stage, "--size", "480x120"]);
        let picture = Decoded::open(&sandbox.path(&format!("out/sphere_80.{stage}.zebra.png")));
        assert!(seen.iter().all(|other| *other != picture.rgb), "{stage}");
        seen.push(picture.rgb);
    }
    sandbox.succeeds(&["render", "out", "--stage", "fairing", "--size", "480x120"]);
    let last = Decoded::open(&sandbox.path("out/sphere_80.fairing.zebra.png"));
    assert!(last.rgb == seen[0], "the finished surface is what fairing made");
}

#[test]
fn what_cannot_be_drawn_is_told_with_what_to_do() {
    let sandbox = ball();
    let refused = |args: &[&str], code: i32, told: &str| {
        let outcome = sandbox.isospline(&[&["render", "out"], args].concat());
        assert_eq!(outcome.code, code, "{outcome:?}");
        assert!(outcome.stderr.contains(told), "{}", outcome.stderr);
    };
    refused(&["--stage", "network"], 2, "makes network, which is no surface");
    refused(&["--stage", "nonsense"], 2, "g0_fit");
    refused(&["--size", "9x9"], 2, "16 to 8192");
    refused(&["--size", "big"], 2, "1280x720");
    refused(&["--view", "sideways"], 2, "-60,25");
    refused(&["--view", "0,91"], 2, "elevation");
    refused(&["--style", "error", "--range", "0,1"], 2, "above 0");
    refused(&["--stripes", "0"], 2, "1 to 200");
    refused(&["-o", "out"], 33, "a folder");
    std::fs::remove_file(sandbox.path("out/11-fairing.isos")).expect("it was there");
    refused(&[], 31, "run the model first");
}
