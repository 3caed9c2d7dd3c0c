//! What is compiled into the display shaders: the one place that turns [`Settings`] into specialization constants.
//!
//! An effect that is off is not in the code that runs, and with all of them off the code is that of the plain picture.

use crate::client::settings::{Output, Reconstruction, Settings};
use crate::gpu::Format;

/// Internal resolutions of a repaint: picture pixels per reconstructed one, along each axis.
pub const DETAILS: [u32; 3] = [1, 2, 4];

/// The effects of one repaint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effects {
    /// Picture pixels per reconstructed one, along each axis: one of [`DETAILS`].
    pub detail: u32,
    /// What the picture is encoded for.
    pub output: Output,
}

impl Effects {
    /// What these settings ask for; `detail` is rounded down to one of [`DETAILS`].
    pub fn new(settings: &Settings, detail: u32) -> Self {
        let detail = DETAILS.into_iter().rfind(|d| *d <= detail).unwrap_or(1);
        Self { detail, output: settings.output }
    }

    /// The reconstruction: where pixels are larger than texels, single texels cannot stand for them.
    pub fn reconstruction(&self, settings: &Settings) -> Reconstruction {
        match settings.reconstruction {
            Reconstruction::None if self.detail > 1 => Reconstruction::Mipmap,
            kind => kind,
        }
    }

    /// Specialization constants of `tonemap.frag`, in their order.
    pub fn tonemap_constants(&self) -> [u32; 1] {
        [self.detail]
    }

    /// Format of the encoded picture.
    pub fn encoded_format(&self) -> Format {
        Format::Rgba8
    }
}
