//! The effects that are compiled into the display shaders: the one place that turns [`Settings`] into specialization constants.
//!
//! An effect that is off is not in the code that runs, and with all of them off the code is that of the plain picture.

use glam::Mat3;

use crate::client::lod::StreamLod;
use crate::client::post_process::PostSettings;
use crate::client::settings::{
    AdaptiveFilter, ColorOutput, DisplayView, Dither, FilmSpec, Masking, Reconstruction, Settings, ToneCurve,
};
use crate::color::{Profile, pq, profile};
use crate::gpu::TexelFormat;

/// Internal resolutions of a repaint: picture pixels per reconstructed one, along each axis.
pub const DETAILS: [u32; 3] = [1, 2, 4];

/// The effects of one repaint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effects {
    /// Picture pixels per reconstructed one, along each axis: one of [`DETAILS`].
    pub detail: u32,
    /// The kind of noise masking, if any.
    pub masking: Option<Masking>,
    /// Whether the light stream is filtered adaptively.
    pub adaptive_light: bool,
    /// The quantity that is shown.
    pub view: DisplayView,
    /// Glare of the eye, at full resolution or at the finest that the device can compute in time.
    pub glare: bool,
    /// Tone curve.
    pub curve: ToneCurve,
    /// The encoding of the picture.
    pub output: ColorOutput,
    /// Largest luminance of a wide-range encoding, cd/m².
    pub peak: u32,
    /// Whether the transfer function is the profile's lookup table.
    pub table: bool,
    /// The dither that hides the steps of the encoding.
    pub dither: Dither,
}

impl Effects {
    /// The effects selected by these settings; `detail` is rounded down to one of [`DETAILS`].
    pub fn new(settings: &Settings, detail: u32) -> Self {
        let detail = DETAILS.into_iter().rfind(|d| *d <= detail).unwrap_or(1);
        let (view, output) = (settings.view, settings.output);
        // A setting without effect must not create another pipeline.
        let has_curve = matches!(view, DisplayView::Picture | DisplayView::Clipping);
        let curve = if has_curve { settings.curve } else { ToneCurve::Paper };
        let table = output == ColorOutput::Sdr && settings.profile.transfer.is_some();
        let peak = if output == ColorOutput::Sdr { pq::PEAK } else { settings.peak };
        let dither = if output == ColorOutput::ScRgb { Dither::None } else { settings.dither };
        // Coarse pictures are shown when frame time is short, so they get the cheaper masking.
        let kind = if detail == 1 { settings.masking } else { Masking::LowPass };
        let masking = (settings.vm > 0.0 && !view.is_error()).then_some(kind);
        // Texels as they are: that is what the reconstruction without a kernel is asked for.
        let adaptive_light = settings.adaptive_filter == AdaptiveFilter::Light
            && settings.reconstruction != Reconstruction::None
            && !view.is_error();
        // Nor is there time for a convolution, which would need a separate kernel for every resolution.
        let glare = detail == 1 && !view.is_error() && settings.glare.is_some();
        Self { detail, masking, adaptive_light, view, glare, curve, output, peak, table, dither }
    }

    /// As [`new`](Self::new); with glare the whole picture is computed on a grid of `coarse` picture pixels, one of [`DETAILS`].
    pub fn with_glare_at(settings: &Settings, detail: u32, coarse: u32) -> Self {
        let glare = !settings.view.is_error() && settings.glare.is_some();
        let effects = Self::new(settings, if glare { detail.max(coarse) } else { detail });
        Self { glare: glare && effects.detail == coarse, ..effects }
    }

    /// Whether bilateral filtering applies to a stream at this level of detail; with too few samples low-pass masking replaces it.
    pub fn bilateral(&self, lod: &StreamLod) -> bool {
        self.masking == Some(Masking::Bilateral) && lod.allows_bilateral()
    }

    /// Whether a stream of these sums, `light` or camera, is filtered adaptively. A picture of one pixel has no coarser level.
    pub fn adapts(&self, spec: &FilmSpec, light: bool) -> bool {
        light && self.adaptive_light && spec.width.max(spec.height) > 1
    }

    /// The post-processes, which an error view does not have.
    pub fn post<'a>(&self, settings: &'a Settings) -> Option<&'a PostSettings> {
        Some(&settings.post).filter(|_| !self.view.is_error())
    }

    /// Whether the variance is read.
    pub fn reads_variance(&self) -> bool {
        self.masking.is_some() || self.view.is_error()
    }

    /// Reconstruction method; if pixels are larger than texels, a single texel would not represent one.
    pub fn reconstruction(&self, settings: &Settings) -> Reconstruction {
        match settings.reconstruction {
            Reconstruction::None if self.detail > 1 => Reconstruction::Mipmap,
            kind => kind,
        }
    }

    /// The specialization constants of `tonemap.frag`, in order; it numbers curves, outputs and dithers as the enums do.
    pub fn tonemap_constants(&self) -> [u32; 7] {
        let view = match self.view {
            DisplayView::Picture => 0,
            DisplayView::CameraVariance | DisplayView::LightVariance => 1,
            DisplayView::FalseColor => 2,
            DisplayView::Clipping => 3,
        };
        let (curve, output, dither) = (self.curve as u32, self.output as u32, self.dither as u32);
        let ceiling = self.peak as f32 / pq::DIFFUSE_WHITE;
        [self.detail, view, curve, output, u32::from(self.table), dither, ceiling.to_bits()]
    }

    /// Format of the encoded picture.
    pub fn encoded_format(&self) -> TexelFormat {
        match self.output {
            ColorOutput::Sdr => TexelFormat::Rgba8,
            ColorOutput::ScRgb => TexelFormat::Rgba16F,
            ColorOutput::Hdr10 => TexelFormat::Rgb10A2,
        }
    }
}

/// The matrix `P` from the curve's result, XYZ after the paper's and Rec.709 after the others, to the linear RGB of the output.
/// HDR outputs have primaries of their own, which replace the profile's.
pub fn matrix(settings: &Settings) -> Mat3 {
    let from_xyz = match settings.output {
        ColorOutput::Sdr => settings.profile.from_xyz,
        ColorOutput::ScRgb => Profile::srgb().from_xyz,
        ColorOutput::Hdr10 => Profile::rec2020().from_xyz,
    };
    match settings.curve {
        ToneCurve::Paper => from_xyz,
        _ => (from_xyz.as_dmat3() * profile::xyz_from_rec709()).as_mat3(),
    }
}
