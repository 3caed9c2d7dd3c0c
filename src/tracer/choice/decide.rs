//! The decision: least variance × cost, with two safeguards.
//!
//! The estimate of a method's error at equal time is the mean over the picture of its relative variance per path (relMSE:
//! variance / (Y² + floor²)), times the cost of a path. Methods that trace from both ends gain more from stratified numbers than others,
//! which trials lack: a factor. The estimate is too low where a method has not found all light, so
//!
//! - particle tracing is excluded where the picture shows a delta, which it never finds, and path tracing where light leaves along
//!   normals only;
//! - where a method's mean in a part of the picture is significantly below another's, it is charged for what it has missed:
//!   paths that bring a mean of Δ and of which none was among n have a second moment of at least n Δ². Bidirectional tracing with
//!   merging traces the paths of bidirectional tracing alone, so that any difference of these two is what merging finds.

use crate::scene::desc::{IntegratorKind, IntegratorTraits, PhotonUse};

use super::survey::{DELTAS, Survey};
use super::trial::{CELLS, SIDE, Trial};

/// Number of blocks along either side of the picture in which means are compared.
const BLOCKS: usize = 4;

/// Number of standard errors from which a difference of means counts.
const SIGNIFICANT: f64 = 4.0;

/// Luminance below which errors count as absolute, as a share of the picture's mean.
const FLOOR: f64 = 0.1;

/// Factor on the variance of methods that trace paths from both ends. Trials draw their numbers independently. In pictures, whose numbers
/// are stratified, the ratio of bidirectional tracing's time to path tracing's is .78 of what trials find: the median of ten scenes in
/// which trials find it between .5 and 3.5, of 20 scenes, at 24 samples per pixel.
const STRATIFIED: f64 = 0.8;

/// Methods that are within this factor of the best are compared by longer trials.
const CLOSE: f64 = 3.0;

/// Factor by which photon mapping must beat the best of the others: its samples share one map, so that noise falls more slowly
/// than a trial can tell, and they blur.
const PHOTONS_WORTH: f64 = 12.0;

/// The reason mentions light that a method missed from this share on.
const WORTH_TELLING: f64 = 0.02;

/// The judgement of one method.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegratorRating {
    /// The method.
    pub kind: IntegratorKind,
    /// The method can show all of the picture.
    pub complete: bool,
    /// Relative variance per path, including the charge for missed light.
    pub variance: f64,
    /// Share of the light that the method has missed, where that is significant.
    pub missed: f64,
    /// Cost of one path, in units of beginning one.
    pub cost: f64,
    /// Mean luminance of the picture.
    pub mean: f64,
}

impl IntegratorRating {
    /// Time to a given error, relative; infinite where the method cannot reach it.
    pub fn time(&self) -> f64 {
        if self.complete { self.variance * self.cost } else { f64::INFINITY }
    }

    /// The same, on the safe side for photon mapping.
    fn cautious_time(&self) -> f64 {
        if shares_one_map(self.kind) { PHOTONS_WORTH * self.time() } else { self.time() }
    }
}

/// A method, and why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegratorChoice {
    /// The method; never [`IntegratorKind::Auto`].
    pub kind: IntegratorKind,
    /// One sentence without its end.
    pub reason: String,
    /// The judgement of every method that was tried.
    pub ratings: Vec<IntegratorRating>,
}

impl IntegratorChoice {
    /// The methods among which a longer trial is to decide: those that are close to the best but for photon mapping, if there are several.
    pub(super) fn close(&self) -> Vec<IntegratorKind> {
        let rated = self.ratings.iter().filter(|rating| rating.complete && !shares_one_map(rating.kind));
        let best = rated.clone().map(IntegratorRating::time).fold(f64::INFINITY, f64::min);
        // Where merging gains nothing, bidirectional tracing stands for it.
        let gains = |rating: &IntegratorRating| {
            let extended = self.ratings.iter().find(|other| rating.kind.traits().extends == Some(other.kind));
            extended.is_none_or(|extended| rating.time() < extended.time())
        };
        let is_close =
            |rating: &&IntegratorRating| best > 0.0 && rating.time() <= CLOSE * best && gains(rating);
        let close: Vec<_> = rated.filter(is_close).map(|rating| rating.kind).collect();
        if close.len() > 1 { close } else { Vec::new() }
    }
}

/// Chooses one of the methods that were tried.
pub(super) fn decide(survey: &Survey, trials: &[Trial]) -> IntegratorChoice {
    let complete = |t: &Trial| {
        let IntegratorTraits { finds_deltas, finds_beams, finds_emissive_media, .. } = t.kind.traits();
        (*finds_deltas || survey.delta_seen <= DELTAS)
            && (*finds_beams || !survey.beams)
            && (*finds_emissive_media || !survey.emissive_media)
    };
    let brightness = brightness(trials.iter().filter(|t| complete(t)));
    let mean = brightness.iter().sum::<f64>() / CELLS as f64;
    let floor = (FLOOR * mean).powi(2);
    let ratings: Vec<IntegratorRating> = trials
        .iter()
        .map(|trial| {
            let (grid, noise) = (&trial.grid, trial.noise());
            let scattered = |cell: usize| noise.variance(cell) / (brightness[cell].powi(2) + floor);
            let variance =
                if mean > 0.0 { (0..CELLS).map(scattered).sum::<f64>() / CELLS as f64 } else { 0.0 };
            let mean = (0..CELLS).map(|cell| grid.mean(cell)).sum::<f64>() / CELLS as f64;
            let Trial { kind, cost, .. } = *trial;
            let complete = complete(trial);
            let has_both = kind.traits().paths_per_index.iter().all(|paths| *paths > 0);
            let variance = if has_both { STRATIFIED * variance } else { variance };
            let mut rating = IntegratorRating { kind, complete, variance, missed: 0.0, cost, mean };
            charge(&mut rating, trial, trials, &brightness, floor);
            rating
        })
        .collect();
    let complete = ratings.iter().filter(|rating| rating.complete);
    let best = complete.min_by(|a, b| a.cautious_time().total_cmp(&b.cautious_time()));
    let kind = best.map_or(IntegratorKind::Path, |best| best.kind);
    let reason = reason(kind, survey, &ratings);
    IntegratorChoice { kind, reason, ratings }
}

/// True for photon mapping, all samples of which share one map.
fn shares_one_map(kind: IntegratorKind) -> bool {
    kind.traits().photons == PhotonUse::Gathered
}

/// Luminance of each cell by all methods that can show it (`complete`), smoothed, since single cells are noisy. Photon mapping is left out:
/// all samples of its trial share one map, whose blotches no number of samples averages.
fn brightness<'a>(complete: impl Iterator<Item = &'a Trial>) -> Vec<f64> {
    let used: Vec<&Trial> = complete.filter(|t| !shares_one_map(t.kind)).collect();
    let raw: Vec<f64> = (0..CELLS)
        .map(|cell| used.iter().map(|t| t.grid.mean(cell)).sum::<f64>() / used.len().max(1) as f64)
        .collect();
    let near = |i: usize| i.saturating_sub(1)..=(i + 1).min(SIDE - 1);
    (0..CELLS)
        .map(|cell| {
            let (x, y) = (cell % SIDE, cell / SIDE);
            let around = near(y).flat_map(|y| near(x).map(move |x| y * SIDE + x));
            let (sum, n) = around.fold((0.0, 0.0), |(sum, n), cell| (sum + raw[cell], n + 1.0));
            sum / n
        })
        .collect()
}

/// Number of cells along either side of a block.
const WIDTH: usize = SIDE / BLOCKS;

/// The cells of a block, row by row.
fn cells_of(block: usize) -> impl Iterator<Item = usize> {
    let (left, top) = (block % BLOCKS * WIDTH, block / BLOCKS * WIDTH);
    (0..WIDTH * WIDTH).map(move |i| (top + i / WIDTH) * SIDE + left + i % WIDTH)
}

/// The mean of a block and its variance.
fn mean_of(trial: &Trial, block: usize) -> (f64, f64) {
    let n = (WIDTH * WIDTH) as f64;
    let (mean, variance) = cells_of(block).fold((0.0, 0.0), |(mean, variance), cell| {
        (mean + trial.grid.mean(cell), variance + trial.grid.variance_of_mean(cell))
    });
    // `paths` per unit of picture, n / CELLS of the picture.
    (mean / n, variance / n / (trial.paths as f64 * n / CELLS as f64))
}

/// Charges a method for light that another one, photon mapping excepted, has found and it has not.
fn charge(rating: &mut IntegratorRating, trial: &Trial, others: &[Trial], brightness: &[f64], floor: f64) {
    const COUNT: f64 = (BLOCKS * BLOCKS) as f64;
    let mut missed = 0.0;
    for block in 0..BLOCKS * BLOCKS {
        let (mean, variance) = mean_of(trial, block);
        let gap = |other: &Trial| {
            let (more, v) = mean_of(other, block);
            let gap = more - mean;
            let same_paths = other.kind.traits().extends == Some(trial.kind);
            let counts = same_paths || gap > SIGNIFICANT * (v + variance).sqrt();
            if counts { gap } else { 0.0 }
        };
        let others = others.iter().filter(|o| o.kind != trial.kind && !shares_one_map(o.kind));
        let gap = others.map(gap).fold(0.0, f64::max);
        if gap > 0.0 {
            let y = cells_of(block).map(|cell| brightness[cell]).sum::<f64>() / (WIDTH * WIDTH) as f64;
            let paths = trial.paths as f64 / COUNT;
            rating.variance += paths * gap * gap / (y * y + floor) / COUNT;
            missed += gap / COUNT;
        }
    }
    let mean = brightness.iter().sum::<f64>() / CELLS as f64;
    rating.missed = if mean > 0.0 { missed / mean } else { 0.0 };
}

/// The reason of a choice, for people: one sentence without its end.
fn reason(kind: IntegratorKind, survey: &Survey, ratings: &[IntegratorRating]) -> String {
    let of = |kind: IntegratorKind| ratings.iter().find(|r| r.kind == kind);
    let (Some(path), Some(chosen)) = (of(IntegratorKind::Path), of(kind)) else {
        return "nothing else was tried".to_string();
    };
    if survey.lights == 0 || ratings.iter().all(|r| r.mean <= 0.0) {
        return "no light was found, so every method shows the same".to_string();
    }
    let mut parts = Vec::new();
    // The brightest: the others may have missed some.
    let all = ratings.iter().filter(|r| r.complete).map(|r| r.mean).fold(0.0, f64::max);
    let indirect = (1.0 - survey.direct / all).clamp(0.0, 1.0);
    parts.push(match kind == IntegratorKind::Path && indirect < 0.5 {
        true => format!("{} of what is seen arrives with one bounce or none", percent(1.0 - indirect)),
        false => format!("{} of what is seen arrives over 2 or more bounces", percent(indirect)),
    });
    if path.missed >= WORTH_TELLING && kind != IntegratorKind::Path {
        parts.push(format!("trial paths from the camera missed {} of the light", percent(path.missed)));
    }
    let mut rivals: Vec<&IntegratorRating> =
        ratings.iter().filter(|r| r.kind != kind && r.complete).collect();
    rivals.sort_by(|a, b| a.time().total_cmp(&b.time()));
    for rival in rivals {
        parts.push(compare(rival, rival.time() / chosen.time()));
    }
    if survey.beams {
        parts.push("paths from the camera alone do not find light that leaves along normals".to_string());
    }
    if survey.emissive_media {
        parts.push("particles alone do not find light that media emit".to_string());
    }
    if survey.delta_seen > DELTAS && ratings.iter().any(|r| !r.complete && !r.kind.traits().finds_deltas) {
        let seen = percent(survey.delta_seen);
        parts.push(format!("particles alone cannot show mirrors and glass ({seen} of the picture)"));
    }
    parts.join("; ")
}

/// Compares a rival with the chosen method, over whose time its own is `ratio`.
fn compare(rival: &IntegratorRating, ratio: f64) -> String {
    let name = rival.kind.traits().traces;
    match ratio {
        r if !r.is_finite() || r > 1000.0 => format!("{name} need over 1000 times as long"),
        r if r >= 10.0 => format!("{name} need {r:.0} times as long"),
        r if r >= 1.05 => format!("{name} need {r:.1} times as long"),
        r if r >= 0.95 => format!("{name} need as long"),
        r => format!(
            "{name} would be {:.1} times as fast by the trial, which does not see how they blur",
            1.0 / r
        ),
    }
}

fn percent(share: f64) -> String {
    match share * 100.0 {
        p if p > 0.0 && p < 1.0 => "under 1 %".to_string(),
        p if p < 100.0 && p > 99.0 => "over 99 %".to_string(),
        p => format!("{p:.0} %"),
    }
}
