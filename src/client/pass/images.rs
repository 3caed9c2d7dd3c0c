//! The images of a film: accumulators of each stream, targets of a batch, what is shown.

use std::sync::Arc;

use crate::gpu::{Access, Cmd, Format, Gpu, GpuError, Image, ImageDesc, Load, Target};

/// A two-float sum: each half is a pair of images, the old and the new, that change places with every fold.
pub struct Accumulator {
    /// Rounded sums, with mip levels.
    hi: [Image; 2],
    /// What rounding left out.
    lo: [Image; 2],
    /// Which of each pair holds the sums.
    current: usize,
}

/// One accumulator as a fold uses it.
pub struct FoldImages<'a> {
    /// Sums before the fold.
    pub old: [&'a mut Image; 2],
    /// Sums after it: hi, lo.
    pub new: [&'a mut Image; 2],
}

impl Accumulator {
    fn new(gpu: &Arc<Gpu>, name: &str, format: Format, extent: [u32; 2]) -> Result<Self, GpuError> {
        let make = |half: &str, mips| {
            Image::new(gpu, ImageDesc { name: &format!("{name} {half}"), format, extent, mips })
        };
        Ok(Self {
            hi: [make("hi 0", true)?, make("hi 1", true)?],
            lo: [make("lo 0", false)?, make("lo 1", false)?],
            current: 0,
        })
    }

    /// Makes the new sums the current ones, and hands out both.
    pub fn flip(&mut self) -> FoldImages<'_> {
        let old = self.current;
        self.current = 1 - old;
        let [hi_0, hi_1] = &mut self.hi;
        let [lo_0, lo_1] = &mut self.lo;
        match old {
            0 => FoldImages { old: [hi_0, lo_0], new: [hi_1, lo_1] },
            _ => FoldImages { old: [hi_1, lo_1], new: [hi_0, lo_0] },
        }
    }

    /// The current sums, rounded, and their mip levels.
    pub fn sums(&self) -> &Image {
        &self.hi[self.current]
    }

    /// The same, to be drawn into or copied from.
    pub fn sums_mut(&mut self) -> &mut Image {
        &mut self.hi[self.current]
    }
}

/// How far the mip levels below the sums are up to date.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MipState {
    /// Levels of the colour, level 0 included, that hold averages of the current sums.
    pub color: u32,
    /// Levels of the variance.
    pub variance: u32,
}

/// What one stream needs; made when its first sample comes.
pub struct StreamImages {
    /// Sums of X, Y, Z and W.
    pub color: Accumulator,
    /// Sums of squared deviations of luminance.
    pub variance: Accumulator,
    /// Mip levels that can be read.
    pub mips: MipState,
    /// The sums hold nothing yet, not even zeros.
    undefined: bool,
}

impl StreamImages {
    /// Images of this padded extent; `name` is the stream's.
    ///
    /// # Errors
    ///
    /// As [`Image::new`].
    pub fn new(gpu: &Arc<Gpu>, name: &str, extent: [u32; 2]) -> Result<Self, GpuError> {
        Ok(Self {
            color: Accumulator::new(gpu, &format!("{name} color"), Format::Rgba32F, extent)?,
            variance: Accumulator::new(gpu, &format!("{name} variance"), Format::R32F, extent)?,
            mips: MipState::default(),
            undefined: true,
        })
    }

    /// Forgets the sums; the images stay.
    pub fn forget(&mut self) {
        self.undefined = true;
        self.mips = MipState::default();
    }

    /// Clears the sums to zero where they were never written or were forgotten.
    pub fn define(&mut self, cmd: &mut Cmd<'_>) {
        if !std::mem::take(&mut self.undefined) {
            return;
        }
        self.mips = MipState { color: 1, variance: 1 };
        let cmd = &mut cmd.scope("clear");
        for sums in [&mut self.color, &mut self.variance] {
            let (hi, lo) = (&mut sums.hi[sums.current], &mut sums.lo[sums.current]);
            for image in [&mut *hi, &mut *lo] {
                cmd.access_levels(image, 0..1, Access::ColorWrite);
            }
            let target = |image| Target { image, level: 0, load: Load::Clear };
            cmd.rendering(&[target(hi), target(lo)], |_| ());
        }
    }
}

/// What one batch is drawn into; both streams use it in turn.
pub struct BatchImages {
    /// `Σ f [x, y, z, w]`.
    pub color: Image,
    /// `Σ f (Y − m₀)(Y − m₁)`.
    pub variance: Image,
    /// Mean luminance before and after the batch, each as two floats.
    pub means: Image,
}

impl BatchImages {
    /// Images of this padded extent.
    ///
    /// # Errors
    ///
    /// As [`Image::new`].
    pub fn new(gpu: &Arc<Gpu>, extent: [u32; 2]) -> Result<Self, GpuError> {
        let make = |name, format| Image::new(gpu, ImageDesc { name, format, extent, mips: false });
        Ok(Self {
            color: make("batch color", Format::Rgba32F)?,
            variance: make("batch variance", Format::R32F)?,
            means: make("batch means", Format::Rgba32F)?,
        })
    }
}

/// What a repaint writes, in picture pixels.
pub struct PictureImages {
    /// Scene-linear XYZ.
    pub xyz: Image,
    /// Encoded R, G, B.
    pub encoded: Image,
}

impl PictureImages {
    /// Images of this extent, without padding.
    ///
    /// # Errors
    ///
    /// As [`Image::new`].
    pub fn new(gpu: &Arc<Gpu>, extent: [u32; 2]) -> Result<Self, GpuError> {
        let make = |name, format| Image::new(gpu, ImageDesc { name, format, extent, mips: false });
        Ok(Self {
            xyz: make("picture XYZ", Format::Rgba32F)?,
            encoded: make("picture encoded", Format::Rgba8)?,
        })
    }
}
