//! The result of a run: what all reports are made of.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::case_times::CaseTimes;
use super::judgement::Judgement;
use super::timing::{CaseTiming, TimingVerdict};

/// A whole run. Field names are JSON keys.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunReport {
    /// Version of this program.
    pub version: String,
    /// The folder that was tested.
    pub folder: PathBuf,
    /// When it began: RFC 3339, UTC.
    pub started: String,
    /// Wall clock of the run.
    pub seconds: f64,
    /// Probability that a run without any change reports one.
    pub false_alarm: f64,
    /// Per cent by which no time of a case may be certainly longer than with another program; `None` if times make no case red.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fail_on_slower: Option<f64>,
    /// In the order of the manifest.
    pub cases: Vec<CaseReport>,
}

/// One case. Field names are JSON keys.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CaseReport {
    /// Name of the case.
    pub name: String,
    /// The scene file, relative to the folder of the run.
    pub scene: PathBuf,
    /// Method that was asked for, or what the renderer is called.
    pub method: String,
    /// Device that rendered it, and its driver, as the program states them.
    pub device: String,
    /// The command of the first rendering, so that it can be repeated.
    pub command: Vec<String>,
    /// The outcome.
    pub verdict: CaseVerdict,
    /// One sentence about the outcome: why it is broken, what changed, or what would have been noticed.
    pub sentence: String,
    /// The statistics; `None` where nothing was compared.
    pub judgement: Option<Judgement>,
    /// Class of tolerance.
    pub tolerance: String,
    /// Renderings and the samples per pixel of each.
    pub renderings: u32,
    /// Samples per pixel of one rendering.
    pub spp: u64,
    /// Wall clock of all renderings of the case.
    pub seconds: f64,
    /// Evidence of this run, an EXR file in the folder of the results; `None` if there is none.
    pub picture: Option<PathBuf>,
    /// What it was compared with.
    pub reference: Option<PathBuf>,
    /// Standard error of its renderings.
    pub log: Option<PathBuf>,
    /// Times of its renderings; `None` if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<CaseTimes>,
    /// How its times compare with those of another program, if that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<CaseTiming>,
}

/// Outcome of a case, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaseVerdict {
    /// Every bit is that of the reference.
    SameBits,
    /// No difference that noise does not explain.
    EqualWithinNoise,
    /// A difference that noise does not explain.
    Changed,
    /// It could not be rendered or compared.
    Broken,
}

impl CaseVerdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::SameBits => "same bits",
            Self::EqualWithinNoise => "equal within noise",
            Self::Changed => "changed",
            Self::Broken => "broken",
        }
    }
}

impl RunReport {
    /// 0 if nothing changed, 1 if something did, 2 if a case is broken. With [`fail_on_slower`](Self::fail_on_slower) also 1 if a case is
    /// slower, and 2 if one could not be timed.
    pub fn exit_code(&self) -> u8 {
        let code = |case: &CaseReport| match (case.verdict, self.time_failure(case)) {
            (CaseVerdict::Broken, _) | (_, Some(TimingVerdict::Untimed)) => 2,
            (CaseVerdict::Changed, _) | (_, Some(_)) => 1,
            _ => 0,
        };
        self.cases.iter().map(code).max().unwrap_or(0)
    }

    /// Why its times make a case red: [`TimingVerdict::Slower`] or [`TimingVerdict::Untimed`].
    pub fn time_failure(&self, case: &CaseReport) -> Option<TimingVerdict> {
        let (percent, timing) = self.fail_on_slower.zip(case.timing.as_ref())?;
        match timing.verdict {
            TimingVerdict::Untimed => Some(TimingVerdict::Untimed),
            _ => timing.is_slower_by(percent / 100.0).then_some(TimingVerdict::Slower),
        }
    }
}
