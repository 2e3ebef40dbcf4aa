//! Writes a ball and a ring, whole, with a hole in the ball and of degree 6, in every format into a
//! folder: food for foreign readers.
//!
//! `cargo run -p isospline-export --example sample_exports -- FOLDER`

#[path = "../sample.rs"]
#[expect(dead_code, reason = "some samples are for tests alone")]
mod sample;

use isospline_artifact::kinds::Patches;
use isospline_export::{Format, Options, StepOptions, StepSchema, write_file};
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder to write into")?);
    let samples = [
        ("sample", sample::ball_and_ring()),
        ("hollow", sample::hollow_ball_and_ring()),
        ("sextic", sample::of_degree_six(sample::hollow_ball_and_ring())),
    ];
    for (name, patches) in samples {
        write_all(&folder, name, &patches)?;
    }
    Ok(())
}

fn write_all(folder: &Path, name: &str, patches: &Patches) -> Result<(), Box<dyn Error>> {
    for format in Format::ALL {
        let path = folder.join(format!("{name}.{format}"));
        write_file(format, &patches.view(), &Options::default(), &path)?;
    }
    let variants = [
        ("compact", StepOptions { compact: true, ..StepOptions::default() }),
        ("pcurves", StepOptions { pcurves: true, ..StepOptions::default() }),
        ("ap214", StepOptions { schema: StepSchema::Ap214, ..StepOptions::default() }),
    ];
    for (variant, step) in variants {
        let path = folder.join(format!("{name}.{variant}.step"));
        write_file(Format::Step, &patches.view(), &Options { step, ..Options::default() }, &path)?;
    }
    Ok(())
}
