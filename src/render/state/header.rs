//! Header of a state.

use std::fmt;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use miette::Result;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::client::FilmCounts;
use crate::render::run_spec::RunSpec;
use crate::render::state::identity::Identity;
use crate::render::state::ranges::IndexRanges;
use crate::stream::{CHUNK, PathCounts, REPLICATES, Rejections};
use crate::study::{ErrorTarget, MonitorProgress};

/// Goal of a render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderGoal {
    /// Indices of the picture, or of this part of it. The end is `u64::MAX` if time or error decide.
    pub indices: Range<u64>,
    /// Limit of the rendering time.
    pub time: Option<Duration>,
    /// Error target.
    pub error: Option<ErrorTarget>,
}

/// Position of a part among all parts of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Number of the part, from 1 on. Above `of`, the part extends the sequence beyond the divided picture.
    pub number: u64,
    /// Number of parts.
    pub of: u64,
}

impl Share {
    /// Indices of this part of a picture: whole chunks, except at the end of the picture. Parts beyond it have the size of the largest one.
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

/// Everything in a state except its sums. Field names are JSON keys.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StateHeader {
    /// Name and version of the program that wrote it.
    pub program: String,
    /// The settings.
    pub run: RunSpec,
    /// Identification of scene and samples.
    pub identity: Identity,
    /// Indices of the whole picture.
    pub picture: Range<u64>,
    /// Goal of this render, and the part of the picture, if it is one.
    pub goal: RenderGoal,
    pub share: Option<Share>,
    /// Indices included in the sums.
    pub indices: IndexRanges,
    /// Samples and paths in the sums of the film.
    pub counts: FilmCounts,
    /// Paths in the sums of each replicate.
    pub replicates: [PathCounts; REPLICATES],
    /// Rejected values.
    pub rejections: Rejections,
    /// Rendering time in seconds, summed over all parts.
    pub seconds: f64,
    /// Error so far, which decides about the end of the render.
    pub progress: MonitorProgress,
    /// The right eye, if there are two; counts and error above are then those of the left one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub right_eye: Option<EyeHeader>,
}

/// What a state says of the right eye's picture alone: its paths are those of the left one's.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct EyeHeader {
    /// Samples and paths in the sums of its film.
    pub counts: FilmCounts,
    /// Its error so far.
    pub progress: MonitorProgress,
}

impl StateHeader {
    /// The header of a state with nothing in its sums.
    pub fn empty(run: RunSpec, identity: Identity, picture: Range<u64>, goal: RenderGoal) -> Self {
        let right_eye = run.stereo.map(|_| EyeHeader::default());
        Self {
            program: format!("pointillist {}", env!("CARGO_PKG_VERSION")),
            run,
            identity,
            picture,
            goal,
            share: None,
            indices: IndexRanges::default(),
            counts: FilmCounts::default(),
            replicates: Default::default(),
            rejections: Rejections::default(),
            seconds: 0.0,
            progress: MonitorProgress::default(),
            right_eye,
        }
    }

    /// Whether every index of the goal is included in the sums.
    pub fn is_complete(&self) -> bool {
        self.indices.missing(self.goal.indices.clone()).count() == 0
    }

    /// Samples per pixel in the sums.
    pub fn samples_per_pixel(&self) -> f64 {
        let texels: f64 = self.run.film.padded_extent().map(f64::from).iter().product();
        self.counts.paths() as f64 / texels
    }

    /// Describes why `other` belongs to another picture, naming both values; `None` if they are parts of one picture.
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

    /// Returns an error if a state does not belong to the requested render.
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

/// The first setting that affects sums and differs.
fn first_difference(a: &RunSpec, b: &RunSpec) -> Option<(String, String, String)> {
    // Settings that affect no sample.
    const FREE: [&str; 6] = ["scene", "spp", "first_index", "device", "auto", "aovs"];
    let [Value::Object(a), Value::Object(b)] =
        [a, b].map(|run| serde_json::to_value(run).unwrap_or_default())
    else {
        return None;
    };
    let of = |run: &Map<String, Value>, key: &str| run.get(key).cloned().unwrap_or_default();
    let differs = |key: &&String| !FREE.contains(&key.as_str()) && of(&a, key) != of(&b, key);
    let key = a.keys().chain(b.keys()).find(differs)?;
    Some((key.clone(), of(&a, key).to_string(), of(&b, key).to_string()))
}
