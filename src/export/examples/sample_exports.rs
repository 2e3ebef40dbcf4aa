//! Writes a ball and a ring in every format into a folder: food for foreign readers.
//!
//! `cargo run -p isospline-export --example sample_exports -- FOLDER`

#[path = "../sample.rs"]
mod sample;

use isospline_export::{Format, Options, write_file};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder to write into")?);
    let patches = sample::ball_and_ring();
    for format in Format::ALL {
        let path = folder.join(format!("sample.{format}"));
        write_file(format, &patches.view(), &Options::default(), &path)?;
    }
    Ok(())
}
