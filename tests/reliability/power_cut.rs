//! R2, power cut: the file system stops in the middle of a run and comes back as the disk has it.

#![expect(clippy::disallowed_methods, reason = "the moment of the cut is chosen by the clock")]

use crate::reliability::dice::Dice;
use crate::reliability::mount::Mount;
use crate::reliability::process::{done, is_root, is_there};
use crate::reliability::sample::{Sample, computed, stage_of, stages};
use crate::reliability::{Scale, Tally};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// `EXT4_IOC_SHUTDOWN` with the flag that leaves the log unwritten: all that was not synced is
/// lost.
const CUT: &str = "open(my $f, '<', $ARGV[0]) or die $!; \
    my $flag = pack('L', 2); ioctl($f, 0x8004587d, $flag) or die $!;";

pub(super) fn try_all(scale: Scale, tally: &mut Tally) {
    let tools = ["mkfs.ext4", "mount", "perl"];
    if !is_root() {
        return tally.skip("power cuts", "not root");
    }
    if let Some(tool) = tools.into_iter().find(|tool| !is_there(tool)) {
        return tally.skip("power cuts", &format!("no {tool}"));
    }
    let sample = Sample::new();
    let image = sample.sandbox.write("disk.img", "");
    let made = std::fs::File::options().write(true).open(&image).and_then(|f| f.set_len(32 << 20));
    made.expect("the sandbox can be written");
    let at = image.display().to_string();
    let formatted = done("mkfs.ext4", &["-q", "-F", &at]);
    if let Err(why) = formatted.and_then(|()| trial(&sample, &image)) {
        return tally.skip("power cuts", &why);
    }
    let mut dice = Dice::new(2);
    let (mut acknowledged, mut at_work) = (0, 0);
    for n in 0..scale.of(5, 200) {
        // Cuts are spread over the run and a little beyond its end.
        let moment = Duration::from_secs_f64(1.2 * sample.seconds * dice.unit());
        let outcome = cut(&sample, &image, moment).and_then(|stored| {
            acknowledged += stored.len();
            at_work += usize::from(stored.len() < sample.sound.len());
            resumed(&sample, &image, &stored)
        });
        tally.case(format!("cut {n}"), outcome);
    }
    tally.figure(format!(
        "{acknowledged} acknowledged stages, none lost; {at_work} cuts of a run at work"
    ));
}

/// Whether loop mounts can be had at all.
fn trial(sample: &Sample, image: &Path) -> Result<(), String> {
    Mount::image(image, &sample.sandbox.path("disk")).map(drop)
}

/// Starts a run on an empty disk and cuts; the stages that it had told to be stored by then.
fn cut(sample: &Sample, image: &Path, moment: Duration) -> Result<Vec<String>, String> {
    let disk = sample.sandbox.path("disk");
    let _mount = Mount::image(image, &disk)?;
    let folder = disk.join("out");
    let _ = std::fs::remove_dir_all(&folder);
    done("sync", &["-f", &disk.display().to_string()])?;
    let said = sample.sandbox.path("said");
    let log = std::fs::File::create(&said).map_err(|error| error.to_string())?;
    let mut command = sample.command(&folder, &["--json"]);
    let child = command.stdout(log).stderr(Stdio::null()).spawn();
    let mut child = child.map_err(|error| error.to_string())?;
    std::thread::sleep(moment);
    // What it tells between this and the cut may be lost or not; nobody has read it.
    let said = std::fs::read_to_string(said).unwrap_or_default();
    done("perl", &["-e", CUT, &disk.display().to_string()])?;
    let status = child.wait().map_err(|error| error.to_string())?;
    match status.code() {
        Some(0 | 31 | 33) => Ok(stages(&said, "stored")),
        code => Err(format!("the run that was cut off ended with {code:?}: {said}")),
    }
}

/// What was acknowledged is there in its bytes, and a run goes on from there.
fn resumed(sample: &Sample, image: &Path, stored: &[String]) -> Result<(), String> {
    let disk = sample.sandbox.path("disk");
    let _mount = Mount::image(image, &disk)?;
    let folder = disk.join("out");
    for (name, bytes) in
        sample.sound.iter().filter(|(n, _)| stored.iter().any(|s| s == stage_of(n)))
    {
        let found = std::fs::read(folder.join(name)).map_err(|error| format!("{name}: {error}"))?;
        if found != *bytes {
            return Err(format!("{name} was acknowledged and has other bytes"));
        }
    }
    let ran = sample.resumes(&folder)?;
    let again = computed(&ran.outcome.stdout);
    match stored.iter().find(|stage| again.contains(stage)) {
        Some(stage) => Err(format!("{stage} was acknowledged and is made again")),
        None => Ok(()),
    }
}
