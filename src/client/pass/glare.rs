//! Glare of the eye, a convolution by Fourier transform in compute (paper §4.2, step 5).

use std::sync::Arc;

use crate::client::error::ClientError;
use crate::client::glare::{Axis, Kernel, spectrum};
use crate::client::later::{Later, Patience};
use crate::client::layout::GlarePush;
use crate::client::settings::Glare;
use crate::gpu::{
    Access, Binding, Buffer, BufferUse, Cmd, ComputeDesc, ComputePipeline, Gpu, GpuError, Image,
};

/// Most stages of a transform.
const STAGES: usize = 8;

/// The picture as an eye sees it that scatters light. Nothing is made before the first [`record`](Self::record).
///
/// Reads and writes: the picture. Three passes: rows to frequencies, columns times kernel, rows back; one workgroup
/// transforms one line in shared memory. Cost depends on the picture's extent alone.
#[derive(Default)]
pub struct GlarePass {
    made: Option<Made>,
    under_way: Option<(Key, Later<Result<Made, ClientError>>)>,
}

/// Extent of the picture and state of the eye.
type Key = ([u32; 2], Glare);

/// What depends on both.
struct Made {
    key: Key,
    tables: Tables,
    pipelines: Arc<Pipelines>,
}

/// The shaders for these lengths.
struct Pipelines {
    halves: [usize; 2],
    rows: ComputePipeline,
    columns: ComputePipeline,
    back: ComputePipeline,
}

/// What the shaders read and write.
struct Tables {
    extent: [u32; 2],
    axes: [Axis; 2],
    /// Twiddles and places of either axis.
    lines: [Buffer; 2],
    gain: Buffer,
    /// Spectrum of each channel's kernel; a single one where they are equal.
    kernels: Vec<Buffer>,
    /// Frequencies of each channel's rows.
    work: [Buffer; 3],
}

impl GlarePass {
    /// Adds glare to the picture, in place; `picture` was made by [`Image::storage`]. What depends on its extent and on
    /// `glare` is made when either changes: at once, or in the background, and then until it is there the picture gets
    /// the glare of before, or none where its extent is another.
    ///
    /// # Errors
    ///
    /// [`ClientError::Memory`] and [`ClientError::Gpu`], among them [`GpuError::TooLarge`] where a line does not fit
    /// into the memory that a workgroup shares, or a channel into a buffer.
    pub fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        picture: &mut Image,
        (glare, patience): (&Glare, Patience),
    ) -> Result<(), ClientError> {
        let extent = picture.extent(0);
        self.make(gpu, (extent, *glare), patience)?;
        if let Some(made) = self.made.as_ref().filter(|made| made.key.0 == extent) {
            made.pipelines.record(&mut cmd.scope("glare"), &made.tables, picture);
        }
        Ok(())
    }

    /// True while something is made in the background.
    pub fn awaits(&self) -> bool {
        self.under_way.is_some()
    }

    /// True when something that was made in the background is there to be shown.
    pub fn has_arrived(&self) -> bool {
        self.under_way.as_ref().is_some_and(|(_, later)| later.is_there())
    }

    /// Makes what `key` needs, or sees to it that it is being made.
    fn make(&mut self, gpu: &Arc<Gpu>, key: Key, patience: Patience) -> Result<(), ClientError> {
        let ready = |later: &Later<_>| patience == Patience::Wait || later.is_there();
        if self.made.as_ref().is_some_and(|made| made.key == key) {
            self.under_way = None;
        } else if let Some((_, later)) = self.under_way.take_if(|(k, later)| *k == key && ready(later))
            && let Some(made) = later.wait()
        {
            self.made = Some(made?);
        } else if patience == Patience::Wait {
            (self.made, self.under_way) = (Some(Made::new(gpu, key, self.pipelines())?), None);
        } else if self.under_way.as_ref().is_none_or(|(_, later)| later.is_there()) {
            // One at a time: while a slider moves, what it passes by is not made.
            let (device, pipelines) = (gpu.clone(), self.pipelines());
            match Later::begin(move || Made::new(&device, key, pipelines)) {
                Some(later) => self.under_way = Some((key, later)),
                None => self.made = Some(Made::new(gpu, key, self.pipelines())?),
            }
        }
        Ok(())
    }

    fn pipelines(&self) -> Option<Arc<Pipelines>> {
        self.made.as_ref().map(|made| made.pipelines.clone())
    }
}

impl Made {
    /// `old` is used again where the lengths are the same.
    fn new(gpu: &Arc<Gpu>, key: Key, old: Option<Arc<Pipelines>>) -> Result<Self, ClientError> {
        let tables = Tables::new(gpu, key.0, &key.1)?;
        let halves = [tables.axes[0].half, tables.axes[1].half];
        let pipelines = match old.filter(|old| old.halves == halves) {
            Some(old) => old,
            None => Arc::new(Pipelines::new(gpu, &tables.axes)?),
        };
        Ok(Self { key, tables, pipelines })
    }
}

impl Pipelines {
    fn new(gpu: &Arc<Gpu>, [across, down]: &[Axis; 2]) -> Result<Self, GpuError> {
        let make = |shader, axis: &Axis, images: &[bool]| {
            let mut constants = [1; STAGES + 1];
            constants[0] = axis.half as u32;
            constants[1..=axis.radices.len()].copy_from_slice(&axis.radices);
            let shader = (shader, &constants[..]);
            ComputePipeline::new(gpu, &ComputeDesc { shader, push_bytes: size_of::<GlarePush>(), images })
        };
        Ok(Self {
            halves: [across.half, down.half],
            rows: make("glare_rows.comp", across, &[false, true, false, false])?,
            columns: make("glare_columns.comp", down, &[false; 3])?,
            back: make("glare_back.comp", across, &[false, true, false, false, false])?,
        })
    }

    fn record(&self, cmd: &mut Cmd<'_>, tables: &Tables, picture: &mut Image) {
        let pairs = tables.extent[1].div_ceil(2);
        let push = |channel| GlarePush { extent: tables.extent, channel };
        let lines = tables.lines.each_ref().map(Binding::Buffer);
        let work = tables.work.each_ref().map(Binding::Buffer);
        cmd.access(picture, Access::Storage);
        cmd.storage_in_turn();
        for (channel, work) in (0..).zip(work) {
            let bindings = [lines[0], Binding::Image(picture), Binding::Buffer(&tables.gain), work];
            cmd.dispatch(&self.rows, bytemuck::bytes_of(&push(channel)), &bindings, pairs);
        }
        cmd.storage_in_turn();
        for (channel, work) in (0..).zip(work) {
            let kernel = &tables.kernels[(channel as usize).min(tables.kernels.len() - 1)];
            let bindings = [lines[1], Binding::Buffer(kernel), work];
            let columns = tables.axes[0].half as u32 + 1;
            cmd.dispatch(&self.columns, bytemuck::bytes_of(&push(channel)), &bindings, columns);
        }
        cmd.storage_in_turn();
        cmd.access(picture, Access::Storage);
        let bindings = [lines[0], Binding::Image(picture), work[0], work[1], work[2]];
        cmd.dispatch(&self.back, bytemuck::bytes_of(&push(0)), &bindings, pairs);
    }
}

impl Tables {
    fn new(gpu: &Arc<Gpu>, extent: [u32; 2], glare: &Glare) -> Result<Self, ClientError> {
        let [width, height] = extent;
        let axes = extent.map(|n| Axis::new(n as usize));
        let no_memory = || ClientError::Memory {
            what: "glare",
            bytes: u64::from(width) * u64::from(height) * 2 * size_of::<[f32; 3]>() as u64,
        };
        let columns = axes[0].half + 1;
        let work = columns * height.next_multiple_of(2) as usize * size_of::<[f32; 2]>();
        let most = gpu.shared_bytes() / size_of::<[f32; 2]>();
        if axes.iter().any(|axis| axis.half > most || axis.radices.len() > STAGES)
            || work > gpu.storage_bytes()
        {
            let limit = most.min((gpu.storage_bytes() / size_of::<[f32; 2]>()).isqrt()) as u32;
            return Err(
                GpuError::TooLarge { name: "the picture for glare".into(), width, height, limit }.into()
            );
        }
        let kernel = Kernel::new([width as usize, height as usize], glare).ok_or_else(no_memory)?;
        let spectra = spectrum(&kernel, [&axes[0], &axes[1]]).ok_or_else(no_memory)?;
        let kernels = spectra.chunks_exact(columns * (axes[1].half + 1));
        let scratch = |name| Buffer::new(gpu, name, BufferUse::Scratch, work);
        Ok(Self {
            extent,
            lines: [line_table(gpu, &axes[0])?, line_table(gpu, &axes[1])?],
            gain: table(gpu, "glare gain", bytemuck::cast_slice(kernel.gain.pixels()))?,
            kernels: kernels
                .map(|plane| table(gpu, "glare kernel", bytemuck::cast_slice(plane)))
                .collect::<Result<_, _>>()?,
            work: [scratch("glare X")?, scratch("glare Y")?, scratch("glare Z")?],
            axes,
        })
    }
}

/// Twiddles, then the place of every frequency, as `include/fourier.glsl` reads them.
fn line_table(gpu: &Arc<Gpu>, axis: &Axis) -> Result<Buffer, GpuError> {
    let mut data = axis.twiddles();
    let mut places = vec![[0.0f32; 2]; axis.half];
    for (place, frequency) in axis.frequencies().into_iter().enumerate() {
        places[frequency as usize][0] = place as f32; // below 2²⁴: exact
    }
    data.append(&mut places);
    table(gpu, "glare line", bytemuck::cast_slice(&data))
}

/// A buffer with these contents.
fn table(gpu: &Arc<Gpu>, name: &str, bytes: &[u8]) -> Result<Buffer, GpuError> {
    let mut buffer = Buffer::new(gpu, name, BufferUse::Table, bytes.len())?;
    buffer.mapped_mut().copy_from_slice(bytes);
    Ok(buffer)
}
