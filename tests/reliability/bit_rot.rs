//! R3, bit rot: every byte, every length, on every artifact; then through the program.

use crate::reliability::dice::Dice;
use crate::reliability::held::Held;
use crate::reliability::kill::{chunked, killed};
use crate::reliability::sample::{PATIENCE, Sample, copy_folder, stage_of};
use crate::reliability::seal::{Place, places};
use crate::reliability::{Scale, Tally, process};
use isospline_artifact::{Container, StoreError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// What a byte is changed by: one bit low, one high, all, half, and one in the middle.
const CHANGES: [u8; 5] = [0x01, 0x80, 0xff, 0x55, 0x10];

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let sample = Sample::new();
    // At the short scale every byte is still changed, each in one of the ways.
    for (name, sound) in &sample.sound {
        let places = places(sound);
        for offset in 0..sound.len() {
            for change in &CHANGES[..scale.of(1, CHANGES.len())] {
                let mut file = sound.clone();
                file[offset] ^= change.rotate_left(offset as u32);
                seen(tally, name, &file, &format!("byte {offset} ^ {change:#x}"), |said| {
                    names_place(said, &places, offset)
                });
            }
        }
        // A length that is cut within the header says less than one that is cut later.
        for length in (0..sound.len()).step_by(scale.of(7, 1)) {
            seen(tally, name, &sound[..length], &format!("cut to {length}"), |said| {
                said.contains("cut off after")
            });
        }
        for extra in [1, 2, 7, 8, 63, 64, 4096, sound.len()] {
            let longer: Vec<u8> = sound.iter().copied().cycle().take(sound.len() + extra).collect();
            seen(tally, name, &longer, &format!("{extra} bytes more"), |said| {
                said.contains(&format!("{extra} bytes follow the end"))
            });
        }
    }
    let bytes: usize = sample.sound.values().map(Vec::len).sum();
    tally.figure(format!("{bytes} bytes in {} artifacts", sample.sound.len()));
    through_the_program(scale, tally, &sample);
    unfinished(scale, tally);
}

/// Whether the reader finds the damage and says what `fits`.
fn seen(tally: &mut Tally, name: &str, file: &[u8], what: &str, fits: impl Fn(&str) -> bool) {
    let opened = || -> Result<(), StoreError> {
        Container::new(name.to_owned(), Held::copy_of(file))?.verify()
    };
    let outcome = match catch_unwind(AssertUnwindSafe(opened)) {
        Err(_) => Err("a panic".to_owned()),
        Ok(Ok(())) => Err("not found".to_owned()),
        Ok(Err(error)) => {
            let said = error.to_string();
            let named = said.starts_with(&format!("{name}: ")) && fits(&said);
            if named { Ok(()) } else { Err(format!("says {said:?}")) }
        }
    };
    if outcome.is_ok() { tally.passed(1) } else { tally.case(format!("{name}, {what}"), outcome) }
}

/// Whether a message names the part of the file that `offset` lies in.
fn names_place(said: &str, places: &[Place], offset: usize) -> bool {
    if let Some(place) = places.iter().find(|p| (p.offset..p.end()).contains(&offset)) {
        let block = (offset - place.offset) / (place.stride * place.block_rows);
        let first = block * place.block_rows;
        let end = (first + place.block_rows).min(place.rows);
        let told = format!("section {:?} is damaged in block {block} ", place.name);
        return said.contains(&told) && said.contains(&format!("(rows {first}..{end})"));
    }
    let parts: &[&str] = match offset {
        0..8 => &["not an isospline artifact"],
        8..12 => &["container version"],
        // A changed length of the header may point beyond the end of the file.
        12..16 => &["the header is damaged", "cut off after"],
        _ => &["the header is damaged", "the padding after", "the checksum table", "the footer"],
    };
    parts.iter().any(|part| said.contains(part))
}

/// A damaged file of a store is told by `inspect --verify`, and the stage is run again as soon as
/// its rows are needed.
fn through_the_program(scale: Scale, tally: &mut Tally, sample: &Sample) {
    let mut dice = Dice::new(3);
    for n in 0..scale.of(12, 200) {
        let names: Vec<&String> = sample.sound.keys().collect();
        let name = names[n % names.len()];
        let mut file = sample.sound[name].clone();
        let offset = dice.below(file.len());
        match n % 4 {
            0 => file.truncate(offset),
            1 => file.extend_from_within(..offset),
            _ => file[offset] ^= 1 << dice.below(8),
        }
        tally.case(format!("{name} of a store, {n}"), rebuilt(sample, name, &file, n % 2 == 0));
    }
}

/// What is made of the file is run again, or, if `removed`, is gone too.
fn rebuilt(sample: &Sample, name: &str, file: &[u8], removed: bool) -> Result<(), String> {
    let store = sample.copy("rot");
    sample.sandbox.write(&format!("rot/{name}"), file);
    let mut inspect = Command::new(crate::program());
    inspect.args(["inspect", "--verify"]).arg(store.join(name));
    let told = process::watched(&mut inspect, PATIENCE);
    let known = [30, 31].contains(&told.outcome.code) && told.outcome.stderr.contains(name);
    if !known && file != sample.sound[name] {
        return Err(format!("inspect --verify: {}", told.told()));
    }
    let later: Vec<&String> = sample.sound.range(name.to_owned()..).skip(1).map(|f| f.0).collect();
    let mut next = Vec::new();
    if removed {
        for name in &later {
            std::fs::remove_file(store.join(name)).map_err(|error| error.to_string())?;
        }
    } else if let Some(stage) = later.first().map(|name| stage_of(name)) {
        next = vec!["--from", stage];
    }
    let ran = sample.run(&store, &next);
    if ran.outcome.code != 0 {
        return Err(format!("the run after it: {}", ran.told()));
    }
    sample.is_sound(&store)
}

/// What a killed run left, its journals and its rows, damaged: the next run takes what can be
/// trusted and makes the rest.
fn unfinished(scale: Scale, tally: &mut Tally) {
    let sample = chunked();
    let mut dice = Dice::new(33);
    let (left, folder) = (sample.sandbox.path("left"), sample.sandbox.path("rot"));
    let n_cases = scale.of(6, 200);
    let mut n = 0;
    for _ in 0..20 * n_cases {
        if n >= n_cases {
            break;
        }
        let _ = std::fs::remove_dir_all(&left);
        killed(&sample, &left, Duration::from_secs_f64(sample.seconds * dice.unit()));
        let files = begun(&left);
        if files.is_empty() {
            continue;
        }
        for _ in 0..5 {
            let _ = std::fs::remove_dir_all(&folder);
            copy_folder(&left, &folder);
            let name = dice.pick(&files);
            let mut bytes = std::fs::read(folder.join(name)).unwrap_or_default();
            let at = dice.below(bytes.len());
            match dice.below(4) {
                0 => bytes.truncate(at),
                1 => bytes.extend_from_within(..at),
                _ => bytes[at] ^= 1 << dice.below(8),
            }
            sample.sandbox.write(&format!("rot/{name}"), bytes);
            tally.case(
                format!("{name} of a killed run, byte {at}"),
                sample.resumes(&folder).map(drop),
            );
            n += 1;
        }
    }
    tally.figure(format!("{n} journals and rows of killed runs"));
}

/// Files of artifacts that were begun and not finished.
fn begun(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter(|entry| entry.metadata().is_ok_and(|data| data.len() > 0));
    let mut names: Vec<String> =
        names.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| name.ends_with(".partial") || name.ends_with(".journal"));
    names.sort();
    names
}
