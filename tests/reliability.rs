//! The scoreboard: what may happen to a run, tried many times, and what must come of it.
//!
//! One file a row. A row is the same code at both scales; the short one is part of the tests, the
//! full one is printed by `make reliability`.

mod archive;
mod bit_rot;
mod bumped_stage;
mod concurrency;
mod determinism;
mod dice;
mod freshness;
pub mod fuzz_targets;
mod fuzzing;
mod held;
mod hostile;
mod hostile_systems;
mod hostile_texts;
mod io_faults;
mod kill;
mod memory_limits;
mod mount;
mod mutation;
mod odd_meshes;
mod power_cut;
mod process;
mod sample;
mod seal;
mod seeded_defects;
mod strace;
mod tally;

use std::panic::{AssertUnwindSafe, catch_unwind};
pub use tally::{HEAD, Tally};

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A minute or less for all rows.
    Short,
    /// The counts of the scoreboard.
    Full,
}

impl Scale {
    /// A count at this scale.
    pub fn of(self, short: usize, full: usize) -> usize {
        match self {
            Self::Short => short,
            Self::Full => full,
        }
    }
}

/// One row of the scoreboard.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Its number, such as `R3`.
    pub id: &'static str,
    /// What may happen.
    pub property: &'static str,
    try_all: fn(Scale, &mut Tally),
}

impl Row {
    /// Tries everything of this row.
    pub fn tried(&self, scale: Scale) -> Tally {
        let mut tally = Tally::new(self.id);
        // A row that breaks must not take the board with it.
        let broken = catch_unwind(AssertUnwindSafe(|| (self.try_all)(scale, &mut tally))).err();
        if let Some(payload) = broken {
            let text = payload.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
            tally.case("the row itself", Err(text.unwrap_or("a panic").to_owned()));
        }
        tally
    }

    /// The row of this number.
    ///
    /// # Panics
    /// If there is none.
    pub fn numbered(id: &str) -> Self {
        *ROWS.iter().find(|row| row.id == id).unwrap_or_else(|| panic!("no row {id}"))
    }
}

/// All rows.
pub const ROWS: [Row; 11] = [
    Row { id: "R1", property: "kill -9", try_all: kill::try_all },
    Row { id: "R2", property: "power cut", try_all: power_cut::try_all },
    Row { id: "R3", property: "bit rot", try_all: bit_rot::try_all },
    Row { id: "R4", property: "I/O faults", try_all: io_faults::try_all },
    Row { id: "R5", property: "concurrency", try_all: concurrency::try_all },
    Row { id: "R6", property: "fuzz", try_all: fuzzing::try_all },
    Row { id: "R7", property: "determinism", try_all: determinism::try_all },
    Row { id: "R8", property: "freshness", try_all: freshness::try_all },
    Row { id: "R9", property: "hostile input", try_all: hostile::try_all },
    Row { id: "R10", property: "memory", try_all: memory_limits::try_all },
    Row { id: "R11", property: "self-check", try_all: seeded_defects::try_all },
];
