//! The state of a film apart from its images, alike on every device: counts of samples and paths, the luminance scale, and
//! how full the batch is.

use crate::client::error::ClientError;
use crate::client::filter::{MAX_EXTENT, accepts};
use crate::client::lod::{StreamLod, power_of_two_below};
use crate::client::settings::{CHUNK_SAMPLES, FilmCounts, FilmSpec};
use crate::stream::{PathCounts, Sample};

/// Counts and scale since the last clear, and how full the batch is.
#[derive(Debug)]
pub struct FilmState {
    spec: FilmSpec,
    counts: FilmCounts,
    /// Samples that were not drawn yet: those of the batch, and of batches that wait.
    waiting: usize,
    /// Samples of a full batch of sums in memory.
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

    /// Makes batches of one chunk, whatever the size of the film.
    pub fn take_small_batches(&mut self) {
        self.capacity = CHUNK_SAMPLES;
    }

    /// The specification of the film.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// Counts a sample that goes into the batch; false for one that [`accepts`] refuses.
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

    /// Sets the luminance scale, if it is not known and a sample of the chunk had light. It is that of a chunk, so that it does not
    /// depend on the size of the film. Black chunks leave it open: their deviations are 0 in every unit.
    fn find_scale(&mut self) {
        if self.luminance_scale.is_none() && self.luminance.1 > 0 {
            self.luminance_scale = Some(power_of_two_below(self.luminance.0 / self.luminance.1 as f64));
        }
    }

    /// True when a batch in memory must be rasterised before the next sample.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.waiting >= self.capacity
    }

    /// Samples that were not drawn yet.
    pub fn waiting(&self) -> usize {
        self.waiting
    }

    /// Begins the raster of all samples that wait. False when there is nothing to draw.
    pub fn start_raster(&mut self) -> bool {
        self.find_scale();
        std::mem::take(&mut self.waiting) > 0
    }

    /// Ends the chunk with the samples that there are, of which the scale is found.
    pub fn end_chunk(&mut self) {
        self.find_scale();
    }

    /// So many samples wait no more: they are drawn, or lost.
    pub fn leave(&mut self, samples: usize) {
        self.waiting -= samples.min(self.waiting);
    }

    /// Counts paths that were started, whether or not they gave samples; stays at the largest number.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.counts.camera_paths = self.counts.camera_paths.saturating_add(paths.camera);
        self.counts.light_paths = self.counts.light_paths.saturating_add(paths.light);
    }

    /// Counts what another film has received, whose sums are added to this one's.
    pub fn add_counts(&mut self, counts: FilmCounts) {
        let FilmCounts { camera_samples, light_samples, camera_paths, light_paths } = counts;
        self.counts.camera_samples = self.counts.camera_samples.saturating_add(camera_samples);
        self.counts.light_samples = self.counts.light_samples.saturating_add(light_samples);
        self.count_paths(PathCounts { camera: camera_paths, light: light_paths });
    }

    /// Sets the luminance scale, a power of two, before the first sample would.
    pub fn set_scale(&mut self, scale: f32) {
        self.luminance_scale = Some(scale);
    }

    /// Forgets everything: a new epoch.
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

    /// The luminance scale, a power of two; 1 until a sample had luminance.
    pub fn scale(&self) -> f32 {
        self.luminance_scale.unwrap_or(1.0)
    }

    /// Texels of the picture / light paths; 0 while there are none.
    pub fn light_scale(&self) -> f32 {
        self.counts.light_scale(self.spec.width, self.spec.height)
    }

    /// Level of detail of the camera and of the light stream; `None` without samples.
    pub fn lods(&self) -> [Option<StreamLod>; 2] {
        let [width, height] = self.spec.padded_extent();
        let levels = width.max(height).ilog2() as usize + 1;
        self.samples().map(|samples| StreamLod::new(u64::from(width) * u64::from(height), samples, levels))
    }
}
