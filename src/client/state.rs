//! State of a film apart from its images, common to all devices: counts of samples and paths, luminance scale, and fill of the batch.

use crate::client::error::ClientError;
use crate::client::filter::{MAX_EXTENT, accepts};
use crate::client::lod::{StreamLod, power_of_two_below};
use crate::client::settings::{CHUNK_SAMPLES, FilmCounts, FilmSpec};
use crate::stream::{PathCounts, Sample};

/// Counts and scale since the last clear, and fill of the batch.
#[derive(Debug)]
pub struct FilmState {
    spec: FilmSpec,
    counts: FilmCounts,
    /// Samples not yet rasterised, in the batch and in batches waiting to be drawn.
    waiting: usize,
    /// Samples of a full batch on the CPU.
    capacity: usize,
    /// Sum and count of the positive luminances in the chunk, in sample order, until the scale is known.
    luminance: (f64, u64),
    luminance_scale: Option<f32>,
}

impl FilmState {
    /// The state of an empty film.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large.
    pub fn new(spec: FilmSpec) -> Result<Self, ClientError> {
        let max = MAX_EXTENT - 2 * spec.pad();
        if !(1..=max).contains(&spec.width) || !(1..=max).contains(&spec.height) {
            return Err(ClientError::Extent { width: spec.width, height: spec.height, max });
        }
        let (counts, capacity) = (FilmCounts::default(), spec.batch_capacity());
        Ok(Self { spec, counts, waiting: 0, capacity, luminance: (0.0, 0), luminance_scale: None })
    }

    /// Uses batches of one chunk, whatever the size of the film.
    pub fn take_small_batches(&mut self) {
        self.capacity = CHUNK_SAMPLES;
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// Counts a sample for the batch; false if [`accepts`] refuses it.
    #[inline]
    pub fn take(&mut self, sample: &Sample) -> bool {
        if !accepts(sample) {
            return false;
        }
        if self.luminance_scale.is_none() && sample.xyz.y > 0.0 {
            self.luminance.0 += f64::from(sample.xyz.y) / f64::from(sample.w.abs());
            self.luminance.1 += 1;
        }
        let light = sample.w < 0.0;
        self.counts.camera_samples += u64::from(!light);
        self.counts.light_samples += u64::from(light);
        self.waiting += 1;
        if self.luminance_scale.is_none() && self.waiting.is_multiple_of(CHUNK_SAMPLES) {
            self.find_scale();
        }
        true
    }

    /// Sets the luminance scale, if it is unknown and the chunk has a sample with light. It is derived from a single chunk, so that it does
    /// not depend on the size of the film. Black chunks leave it open: their deviations are 0 in every unit.
    fn find_scale(&mut self) {
        if self.luminance_scale.is_none() && self.luminance.1 > 0 {
            self.luminance_scale = Some(power_of_two_below(self.luminance.0 / self.luminance.1 as f64));
        }
    }

    /// True when a batch on the CPU must be rasterised before the next sample.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.waiting >= self.capacity
    }

    /// Samples not yet rasterised.
    pub fn waiting(&self) -> usize {
        self.waiting
    }

    /// Begins to rasterise all waiting samples. False if there are none.
    pub fn start_raster(&mut self) -> bool {
        self.find_scale();
        std::mem::take(&mut self.waiting) > 0
    }

    /// Ends the chunk early and derives the scale from its samples.
    pub fn end_chunk(&mut self) {
        self.find_scale();
    }

    /// Removes this many samples from the waiting ones: they are rasterised, or lost.
    pub fn leave(&mut self, samples: usize) {
        self.waiting -= samples.min(self.waiting);
    }

    /// Counts paths that were started, with or without samples; saturates.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.counts.camera_paths = self.counts.camera_paths.saturating_add(paths.camera);
        self.counts.light_paths = self.counts.light_paths.saturating_add(paths.light);
    }

    /// Adds the counts of another film whose sums are added to this one's.
    pub fn add_counts(&mut self, counts: FilmCounts) {
        let FilmCounts { camera_samples, light_samples, camera_paths, light_paths } = counts;
        self.counts.camera_samples = self.counts.camera_samples.saturating_add(camera_samples);
        self.counts.light_samples = self.counts.light_samples.saturating_add(light_samples);
        self.count_paths(PathCounts { camera: camera_paths, light: light_paths });
    }

    /// Sets the luminance scale, a power of two, in place of the automatic one.
    pub fn set_scale(&mut self, scale: f32) {
        self.luminance_scale = Some(scale);
    }

    /// Discards everything for another epoch.
    pub fn clear(&mut self) {
        (self.counts, self.waiting) = (FilmCounts::default(), 0);
        (self.luminance, self.luminance_scale) = ((0.0, 0), None);
    }

    /// The numbers of samples and paths received since the last [`clear`](Self::clear).
    pub fn counts(&self) -> FilmCounts {
        self.counts
    }

    /// Samples of the camera and of the light stream.
    pub fn samples(&self) -> [u64; 2] {
        [self.counts.camera_samples, self.counts.light_samples]
    }

    /// The luminance scale, a power of two; 1 before any sample with luminance.
    pub fn scale(&self) -> f32 {
        self.luminance_scale.unwrap_or(1.0)
    }

    /// Texels of the picture / light paths; 0 while there are none.
    pub fn light_scale(&self) -> f32 {
        self.counts.light_scale(self.spec.width, self.spec.height)
    }

    /// The luminance scale, once it is known.
    pub fn known_scale(&self) -> Option<f32> {
        self.luminance_scale
    }

    /// Level of detail of the camera and of the light stream with so many samples; `None` without.
    pub fn lods(&self, samples: [u64; 2]) -> [Option<StreamLod>; 2] {
        let [width, height] = self.spec.padded_extent();
        let levels = width.max(height).ilog2() as usize + 1;
        samples.map(|samples| StreamLod::new(u64::from(width) * u64::from(height), samples, levels))
    }
}
