//! Rasterisation of batches into sums: on the Vulkan device, or on the CPU if the device is the CPU.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::client::error::ClientError;
use crate::client::layout::FoldPush;
use crate::client::pass::fold::FoldPass;
use crate::client::pass::images::{BatchImages, StreamImages};
use crate::client::pass::splat::{SplatPass, Sprites, splat_push};
use crate::client::pass::variance::VariancePass;
use crate::client::reference::accumulator::Accumulator;
use crate::client::reference::sums::HostSums;
use crate::client::settings::{FilmData, FilmSpec};
use crate::client::state::FilmState;
use crate::client::upload::{BatchSnapshot, MOST_PENDING, Uploader, VertexBatch};
use crate::gpu::{Buffer, BufferUse, Cmd, FrameNumber, Gpu, Image};
use crate::stream::Sample;

/// Images of camera and light, with a layer for each eye; `None` before the stream's first sample.
pub type Streams = [Option<StreamImages>; 2];

/// The layer of the images that a rasteriser adds to, and how many there are.
#[derive(Clone, Copy, Debug)]
pub struct EyeLayer {
    /// 0, or 1 for the right one of two eyes.
    pub index: u32,
    /// The number of eyes.
    pub count: u32,
}

/// Rasteriser of batches.
pub enum Raster {
    /// Passes on the device, into its images.
    Device(Box<DeviceRaster>),
    /// The CPU, which copies the sums to the images when they are read. A driver that runs on the CPU takes seven times as long for the
    /// same sums (`tools/bench client`), which delays every edit.
    Host(Box<HostRaster>),
}

/// Batches, passes and images on a device.
pub struct DeviceRaster {
    gpu: Arc<Gpu>,
    layer: EyeLayer,
    uploader: Uploader,
    /// Created with the first batch.
    passes: Option<Passes>,
    /// The frame that rasterises the last batch.
    rasterised: FrameNumber,
}

/// Passes of a batch, and their images.
struct Passes {
    splat: SplatPass,
    fold: FoldPass,
    variance: Option<VariancePass>,
    targets: BatchImages,
}

/// Sums in main memory.
#[derive(Default)]
pub struct HostRaster {
    sums: HostSums,
    /// Whether the images hold the present sums.
    copied: bool,
    /// Samples rasterised since this was last read, and the time that took.
    spent: (u64, Duration),
}

impl Raster {
    /// A rasteriser on the device.
    ///
    /// # Errors
    ///
    /// [`ClientError::Threads`].
    pub fn device(gpu: &Arc<Gpu>, spec: &FilmSpec, layer: EyeLayer) -> Result<Self, ClientError> {
        Ok(Self::Device(Box::new(DeviceRaster {
            gpu: gpu.clone(),
            layer,
            uploader: Uploader::new(gpu, spec)?,
            passes: None,
            rasterised: FrameNumber::default(),
        })))
    }

    /// A rasteriser on the CPU.
    pub fn host() -> Self {
        Self::Host(Box::default())
    }

    /// The sums, if in main memory.
    pub fn into_host_sums(self) -> Option<HostSums> {
        match self {
            Self::Device(_) => None,
            Self::Host(host) => Some(host.sums),
        }
    }

    /// The rasteriser for another device after this one was lost; `None` if the batch was on it.
    pub fn moved(self) -> Option<Self> {
        match self {
            Self::Device(_) => None,
            Self::Host(host) => Some(Self::Host(Box::new(HostRaster { copied: false, ..*host }))),
        }
    }

    /// Adds a sample that `state` has [taken](FilmState::take). When [`is_full`](Self::is_full) returns true, [`advance`](Self::advance)
    /// must be called next.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        match self {
            Self::Device(device) => device.uploader.push(sample),
            Self::Host(host) => host.sums.push(sample),
        }
    }

    /// Whether the batch in main memory, or its present chunk for the device, is full.
    #[inline]
    pub fn is_full(&self, state: &FilmState) -> bool {
        match self {
            Self::Device(device) => device.uploader.is_chunk_full(),
            Self::Host(_) => state.is_full(),
        }
    }

    /// Rasterises the full batch on the CPU; or sends the full chunk to the device and begins to draw the batches that are ready.
    ///
    /// # Errors
    ///
    /// [`ClientError`]; samples are lost then.
    pub fn advance(&mut self, state: &mut FilmState, streams: &mut Streams) -> Result<(), ClientError> {
        match self {
            Self::Device(device) => {
                device.uploader.send(moment(state), false);
                device.draw_batches(state, streams, MOST_PENDING)
            }
            Self::Host(host) => host.draw(state),
        }
    }

    /// Begins to draw all full batches.
    ///
    /// # Errors
    ///
    /// As [`advance`](Self::advance).
    pub fn settle(&mut self, state: &mut FilmState, streams: &mut Streams) -> Result<(), ClientError> {
        match self {
            Self::Device(device) => device.draw_batches(state, streams, 0),
            Self::Host(_) => Ok(()),
        }
    }

    /// Begins to draw all waiting samples.
    ///
    /// # Errors
    ///
    /// As [`advance`](Self::advance).
    pub fn flush(&mut self, state: &mut FilmState, streams: &mut Streams) -> Result<(), ClientError> {
        match self {
            Self::Device(device) => {
                state.end_chunk();
                device.uploader.send(moment(state), true);
                device.draw_batches(state, streams, 0)
            }
            Self::Host(host) => host.draw(state),
        }
    }

    /// Discards batches and sums; the contents of the device's images stay.
    pub fn clear(&mut self) {
        match self {
            Self::Device(device) => device.uploader.clear(),
            Self::Host(host) => {
                host.sums.clear();
                host.copied = false;
            }
        }
    }

    /// Replaces the sums by ones read from a film of one eye, including its overscan.
    pub fn restore(
        &mut self,
        data: &FilmData,
        spec: &FilmSpec,
        streams: &mut Streams,
    ) -> Result<(), ClientError> {
        let device = match self {
            Self::Device(device) => device,
            Self::Host(host) => {
                host.copied = false;
                return host.sums.restore(spec, data);
            }
        };
        let color = [data.camera.as_flattened(), data.light.as_flattened()];
        let variance = [&data.camera_variance, &data.light_variance];
        make_images(&device.gpu, spec, color.map(|sums| sums.len() as u64), true, 1, streams)?;
        let mut frame = device.gpu.begin()?;
        for (stream, images) in streams.iter_mut().enumerate() {
            let Some(images) = images.as_mut().filter(|_| !color[stream].is_empty()) else { continue };
            // The remainders are cleared to zero.
            images.define(&mut frame.cmd());
            copy_sums(&device.gpu, &mut frame.cmd(), &[(color[stream], variance[stream])], images)?;
        }
        device.rasterised = frame.submit()?;
        Ok(())
    }

    /// The sums, if in main memory.
    pub fn host_sums(&self) -> Option<&HostSums> {
        match self {
            Self::Device(_) => None,
            Self::Host(host) => Some(&host.sums),
        }
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        match self {
            Self::Device(_) => Default::default(),
            Self::Host(host) => std::mem::take(&mut host.spent),
        }
    }

    /// Number of the frame that draws the last batch.
    pub fn rasterised(&self) -> FrameNumber {
        match self {
            Self::Device(device) => device.rasterised,
            Self::Host(_) => FrameNumber::default(),
        }
    }
}

impl DeviceRaster {
    /// Begins to draw the batches that are ready, after waiting until at most `pending` chunks are unsorted. After an error the other
    /// batches are still drawn.
    fn draw_batches(
        &mut self,
        state: &mut FilmState,
        streams: &mut Streams,
        pending: usize,
    ) -> Result<(), ClientError> {
        let mut outcome = Ok(());
        while let Some(batch) = self.uploader.next_batch(pending) {
            let drawn = match batch {
                Ok(batch) => {
                    state.leave(batch.samples());
                    self.draw(batch, state.spec(), streams)
                }
                Err((error, lost)) => {
                    state.leave(lost);
                    Err(error)
                }
            };
            outcome = outcome.and(drawn);
        }
        outcome
    }

    /// Records the passes of a batch.
    fn draw(
        &mut self,
        batch: VertexBatch,
        spec: &FilmSpec,
        streams: &mut Streams,
    ) -> Result<(), ClientError> {
        let BatchSnapshot { samples, scale } = batch.moment();
        let inverse_scale = scale.recip();
        let EyeLayer { index: layer, count } = self.layer;
        make_images(&self.gpu, spec, samples, true, count, streams)?;
        let passes = match &mut self.passes {
            Some(passes) => passes,
            empty => empty.insert(Passes::new(&self.gpu, spec)?),
        };
        let push = splat_push(spec, inverse_scale);
        let mut frame = self.gpu.begin()?;
        let cmd = &mut frame.cmd();
        for (i, stream) in streams.iter_mut().enumerate() {
            let Some(stream) = stream else {
                continue;
            };
            // Also if all samples of the stream lie outside: displayed sums must be defined.
            stream.define(cmd);
            if batch.is_empty(i) {
                continue;
            }
            stream.changed();
            let sprites = Sprites { vertices: &batch, stream: i, push };
            let targets = &mut passes.targets;
            passes.splat.record(cmd, &sprites, &mut targets.color);
            passes.fold.record(cmd, layer, &mut stream.color, targets, &FoldPush { inverse_scale });
            if let (Some(pass), Some(deviations), Some(sums)) =
                (&passes.variance, &mut targets.deviations, &mut stream.variance)
            {
                pass.record(cmd, layer, &sprites, deviations, sums);
            }
        }
        let number = frame.submit()?;
        batch.submitted(number);
        self.rasterised = number;
        Ok(())
    }
}

impl Passes {
    fn new(gpu: &Arc<Gpu>, spec: &FilmSpec) -> Result<Self, ClientError> {
        Ok(Self {
            splat: SplatPass::new(gpu, spec)?,
            fold: FoldPass::new(gpu, spec)?,
            variance: spec.variance.map(|form| VariancePass::new(gpu, spec, form)).transpose()?,
            targets: BatchImages::new(gpu, spec)?,
        })
    }
}

impl HostRaster {
    /// Rasterises the batch; on an error its samples are lost.
    fn draw(&mut self, state: &mut FilmState) -> Result<(), ClientError> {
        let (start, samples) = (Instant::now(), state.waiting() as u64);
        state.start_raster();
        self.copied = false;
        let outcome = self.sums.raster(state);
        self.spent = (self.spent.0 + samples, self.spent.1 + start.elapsed());
        outcome
    }
}

/// Records the copy of the sums of all eyes that the images do not hold yet, where they are in main memory.
pub fn complete<'a>(
    gpu: &Arc<Gpu>,
    cmd: &mut Cmd<'_>,
    spec: &FilmSpec,
    eyes: impl Iterator<Item = &'a mut Raster>,
    streams: &mut Streams,
) -> Result<(), ClientError> {
    let host = |raster: &'a mut Raster| match raster {
        Raster::Device(_) => None,
        Raster::Host(host) => Some(host),
    };
    let mut eyes: Vec<_> = eyes.filter_map(host).collect();
    if eyes.iter().all(|host| host.copied) {
        return Ok(());
    }
    let drawn =
        [0, 1].map(|stream| eyes.iter().filter(|host| host.sums.stream(stream).is_some()).count() as u64);
    make_images(gpu, spec, drawn, false, eyes.len() as u32, streams)?;
    let cmd = &mut cmd.scope("copy");
    for (i, images) in streams.iter_mut().enumerate() {
        let Some(images) = images.as_mut().filter(|_| drawn[i] > 0) else { continue };
        let sums: Vec<_> =
            eyes.iter().map(|host| host.sums.stream(i).map(floats_of).unwrap_or_default()).collect();
        copy_sums(gpu, cmd, &sums, images)?;
    }
    for host in &mut eyes {
        host.copied = true;
    }
    Ok(())
}

fn moment(state: &FilmState) -> BatchSnapshot {
    BatchSnapshot { samples: state.samples(), scale: state.scale() }
}

/// The sums of colour and of variance.
fn floats_of(sums: &Accumulator) -> (&[f32], &[f32]) {
    (bytemuck::cast_slice(sums.color_sums()), sums.variance_sums())
}

/// Records the copy of a stream's sums of colour and variance into its images, eye by eye; empty ones are those of an eye without samples.
fn copy_sums(
    gpu: &Arc<Gpu>,
    cmd: &mut Cmd<'_>,
    eyes: &[(&[f32], &[f32])],
    images: &mut StreamImages,
) -> Result<(), ClientError> {
    // Although dropped here, the buffers live until the frame that reads them has completed.
    let mut copy = |sums: &[&[f32]], image: &mut Image| -> Result<(), ClientError> {
        let longest = sums.iter().map(|sums| sums.len()).max().unwrap_or_default();
        let upload = |sums: &&[f32]| match sums.is_empty() {
            true => {
                Buffer::filled(gpu, "sums", BufferUse::Upload, bytemuck::cast_slice(&vec![0f32; longest]))
            }
            false => Buffer::filled(gpu, "sums", BufferUse::Upload, bytemuck::cast_slice(sums)),
        };
        let buffers = sums.iter().map(upload).collect::<Result<Vec<_>, _>>()?;
        cmd.copy_from_buffers(&buffers.iter().collect::<Vec<_>>(), image);
        Ok(())
    };
    images.changed();
    let (color, variance): (Vec<_>, Vec<_>) = eyes.iter().copied().unzip();
    copy(&color, images.color.sums_mut())?;
    if let Some(sums) = &mut images.variance {
        copy(&variance, sums.sums_mut())?;
    }
    images.written();
    Ok(())
}

/// Creates a stream's images with its first sample; `folded` and `eyes` as in [`StreamImages::new`].
fn make_images(
    gpu: &Arc<Gpu>,
    spec: &FilmSpec,
    samples: [u64; 2],
    folded: bool,
    eyes: u32,
    streams: &mut Streams,
) -> Result<(), ClientError> {
    /// Name prefixes of the streams' images.
    const NAMES: [&str; 2] = ["camera", "light"];
    for (i, stream) in streams.iter_mut().enumerate() {
        if samples[i] > 0 && stream.is_none() {
            *stream = Some(StreamImages::new(gpu, NAMES[i], spec, folded, eyes)?);
        }
    }
    Ok(())
}
