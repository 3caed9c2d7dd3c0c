//! The sums of the samples of a film: counts and batch of each eye, and the images of both streams.

use std::sync::Arc;
use std::time::Duration;

use crate::client::error::ClientError;
use crate::client::pass::images::StreamImages;
use crate::client::pass::repaint::{FilmSums, floats};
use crate::client::raster::{self, EyeLayer, Raster, Streams};
use crate::client::readback::Readback;
use crate::client::reference::sums::HostSums;
use crate::client::settings::{FilmCounts, FilmData, FilmSpec};
use crate::client::state::FilmState;
use crate::gpu::{Buffer, BufferUse, Cmd, FrameNumber, Gpu, Image, Region};
use crate::image::stereo::Eye;
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
    /// The left, and perhaps the right one; all in units of one luminance scale.
    eyes: Vec<EyeSums>,
    /// Camera and light stream, created with their first sample.
    streams: Streams,
    /// Samples were lost since the last clear.
    damaged: bool,
}

/// Counts and batch of one eye.
struct EyeSums {
    state: FilmState,
    raster: Raster,
}

impl SampleSums {
    /// Sums of so many eyes without samples.
    ///
    /// # Errors
    ///
    /// [`ClientError::Extent`] for a side of 0 or too large, [`ClientError::Threads`].
    pub fn new(gpu: &Arc<Gpu>, spec: FilmSpec, place: SumsPlace, eyes: u32) -> Result<Self, ClientError> {
        let of_eye = |index| {
            let state = FilmState::new(spec)?;
            let raster = match place {
                SumsPlace::Device => Raster::device(gpu, &spec, EyeLayer { index, count: eyes })?,
                SumsPlace::Host => Raster::host(),
            };
            Ok(EyeSums { state, raster })
        };
        let eyes = (0..eyes).map(of_eye).collect::<Result<_, ClientError>>()?;
        Ok(Self { gpu: gpu.clone(), eyes, streams: [None, None], damaged: false })
    }

    /// Number of eyes.
    pub fn eyes(&self) -> u32 {
        self.eyes.len() as u32
    }

    fn state(&self) -> &FilmState {
        &self.eyes[0].state
    }

    /// Moves the sums to another device after this one was lost; `None` if they were on it.
    pub fn moved_to(self, gpu: &Arc<Gpu>) -> Option<Self> {
        let moved = |eye: EyeSums| Some(EyeSums { raster: eye.raster.moved()?, ..eye });
        let eyes = self.eyes.into_iter().map(moved).collect::<Option<_>>()?;
        Some(Self { gpu: gpu.clone(), eyes, streams: [None, None], ..self })
    }

    /// Converts to the sums of a CPU film, which has the left eye alone; `None` if they were on the device.
    pub fn into_host(self) -> Option<(FilmState, HostSums)> {
        let left = self.eyes.into_iter().next()?;
        Some((left.state, left.raster.into_host_sums()?))
    }

    /// Replaces the sums by ones read from a film of one eye and of the same specification, including its overscan.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out; there are no samples then.
    pub fn restore(&mut self, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        let Some(EyeSums { state, raster }) = self.eyes.first_mut() else { return Ok(()) };
        let outcome = raster.restore(data, state.spec(), &mut self.streams);
        match outcome {
            Ok(()) => {
                state.add_counts(data.counts);
                state.set_scale(data.luminance_scale);
            }
            Err(_) => self.clear(),
        }
        outcome
    }

    /// The specification of the images.
    pub fn spec(&self) -> &FilmSpec {
        self.state().spec()
    }

    /// Samples not yet rasterised.
    pub fn waiting(&self) -> usize {
        self.eyes.iter().map(|eye| eye.state.waiting()).sum()
    }

    /// The numbers of samples and paths since the last clear, of the left eye.
    pub fn counts(&self) -> FilmCounts {
        self.state().counts()
    }

    /// Whether samples were lost to an error since the last clear.
    pub fn is_damaged(&self) -> bool {
        self.damaged
    }

    /// Number of the frame that rasterises the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        self.eyes.iter().map(|eye| eye.raster.rasterised()).max().unwrap_or_default()
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let spent = self.eyes.iter_mut().map(|eye| eye.raster.take_host_time());
        spent.fold(Default::default(), |(samples, time), of_eye| (samples + of_eye.0, time + of_eye.1))
    }

    /// Whether the camera and the light stream have images.
    pub fn allocated_streams(&self) -> [bool; 2] {
        [self.streams[0].is_some(), self.streams[1].is_some()]
    }

    /// Adds samples to the batch of an eye; full batches are rasterised, at once or soon.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`], [`ClientError::SorterPanicked`]; samples are lost then.
    pub fn add(&mut self, eye: Eye, samples: &[Sample]) -> Result<(), ClientError> {
        let Some(EyeSums { state, raster }) = self.eyes.get_mut(eye as usize) else { return Ok(()) };
        let mut outcome = Ok(());
        for sample in samples {
            if state.take(sample) {
                raster.push(*sample);
                if raster.is_full(state) {
                    outcome = raster.advance(state, &mut self.streams);
                    if outcome.is_err() {
                        break;
                    }
                }
            }
        }
        self.share_scale();
        self.note(outcome)
    }

    /// Gives all eyes the luminance scale of the first that has one: their layers are read with the same push constants.
    fn share_scale(&mut self) {
        if self.eyes.len() > 1
            && let Some(scale) = self.eyes.iter().find_map(|eye| eye.state.known_scale())
        {
            self.eyes.iter_mut().for_each(|eye| eye.state.set_scale(scale));
        }
    }

    /// Counts paths that were started.
    pub fn count_paths(&mut self, paths: PathCounts) {
        self.eyes.iter_mut().for_each(|eye| eye.state.count_paths(paths));
    }

    /// Draws all full batches.
    ///
    /// # Errors
    ///
    /// As [`add`](Self::add).
    pub fn settle(&mut self) -> Result<(), ClientError> {
        self.each(|raster, state, streams| raster.settle(state, streams))
    }

    /// Rasterises all waiting samples.
    ///
    /// # Errors
    ///
    /// As [`add`](Self::add).
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.each(|raster, state, streams| match state.waiting() {
            0 => Ok(()),
            _ => raster.flush(state, streams),
        })
    }

    /// Has `act` act on each eye, also after an error; returns the first error.
    fn each(
        &mut self,
        mut act: impl FnMut(&mut Raster, &mut FilmState, &mut Streams) -> Result<(), ClientError>,
    ) -> Result<(), ClientError> {
        let mut outcome = Ok(());
        for eye in 0..self.eyes.len() {
            let EyeSums { state, raster } = &mut self.eyes[eye];
            outcome = outcome.and(act(raster, state, &mut self.streams));
            self.share_scale();
        }
        self.note(outcome)
    }

    fn note(&mut self, outcome: Result<(), ClientError>) -> Result<(), ClientError> {
        self.damaged |= outcome.is_err();
        outcome
    }

    /// Discards all samples; the images stay.
    pub fn clear(&mut self) {
        for EyeSums { state, raster } in &mut self.eyes {
            raster.clear();
            state.clear();
        }
        self.damaged = false;
        self.streams.iter_mut().flatten().for_each(StreamImages::forget);
    }

    /// Records the copy of all sums that the images do not hold yet.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] if memory runs out.
    pub fn complete(&mut self, cmd: &mut Cmd<'_>) -> Result<(), ClientError> {
        let spec = *self.spec();
        let rasters = self.eyes.iter_mut().map(|eye| &mut eye.raster);
        raster::complete(&self.gpu, cmd, &spec, rasters, &mut self.streams)
    }

    /// Input of a repaint.
    pub fn view(&mut self) -> FilmSums<'_> {
        // Both eyes are blurred as the one with fewer samples requires.
        let fewest = |stream: usize| {
            let samples = self.eyes.iter().map(|eye| eye.state.samples()[stream]);
            let any = samples.clone().any(|samples| samples > 0);
            samples.min().unwrap_or_default().max(u64::from(any))
        };
        let lods = self.state().lods([fewest(0), fewest(1)]);
        let (light_scale, scale) = (self.state().light_scale(), self.state().scale());
        let spec = *self.spec();
        let [camera, light] = &mut self.streams;
        FilmSums {
            spec,
            streams: [camera.as_mut().zip(lods[0]), light.as_mut().zip(lods[1])],
            light_scale,
            inverse_scale: scale.recip(),
        }
    }

    /// Sums of an eye without the outermost `pad` texels on every side of the padded film. The batch must have been rasterised.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn develop(&mut self, eye: Eye, pad: u32) -> Result<Readback<FilmData>, ClientError> {
        let EyeSums { state, raster } = &self.eyes[eye as usize];
        match raster.host_sums() {
            Some(sums) => Ok(Readback::ready(sums.develop(state, pad))),
            None => {
                let extent = self.spec().padded_extent().map(|n| n - 2 * pad);
                self.develop_region(eye, Region { origin: [pad; 2], extent })
            }
        }
    }

    /// The sum of the weights of the left eye's camera samples at this texel of the padded film; waits for the GPU.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`].
    pub fn weight_at(&mut self, texel: [u32; 2]) -> Result<f32, ClientError> {
        let sum = match self.eyes[0].raster.host_sums() {
            Some(sums) => sums.stream(0).and_then(|sums| sums.color_at(texel)),
            None => {
                let region = Region { origin: texel, extent: [1, 1] };
                self.develop_region(Eye::Left, region)?.wait()?.camera.first().copied()
            }
        };
        Ok(sum.map_or(0.0, |sum| sum[3]))
    }

    fn develop_region(&mut self, eye: Eye, region: Region) -> Result<Readback<FilmData>, ClientError> {
        let state = &self.eyes[eye as usize].state;
        let mut data = FilmData {
            width: region.extent[0],
            height: region.extent[1],
            luminance_scale: state.scale(),
            counts: state.counts(),
            ..FilmData::default()
        };
        let samples = state.samples();
        let gpu = self.gpu.clone();
        let mut frame = gpu.begin()?;
        let mut buffers = [const { (None, None) }; 2];
        for ((stream, samples), buffers) in self.streams.iter_mut().zip(samples).zip(&mut buffers) {
            let Some(stream) = stream.as_mut().filter(|stream| samples > 0 && stream.is_defined()) else {
                continue;
            };
            let mut read = |image: &mut Image| -> Result<Buffer, ClientError> {
                let buffer = Buffer::new(&gpu, "readback", BufferUse::Readback, region.bytes(image))?;
                frame.cmd().scope("readback").copy_to_buffer(image, eye as u32, region, &buffer);
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
