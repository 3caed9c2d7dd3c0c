//! The sums of the samples of a film: counts, batch, and the images of both streams.

use std::sync::Arc;
use std::time::Duration;

use crate::client::error::ClientError;
use crate::client::pass::images::StreamImages;
use crate::client::pass::repaint::{FilmSums, floats};
use crate::client::raster::{Raster, Streams};
use crate::client::readback::Readback;
use crate::client::reference::sums::HostSums;
use crate::client::settings::{FilmCounts, FilmData, FilmSpec};
use crate::client::state::FilmState;
use crate::gpu::{Buffer, BufferUse, Cmd, FrameNumber, Gpu, Image, Region};
use crate::stream::{PathCounts, Sample};

/// Where sums are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SumsPlace {
    /// By passes on the device.
    Device,
    /// By the CPU, which copies them to the device.
    Host,
}

/// The sums of samples, on the device or copied to it.
pub struct SampleSums {
    gpu: Arc<Gpu>,
    state: FilmState,
    raster: Raster,
    /// Camera and light stream, created with their first sample.
    streams: Streams,
    /// Samples were lost since the last clear.
    damaged: bool,
}

impl SampleSums {
    /// Sums without samples.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Threads`].
    pub fn new(gpu: &Arc<Gpu>, spec: FilmSpec, place: SumsPlace) -> Result<Self, ClientError> {
        let state = FilmState::new(spec)?;
        let raster = match place {
            SumsPlace::Device => Raster::device(gpu, &spec)?,
            SumsPlace::Host => Raster::host(gpu),
        };
        Ok(Self { gpu: gpu.clone(), state, raster, streams: [None, None], damaged: false })
    }

    /// Moves the sums to another device after this one was lost; `None` if they were on it.
    pub fn moved_to(self, gpu: &Arc<Gpu>) -> Option<Self> {
        let raster = self.raster.moved_to(gpu)?;
        Some(Self { gpu: gpu.clone(), raster, streams: [None, None], ..self })
    }

    /// Converts to the sums of a CPU film; `None` if they were on the device.
    pub fn into_host(self) -> Option<(FilmState, HostSums)> {
        Some((self.state, self.raster.into_host_sums()?))
    }

    /// Replaces the sums by ones read from a film of the same specification, including its overscan.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out; there are no samples then.
    pub fn restore(&mut self, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        let outcome = self.raster.restore(data, self.state.spec(), &mut self.streams);
        match outcome {
            Ok(()) => {
                self.state.add_counts(data.counts);
                self.state.set_scale(data.luminance_scale);
            }
            Err(_) => self.clear(),
        }
        outcome
    }

    /// The specification of the images.
    pub fn spec(&self) -> &FilmSpec {
        self.state.spec()
    }

    /// Samples not yet rasterised.
    pub fn waiting(&self) -> usize {
        self.state.waiting()
    }

    /// The numbers of samples and paths since the last clear.
    pub fn counts(&self) -> FilmCounts {
        self.state.counts()
    }

    /// Whether samples were lost to an error since the last clear.
    pub fn is_damaged(&self) -> bool {
        self.damaged
    }

    /// Number of the frame that rasterises the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        self.raster.rasterised()
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        self.raster.take_host_time()
    }

    /// Whether the camera and the light stream have images.
    pub fn allocated_streams(&self) -> [bool; 2] {
        [self.streams[0].is_some(), self.streams[1].is_some()]
    }

    /// Adds samples to the batch; full batches are rasterised, at once or soon.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`], [`ClientError::SorterPanicked`]; samples are lost then.
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        for sample in samples {
            if self.state.take(sample) {
                self.raster.push(*sample);
                if self.raster.is_full(&self.state) {
                    let outcome = self.raster.advance(&mut self.state, &mut self.streams);
                    self.note(outcome)?;
                }
            }
        }
        Ok(())
    }

    /// Counts paths that were started.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.state.count_paths(paths);
    }

    /// Draws all full batches.
    ///
    /// # Errors
    ///
    /// As [`add`](Self::add).
    pub fn settle(&mut self) -> Result<(), ClientError> {
        let outcome = self.raster.settle(&mut self.state, &mut self.streams);
        self.note(outcome)
    }

    /// Rasterises all waiting samples.
    ///
    /// # Errors
    ///
    /// As [`add`](Self::add).
    pub fn flush(&mut self) -> Result<(), ClientError> {
        if self.state.waiting() == 0 {
            return Ok(());
        }
        let outcome = self.raster.flush(&mut self.state, &mut self.streams);
        self.note(outcome)
    }

    fn note(&mut self, outcome: Result<(), ClientError>) -> Result<(), ClientError> {
        self.damaged |= outcome.is_err();
        outcome
    }

    /// Discards all samples; the images stay.
    pub fn clear(&mut self) {
        self.raster.clear();
        self.damaged = false;
        self.streams.iter_mut().flatten().for_each(StreamImages::forget);
        self.state.clear();
    }

    /// Records the copy of all sums that the images do not hold yet.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out.
    pub fn complete(&mut self, cmd: &mut Cmd<'_>) -> Result<(), ClientError> {
        self.raster.complete(cmd, self.state.spec(), &mut self.streams)
    }

    /// Input of a repaint.
    pub fn view(&mut self) -> FilmSums<'_> {
        let lods = self.state.lods();
        let [camera, light] = &mut self.streams;
        FilmSums {
            spec: *self.state.spec(),
            streams: [camera.as_mut().zip(lods[0]), light.as_mut().zip(lods[1])],
            light_scale: self.state.light_scale(),
            inverse_scale: self.state.scale().recip(),
        }
    }

    /// Sums without the outermost `pad` texels on every side of the padded film. The batch must have been rasterised.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn develop(&mut self, pad: u32) -> Result<Readback<FilmData>, ClientError> {
        match self.raster.host_sums() {
            Some(sums) => Ok(Readback::ready(sums.develop(&self.state, pad))),
            None => {
                let extent = self.spec().padded_extent().map(|n| n - 2 * pad);
                self.develop_region(Region { origin: [pad; 2], extent })
            }
        }
    }

    /// The sum of the weights of the camera samples at this texel of the padded film; waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn weight_at(&mut self, texel: [u32; 2]) -> Result<f32, ClientError> {
        let sum = match self.raster.host_sums() {
            Some(sums) => sums.stream(0).and_then(|sums| sums.color_at(texel)),
            None => {
                let region = Region { origin: texel, extent: [1, 1] };
                self.develop_region(region)?.wait()?.camera.first().copied()
            }
        };
        Ok(sum.map_or(0.0, |sum| sum[3]))
    }

    fn develop_region(&mut self, region: Region) -> Result<Readback<FilmData>, ClientError> {
        let mut data = FilmData {
            width: region.extent[0],
            height: region.extent[1],
            luminance_scale: self.state.scale(),
            counts: self.state.counts(),
            ..FilmData::default()
        };
        let samples = self.state.samples();
        let gpu = self.gpu.clone();
        let mut frame = gpu.begin()?;
        let mut buffers = [const { (None, None) }; 2];
        for ((stream, samples), buffers) in self.streams.iter_mut().zip(samples).zip(&mut buffers) {
            let Some(stream) = stream.as_mut().filter(|stream| samples > 0 && stream.is_defined()) else {
                continue;
            };
            let mut read = |image: &mut Image| -> Result<Buffer, ClientError> {
                let buffer = Buffer::new(&gpu, "readback", BufferUse::Readback, region.bytes(image))?;
                frame.cmd().scope("readback").copy_to_buffer(image, region, &buffer);
                Ok(buffer)
            };
            // The remainders are not read: they are below the precision of the f32 sums.
            buffers.0 = Some(read(stream.color.sums_mut())?);
            buffers.1 = stream.variance.as_mut().map(|variance| read(variance.sums_mut())).transpose()?;
        }
        let number = frame.submit()?;
        let gpu = self.gpu.clone();
        Ok(Readback::new(move || {
            gpu.wait(number)?;
            let color = |buffer: &Option<Buffer>| -> Vec<[f32; 4]> {
                let all = buffer.as_ref().map(|buffer| floats(buffer.mapped())).unwrap_or_default();
                all.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect()
            };
            let variance = |buffer: &Option<Buffer>| {
                buffer.as_ref().map(|buffer| floats(buffer.mapped())).unwrap_or_default()
            };
            (data.camera, data.camera_variance) = (color(&buffers[0].0), variance(&buffers[0].1));
            (data.light, data.light_variance) = (color(&buffers[1].0), variance(&buffers[1].1));
            Ok(data)
        }))
    }
}
