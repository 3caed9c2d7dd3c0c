//! The film on the CPU: accumulators, batches and the order of the passes.

use glam::Vec4;

use crate::client::error::ClientError;
use crate::client::filter::{MAX_EXTENT, accepts};
use crate::client::lod::{StreamLod, power_of_two_below};
use crate::client::reference::accumulator::Accumulator;
use crate::client::reference::mips::{Pyramid, pyramid};
use crate::client::reference::reconstruct::{ReconstructParameters, StreamView, reconstruct};
use crate::client::reference::splat::Bins;
use crate::client::reference::tonemap::{ToneParameters, tonemap};
use crate::client::reference::variance::VarianceParameters;
use crate::client::settings::{BATCH_CAPACITY, DisplayImage, FilmCounts, FilmData, FilmSpec, Settings};
use crate::stream::{PathCounts, Sample};

/// A film whose passes are plain Rust: `--device cpu`, and the twin the Vulkan film is tested against.
///
/// The same samples in the same order give the same bits for any number of threads.
pub struct ReferenceFilm {
    spec: FilmSpec,
    pool: rayon::ThreadPool,
    camera: Stream,
    light: Stream,
    /// Sum and count of the positive luminances in the batch, in sample order, until the scale is known.
    luminance: (f64, u64),
    luminance_scale: Option<f32>,
    counts: FilmCounts,
}

/// One stream: what waits in the batch, and the sums; no image before the first sample.
#[derive(Default)]
struct Stream {
    batch: Vec<Sample>,
    bins: Bins,
    sums: Option<Accumulator>,
}

impl ReferenceFilm {
    /// An empty film with `threads` threads of its own; 0 takes one per core.
    ///
    /// # Errors
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Threads`] when the system
    /// gives no threads.
    pub fn new(spec: FilmSpec, threads: usize) -> Result<Self, ClientError> {
        let max = MAX_EXTENT - 2 * spec.pad();
        if !(1..=max).contains(&spec.width) || !(1..=max).contains(&spec.height) {
            return Err(ClientError::Extent { width: spec.width, height: spec.height, max });
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("film {i}"))
            .build()
            .map_err(|e| ClientError::Threads { threads, reason: e.to_string() })?;
        Ok(Self {
            spec,
            pool,
            camera: Stream::default(),
            light: Stream::default(),
            luminance: (0.0, 0),
            luminance_scale: None,
            counts: FilmCounts::default(),
        })
    }

    /// What the film is made of.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// Copies samples to the batch; a full batch is rasterised at once.
    ///
    /// Samples that [`accepts`] refuses are dropped; the stream should not carry them.
    ///
    /// # Errors
    /// [`ClientError::Memory`] when a stream's first sample finds no memory for its images.
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples.iter().filter(|s| accepts(s)) {
            if self.luminance_scale.is_none() && sample.xyz.y > 0.0 {
                self.luminance.0 += f64::from(sample.xyz.y) / f64::from(sample.w.abs());
                self.luminance.1 += 1;
            }
            if sample.w > 0.0 {
                self.camera.batch.push(*sample);
                self.counts.camera_samples += 1;
            } else {
                self.light.batch.push(*sample);
                self.counts.light_samples += 1;
            }
            if self.camera.batch.len() + self.light.batch.len() == BATCH_CAPACITY {
                self.flush()?;
            }
        }
        Ok(())
    }

    /// Counts paths that were started, whether or not they gave samples.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.counts.camera_paths = self.counts.camera_paths.saturating_add(paths.camera);
        self.counts.light_paths = self.counts.light_paths.saturating_add(paths.light);
    }

    /// Rasterises what the batch holds: splat, fold, variance.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn flush(&mut self) -> Result<(), ClientError> {
        // Black batches leave the scale open: their deviations are 0 in every unit.
        if self.luminance_scale.is_none() && self.luminance.1 > 0 {
            self.luminance_scale = Some(power_of_two_below(self.luminance.0 / self.luminance.1 as f64));
        }
        let p = VarianceParameters {
            filter: self.spec.filter,
            form: self.spec.variance,
            inverse_scale: self.scale().recip(),
            samples_per_sum: BATCH_CAPACITY.div_ceil(self.spec.batch_slots() as usize),
        };
        let (spec, pool) = (&self.spec, &self.pool);
        for stream in [&mut self.camera, &mut self.light] {
            if stream.batch.is_empty() {
                continue;
            }
            let sums = match &mut stream.sums {
                Some(sums) => sums,
                empty => empty.insert(Accumulator::new(spec)?),
            };
            stream.bins.fill(spec, &stream.batch);
            pool.install(|| sums.add_batch(p, &stream.bins));
            stream.batch.clear();
        }
        Ok(())
    }

    /// Forgets everything: a new epoch.
    ///
    /// # Errors
    /// None here; the Vulkan film may fail.
    pub fn clear(&mut self) -> Result<(), ClientError> {
        for stream in [&mut self.camera, &mut self.light] {
            stream.batch.clear();
            stream.sums = None;
        }
        self.luminance = (0.0, 0);
        self.luminance_scale = None;
        self.counts = FilmCounts::default();
        Ok(())
    }

    /// What was received since the last [`clear`](Self::clear).
    pub fn counts(&self) -> FilmCounts {
        self.counts
    }

    /// The picture as a viewer shows it; rasterises the batch first.
    ///
    /// # Errors
    /// [`ClientError::Memory`] when the mip levels find no memory.
    pub fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        self.flush()?;
        let p = ReconstructParameters {
            spec: self.spec,
            method: settings.reconstruction,
            vm: settings.vm,
            luminance_scale: self.scale(),
            light_scale: self.counts.light_scale(&self.spec),
        };
        self.pool.install(|| {
            let camera = Levels::of(self.camera.sums.as_ref(), &self.spec, settings.vm)?;
            let light = Levels::of(self.light.sums.as_ref(), &self.spec, settings.vm)?;
            let camera = camera.as_ref().and_then(|l| l.view(self.counts.camera_samples, false));
            let light = light.as_ref().and_then(|l| l.view(self.counts.light_samples, true));
            let picture = reconstruct(&p, camera.as_ref(), light.as_ref())
                .ok_or_else(|| Accumulator::out_of_memory("the displayed picture", &self.spec))?;
            Ok(tonemap(&picture, &ToneParameters::from(settings)))
        })
    }

    /// The sums, cropped to the picture; rasterises the batch first.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn develop(&mut self) -> Result<FilmData, ClientError> {
        self.flush()?;
        let color = |s: &Stream| s.sums.as_ref().map(|a| a.crop_color(&self.spec)).unwrap_or_default();
        let variance = |s: &Stream| s.sums.as_ref().map(|a| a.crop_variance(&self.spec)).unwrap_or_default();
        Ok(FilmData {
            width: self.spec.width,
            height: self.spec.height,
            camera: color(&self.camera),
            light: color(&self.light),
            camera_variance: variance(&self.camera),
            light_variance: variance(&self.light),
            luminance_scale: self.scale(),
            counts: self.counts,
        })
    }

    /// The luminance scale, a power of two; 1 until a sample had luminance.
    fn scale(&self) -> f32 {
        self.luminance_scale.unwrap_or(1.0)
    }
}

/// The mip levels of one stream, built anew for each repaint.
struct Levels {
    color: Pyramid<Vec4>,
    variance: Option<Pyramid<f32>>,
}

impl Levels {
    /// Levels of the sums, with those of the variance if `vm` asks for them; `None` without sums.
    fn of(sums: Option<&Accumulator>, spec: &FilmSpec, vm: f32) -> Result<Option<Self>, ClientError> {
        let Some(sums) = sums else {
            return Ok(None);
        };
        let no_memory = || Accumulator::out_of_memory("the mip levels", spec);
        let color = sums.color(spec).and_then(pyramid).ok_or_else(no_memory)?;
        let variance =
            if vm > 0.0 { Some(sums.variance(spec).and_then(pyramid).ok_or_else(no_memory)?) } else { None };
        Ok(Some(Self { color, variance }))
    }

    /// The stream as the reconstruction reads it; `summed` for the light stream.
    fn view(&self, samples: u64, summed: bool) -> Option<StreamView<'_>> {
        let texels = self.color[0].pixels().len() as u64;
        let lod = StreamLod::new(texels, samples, self.color.len())?;
        Some(StreamView { color: &self.color, variance: self.variance.as_deref(), lod, summed })
    }
}
