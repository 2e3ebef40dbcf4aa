//! What became of one model of a batch: a line of the summary.

use crate::batch::BatchModel;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What became of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// A surface that passes the check.
    Converted,
    /// A surface that does not pass the check.
    NotPassed,
    /// No surface, for a reason that lies in the model.
    Refused,
    /// No surface, for a reason that lies elsewhere: a kill, the time limit, the disk, a bug.
    Failed,
}

impl Outcome {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Converted => "converted",
            Self::NotPassed => "not-passed",
            Self::Refused => "refused",
            Self::Failed => "failed",
        }
    }
}

/// One connected component of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Faces.
    pub faces: u64,
    /// Genus; absent unless the component is closed.
    pub genus: Option<i64>,
    /// Volume that it encloses, model units cubed; negative around a hollow.
    #[serde(default)]
    pub volume: Option<f64>,
    /// Components around it.
    #[serde(default)]
    pub depth: u32,
}

/// What became of one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its name in the batch.
    pub model: String,
    /// What became of it.
    pub outcome: Outcome,
    /// Code of the reason; stable; empty where there is none.
    pub reason: String,
    /// The reason as a sentence.
    pub sentence: String,
    /// Where it is seen, model units.
    pub point: Option<[f64; 3]>,
    /// What the user can do.
    pub what_to_do: String,
    /// Exit code of its run; absent where a signal or the time limit ended it.
    pub exit: Option<i32>,
    /// Faces of the surface.
    pub faces: Option<u64>,
    /// Connected components of the surface.
    pub components: Option<u64>,
    /// Sum of their genera.
    pub genus: Option<i64>,
    /// Each component, the one of the lowest face first.
    pub parts: Vec<Part>,
    /// How the topology was established: `certified`, `observed` or `imported`.
    pub topology: String,
    /// Largest error, times the diagonal of the box around the vertices.
    pub error_max_rel: Option<f64>,
    /// Root mean square of the error, likewise.
    pub error_rms_rel: Option<f64>,
    /// Largest angle between the normals of two patches along their edge, degrees.
    pub g1_angle_deg_max: Option<f64>,
    /// Time from the start of its run to the end, seconds.
    pub seconds: f64,
    /// Largest memory of its run, bytes.
    pub peak_resident_bytes: Option<u64>,
    /// Its folder, below that of the batch.
    pub folder: String,
    /// Key of all that may change the outcome; see [`crate::batch::record_key`].
    pub key: String,
}

/// How the run of a model ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// With this exit code.
    Exit(i32),
    /// By this signal, or by none that is known.
    Signal(Option<i32>),
    /// It was ended after the time limit, in seconds.
    TimeLimit(u64),
    /// It was not started.
    NotStarted,
}

impl Record {
    /// The record of a run that ended as told, with the last line of its `--json` output and what
    /// it wrote to standard error.
    ///
    /// `key` is that of [`crate::batch::record_key`].
    pub fn new(
        model: &BatchModel,
        key: String,
        ending: Ending,
        last: Option<&Value>,
        stderr: &str,
    ) -> Self {
        let mut record = Self::empty(model, key);
        if let Ending::Exit(code) = ending {
            record.exit = Some(code);
        }
        match (ending, last) {
            (Ending::Exit(0 | 1), Some(last)) if last["event"] == "report" => {
                record.take_report(&last["report"]);
            }
            (Ending::Exit(code), Some(last)) if last["event"] == "error" => {
                record.take_error(code, last);
            }
            _ => record.take_ending(ending, stderr),
        }
        record
    }

    /// Whether another run of the same model may end otherwise: the reason lies outside of it.
    pub fn is_worth_another_try(&self) -> bool {
        self.outcome == Outcome::Failed && self.reason != BUG
    }

    fn empty(model: &BatchModel, key: String) -> Self {
        Self {
            model: model.name.clone(),
            outcome: Outcome::Failed,
            reason: String::new(),
            sentence: String::new(),
            point: None,
            what_to_do: String::new(),
            exit: None,
            faces: None,
            components: None,
            genus: None,
            parts: Vec::new(),
            topology: String::new(),
            error_max_rel: None,
            error_rms_rel: None,
            g1_angle_deg_max: None,
            seconds: 0.0,
            peak_resident_bytes: None,
            folder: model.folder.clone(),
            key,
        }
    }

    fn take_report(&mut self, report: &Value) {
        let check = &report["check"];
        self.faces = check["faces"].as_u64();
        self.components = check["components"].as_u64();
        self.genus = check["genus"].as_i64();
        self.parts = serde_json::from_value(check["component_list"].clone()).unwrap_or_default();
        self.topology = text(&report["topology"]);
        self.error_max_rel = check["rel_error_max"].as_f64();
        self.error_rms_rel = check["rel_error_rms"].as_f64();
        self.g1_angle_deg_max = check["g1_angle_deg_max"].as_f64();
        self.peak_resident_bytes = report["peak_resident_bytes"].as_u64().filter(|&b| b > 0);
        if check["pass"].as_bool() == Some(true) {
            self.outcome = Outcome::Converted;
            return;
        }
        self.outcome = Outcome::NotPassed;
        "check-not-passed".clone_into(&mut self.reason);
        let failures = check["failures"].as_array().map_or(&[][..], Vec::as_slice);
        let failures: Vec<String> = failures.iter().map(text).collect();
        self.sentence = failures.join("; ");
        let worst = ["worst_error", "worst_normal", "worst_g1_angle"];
        self.point = worst.iter().find_map(|place| point(&check[place]["point"]));
        "raise target.faces, or see the figures with isospline check"
            .clone_into(&mut self.what_to_do);
    }

    fn take_error(&mut self, exit: i32, error: &Value) {
        self.outcome = if is_refusal(exit) { Outcome::Refused } else { Outcome::Failed };
        self.reason = text(&error["code"]);
        self.sentence = text(&error["message"]);
        self.what_to_do = text(&error["help"]);
        self.point = point(&error["place"]);
    }

    fn take_ending(&mut self, ending: Ending, stderr: &str) {
        let (reason, sentence, help) = match ending {
            Ending::Exit(code) => {
                let last = stderr.lines().rev().find(|line| !line.trim().is_empty());
                let told = last.unwrap_or("it said nothing").trim().to_owned();
                (BUG, format!("the run ended with exit code {code}: {told}"), "please report it")
            }
            Ending::Signal(signal) => {
                let signal =
                    signal.map_or_else(|| "a signal".to_owned(), |n| format!("signal {n}"));
                let help = "see whether memory was short, and run the batch again";
                ("killed", format!("{signal} ended the run"), help)
            }
            Ending::TimeLimit(seconds) => {
                let help = "raise --timeout, or ask for fewer faces";
                ("time-limit", format!("the run was ended after {seconds} s"), help)
            }
            Ending::NotStarted => {
                ("not-started", "the run was not started".to_owned(), "run the batch again")
            }
        };
        reason.clone_into(&mut self.reason);
        self.sentence = sentence;
        help.clone_into(&mut self.what_to_do);
    }
}

/// Code of the reason that is the program's own fault.
const BUG: &str = "bug";

/// Exit codes from 10 to 29 say what is wrong with the model.
fn is_refusal(exit: i32) -> bool {
    (10..30).contains(&exit)
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

fn point(value: &Value) -> Option<[f64; 3]> {
    serde_json::from_value(value.clone()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::PathBuf;

    fn record(ending: Ending, last: Option<&Value>, stderr: &str) -> Record {
        let model =
            BatchModel { name: "a.vm".into(), path: PathBuf::from("a.vm"), folder: "a".into() };
        Record::new(&model, "key".into(), ending, last, stderr)
    }

    #[test]
    fn a_refusal_lies_in_the_model_and_a_failure_elsewhere() {
        let error = |exit: i32, code: &str| {
            let place = [1.0, 2.0, 3.0];
            let line = json!({"event": "error", "exit": exit, "code": code, "message": "m",
                "help": "h", "place": place});
            record(Ending::Exit(exit), Some(&line), "")
        };
        let refused = error(22, "singular-point");
        assert_eq!(
            (refused.outcome, refused.reason.as_str()),
            (Outcome::Refused, "singular-point")
        );
        assert_eq!(refused.point, Some([1.0, 2.0, 3.0]));
        assert!(!refused.is_worth_another_try());
        let disk = error(33, "input-output");
        assert_eq!(disk.outcome, Outcome::Failed);
        assert!(disk.is_worth_another_try());
    }

    #[test]
    fn a_surface_that_does_not_pass_is_not_converted() {
        let line = |pass: bool| {
            json!({"event": "report", "report": {"topology": "certified", "check": {
                "pass": pass, "faces": 8, "components": 1, "genus": 0, "failures": ["too far"],
                "component_list": [{"faces": 8, "genus": 0, "volume": 2.5}],
                "worst_error": {"point": [0.0, 0.0, 1.0]}}}})
        };
        let converted = record(Ending::Exit(0), Some(&line(true)), "");
        assert_eq!((converted.outcome, converted.faces), (Outcome::Converted, Some(8)));
        assert_eq!(converted.parts[0].volume, Some(2.5));
        let failed = record(Ending::Exit(1), Some(&line(false)), "");
        assert_eq!((failed.outcome, failed.sentence.as_str()), (Outcome::NotPassed, "too far"));
        assert_eq!(failed.point, Some([0.0, 0.0, 1.0]));
    }

    #[test]
    fn a_run_that_says_nothing_is_told_by_how_it_ended() {
        assert_eq!(record(Ending::Signal(Some(9)), None, "").reason, "killed");
        assert_eq!(record(Ending::TimeLimit(5), None, "").reason, "time-limit");
        let bug = record(Ending::Exit(70), None, "first\nbug of isospline: oh\n\n");
        assert_eq!(bug.reason, "bug");
        assert!(bug.sentence.contains("bug of isospline: oh"), "{}", bug.sentence);
        assert!(!bug.is_worth_another_try());
    }

    #[test]
    fn a_record_is_read_back_as_it_was_written() {
        let line = json!({"event": "error", "exit": 23, "code": "leaves-box", "message": "a\n\"b\"",
            "help": null, "place": null});
        let record = record(Ending::Exit(23), Some(&line), "");
        let text = serde_json::to_string(&record).unwrap();
        assert_eq!(text.lines().count(), 1);
        assert_eq!(serde_json::from_str::<Record>(&text).unwrap(), record);
    }
}
