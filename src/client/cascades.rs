//! Firefly reweighting: samples of high contribution that are too rare to be averaged.
//!
//! Zirr, Hanika, Dachsbacher, *Re-weighting Firefly Samples for Improved Finite-Sample Monte Carlo Estimates*, Computer
//! Graphics Forum 37(6), 2018. Samples are split over a cascade of films by brightness, b^j and b^(j + 1) for the two that a
//! brightness lies between. What a film holds at a pixel is as reliable as
//!
//! - the number of samples there that are about so bright, in the film and its two neighbours, is large against κ,
//! - and the light of all darker films is large against κ such samples.
//!
//! The mean of both, at most 1, is its weight. With the number of samples all weights tend to 1: the picture is biased, mostly
//! too dark, and **unbiased in the limit**. Nothing is lost: the plain sums are kept, and only the part of the cascade that is
//! not reliable is taken from them. The memory is that of as many films as there are brightnesses.

use glam::Vec3;

use crate::client::Film;
use crate::client::develop::linear_xyz;
use crate::client::error::ClientError;
use crate::client::lod::power_of_two_below;
use crate::client::reference::ReferenceFilm;
use crate::client::settings::{DisplayImage, FilmCounts, FilmData, FilmSpec, Settings};
use crate::image::Grid;
use crate::stream::{PathCounts, Sample};

/// Ratio of brightness of two films, the base b of the cascade.
const BASE: f32 = 8.0;

/// Films above the first, which is not stored because it is always reliable: brightness up to 2^48 times the mean.
const FILMS: usize = 16;

/// Makes a film of the cascade.
pub type MakeFilm = Box<dyn Fn(FilmSpec) -> Result<Box<dyn Film>, ClientError>>;

/// A film with firefly reweighting.
pub struct CascadeFilm {
    /// Sums of all samples, without reweighting.
    plain: Box<dyn Film>,
    make: MakeFilm,
    spec: FilmSpec,
    /// Films from the second brightness level on, created with their first sample, and the samples waiting for them.
    films: [Option<Box<dyn Film>>; FILMS],
    waiting: [Vec<Sample>; FILMS],
    kappa: f32,
    /// Brightness of the first level, once known.
    start: Option<f32>,
    withheld: Option<f64>,
}

/// Sums `[X, Y, Z, W]` of one stream, row-major.
type Sums = [[f32; 4]];

impl CascadeFilm {
    /// An empty film with the threshold `kappa` > 0.
    ///
    /// # Errors
    ///
    /// As for `make`.
    pub fn new(make: MakeFilm, spec: FilmSpec, kappa: f32) -> Result<Self, ClientError> {
        let plain = make(spec)?;
        let (films, waiting) = Default::default();
        Ok(Self { plain, make, spec, films, waiting, kappa, start: None, withheld: None })
    }

    /// Splits a sample between the two films whose brightness levels enclose its own.
    fn split(&mut self, sample: &Sample, start: f32) {
        let brightness = sample.xyz.y / sample.w.abs() / start;
        if brightness.is_nan() || brightness <= 1.0 {
            return;
        }
        let level = (brightness.ln() / BASE.ln()).clamp(0.0, FILMS as f32 - 1.0) as usize;
        let lower = BASE.powi(level as i32);
        let darker = ((lower / brightness - 1.0 / BASE) / (1.0 - 1.0 / BASE)).clamp(0.0, 1.0);
        // Film indices start at the second brightness level.
        for (film, share) in [(level.wrapping_sub(1), darker), (level, 1.0 - darker)] {
            if let Some(waiting) = self.waiting.get_mut(film).filter(|_| share > 0.0) {
                waiting.push(Sample { xyz: sample.xyz * share, ..*sample });
            }
        }
    }

    /// Sums of the picture after the unreliable part of the cascade is subtracted.
    fn reweighted(&mut self) -> Result<FilmData, ClientError> {
        let mut data = self.plain.develop()?;
        let Some(start) = self.start else { return Ok(data) };
        let mut layers = Vec::new();
        for film in &mut self.films {
            layers.push(film.as_mut().map(|film| film.develop()).transpose()?);
        }
        let last = layers.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let size = [data.width as usize, data.height as usize];
        let (mut taken, mut all) = (0.0, 0.0);
        for light in [false, true] {
            let of = |data: &FilmData| if light { data.light.clone() } else { data.camera.clone() };
            let mut cascade: Vec<Vec<[f32; 4]>> =
                layers[..last].iter().map(|layer| layer.as_ref().map(of).unwrap_or_default()).collect();
            let sums = if light { &mut data.light } else { &mut data.camera };
            cascade.iter_mut().for_each(|layer| layer.resize(sums.len(), [0.0; 4]));
            let weight = |sums: &Sums| sums.iter().map(|sum| f64::from(sum[1])).sum::<f64>();
            all += weight(sums);
            let before = weight(sums);
            reweight(sums, &cascade, size, start, self.kappa);
            taken += before - weight(sums);
        }
        self.withheld = Some(if all > 0.0 { taken / all } else { 0.0 });
        Ok(data)
    }
}

/// Subtracts the unreliable part of a cascade's films from the sums of all samples.
fn reweight(sums: &mut Sums, cascade: &[Vec<[f32; 4]>], [width, height]: [usize; 2], start: f32, kappa: f32) {
    if sums.is_empty() {
        return;
    }
    // The darkest level is what no film of the cascade contains. `picture` then grows by the reliable part of one film after another.
    let mut picture: Vec<Vec3> = sums.iter().map(|sum| Vec3::new(sum[0], sum[1], sum[2])).collect();
    for layer in cascade {
        for (rest, sum) in picture.iter_mut().zip(layer) {
            *rest = (*rest - Vec3::new(sum[0], sum[1], sum[2])).max(Vec3::ZERO);
        }
    }
    let darkest: Vec<f32> = picture.iter().map(|rest| rest.y).collect();
    for (j, layer) in cascade.iter().enumerate() {
        let brightness = start * BASE.powi(j as i32 + 1);
        // Number of samples of similar brightness, per pixel.
        let count: Vec<f32> = (0..layer.len())
            .map(|i| {
                let below = if j == 0 { darkest[i] } else { cascade[j - 1][i][1] };
                let above = cascade.get(j + 1).map_or(0.0, |layer| layer[i][1]);
                (below * BASE + layer[i][1] + above / BASE) / brightness
            })
            .collect();
        for (i, sum) in layer.iter().enumerate().filter(|(_, sum)| sum[1] > 0.0) {
            let [x, y] = [i % width, i / width];
            let near = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
            let around = near(y, height).flat_map(|y| near(x, width).map(move |x| y * width + x));
            let (total, cells) = around.fold((0.0, 0.0), |(total, n), i| (total + count[i], n + 1.0));
            // A few bright samples in one pixel are not evidence for its neighbourhood.
            let met = if total / cells >= 1.0 { count[i] } else { total / cells };
            let by_count = (met - 1.0) / kappa;
            let by_light = picture[i].y / (kappa * brightness);
            let reliability = (0.5 * (by_count + by_light)).clamp(0.0, 1.0);
            picture[i] += reliability * Vec3::new(sum[0], sum[1], sum[2]);
        }
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        // Where everything is reliable the sums stay unchanged, except for rounding.
        let held: f32 = cascade.iter().map(|layer| layer[i][1]).sum();
        if held > 0.0 && picture[i].y < sum[1] * (1.0 - 1e-6) {
            *sum = [picture[i].x, picture[i].y, picture[i].z, sum[3]];
        }
    }
}

impl Film for CascadeFilm {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.plain.add(samples)?;
        let start = match self.start {
            Some(start) => start,
            None => {
                let bright = samples.iter().map(|s| f64::from(s.xyz.y / s.w.abs())).filter(|y| *y > 0.0);
                let (sum, count) = bright.fold((0.0, 0.0), |(sum, n), y| (sum + y, n + 1.0));
                if count == 0.0 || !f64::is_finite(sum) {
                    return Ok(());
                }
                *self.start.insert(power_of_two_below(sum / count))
            }
        };
        samples.iter().for_each(|sample| self.split(sample, start));
        for (film, waiting) in self.films.iter_mut().zip(&mut self.waiting) {
            if waiting.is_empty() {
                continue;
            }
            let film = match film {
                Some(film) => film,
                empty => empty.insert((self.make)(FilmSpec { variance: None, ..self.spec })?),
            };
            film.add(waiting)?;
            waiting.clear();
        }
        Ok(())
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.plain.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        self.plain.flush()?;
        self.films.iter_mut().flatten().try_for_each(|film| film.flush())
    }

    fn clear(&mut self) {
        self.plain.clear();
        (self.films, self.start, self.withheld) = Default::default();
        self.waiting.iter_mut().for_each(Vec::clear);
    }

    fn keep_batch(&mut self, keep: bool) {
        self.plain.keep_batch(keep);
        self.films.iter_mut().flatten().for_each(|film| film.keep_batch(keep));
    }

    fn counts(&self) -> FilmCounts {
        self.plain.counts()
    }

    /// Display without blur and glare, since both read the sums on the device, which are not reweighted.
    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let data = self.reweighted()?;
        let picture = linear_xyz(&data).into_iter().map(Vec3::from).collect();
        let grid = Grid::from_rows(data.width as usize, data.height as usize, picture);
        let Some(grid) = grid else { return self.plain.display(settings) };
        ReferenceFilm::show(&grid, &Settings { glare: None, ..settings.clone() })
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.reweighted()
    }

    fn withheld(&self) -> Option<f64> {
        self.withheld
    }
}
