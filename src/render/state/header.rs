//! What a state says of itself.

use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use miette::Result;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::client::FilmCounts;
use crate::render::run_spec::RunSpec;
use crate::render::state::identity::Identity;
use crate::render::state::ranges::IndexRanges;
use crate::stream::{CHUNK, PathCounts, REPLICATES, Rejections};
use crate::study::{ErrorTarget, MonitorProgress};

/// Until when a render goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderGoal {
    /// Its indices: those of the picture, or of this part of it. The end is `u64::MAX` where time or error decide.
    pub indices: Range<u64>,
    /// Rendering time.
    pub time: Option<Duration>,
    /// The error that is good enough.
    pub error: Option<ErrorTarget>,
}

/// The place of a part of a picture among all parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Number of the part, from 1 on. Above `of` it goes on beyond the picture that was divided.
    pub number: u64,
    /// Number of parts.
    pub of: u64,
}

impl Share {
    /// The indices of this part of a picture: whole chunks, but for the end of the picture. Parts beyond have the size of the largest before.
    pub fn indices(self, picture: &Range<u64>) -> Range<u64> {
        let (length, of, chunk) =
            (u128::from(picture.end - picture.start), u128::from(self.of.max(1)), u128::from(CHUNK));
        let cut = |number: u64| {
            let number = u128::from(number);
            let cut = match number.checked_sub(of) {
                Some(beyond) => length + beyond * length.div_ceil(of).next_multiple_of(chunk),
                None => length * number / of / chunk * chunk,
            };
            picture.start.saturating_add(u64::try_from(cut).unwrap_or(u64::MAX))
        };
        cut(self.number.saturating_sub(1))..cut(self.number)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "part {} of {}", self.number, self.of)
    }
}

/// Everything in a state but its sums. The names of the fields are the keys of its JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StateHeader {
    /// The program that wrote it.
    pub program: String,
    /// The settings.
    pub run: RunSpec,
    /// Scene and samples.
    pub identity: Identity,
    /// The indices of the whole picture.
    pub picture: Range<u64>,
    /// What this render is to do, and the part of the picture that it is, if it is one.
    pub goal: RenderGoal,
    pub share: Option<Share>,
    /// The indices in the sums.
    pub indices: IndexRanges,
    /// Samples and paths in the sums of the film.
    pub counts: FilmCounts,
    /// Paths in the sums of each replicate.
    pub replicates: [PathCounts; REPLICATES],
    /// What was rejected.
    pub rejections: Rejections,
    /// Seconds of rendering, over all parts.
    pub seconds: f64,
    /// The error so far, by which the end of the render is decided.
    pub progress: MonitorProgress,
}

impl StateHeader {
    /// True if every index of the goal is in the sums.
    pub fn is_complete(&self) -> bool {
        self.indices.missing(self.goal.indices.clone()).count() == 0
    }

    /// Samples per pixel in the sums.
    pub fn samples_per_pixel(&self) -> f64 {
        let texels: f64 = self.run.film.padded_extent().map(f64::from).iter().product();
        self.counts.paths() as f64 / texels
    }

    /// How the picture of `other` is another one than this, in words that name both; `None` where they are parts of one picture.
    pub fn difference(&self, other: &Self) -> Option<String> {
        if self.identity.scene != other.identity.scene {
            return Some("the files of the scene differ".to_string());
        }
        if let Some((key, a, b)) = first_difference(&self.run, &other.run) {
            return Some(format!("{key} is {b} instead of {a}"));
        }
        (self.identity != other.identity).then(|| {
            format!(
                "its samples differ although scene and settings do not ({} and {}): another build, another processor or another \
                 library of mathematical functions",
                self.program, other.program
            )
        })
    }

    /// The error of a state that is not the render that was asked for.
    pub fn check_same(&self, other: &Self, file: &Path) -> Result<()> {
        match self.difference(other) {
            None => Ok(()),
            Some(how) => Err(miette::miette!(
                help = "give the scene and the options with which it was begun, or another name for the file",
                "{} is the state of another picture: {how}",
                file.display()
            )),
        }
    }
}

/// The first setting that decides sums and differs.
fn first_difference(a: &RunSpec, b: &RunSpec) -> Option<(String, String, String)> {
    // Where the scene lies and what was asked for decide no sample.
    const FREE: [&str; 6] = ["scene", "spp", "first_index", "device", "auto", "aovs"];
    let [Value::Object(a), Value::Object(b)] =
        [a, b].map(|run| serde_json::to_value(run).unwrap_or_default())
    else {
        return None;
    };
    let differs = |(key, value): &(String, Value)| {
        !FREE.contains(&key.as_str()) && b.get(key).unwrap_or(&Value::Null) != value
    };
    let (key, value) = a.into_iter().find(differs)?;
    let other = b.get(&key).cloned().unwrap_or_default();
    Some((key, value.to_string(), other.to_string()))
}
