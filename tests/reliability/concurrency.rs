//! R5, concurrency: several processes on one store at the same time.

#![expect(clippy::disallowed_methods, reason = "processes are started and waited for together")]

use crate::reliability::dice::Dice;
use crate::reliability::process::Ran;
use crate::reliability::sample::{PATIENCE, Sample};
use crate::reliability::{Scale, Tally, process};

/// Exit code of a run that found the store in use.
const LOCKED: i32 = 32;

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let sample = Sample::new();
    let mut dice = Dice::new(5);
    let (mut won, mut told_so) = (0, 0);
    for n in 0..scale.of(10, 200) {
        let processes = 2 + dice.below(7);
        let folder = sample.sandbox.path("shared");
        let _ = std::fs::remove_dir_all(&folder);
        // One in three rounds finds half of the work done.
        if n % 3 == 2 {
            sample.copy("shared");
            for name in sample.sound.keys().skip(3) {
                std::fs::remove_file(folder.join(name)).expect("a file of the sandbox");
            }
        }
        let ended = std::thread::scope(|scope| {
            let start = || scope.spawn(|| sample.run(&folder, &[]));
            let runs: Vec<_> = (0..processes).map(|_| start()).collect();
            runs.into_iter().map(|run| run.join().expect("a thread ends")).collect::<Vec<Ran>>()
        });
        won += ended.iter().filter(|ran| ran.outcome.code == 0).count();
        told_so += ended.iter().filter(|ran| ran.outcome.code == LOCKED).count();
        tally.case(format!("{processes} processes, {n}"), agree(&sample, &folder, &ended));
    }
    tally.figure(format!("{won} runs ended well, {told_so} said \"in use\", no stale lock"));
}

fn agree(sample: &Sample, folder: &std::path::Path, ended: &[Ran]) -> Result<(), String> {
    let good = |ran: &&Ran| ran.outcome.code == 0;
    let refused = |ran: &&Ran| ran.outcome.code == LOCKED && ran.outcome.stderr.contains("in use");
    if let Some(other) = ended.iter().find(|ran| !good(ran) && !refused(ran)) {
        return Err(other.told());
    }
    if !ended.iter().any(|ran| good(&ran)) {
        return Err("all said that another works on the store".to_owned());
    }
    sample.is_sound(folder)?;
    let after = process::watched(&mut sample.command(folder, &[]), PATIENCE);
    let idle = after.outcome.code == 0 && after.outcome.stdout.contains("nothing to do");
    if idle { Ok(()) } else { Err(format!("a run afterwards: {}", after.told())) }
}
