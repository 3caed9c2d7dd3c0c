//! Whether two pictures have the same expectation, and what would have been noticed.

use serde::{Deserialize, Deserializer, Serialize};

use super::evidence::Evidence;
use super::statistics::areas::AreaLayout;
use super::statistics::contrast::{Contrast, Contrasts, ROUNDING, Renderings, bonferroni, freedom};
use super::statistics::permutation;
use crate::image::compare::luminance;
use crate::image::{Grid, ImageError};

/// Tests that share the probability of a false alarm: the whole picture, all areas together, the largest area, the largest pixel.
const TESTS: f64 = 4.0;

/// A p value below this, corrected for the number of tests, is worth more renderings.
const SUSPICIOUS: f64 = 0.1;

/// Degrees of freedom that the mean variance of 5×5 pixels has beside that of the pixel itself.
const FREEDOM_OF_NEIGHBOURS: f64 = 4.0;

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
/// Four tests share the probability of a false alarm equally (Bonferroni), and within each all pixels, areas and channels are corrected
/// for:
///
/// | test | finds |
/// |---|---|
/// | brightness of the whole picture: red, green, blue, and a factor weighted by the precision of the areas | a light or an albedo that changed |
/// | mean square of the areas' differences in units of their errors | small changes in many places: a shifted camera or texture |
/// | largest difference of an area of 8×8 pixels | a change of a few objects |
/// | largest difference of a pixel | a pixel that stands out |
///
/// A pixel that is not finite in only one of the pictures is a change without any statistics.
///
/// The first three use the spread over renderings alone. Where both have areas, single renderings vary alike within a factor of 2, and there
/// are at least 800 ways of exchanging renderings, their p values are those of permutations; the tail beyond one of 200 is continued by
/// that of the normal or χ² distribution (`statistics/permutation.rs`). With fewer renderings, of different effort, or where one side has
/// only variances of pixels, Welch's t test and Bonferroni's correction are used, with variances that are rather too large.
///
/// For the whole picture as many exchanges are drawn as the level asks for, where there are enough. There are not for two sets of 8 renderings, or 6 and 16:
/// if their averages had a flatter distribution than the normal one, as few dimensions of quasi-Monte Carlo points might give, p values of
/// 1e-6 may be too small by a factor of 4 (uniform distribution) or 18 (arcsine distribution). Those of areas are continued from one of 200 in any
/// case: they are of thousands of averages over 64 pixels.
///
/// The test of pixels uses Welch's t with variances that are averaged with those of their neighbours, so that renderings that agree by
/// chance do not look exact.
///
/// # Errors
/// [`ImageError::Size`] for different sizes.
pub fn judge(now: &Evidence, reference: &Evidence, level: JudgementLevel) -> Result<Judgement, ImageError> {
    same_size(now, reference)?;
    let relative = level.relative;
    let (width, height) = (now.mean.width(), now.mean.height());
    let layout = AreaLayout::new(width, height);
    let used = comparable(now, reference);
    let mut contrasts = Contrasts::of(now, reference, &used);
    let mut found = contrasts.statistics(relative);
    let renderings = Renderings::of(now, reference)
        .filter(|all| contrasts.have_equal_effort([all.sides[0].len(), all.sides[1].len()]));
    let permuted = renderings.and_then(|all| permutation::p_values(&all, found, level.false_alarm / TESTS));
    let [whole, square, area] = permuted.unwrap_or_else(|| {
        contrasts = contrasts.clone().cautious();
        found = contrasts.statistics(relative);
        contrasts.p_values(found)
    });
    let each = level.false_alarm / TESTS;
    let powerless = contrasts.is_powerless(each);
    let mut tests = vec![
        JudgedTest {
            name: whole_name(now, reference, powerless),
            statistic: found.whole,
            p_value: whole,
            place: None,
        },
        JudgedTest {
            name: "mean square of the differences of all areas".to_owned(),
            statistic: found.square,
            p_value: square,
            place: None,
        },
        JudgedTest {
            name: "largest difference of an area of 8×8 pixels".to_owned(),
            statistic: found.area,
            p_value: area,
            place: contrasts.largest(relative).map(|column| layout.centre(column / 3)),
        },
        pixel_test(now, reference, &used, relative),
    ];
    let least = tests.iter().map(|test| test.p_value).fold(1.0, f64::min);
    let mut p_value = (TESTS * least).min(1.0);
    if let Some(test) = finite_test(now, reference) {
        p_value = p_value.min(test.p_value);
        tests.push(test);
    }
    let changed = p_value <= level.false_alarm;
    Ok(Judgement {
        changed,
        undecided: !changed && (p_value < SUSPICIOUS || powerless),
        p_value,
        tests,
        brightness: std::array::from_fn(|c| contrasts.whole.get(c).map_or([1.0, 0.0], ratio)),
        detectable: contrasts.detectable(each) + relative.max(ROUNDING),
        detectable_area: contrasts.detectable_area(each) + relative.max(ROUNDING),
    })
}

/// Name of the test of brightness, with what limits it.
fn whole_name(now: &Evidence, reference: &Evidence, powerless: bool) -> String {
    let mut name = "brightness of the whole picture".to_owned();
    for (side, evidence) in [("picture", now), ("reference", reference)] {
        if evidence.areas.len() < 2 {
            name += &format!(" (the noise of the {side} is not from several renderings)");
        }
    }
    if powerless {
        name += " (too few renderings: only large changes are found)";
    }
    name
}

/// Ratio of the means and its standard error; 1 where both are 0, and the largest number where only the reference is.
fn ratio(contrast: &Contrast) -> [f64; 2] {
    let [now, reference] = contrast.means;
    if now == reference {
        return [1.0, if reference == 0.0 { 0.0 } else { contrast.error() / reference.abs() }];
    }
    let relative = |value: f64| (value / reference.abs()).clamp(f64::MIN, f64::MAX);
    let error = contrast.error();
    [relative(now) * reference.signum(), if error == 0.0 { 0.0 } else { relative(error) }]
}

/// For which pixels means and variances of both are finite.
fn comparable(now: &Evidence, reference: &Evidence) -> Vec<bool> {
    let finite = |grid: &Grid<[f32; 3]>, i: usize| grid.pixels()[i].iter().all(|c| c.is_finite());
    let grids = [&now.mean, &now.variance, &reference.mean, &reference.variance];
    (0..now.mean.pixels().len()).map(|i| grids.iter().all(|grid| finite(grid, i))).collect()
}

/// The test of pixels that are not finite in only one of the pictures; `None` where all are finite in both.
fn finite_test(now: &Evidence, reference: &Evidence) -> Option<JudgedTest> {
    let finite = |rgb: &[f32; 3]| rgb.iter().all(|c| c.is_finite());
    let pairs = || now.mean.pixels().iter().zip(reference.mean.pixels()).map(|(a, b)| (finite(a), finite(b)));
    pairs().find(|(a, b)| !(a & b))?;
    let differing = pairs().filter(|(a, b)| a != b).count();
    Some(JudgedTest {
        name: "pixels that are not finite in only one of the pictures".to_owned(),
        statistic: differing as f64,
        p_value: if differing > 0 { 0.0 } else { 1.0 },
        place: pairs()
            .position(|(a, b)| a != b)
            .map(|i| [i % now.mean.width().max(1), i / now.mean.width().max(1)]),
    })
}

/// The test of the largest difference of a pixel and channel.
fn pixel_test(now: &Evidence, reference: &Evidence, used: &[bool], relative: f64) -> JudgedTest {
    let width = now.mean.width();
    let sides = [now, reference];
    let freedom = sides.map(freedom);
    let (mut largest, mut place) = (0.0, None);
    for i in (0..used.len()).filter(|&i| used[i]) {
        let around = sides.map(|side| neighbours(&side.variance, used, [i % width, i / width]));
        let score_of = |c: usize| {
            let variance = std::array::from_fn(|k| {
                let own = freedom[k] * f64::from(sides[k].variance.pixels()[i][c]);
                (own + FREEDOM_OF_NEIGHBOURS * around[k][c]) / (freedom[k] + FREEDOM_OF_NEIGHBOURS)
            });
            let means = sides.map(|side| f64::from(side.mean.pixels()[i][c]));
            Contrast { means, variance, freedom }.score(relative)
        };
        for score in (0..3).map(score_of) {
            if score > largest {
                (largest, place) = (score, Some([i % width, i / width]));
            }
        }
    }
    JudgedTest {
        name: "largest difference of a pixel".to_owned(),
        statistic: largest,
        p_value: bonferroni(largest, 3 * used.iter().filter(|used| **used).count()),
        place,
    }
}

/// Mean of the variances of the used ones of 5×5 pixels around one that is used.
fn neighbours(variance: &Grid<[f32; 3]>, used: &[bool], [x, y]: [usize; 2]) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for ny in y.saturating_sub(2)..(y + 3).min(variance.height()) {
        for nx in x.saturating_sub(2)..(x + 3).min(variance.width()) {
            if used[ny * variance.width() + nx] {
                let value = variance.at(nx, ny);
                sum = std::array::from_fn(|c| sum[c] + f64::from(value[c]));
                count += 1.0;
            }
        }
    }
    sum.map(|s| s / count)
}

/// Difference over its standard error by pixel, of luminance, positive where the picture is brighter than the reference: 0 where both are
/// equal within rounding, +∞ where only the picture is not finite, −∞ where only the reference is not, NaN where both are not or a variance is unknown.
///
/// The noise of red, green and blue is taken to be fully correlated, so that the error is rather too large.
///
/// # Errors
/// [`ImageError::Size`] for different sizes.
pub fn signed_z(now: &Evidence, reference: &Evidence) -> Result<Grid<f32>, ImageError> {
    same_size(now, reference)?;
    let error = |evidence: &Evidence, i: usize| luminance(evidence.variance.pixels()[i].map(f32::sqrt));
    let pixels = now.mean.pixels().iter().zip(reference.mean.pixels()).enumerate();
    let scores = pixels.map(|(i, (a, b))| {
        let finite = [a, b].map(|rgb| rgb.iter().all(|c| c.is_finite()));
        match finite {
            [true, true] => {}
            [false, true] => return f32::INFINITY,
            [true, false] => return f32::NEG_INFINITY,
            [false, false] => return f32::NAN,
        }
        let (a, b) = (luminance(*a), luminance(*b));
        let rounding = ROUNDING * a.abs().max(b.abs());
        if (a - b).abs() <= rounding {
            return 0.0;
        }
        let error = error(now, i).hypot(error(reference, i));
        // The rounding of exact values counts as their error.
        let error = if error < rounding { rounding } else { error };
        ((a - b) / error) as f32
    });
    let (width, height) = (now.mean.width(), now.mean.height());
    Grid::from_rows(width, height, scores.collect())
        .ok_or(ImageError::Size { a: (width, height), b: (width, height) })
}

/// Refuses pictures of different sizes.
fn same_size(now: &Evidence, reference: &Evidence) -> Result<(), ImageError> {
    let size = |evidence: &Evidence| (evidence.mean.width(), evidence.mean.height());
    let (a, b) = (size(now), size(reference));
    if a == b { Ok(()) } else { Err(ImageError::Size { a, b }) }
}

#[cfg(test)]
mod tests;
