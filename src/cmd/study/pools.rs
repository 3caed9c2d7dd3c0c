//! Pooled pictures of a study on disk, so that a second run continues with them: `reference.exr` has the reference as its main layer, and
//! mean and variance of each method's pictures as further layers; `trials.exr` has those of the trials.

use miette::{IntoDiagnostic, Result};

use crate::client::FilmSpec;
use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::renderer::StudyRenderer;
use crate::image::Attribute;
use crate::image::exr::{self, Layers};
use crate::study::pool::{NoisyPixel, ReferencePool};

/// File of the reference.
pub const FILE: &str = "reference.exr";

/// File of the trials' pools.
const TRIALS: &str = "trials.exr";

/// The attribute with the samples per pixel of each method: `path=12.5 bidirectional=3`.
const SAMPLES: &str = "pooledSamples";

const CHANNELS: [&str; 7] = ["R", "G", "B", "varianceR", "varianceG", "varianceB", "varianceY"];

/// Pools of a study.
pub struct Pools {
    /// Pool of the full-size pictures.
    pub full: ReferencePool,
    /// Pool of the trials.
    pub trial: ReferencePool,
}

impl Pools {
    /// Pools without pictures.
    pub fn empty(renderer: &StudyRenderer) -> Self {
        let film = &renderer.run.film;
        let pool = |film: &FilmSpec| ReferencePool::new([film.width as usize, film.height as usize]);
        Self { full: pool(film), trial: pool(renderer.trial.as_ref().unwrap_or(film)) }
    }

    /// The pools of earlier runs in the directory; empty ones if none can be read.
    pub fn open(renderer: &StudyRenderer, folder: &StudyFolder) -> Self {
        let mut pools = Self::empty(renderer);
        // Pools without measurements are ignored.
        if !folder.measurements.is_empty() {
            load(&mut pools.full, folder, FILE);
            load(&mut pools.trial, folder, TRIALS);
        }
        pools
    }

    /// The pool of the trials, or of the full-size pictures.
    pub fn of(&mut self, is_trial: bool) -> &mut ReferencePool {
        if is_trial { &mut self.trial } else { &mut self.full }
    }
}

/// Adds the contents of a file, if it can be read.
fn load(pool: &mut ReferencePool, folder: &StudyFolder, name: &str) {
    let [width, height] = pool.size();
    let Ok(layers) = exr::read(&folder.file(name)) else { return };
    let Some(Attribute::Text(samples)) = layers.attribute(SAMPLES) else { return };
    if (layers.width, layers.height) != (width, height) {
        return;
    }
    for (method, samples) in samples.split(' ').filter_map(|pair| pair.split_once('=')) {
        let channels = CHANNELS.map(|channel| layers.channel(&format!("{method}.{channel}")));
        let (Ok(samples), true) = (samples.parse::<f64>(), channels.iter().all(Option::is_some)) else {
            continue;
        };
        let at = |channel: usize, i: usize| {
            channels[channel].and_then(|values| values.get(i)).copied().unwrap_or_default()
        };
        let pixel = |i: usize| NoisyPixel {
            mean: std::array::from_fn(|c| at(c, i)),
            variance: std::array::from_fn(|c| at(c + 3, i)),
        };
        pool.add_earlier(method, samples, &(0..width * height).map(pixel).collect::<Vec<_>>());
    }
}

/// Writes both pools.
pub fn save(pools: &Pools, folder: &StudyFolder) -> Result<()> {
    for (pool, name) in [(&pools.full, FILE), (&pools.trial, TRIALS)] {
        let Some(reference) = pool.reference(None) else { continue };
        let [width, height] = pool.size();
        let mut layers = Layers { width, height, ..Layers::default() };
        for (c, name) in CHANNELS.into_iter().enumerate().take(3) {
            layers.push(name, reference.iter().map(|pixel| pixel.mean[c]));
        }
        let mut samples = Vec::new();
        for (method, count, pixels) in pool.parts() {
            samples.push(format!("{method}={count}"));
            for (c, name) in CHANNELS.into_iter().enumerate() {
                let value = |pixel: &NoisyPixel| if c < 3 { pixel.mean[c] } else { pixel.variance[c - 3] };
                layers.push(&format!("{method}.{name}"), pixels.iter().map(value));
            }
        }
        layers.attributes.push((SAMPLES.to_string(), Attribute::Text(samples.join(" "))));
        exr::write(&folder.file(name), &layers).into_diagnostic()?;
    }
    Ok(())
}
