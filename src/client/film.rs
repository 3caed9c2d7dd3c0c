//! The film on a Vulkan device: accumulators, batches and the order of the passes.

use std::sync::Arc;

use crate::client::error::ClientError;
use crate::client::filter::{MAX_EXTENT, accepts};
use crate::client::layout::FoldPush;
use crate::client::lod::{StreamLod, power_of_two_below};
use crate::client::pass::fold::FoldPass;
use crate::client::pass::images::{BatchImages, StreamImages};
use crate::client::pass::repaint::{Repaint, Sums, floats};
use crate::client::pass::splat::{SplatPass, Sprites, splat_push};
use crate::client::pass::variance::VariancePass;
use crate::client::settings::{DisplayImage, FilmCounts, FilmData, FilmSpec, Settings};
use crate::client::upload::{Batch, VertexBuffers};
use crate::gpu::{Gpu, Region, read_image};
use crate::stream::{PathCounts, Sample};

/// A film on a Vulkan device; the twin of [`ReferenceFilm`](crate::client::reference::ReferenceFilm).
///
/// The same samples in the same order give the same bits on the same device, however they are split into calls.
pub struct VulkanFilm {
    gpu: Arc<Gpu>,
    spec: FilmSpec,
    batch: Batch,
    vertices: VertexBuffers,
    /// Made with the first batch.
    passes: Option<Passes>,
    /// Camera and light; made with the stream's first sample.
    streams: [Option<StreamImages>; 2],
    /// Made with the first repaint.
    repaint: Option<Repaint>,
    /// Sum and count of the positive luminances in the batch, in sample order, until the scale is known.
    luminance: (f64, u64),
    luminance_scale: Option<f32>,
    counts: FilmCounts,
}

/// The passes of a batch and what they draw into.
struct Passes {
    splat: SplatPass,
    fold: FoldPass,
    variance: VariancePass,
    targets: BatchImages,
}

/// What a stream's images are called.
const STREAM_NAMES: [&str; 2] = ["camera", "light"];

impl VulkanFilm {
    /// An empty film.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Gpu`] when there is no memory.
    pub fn new(gpu: Arc<Gpu>, spec: FilmSpec) -> Result<Self, ClientError> {
        let max = MAX_EXTENT - 2 * spec.pad();
        if !(1..=max).contains(&spec.width) || !(1..=max).contains(&spec.height) {
            return Err(ClientError::Extent { width: spec.width, height: spec.height, max });
        }
        Ok(Self {
            vertices: VertexBuffers::new(&gpu)?,
            gpu,
            spec,
            batch: Batch::default(),
            passes: None,
            streams: [None, None],
            repaint: None,
            luminance: (0.0, 0),
            luminance_scale: None,
            counts: FilmCounts::default(),
        })
    }

    /// What the film is made of.
    pub fn spec(&self) -> &FilmSpec {
        &self.spec
    }

    /// Copies samples to the batch; a full batch is rasterised at once, without waiting for it.
    ///
    /// Samples that [`accepts`] refuses are dropped; the stream should not carry them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory for a stream's images or the device was lost.
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples.iter().filter(|s| accepts(s)) {
            if self.luminance_scale.is_none() && sample.xyz.y > 0.0 {
                self.luminance.0 += f64::from(sample.xyz.y) / f64::from(sample.w.abs());
                self.luminance.1 += 1;
            }
            if sample.w > 0.0 {
                self.counts.camera_samples += 1;
            } else {
                self.counts.light_samples += 1;
            }
            if self.batch.push(*sample) {
                self.flush()?;
            }
        }
        Ok(())
    }

    /// Counts paths that were started, whether or not they gave samples.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.counts.camera_paths += paths.camera;
        self.counts.light_paths += paths.light;
    }

    /// Rasterises what the batch holds: splat, fold, variance. Does not wait for the GPU.
    ///
    /// # Errors
    ///
    /// As [`add`](Self::add).
    pub fn flush(&mut self) -> Result<(), ClientError> {
        if self.batch.is_empty() {
            return Ok(());
        }
        let outcome = self.raster();
        // After an error the samples are lost: kept, they would outgrow the vertex buffer.
        self.batch.clear();
        outcome
    }

    /// Uploads the batch and records its passes.
    fn raster(&mut self) -> Result<(), ClientError> {
        // Black batches leave the scale open: their deviations are 0 in every unit.
        if self.luminance_scale.is_none() && self.luminance.1 > 0 {
            self.luminance_scale = Some(power_of_two_below(self.luminance.0 / self.luminance.1 as f64));
        }
        self.make_images()?;
        let inverse_scale = self.scale().recip();
        let Some(passes) = &mut self.passes else {
            return Ok(()); // made above
        };
        let (vertices, parts) = self.vertices.upload(&mut self.batch, &self.spec)?;
        let push = splat_push(&self.spec, inverse_scale);
        let mut frame = self.gpu.begin()?;
        let cmd = &mut frame.cmd();
        for (stream, range) in self.streams.iter_mut().zip([parts.camera, parts.light]) {
            let Some(stream) = stream else {
                continue;
            };
            // Also for a stream whose samples all lie outside: what is displayed must be defined.
            stream.define(cmd);
            if range.is_empty() {
                continue;
            }
            stream.changed();
            let sprites = Sprites { vertices, range };
            let targets = &mut passes.targets;
            passes.splat.record(cmd, &sprites, &push, &mut targets.color);
            passes.fold.record(cmd, &mut stream.color, targets, &FoldPush { inverse_scale });
            passes.variance.record(cmd, &sprites, &push, targets, &mut stream.variance);
        }
        let number = frame.submit()?;
        self.vertices.submitted(number);
        Ok(())
    }

    /// Forgets everything: a new epoch. The images stay for the next one.
    ///
    /// # Errors
    ///
    /// None today; kept for the twins' common shape.
    pub fn clear(&mut self) -> Result<(), ClientError> {
        self.batch.clear();
        self.streams.iter_mut().flatten().for_each(StreamImages::forget);
        self.luminance = (0.0, 0);
        self.luminance_scale = None;
        self.counts = FilmCounts::default();
        Ok(())
    }

    /// What was received since the last [`clear`](Self::clear).
    pub fn counts(&self) -> FilmCounts {
        self.counts
    }

    /// Which streams, camera and light, have images: those that ever had a sample.
    pub fn allocated_streams(&self) -> [bool; 2] {
        [self.streams[0].is_some(), self.streams[1].is_some()]
    }

    /// The picture as a viewer shows it; rasterises the batch first and waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when there is no memory or the device was lost.
    pub fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.display(sums, settings)
    }

    /// The reconstructed picture before the tone curve: scene-linear `[X, Y, Z]`, `[height][width]`; waits for the GPU.
    ///
    /// # Errors
    ///
    /// As [`display`](Self::display).
    pub fn reconstruct(&mut self, settings: &Settings) -> Result<Vec<[f32; 3]>, ClientError> {
        let (repaint, sums) = self.repaint()?;
        repaint.reconstruct(sums, settings)
    }

    /// The sums, cropped to the picture; rasterises the batch first and waits for the GPU.
    ///
    /// # Errors
    ///
    /// As [`display`](Self::display).
    pub fn develop(&mut self) -> Result<FilmData, ClientError> {
        let pad = self.spec.pad();
        let extent = [self.spec.width, self.spec.height];
        self.develop_region(Region { origin: [pad, pad], extent })
    }

    /// The sums with the overscan around the picture, `width` and `height` being those of the padded target.
    ///
    /// # Errors
    ///
    /// As [`display`](Self::display).
    pub fn develop_padded(&mut self) -> Result<FilmData, ClientError> {
        self.develop_region(Region { origin: [0, 0], extent: self.spec.padded_extent() })
    }

    fn develop_region(&mut self, region: Region) -> Result<FilmData, ClientError> {
        self.flush()?;
        let mut data = FilmData {
            width: region.extent[0],
            height: region.extent[1],
            luminance_scale: self.scale(),
            counts: self.counts,
            ..FilmData::default()
        };
        let samples = self.samples();
        for (i, stream) in self.streams.iter_mut().enumerate() {
            let Some(stream) = stream.as_mut().filter(|s| samples[i] > 0 && s.is_defined()) else {
                continue;
            };
            // hi is the rounded sum: lo adds nothing to an f32.
            let color = read_image(&self.gpu, stream.color.sums_mut(), region)?;
            let color = floats(&color).chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
            let variance = floats(&read_image(&self.gpu, stream.variance.sums_mut(), region)?);
            if i == 0 {
                (data.camera, data.camera_variance) = (color, variance);
            } else {
                (data.light, data.light_variance) = (color, variance);
            }
        }
        Ok(data)
    }

    /// Rasterises the batch, and hands out what shows the sums together with them.
    fn repaint(&mut self) -> Result<(&mut Repaint, Sums<'_>), ClientError> {
        self.flush()?;
        let lods = self.lods();
        let (light_scale, inverse_scale) = (self.counts.light_scale(&self.spec), self.scale().recip());
        let repaint = match &mut self.repaint {
            Some(repaint) => repaint,
            empty => empty.insert(Repaint::new(&self.gpu, self.spec)?),
        };
        let [camera, light] = &mut self.streams;
        let streams = [camera.as_mut().zip(lods[0]), light.as_mut().zip(lods[1])];
        Ok((repaint, Sums { streams, light_scale, inverse_scale }))
    }

    /// Level of detail of each stream; `None` where it has no samples.
    fn lods(&self) -> [Option<StreamLod>; 2] {
        let [width, height] = self.spec.padded_extent();
        let levels = width.max(height).ilog2() as usize + 1;
        self.samples().map(|samples| StreamLod::new(u64::from(width) * u64::from(height), samples, levels))
    }

    fn samples(&self) -> [u64; 2] {
        [self.counts.camera_samples, self.counts.light_samples]
    }

    /// Makes what a batch needs: passes and targets with the first, a stream's images with its first sample.
    fn make_images(&mut self) -> Result<(), ClientError> {
        let (gpu, extent) = (&self.gpu, self.spec.padded_extent());
        if self.passes.is_none() {
            self.passes = Some(Passes {
                splat: SplatPass::new(gpu, &self.spec)?,
                fold: FoldPass::new(gpu, &self.spec)?,
                variance: VariancePass::new(gpu, &self.spec)?,
                targets: BatchImages::new(gpu, &self.spec)?,
            });
        }
        let samples = self.samples();
        for (i, stream) in self.streams.iter_mut().enumerate() {
            if samples[i] > 0 && stream.is_none() {
                *stream = Some(StreamImages::new(gpu, STREAM_NAMES[i], extent)?);
            }
        }
        Ok(())
    }

    /// The luminance scale, a power of two; 1 until a sample had luminance.
    fn scale(&self) -> f32 {
        self.luminance_scale.unwrap_or(1.0)
    }
}
