//! The pictures of a case for the page: displayed, and the maps of their difference.
//!
//! Cases that a reader has to look at are shown in full, and all others small, so that a page of 100 cases stays one that a browser opens
//! at once.

use std::path::{Path, PathBuf};

use super::wording;
use crate::client::{Settings, develop};
use crate::color::palette;
use crate::image::compare::{PIXELS_PER_DEGREE, flip, worst};
use crate::image::{Grid, ImageError, data_uri};
use crate::regress::evidence::Evidence;
use crate::regress::judgement::signed_z;
use crate::regress::run_report::{CaseReport, CaseVerdict};

/// Longest side of a picture of a case that is changed, broken or undecided, in pixels.
const SIDE: usize = 512;
/// Longest side of a picture of any other case.
const GREEN: usize = 192;
/// JPEG quality, with chroma at full resolution: what differs is in the maps, which are made of the pictures themselves.
const QUALITY: u8 = 85;
/// Steps of a FLIP map from 0 to 1.
const FLIP_STEPS: f32 = 32.0;
/// Longest side in the table of cases.
const SMALL: usize = 96;

/// Magnitude of z that has the strongest colour.
pub const STRONGEST_Z: f32 = 6.0;

/// What a page shows of a case, as data URIs; what cannot be shown is `None`, with the reason in `problems`.
#[derive(Debug, Default)]
pub struct CasePictures {
    /// The picture of this run.
    pub picture: Option<String>,
    /// The same, small.
    pub thumbnail: Option<String>,
    /// The reference; left out where it has the same bits.
    pub reference: Option<String>,
    /// Map of FLIP between both as displayed, and its mean.
    pub flip: Option<(String, f64)>,
    /// Map of the signed z values, and the one of largest magnitude with its pixel.
    pub z: Option<SignedZMap>,
    /// Each pixel of a picture shown stands for so many in each direction; 0 without a picture.
    pub step: usize,
    /// Why something is not shown, in sentences.
    pub problems: Vec<String>,
}

/// Map of signed z values.
#[derive(Debug)]
pub struct SignedZMap {
    /// The map.
    pub uri: String,
    /// The value of largest magnitude and its pixel (column, row); `None` if nothing differs.
    pub largest: Option<(f32, [usize; 2])>,
}

impl CasePictures {
    /// Reads the pictures of a case. Relative names are looked for in the folder of the results and in the `folder` of the run.
    pub fn read(case: &CaseReport, folder: &Path, results: &Path) -> Self {
        let mut shown = Self::default();
        let now = case.picture.as_deref().map(|path| located(path, [results, folder]));
        let now = now.and_then(|path| shown.said("The picture of this run", evidence(&path)));
        let Some(now) = now else { return shown };
        let displayed = display(&now);
        let side = if wording::is_notable(case) { SIDE } else { GREEN };
        shown.step = displayed.step(side);
        shown.thumbnail = data_uri::displayed(&displayed, SMALL, QUALITY);
        shown.picture = data_uri::displayed(&displayed, side, QUALITY);
        if case.verdict == CaseVerdict::SameBits {
            return shown;
        }
        let reference = case.reference.as_deref().map(|path| located(path, [folder, results]));
        let reference = reference.and_then(|path| shown.said("The reference", evidence(&path)));
        let Some(reference) = reference else { return shown };
        let displayed_reference = display(&reference);
        shown.reference = data_uri::displayed(&displayed_reference, side, QUALITY);
        let seen = flip(&displayed, &displayed_reference, PIXELS_PER_DEGREE);
        if let Some(seen) = shown.said("The FLIP map", seen) {
            let mean = |square: &[f32]| square.iter().sum::<f32>() / square.len() as f32;
            let map = data_uri::false_colors(&seen.map.reduced(side, mean), flip_color);
            shown.flip = map.map(|map| (map, seen.mean));
        }
        if let Some(z) = shown.said("The map of z values", signed_z(&now, &reference)) {
            let largest = worst(&z).map(|worst| (worst.value, [worst.x, worst.y]));
            let map = data_uri::false_colors(&z.reduced(side, strongest), z_color);
            shown.z = map.map(|uri| SignedZMap { uri, largest });
        }
        shown
    }

    /// The value, or nothing and the reason among the problems.
    fn said<T>(&mut self, what: &str, result: Result<T, ImageError>) -> Option<T> {
        result.map_err(|error| self.problems.push(format!("{what} cannot be shown: {error}."))).ok()
    }
}

/// The colour of a FLIP value, in steps for the same reason as [`z_color`].
pub fn flip_color(flip: f32) -> [u8; 3] {
    palette::color((FLIP_STEPS * flip).round() / FLIP_STEPS)
}

/// The colour of a z value: steps of half a standard error, so that noise takes little room in the file.
pub fn z_color(z: f32) -> [u8; 3] {
    palette::signed((2.0 * z).round() / (2.0 * STRONGEST_Z))
}

/// The value of largest magnitude: one wrong pixel stays visible in a reduced map. NaN if all are.
fn strongest(square: &[f32]) -> f32 {
    square.iter().fold(f32::NAN, |most, &z| if z.abs() > most.abs() || most.is_nan() { z } else { most })
}

/// The first of these places of a relative name where there is a file; the first if there is none.
pub fn located(path: &Path, folders: [&Path; 2]) -> PathBuf {
    let [first, second] = folders.map(|folder| folder.join(path));
    let places = [first.as_path(), second.as_path(), path];
    places.into_iter().find(|place| place.exists()).map_or_else(|| first.clone(), Path::to_path_buf)
}

/// A picture that this program stored as evidence, or one of any program.
fn evidence(path: &Path) -> Result<Evidence, ImageError> {
    match Evidence::read(path) {
        Ok((evidence, _)) => Ok(evidence),
        Err(ImageError::Channel { .. }) => Evidence::of_single(path),
        Err(error) => Err(error),
    }
}

/// Display-linear sRGB by the tone curve of `pointillist compare`.
fn display(evidence: &Evidence) -> Grid<[f32; 3]> {
    develop::shown(&evidence.mean, &Settings::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::palette::NOTHING;
    use crate::regress::report::sample;

    #[test]
    fn a_reduced_map_keeps_its_outliers() {
        assert_eq!(strongest(&[0.5, -7.0, f32::NAN, 2.0]), -7.0);
        assert_eq!(strongest(&[f32::NAN, 0.0]), 0.0);
        assert!(strongest(&[f32::NAN]).is_nan());
        assert_eq!(z_color(f32::NAN), NOTHING);
        assert_eq!((z_color(0.2), z_color(-40.0)), (palette::signed(0.0), palette::signed(-1.0)));
        assert_eq!(z_color(f32::INFINITY), palette::signed(1.0));
        assert_eq!((flip_color(f32::NAN), flip_color(0.51)), (NOTHING, palette::color(0.5)));
    }

    #[test]
    fn files_are_found_in_either_folder() {
        let [results, folder] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let find = |name: &str| located(Path::new(name), [results.path(), folder.path()]);
        assert_eq!(find("a.exr"), results.path().join("a.exr"));
        std::fs::write(folder.path().join("a.exr"), "a").expect("written");
        assert_eq!(find("a.exr"), folder.path().join("a.exr"));
        let absolute = folder.path().join("a.exr");
        assert_eq!(find(absolute.to_str().expect("UTF-8")), absolute);
    }

    #[test]
    fn missing_and_damaged_pictures_are_said() {
        let results = tempfile::tempdir().expect("a folder");
        let mut case = sample::changed();
        assert!(CasePictures::read(&case, results.path(), results.path()).problems.is_empty());
        case.picture = Some("none.exr".into());
        let shown = CasePictures::read(&case, results.path(), results.path());
        assert!(
            shown.problems[0].starts_with("The picture of this run cannot be shown: cannot read "),
            "{shown:?}"
        );
        std::fs::write(results.path().join("none.exr"), "no picture").expect("written");
        let shown = CasePictures::read(&case, results.path(), results.path());
        assert!(shown.problems.len() == 1 && shown.picture.is_none(), "{shown:?}");
    }
}
