//! Judges the text of a STEP file that [`crate::write`] wrote, by what the text says alone.
//!
//! CAD kernels heal what they read and stay silent: a turned shell or a border that is a tenth of
//! the model off are "valid" once read. So this looks at the file itself: every reference leads
//! to an entity of the right kind, every edge is used once each way in one shell, the loops run
//! counter-clockwise about the normals, borders of surfaces are the curves of their edges in all
//! bits, shells are closed and turned the right way, and the nets hold the volume that is stated.
//! It shares no code with the writer but the nodes of Gauss, and knows the entities that the writer
//! uses and no others.

mod borders;
mod defect;
mod entities;
mod part21;
mod shells;
mod units;
mod volume;

#[cfg(test)]
mod broken;

pub use defect::StepDefect;

use entities::Model;
use shells::Shell;
use std::io;
use std::path::Path;

/// What a sound file holds.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StepSummary {
    /// Solids, each with one outer shell.
    pub solids: usize,
    /// All shells, voids last within their solid.
    pub shells: Vec<StepShell>,
    /// Volume of all solids, their voids taken off, in cubes of the file's unit.
    pub volume: f64,
    /// The unit of length, metres.
    pub unit_metres: f64,
    /// Entities of all kinds.
    pub entities: usize,
}

/// A closed shell.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StepShell {
    /// Whether it bounds a hole in its solid.
    pub is_void: bool,
    /// Faces.
    pub faces: usize,
    /// Edges, each of two faces.
    pub edges: usize,
    /// Vertices.
    pub vertices: usize,
    /// Handles: `1 - (V - E + F) / 2`.
    pub genus: usize,
    /// Volume, negative for a void, in cubes of the file's unit.
    pub volume: f64,
}

/// Most defects that are told of one file: after these another is no news.
const MOST: usize = 100;

/// Reads all of a STEP file and judges it; see [`lint_step`].
///
/// # Errors
/// If the file cannot be read or is no text.
pub fn lint_step_file(path: &Path) -> io::Result<Result<StepSummary, Vec<StepDefect>>> {
    Ok(lint_step(&std::fs::read_to_string(path)?))
}

/// Judges the text of a STEP file.
///
/// # Errors
/// What is wrong with it, at most a hundred things, the graver ones first.
pub fn lint_step(text: &str) -> Result<StepSummary, Vec<StepDefect>> {
    let parsed = part21::parse(text).map_err(|defect| vec![defect])?;
    let mut defects = Vec::new();
    let model = Model::new(parsed, &mut defects);
    // What is not there cannot be judged further.
    require_none(&mut defects)?;
    let solids = shells::read(&model, &mut defects);
    let mut shells = Vec::new();
    for (shell, is_void) in &solids.shells {
        shells.push(judge(&model, shell, *is_void, &mut defects));
    }
    let unit_metres = units::length(&model).unwrap_or_else(|defect| {
        defects.push(defect);
        f64::NAN
    });
    let volume = shells.iter().map(|shell| shell.volume).sum();
    // A wrong volume follows from most other defects and says less than they do.
    if defects.is_empty() {
        defects.extend(volume::against_stated(&model, volume));
    }
    require_none(&mut defects)?;
    let entities = model.entities.len();
    Ok(StepSummary { solids: solids.count, shells, volume, unit_metres, entities })
}

fn require_none(defects: &mut Vec<StepDefect>) -> Result<(), Vec<StepDefect>> {
    defects.truncate(MOST);
    if defects.is_empty() { Ok(()) } else { Err(std::mem::take(defects)) }
}

fn judge(
    model: &Model<'_>,
    shell: &Shell,
    is_void: bool,
    defects: &mut Vec<StepDefect>,
) -> StepShell {
    let before = defects.len();
    let census = shell.close(defects);
    let mut flux = volume::Flux::default();
    for face in &shell.faces {
        match borders::judge(model, face, defects) {
            Ok(net) => flux.add(&net),
            Err(defect) => defects.push(defect),
        }
    }
    let volume = flux.volume();
    // An outer shell holds a positive volume, the shell of a void a negative one.
    if defects.len() == before && (volume < 0.0) != is_void {
        defects.push(StepDefect::TurnedShell { shell: shell.number, volume });
    }
    let euler = census.vertices as i64 - census.edges as i64 + shell.faces.len() as i64;
    StepShell {
        is_void,
        faces: shell.faces.len(),
        edges: census.edges,
        vertices: census.vertices,
        genus: usize::try_from(1 - euler / 2).unwrap_or(0),
        volume,
    }
}
