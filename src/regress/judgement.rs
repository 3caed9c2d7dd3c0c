//! Whether two pictures have the same expectation, and what would have been noticed.

use serde::{Deserialize, Deserializer, Serialize};

use super::evidence::Evidence;
use crate::image::{Grid, ImageError};

/// The probability of a false alarm that a comparison may spend, and what counts as none.
#[derive(Clone, Copy, Debug)]
pub struct JudgementLevel {
    /// Probability that two pictures of the same expectation are called changed: that of the run over the number of cases and of looks.
    pub false_alarm: f64,
    /// Relative difference that counts as none.
    pub relative: f64,
}

/// The result of a comparison. Field names are JSON keys.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Judgement {
    /// A test rejected that both have the same expectation.
    pub changed: bool,
    /// More renderings could decide: something is unlikely, but not at the level.
    pub undecided: bool,
    /// Probability of a difference at least as large if nothing changed, corrected for the number of tests within the picture.
    #[serde(deserialize_with = "number")]
    pub p_value: f64,
    /// Every test that was made.
    pub tests: Vec<JudgedTest>,
    /// Brightness of the picture over that of the reference, by channel, and its standard error.
    #[serde(deserialize_with = "numbers")]
    pub brightness: [[f64; 2]; 3],
    /// Smallest relative change of brightness of the whole picture that would have been found with a probability of 90 %.
    #[serde(deserialize_with = "number")]
    pub detectable: f64,
    /// The same of one area (median over the areas).
    #[serde(deserialize_with = "number")]
    pub detectable_area: f64,
}

/// One statistical test of a comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JudgedTest {
    /// What was tested, in words.
    pub name: String,
    /// The statistic.
    #[serde(deserialize_with = "number")]
    pub statistic: f64,
    /// Its p value, corrected for the number of pixels or areas.
    #[serde(deserialize_with = "number")]
    pub p_value: f64,
    /// Pixel (column, row) of the largest difference, if it has one.
    pub place: Option<[usize; 2]>,
}

/// A number of a report: JSON has null for those that are not finite.
fn number<'de, D: Deserializer<'de>>(source: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(source)?.unwrap_or(f64::NAN))
}

/// The same of all channels.
fn numbers<'de, D: Deserializer<'de>>(source: D) -> Result<[[f64; 2]; 3], D::Error> {
    let all: [[Option<f64>; 2]; 3] = Deserialize::deserialize(source)?;
    Ok(all.map(|channel| channel.map(|value| value.unwrap_or(f64::NAN))))
}

/// Compares two pictures of the same scene.
///
/// # Errors
/// [`ImageError::Size`] for different sizes.
pub fn judge(
    _now: &Evidence,
    _reference: &Evidence,
    _level: JudgementLevel,
) -> Result<Judgement, ImageError> {
    unreachable!("written elsewhere")
}

/// Difference over its standard error by pixel, of luminance, positive where the picture is brighter than the reference.
///
/// # Errors
/// [`ImageError::Size`] for different sizes.
pub fn signed_z(_now: &Evidence, _reference: &Evidence) -> Result<Grid<f32>, ImageError> {
    unreachable!("written elsewhere")
}
