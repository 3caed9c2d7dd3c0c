//! Rejected values: counted by cause and origin, with examples that can be traced again.
//!
//! A value that is not a number, or infinite, or negative, or too large for sums over a picture is a defect. It must neither spoil the
//! picture nor pass unseen: what is wrong by itself is left out, and counted with what it takes to repeat it.

use std::collections::BTreeMap;

use super::sample::MAX_VALUE;
use crate::color::Xyz;

/// Why a value is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum Cause {
    /// It is not a number.
    NotANumber,
    /// It is infinite.
    Infinite,
    /// A colour is negative, or a weight is not above 0, which would mean the light stream.
    NotPositive,
    /// It exceeds [`MAX_VALUE`], so that sums might overflow.
    TooLarge,
    /// A position lies outside the window that samples must cover.
    OutsideWindow,
}

impl Cause {
    /// All causes.
    pub const ALL: [Cause; 5] =
        [Cause::NotANumber, Cause::Infinite, Cause::NotPositive, Cause::TooLarge, Cause::OutsideWindow];

    /// The worst cause among these values; `None` if all are finite.
    pub fn of(values: &[f32]) -> Option<Self> {
        match values {
            v if v.iter().any(|x| x.is_nan()) => Some(Cause::NotANumber),
            v if v.iter().any(|x| x.is_infinite()) => Some(Cause::Infinite),
            _ => None,
        }
    }

    /// A short description for reports.
    pub fn describe(self) -> &'static str {
        match self {
            Cause::NotANumber => "not a number",
            Cause::Infinite => "infinite",
            Cause::NotPositive => "not positive",
            Cause::TooLarge => "too large",
            Cause::OutsideWindow => "outside the window",
        }
    }
}

/// The value that was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub enum FaultyValue {
    /// The position of a sample: all of the sample is lost.
    Position,
    /// The weight of a sample: all of it is lost.
    Weight,
    /// The colour of a sample: all of it is lost.
    Color,
    /// The contribution of a light sample at a vertex.
    LightSample,
    /// The contribution of a light that was hit.
    Emission,
    /// The initial throughput of a light path: the path is lost.
    LightPath,
    /// The throughput behind a vertex: the path ends there.
    Scattering,
    /// The contribution of a light path vertex to the camera.
    CameraConnection,
    /// The contribution of a connection of a camera subpath and a light subpath.
    Connection,
    /// The flux of a photon.
    Photon,
    /// The contribution of a photon at a vertex.
    Gathering,
}

impl FaultyValue {
    /// True for what the sink finds, which is a whole sample; anything else is one contribution to a sample.
    pub fn is_sample(self) -> bool {
        matches!(self, FaultyValue::Position | FaultyValue::Weight | FaultyValue::Color)
    }

    /// A short description for reports.
    pub fn describe(self) -> &'static str {
        match self {
            FaultyValue::Position => "position",
            FaultyValue::Weight => "weight",
            FaultyValue::Color => "color",
            FaultyValue::LightSample => "light sample",
            FaultyValue::Emission => "emission",
            FaultyValue::LightPath => "light path",
            FaultyValue::Scattering => "scattering",
            FaultyValue::CameraConnection => "connection to the camera",
            FaultyValue::Connection => "connection",
            FaultyValue::Photon => "photon",
            FaultyValue::Gathering => "gathering of photons",
        }
    }
}

/// Why a sample of this colour, times its weight, and this weight does not belong to the stream: the part that is wrong, and how.
pub fn fault_of_sample(uv: [f32; 2], color: Xyz, weight: f32) -> Option<(FaultyValue, Cause)> {
    let color = [color.x, color.y, color.z];
    let [position, weighed, colored] = [&uv[..], &[weight], &color].map(Cause::of);
    let too_large = |values: &[f32]| values.iter().any(|v| *v > MAX_VALUE).then_some(Cause::TooLarge);
    let negative = || color.iter().any(|v| *v < 0.0).then_some(Cause::NotPositive);
    let weighed = weighed.or((weight <= 0.0).then_some(Cause::NotPositive)).or_else(|| too_large(&[weight]));
    let colored = colored.or_else(negative).or_else(|| too_large(&color));
    let parts =
        [(FaultyValue::Position, position), (FaultyValue::Weight, weighed), (FaultyValue::Color, colored)];
    parts.into_iter().find_map(|(part, cause)| Some((part, cause?)))
}

/// A value that was rejected: what is wrong with it, and where it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct Fault {
    /// Why it was rejected.
    pub cause: Cause,
    /// The value.
    pub part: FaultyValue,
    /// Index of the surface where it was found.
    pub surface: Option<u32>,
    /// Index of the light that it came from.
    pub light: Option<u32>,
}

/// A rejected value, and what it takes to repeat it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct Rejected {
    /// Index of the path.
    pub index: u64,
    /// The fault.
    pub fault: Fault,
    /// Number of the light path of photon mapping that it was found in, if it was one; those are made beside the path of the index.
    pub light_path: Option<u64>,
    /// Number of generations of the photons that the path has seen, if any.
    pub generations: Option<u64>,
}

/// Most examples that are kept.
pub const EXAMPLES: usize = 100;

/// Most faults that are counted apart; beyond, surfaces and lights are left away.
const APART: usize = 4096;

/// Counts of rejected values by fault, and the first of them by path index.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(from = "RejectionList", into = "RejectionList")]
pub struct Rejections {
    counts: BTreeMap<Fault, u64>,
    /// Ascending.
    examples: Vec<Rejected>,
}

/// The same as lists, for files.
#[derive(serde::Serialize, serde::Deserialize)]
struct RejectionList {
    counts: Vec<(Fault, u64)>,
    examples: Vec<Rejected>,
}

impl From<Rejections> for RejectionList {
    fn from(Rejections { counts, examples }: Rejections) -> Self {
        Self { counts: counts.into_iter().collect(), examples }
    }
}

impl From<RejectionList> for Rejections {
    fn from(list: RejectionList) -> Self {
        let mut rejections = Self::default();
        list.counts.into_iter().for_each(|(fault, count)| rejections.count_more(fault, count));
        list.examples.into_iter().for_each(|example| rejections.keep(example));
        rejections
    }
}

impl Rejections {
    /// Counts one rejected value.
    #[cold]
    pub fn add(&mut self, rejected: Rejected) {
        self.count_more(rejected.fault, 1);
        self.keep(rejected);
    }

    /// Adds the counts of `other` and keeps the smallest indices of both. The result does not depend on the order of merging,
    /// and so not on threads.
    pub fn merge(&mut self, other: &Rejections) {
        other.counts.iter().for_each(|(&fault, &count)| self.count_more(fault, count));
        other.examples.iter().for_each(|&example| self.keep(example));
    }

    /// The same counts, without examples.
    pub fn without_examples(self) -> Self {
        Self { examples: Vec::new(), ..self }
    }

    /// Number of values that were rejected for one cause.
    pub fn count(&self, cause: Cause) -> u64 {
        self.sum(|fault| fault.cause == cause)
    }

    /// Number of whole samples that were rejected.
    pub fn samples(&self) -> u64 {
        self.sum(|fault| fault.part.is_sample())
    }

    /// Number of rejected values: samples, and contributions to samples.
    pub fn total(&self) -> u64 {
        self.sum(|_| true)
    }

    /// Counts by fault.
    pub fn faults(&self) -> impl Iterator<Item = (&Fault, u64)> {
        self.counts.iter().map(|(fault, count)| (fault, *count))
    }

    /// Those with the smallest path indices, ascending, at most [`EXAMPLES`].
    pub fn examples(&self) -> &[Rejected] {
        &self.examples
    }

    fn sum(&self, of: impl Fn(&Fault) -> bool) -> u64 {
        self.faults().filter(|(fault, _)| of(fault)).fold(0, |sum, (_, count)| sum.saturating_add(count))
    }

    fn count_more(&mut self, fault: Fault, count: u64) {
        let apart = self.counts.len() < APART || self.counts.contains_key(&fault);
        let fault = if apart { fault } else { Fault { surface: None, light: None, ..fault } };
        let sum = self.counts.entry(fault).or_default();
        *sum = sum.saturating_add(count);
    }

    fn keep(&mut self, example: Rejected) {
        if let Err(at) = self.examples.binary_search(&example)
            && at < EXAMPLES
        {
            self.examples.insert(at, example);
            self.examples.truncate(EXAMPLES);
        }
    }
}
