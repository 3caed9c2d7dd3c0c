//! Downsampled copies of a picture displayed much smaller than its size: a single blit would read 4 texels per pixel and skip the others,
//! so that noise and thin lines would flicker.
//!
//! Averages are of encoded values: small bright spots come out slightly darker than an average of linear light.

use std::sync::Arc;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::device::gpu::Gpu;
use crate::gpu::error::GpuError;
use crate::gpu::resources::image::{Image, ImageDesc};
use crate::gpu::window::images::{CopyFilter, CopyRegion, WindowImage};

/// The copies, each half the size of the previous one.
#[derive(Default)]
pub(in crate::gpu) struct ReducedPictures {
    levels: Vec<Image>,
    /// Number of copies that hold the present picture.
    made: usize,
}

impl ReducedPictures {
    /// Halves the picture until no region has many more texels than its target in the window. Returns the smallest copy, and the regions in
    /// it. If `is_new` is false the picture is that of the previous call, and its copies are reused.
    ///
    /// # Errors
    ///
    /// Those of [`Image::of`] for the copies.
    pub fn of<'a>(
        &'a mut self,
        gpu: &Arc<Gpu>,
        cmd: &mut Cmd<'_>,
        picture: &'a mut Image,
        regions: &[CopyRegion],
        is_new: bool,
    ) -> Result<(&'a mut Image, Vec<CopyRegion>), GpuError> {
        let (mut regions, mut level) = (regions.to_vec(), 0);
        self.made = if is_new { 0 } else { self.made };
        while regions.iter().any(is_reduced) {
            let whole = if level == 0 { &*picture } else { &self.levels[level - 1] };
            let extent = whole.extent(0).map(|n| n.div_ceil(2));
            let (format, layers) = (whole.format(), whole.layers());
            let is_like = |half: &Image| half.format() == format && half.layers() == layers;
            let fits = |half: &Image| half.extent(0) == extent && is_like(half);
            if !self.levels.get(level).is_some_and(fits) {
                self.levels.truncate(level);
                self.made = self.made.min(level);
                let desc = ImageDesc::new(format, extent).layered(layers);
                self.levels.push(Image::of(gpu, "window.reduced", desc)?);
            }
            if level >= self.made {
                let (before, rest) = self.levels.split_at_mut(level);
                halve(cmd, before.last_mut().unwrap_or(&mut *picture), &mut rest[0]);
                self.made = level + 1;
            }
            regions.iter_mut().for_each(|region| *region = in_half(*region, extent));
            level += 1;
        }
        self.levels.truncate(level);
        self.made = self.made.min(level);
        Ok((self.levels.last_mut().unwrap_or(picture), regions))
    }
}

/// Width or height of a rectangle.
fn size(corners: [[i32; 2]; 2], axis: usize) -> i32 {
    corners[1][axis] - corners[0][axis]
}

/// Whether there are more than 3 texels for 2 window pixels along an axis, so that a linear filter would skip some.
fn is_reduced(region: &CopyRegion) -> bool {
    (0..2).any(|axis| 2 * size(region.from, axis) > 3 * size(region.to, axis).max(1))
}

/// The same region in the picture at half the size; texels cut by the border are included.
fn in_half(region: CopyRegion, extent: [u32; 2]) -> CopyRegion {
    let [low, high] = region.from;
    let end = [0, 1].map(|axis| (high[axis] + 1) / 2).map(|n| n.max(1));
    let end = [0, 1].map(|axis| end[axis].min(extent[axis] as i32));
    CopyRegion { from: [low.map(|n| n / 2), end], ..region }
}

/// Averages 2×2 texels. The remainder of an odd side becomes a separate texel.
fn halve(cmd: &mut Cmd<'_>, picture: &mut Image, half: &mut Image) {
    let axis = |n: i32| match n % 2 {
        0 => vec![([0, n], [0, n / 2])],
        _ => vec![([0, n - 1], [0, n / 2]), ([n - 1, n], [n / 2, n / 2 + 1])],
    };
    let [columns, rows] = picture.extent(0).map(|n| axis(n as i32));
    let both = |x: [i32; 2], y: [i32; 2]| [[x[0], y[0]], [x[1], y[1]]];
    let regions = rows.iter().flat_map(|(y, to_y)| {
        columns.iter().map(move |(x, to_x)| CopyRegion { from: both(*x, *y), to: both(*to_x, *to_y) })
    });
    let regions: Vec<_> =
        regions.filter(|region| size(region.from, 0) > 0 && size(region.from, 1) > 0).collect();
    let mut shown = WindowImage::of(half);
    cmd.show(picture, &mut shown, &regions, CopyFilter::Linear);
    half.access[0] = shown.access;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::commands::copies::{Region, read_image};
    use crate::gpu::device::options::GpuOptions;
    use crate::gpu::device::physical::DeviceChoice;
    use crate::gpu::resources::buffer::{Buffer, BufferUse};
    use crate::gpu::resources::image::TexelFormat;

    /// Shows a grey picture of `from` texels, given by `value`, in a window of `to` pixels; returns the displayed greys.
    fn shown(gpu: &Arc<Gpu>, from: [u32; 2], to: [u32; 2], value: impl Fn(u32, u32) -> u8) -> Vec<u8> {
        let image = |name, extent| Image::new(gpu, name, TexelFormat::Rgba8, extent).expect(name);
        let (mut picture, mut window) = (image("picture", from), image("window", to));
        let bytes = 4 * (from[0] * from[1]) as usize;
        let mut buffer = Buffer::new(gpu, "texels", BufferUse::Upload, bytes).expect("a buffer");
        for (i, texel) in buffer.mapped_mut().chunks_exact_mut(4).enumerate() {
            let grey = value(i as u32 % from[0], i as u32 / from[0]);
            texel.copy_from_slice(&[grey, grey, grey, 255]);
        }
        let mut reduced = ReducedPictures::default();
        let mut frame = gpu.begin().expect("a frame");
        let mut cmd = frame.cmd();
        cmd.copy_from_buffers(&[&buffer], &mut picture);
        let corners = |extent: [u32; 2]| [[0, 0], extent.map(|n| n as i32)];
        let whole = CopyRegion { from: corners(from), to: corners(to) };
        let (small, regions) = reduced.of(gpu, &mut cmd, &mut picture, &[whole], true).expect("memory");
        let mut image = WindowImage::of(&window);
        cmd.show(small, &mut image, &regions, CopyFilter::Linear);
        window.access[0] = image.access;
        gpu.wait(frame.submit().expect("submit")).expect("wait");
        let read = read_image(gpu, &mut window, 0, Region { origin: [0, 0], extent: to }).expect("read");
        read.chunks_exact(4).map(|texel| texel[0]).collect()
    }

    /// A window with a layer for each eye shows each its own layer of the picture, reduced or not; a picture of one layer is shown in both.
    #[test]
    fn each_layer_is_shown_in_its_own() {
        let options = GpuOptions { validation: true, ..GpuOptions::default() };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        for (from, greys) in [([8, 8], &[40, 200][..]), ([64, 64], &[40, 200]), ([64, 64], &[90])] {
            let image = |name, extent, layers| {
                let desc = ImageDesc::new(TexelFormat::Rgba8, extent).layered(layers);
                Image::of(&gpu, name, desc).expect(name)
            };
            let mut picture = image("picture", from, greys.len() as u32);
            let mut window = image("window", [8, 8], 2);
            let texels = |grey: &u8| vec![[*grey, *grey, *grey, 255]; (from[0] * from[1]) as usize];
            let upload = |grey| {
                Buffer::filled(&gpu, "texels", BufferUse::Upload, texels(grey).as_flattened())
                    .expect("a buffer")
            };
            let buffers: Vec<_> = greys.iter().map(upload).collect();
            let mut reduced = ReducedPictures::default();
            let mut frame = gpu.begin().expect("a frame");
            let mut cmd = frame.cmd();
            cmd.copy_from_buffers(&buffers.iter().collect::<Vec<_>>(), &mut picture);
            let whole = CopyRegion { from: [[0, 0], from.map(|n| n as i32)], to: [[0, 0], [8, 8]] };
            let (small, regions) = reduced.of(&gpu, &mut cmd, &mut picture, &[whole], true).expect("memory");
            let mut shown = WindowImage::of(&window);
            cmd.show(small, &mut shown, &regions, CopyFilter::Linear);
            window.access[0] = shown.access;
            gpu.wait(frame.submit().expect("submit")).expect("wait");
            let region = Region { origin: [0, 0], extent: [8, 8] };
            for layer in 0..2 {
                let grey = greys[(layer as usize).min(greys.len() - 1)];
                let read = read_image(&gpu, &mut window, layer, region).expect("read");
                assert!(read.chunks_exact(4).all(|texel| texel == [grey, grey, grey, 255]), "layer {layer}");
            }
        }
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
    }

    /// Every texel contributes to a reduced picture: isolated bright texels keep their total brightness wherever they are, while a single
    /// blit shows all or nothing of them. Pictures of even size keep their mean.
    #[test]
    fn every_texel_counts() {
        let options = GpuOptions { validation: true, ..GpuOptions::default() };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        for (from, to) in [([64, 64], [8, 8]), ([64, 32], [16, 8]), ([63, 65], [9, 9]), ([40, 40], [15, 15])]
        {
            let mean = |greys: &[u8]| greys.iter().map(|g| f64::from(*g)).sum::<f64>() / greys.len() as f64;
            for phase in 0..4 {
                let dots = |x: u32, y: u32| if x % 4 == phase && y % 4 == phase { 255 } else { 0 };
                let wanted: Vec<u8> =
                    (0..from[0] * from[1]).map(|i| dots(i % from[0], i / from[0])).collect();
                let ratio = mean(&shown(&gpu, from, to, dots)) / mean(&wanted);
                assert!((0.75..1.3).contains(&ratio), "{from:?} in {to:?}, {phase}: {ratio}");
            }
            let even = shown(&gpu, from, to, |_, _| 77);
            assert!(even.iter().all(|grey| *grey == 77), "{from:?} in {to:?}: {even:?}");
        }
        // A picture larger than the window along one axis only, and a window of one pixel.
        let ramp = shown(&gpu, [64, 4], [4, 4], |x, _| (4 * x) as u8);
        for (i, grey) in ramp.iter().enumerate() {
            assert!(grey.abs_diff((64 * (i % 4) + 30) as u8) < 6, "{ramp:?}");
        }
        assert!(shown(&gpu, [256, 256], [1, 1], |x, y| (((x ^ y) & 1) * 254) as u8)[0].abs_diff(127) <= 1);
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
    }
}
