//! Glare of the eye, a convolution by Fourier transform in compute (paper §4.2, step 5).

use std::sync::{Arc, Once};

use crate::client::background::{BackgroundPolicy, BackgroundTask};
use crate::client::compiled_effects::DETAILS;
use crate::client::error::ClientError;
use crate::client::glare::{FourierAxis, GlareKernel, spectrum};
use crate::client::layout::GlarePush;
use crate::client::settings::Glare;
use crate::gpu::{
    Access, Buffer, BufferUse, Cmd, ComputeDesc, ComputePipeline, Gpu, GpuError, Image, StorageBinding,
};

/// Largest number of stages of a transform.
const STAGES: usize = 8;

/// Adds the light scattered in the observer's eye. Nothing is allocated before the first [`record`](Self::record).
///
/// Reads and writes: the picture. Three passes: rows to frequencies, columns times kernel, rows back; one workgroup
/// transforms one line in shared memory. Cost depends on the picture's extent alone.
pub struct GlarePass {
    gpu: Arc<Gpu>,
    convolution: Option<GlareConvolution>,
    under_way: Option<(GlareKey, BackgroundTask<Result<GlareConvolution, ClientError>>)>,
}

/// What a convolution is for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GlareKey {
    /// Width and height of the picture.
    extent: [u32; 2],
    /// Its layers.
    layers: u32,
    /// State of the eye.
    glare: Glare,
}

/// Tables and shaders of the convolution for one picture and one eye.
struct GlareConvolution {
    key: GlareKey,
    tables: GlareTables,
    shaders: Arc<GlareShaders>,
}

/// Shaders for transforms of these lengths, of pictures with so many layers.
struct GlareShaders {
    halves: [usize; 2],
    layers: u32,
    rows: ComputePipeline,
    columns: ComputePipeline,
    back: ComputePipeline,
}

/// The buffers that the shaders read and write.
struct GlareTables {
    extent: [u32; 2],
    axes: [FourierAxis; 2],
    /// Twiddle factors and frequency order, per axis.
    lines: [Buffer; 2],
    gain: Buffer,
    /// Spectrum of each channel's kernel; a single one if they are equal.
    kernels: Vec<Buffer>,
    /// Row frequencies of each channel, layer by layer.
    work: [Buffer; 3],
}

impl GlarePass {
    /// A pass without a convolution.
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self { gpu: gpu.clone(), convolution: None, under_way: None }
    }

    /// Adds glare to the picture, in place; `picture` is an image [for storage](crate::gpu::ImageDesc::storage). When its extent or `glare` changes, the
    /// convolution is set up anew, at once or in the background according to `policy`. Until it is ready the picture gets the previous
    /// glare, or none if the extent has changed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Memory`] and [`ClientError::Gpu`], including [`GpuError::TooLarge`] if a line exceeds the shared memory of a
    /// workgroup, or a channel exceeds a buffer.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        picture: &mut Image,
        glare: &Glare,
        policy: BackgroundPolicy,
    ) -> Result<(), ClientError> {
        let key = GlareKey { extent: picture.extent(0), layers: picture.layers(), glare: *glare };
        self.make(key, policy)?;
        let fits = |made: &&GlareConvolution| GlareKey { glare: *glare, ..made.key } == key;
        if let Some(convolution) = self.convolution.as_ref().filter(fits) {
            convolution.shaders.record(&mut cmd.scope("glare"), &convolution.tables, picture);
        }
        Ok(())
    }

    /// Whether a convolution set up in the background is ready.
    pub fn is_ready(&self) -> bool {
        self.under_way.as_ref().is_some_and(|(_, task)| task.is_ready())
    }

    /// Sets up the convolution for `key`, at once or in the background.
    fn make(&mut self, key: GlareKey, policy: BackgroundPolicy) -> Result<(), ClientError> {
        let block = policy == BackgroundPolicy::Block;
        let ready = |task: &BackgroundTask<_>| block || task.is_ready();
        if self.convolution.as_ref().is_some_and(|made| made.key == key) {
            self.under_way = None;
        } else if let Some((_, task)) = self.under_way.take_if(|(k, task)| *k == key && ready(task))
            && let Some(made) = task.wait()
        {
            self.convolution = Some(made?);
        } else if block {
            self.convolution = Some(GlareConvolution::new(&self.gpu, key, self.shaders())?);
            self.under_way = None;
        } else if self.under_way.as_ref().is_none_or(|(_, task)| task.is_ready()) {
            // One at a time: while a slider is dragged, intermediate values are skipped.
            let (device, shaders) = (self.gpu.clone(), self.shaders());
            match BackgroundTask::start(move || GlareConvolution::new(&device, key, shaders)) {
                Some(task) => self.under_way = Some((key, task)),
                None => self.convolution = Some(GlareConvolution::new(&self.gpu, key, self.shaders())?),
            }
        }
        Ok(())
    }

    fn shaders(&self) -> Option<Arc<GlareShaders>> {
        self.convolution.as_ref().map(|made| made.shaders.clone())
    }
}

impl GlareConvolution {
    /// Reuses the shaders of `old` if the lengths are the same.
    fn new(gpu: &Arc<Gpu>, key: GlareKey, old: Option<Arc<GlareShaders>>) -> Result<Self, ClientError> {
        let tables = GlareTables::new(gpu, key)?;
        let halves = [tables.axes[0].half, tables.axes[1].half];
        let shaders = match old.filter(|old| (old.halves, old.layers) == (halves, key.layers)) {
            Some(old) => old,
            None => Arc::new(GlareShaders::new(gpu, &tables.axes, key.layers)?),
        };
        Ok(Self { key, tables, shaders })
    }
}

impl GlareShaders {
    fn new(gpu: &Arc<Gpu>, [across, down]: &[FourierAxis; 2], layers: u32) -> Result<Self, GpuError> {
        let make = |shader, axis: &FourierAxis, images: &[bool]| {
            let mut constants = [1; STAGES + 1];
            constants[0] = axis.half as u32;
            constants[1..=axis.radices.len()].copy_from_slice(&axis.radices);
            let shader = (shader, &constants[..]);
            let push_bytes = size_of::<GlarePush>();
            ComputePipeline::new(gpu, &ComputeDesc { shader, push_bytes, textures: 0, images, layers })
        };
        Ok(Self {
            halves: [across.half, down.half],
            layers,
            rows: make("glare_rows.comp", across, &[false, true, false, false])?,
            columns: make("glare_columns.comp", down, &[false; 3])?,
            back: make("glare_back.comp", across, &[false, true, false, false, false])?,
        })
    }

    fn record(&self, cmd: &mut Cmd<'_>, tables: &GlareTables, picture: &mut Image) {
        let pairs = tables.extent[1].div_ceil(2);
        let push = |channel| GlarePush { extent: tables.extent, channel };
        let lines = tables.lines.each_ref().map(StorageBinding::Buffer);
        let work = tables.work.each_ref().map(StorageBinding::Buffer);
        cmd.access(picture, Access::Storage);
        cmd.storage_in_turn();
        for (channel, work) in (0..).zip(work) {
            let bindings =
                [lines[0], StorageBinding::Image(picture), StorageBinding::Buffer(&tables.gain), work];
            cmd.dispatch(&self.rows, bytemuck::bytes_of(&push(channel)), &bindings, [pairs, 1]);
        }
        cmd.storage_in_turn();
        for (channel, work) in (0..).zip(work) {
            let kernel = &tables.kernels[(channel as usize).min(tables.kernels.len() - 1)];
            let bindings = [lines[1], StorageBinding::Buffer(kernel), work];
            let columns = tables.axes[0].half as u32 + 1;
            cmd.dispatch(&self.columns, bytemuck::bytes_of(&push(channel)), &bindings, [columns, 1]);
        }
        cmd.storage_in_turn();
        cmd.access(picture, Access::Storage);
        let bindings = [lines[0], StorageBinding::Image(picture), work[0], work[1], work[2]];
        cmd.dispatch(&self.back, bytemuck::bytes_of(&push(0)), &bindings, [pairs, 1]);
    }
}

impl GlareTables {
    fn new(gpu: &Arc<Gpu>, GlareKey { extent, layers, glare }: GlareKey) -> Result<Self, ClientError> {
        let [width, height] = extent;
        let axes = extent.map(|n| FourierAxis::new(n as usize));
        let no_memory = || ClientError::Memory {
            what: "glare",
            bytes: u64::from(width) * u64::from(height) * 2 * size_of::<[f32; 3]>() as u64,
        };
        let columns = axes[0].half + 1;
        let work = layers as usize * work_bytes(&axes);
        if !fits(gpu, &axes) || work > gpu.storage_bytes() {
            let most = gpu.shared_bytes() / size_of::<[f32; 2]>();
            let limit = most.min((gpu.storage_bytes() / size_of::<[f32; 2]>()).isqrt()) as u32;
            return Err(
                GpuError::TooLarge { name: "the picture for glare".into(), width, height, limit }.into()
            );
        }
        let kernel = GlareKernel::new([width as usize, height as usize], &glare).ok_or_else(no_memory)?;
        let spectra = spectrum(&kernel, [&axes[0], &axes[1]]).ok_or_else(no_memory)?;
        let kernels = spectra.chunks_exact(columns * (axes[1].half + 1));
        let scratch = |name| Buffer::new(gpu, name, BufferUse::Scratch, work);
        Ok(Self {
            extent,
            lines: [line_table(gpu, &axes[0])?, line_table(gpu, &axes[1])?],
            gain: Buffer::filled(
                gpu,
                "glare gain",
                BufferUse::Table,
                bytemuck::cast_slice(kernel.gain.pixels()),
            )?,
            kernels: kernels
                .map(|plane| {
                    Buffer::filled(gpu, "glare kernel", BufferUse::Table, bytemuck::cast_slice(plane))
                })
                .collect::<Result<_, _>>()?,
            work: [scratch("glare X")?, scratch("glare Y")?, scratch("glare Z")?],
            axes,
        })
    }
}

/// The finest internal resolution, one of [`DETAILS`], at which this device can compute the glare of a picture of this extent; 1 if it can
/// at none. Many devices have 32 KiB of shared memory per workgroup, enough for a line of 4,096 texels.
pub fn glare_detail(gpu: &Gpu, extent: [u32; 2]) -> u32 {
    static TOLD: Once = Once::new();
    let of = |detail: u32| extent.map(|n| FourierAxis::new(n.div_ceil(detail) as usize));
    let detail = DETAILS.into_iter().find(|detail| fits(gpu, &of(*detail))).unwrap_or(1);
    if detail > 1 {
        TOLD.call_once(|| {
            let [width, height] = extent;
            tracing::warn!(
                "glare of {width}×{height} pixels does not fit this device ({} KiB for a workgroup): the picture is computed \
                 on a grid of {detail}×{detail} pixels; --device cpu has it in full",
                gpu.shared_bytes() >> 10
            );
        });
    }
    detail
}

/// Whether shared memory suffices to transform a line, and a buffer for the frequencies of a channel.
fn fits(gpu: &Gpu, axes: &[FourierAxis; 2]) -> bool {
    let most = gpu.shared_bytes() / size_of::<[f32; 2]>();
    let transforms = axes.iter().all(|axis| axis.half <= most && axis.radices.len() <= STAGES);
    transforms && work_bytes(axes) <= gpu.storage_bytes()
}

/// Bytes of the frequencies of a channel's rows.
fn work_bytes([across, down]: &[FourierAxis; 2]) -> usize {
    (across.half + 1) * down.pixels.next_multiple_of(2) * size_of::<[f32; 2]>()
}

/// Twiddle factors, followed by the position of every frequency, as `include/fourier.glsl` reads them.
fn line_table(gpu: &Arc<Gpu>, axis: &FourierAxis) -> Result<Buffer, GpuError> {
    let mut data = axis.twiddles();
    let mut places = vec![[0.0f32; 2]; axis.half];
    for (place, frequency) in axis.frequencies().into_iter().enumerate() {
        places[frequency as usize][0] = place as f32; // below 2²⁴: exact
    }
    data.append(&mut places);
    Buffer::filled(gpu, "glare line", BufferUse::Table, bytemuck::cast_slice(&data))
}
