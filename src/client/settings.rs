//! Display settings, which may change at any time without restarting the server (paper §4.2), and the specification of a film.
//!
//! The names of every option with a closed set of values stand here once: the command line, the lists of effects and the
//! attributes of files take them from clap's derive ([`OptionNames::name`]), the panel from [`OptionNames::label`]. Shaders
//! number the values in the order in which they are declared.

use clap::ValueEnum;

use crate::client::post_process::{PanoramaView, PostSettings};
use crate::color::{Profile, pq};
pub use crate::gpu::ColorOutput;
use crate::image::stereo::StereoLayout;

/// The names of a display option's values.
pub trait OptionNames: ValueEnum {
    /// The value's name in the panel.
    fn label(&self) -> &'static str;

    /// The value's name on the command line, in lists and in files.
    fn name(&self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Gives every value its name in the panel.
macro_rules! labels {
    ($($option:ident { $($value:ident: $label:literal,)* })*) => {
        $(impl OptionNames for $option {
            fn label(&self) -> &'static str {
                match self {
                    $($option::$value => $label,)*
                }
            }
        })*
    };
}

labels! {
    Reconstruction { Gaussian: "Gaussian", CatmullRom: "Catmull–Rom", Mipmap: "Mipmap", None: "None", }
    Masking { LowPass: "Low-pass", Bilateral: "Bilateral", }
    AdaptiveFilter { Off: "Off", Light: "Light", }
    Denoise { Off: "Off", Wavelet: "Wavelets", Oidn: "Open Image Denoise", }
    DisplayView { Picture: "Picture", CameraVariance: "Error, camera", LightVariance: "Error, light", FalseColor: "False colour", Clipping: "Clipping", }
    Adaptation { Photopic: "Day (photopic)", Mesopic: "Dusk (mesopic)", Scotopic: "Night (scotopic)", }
    ToneCurve { Paper: "1 − exp(−(B·Y)^C)", PbrNeutral: "PBR Neutral", AgX: "AgX", }
    Dither { None: "None", Ordered: "Ordered", BlueNoise: "Blue noise", }
    ColorOutput { Sdr: "8 bits", ScRgb: "scRGB", Hdr10: "HDR10", }
}

impl OptionNames for SplatFilter {
    fn label(&self) -> &'static str {
        match self {
            SplatFilter::Gaussian => "Gaussian",
            SplatFilter::Tent => "Tent",
            SplatFilter::Box => "Box",
            SplatFilter::Scaled(_) => "From a file",
        }
    }
}

/// Number of samples that are sorted and uploaded together. A batch, which is splatted and folded when it is full or on `flush`, consists
/// of one chunk or, on a large film, several ([`FilmSpec::batch_capacity`]).
pub const CHUNK_SAMPLES: usize = 65_536;

/// The filter that spreads a sample over texels.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum, serde::Serialize, serde::Deserialize,
)]
pub enum SplatFilter {
    /// Windowed Gaussian of 5×5 texels, interpolated (the paper's).
    #[default]
    Gaussian,
    /// Tent of radius 1 texel.
    Tent,
    /// Exactly one texel: for comparison with other renderers.
    Box,
    /// A filter of a size of its own, which no option names.
    #[value(skip)]
    Scaled(ScaledFilter),
}

/// A filter of other renderers by its size, in thousandths of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum ScaledFilter {
    /// `exp(−d²/2σ²) − exp(−8)` up to 4σ, where it is 0 (Mitsuba's); σ is 0.1 to 0.75 texels.
    Gaussian {
        /// σ.
        stddev: u16,
    },
    /// A tent of radius 0.25 to 3 texels.
    Tent {
        /// Its radius.
        radius: u16,
    },
}

/// The reconstruction of the picture from the sums (the paper's Figure 2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Reconstruction {
    /// Windowed Gaussian on two mip levels, interpolated.
    #[default]
    Gaussian,
    /// Catmull–Rom spline on two mip levels, interpolated.
    CatmullRom,
    /// Bilinear on two mip levels, interpolated.
    Mipmap,
    /// The texel as it is.
    None,
}

/// The support of the reconstruction's Gaussian: `exp(−σd²)·(1 − smoothstep(0, R, d)^E)` over the texels within `R` per axis
/// (paper §4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ReconstructionKernel {
    /// `2R`: texels along each axis, 2 to 8.
    pub taps: u32,
    /// `E`; 0 leaves the window out, and the Gaussian is cut off.
    pub exponent: u32,
}

impl Default for ReconstructionKernel {
    /// The paper's R = 2.5 and E = 8.
    fn default() -> Self {
        Self { taps: 5, exponent: 8 }
    }
}

impl ReconstructionKernel {
    /// `R`, texels.
    pub fn radius(self) -> f32 {
        0.5 * self.taps as f32
    }
}

/// The summation of batches in a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Summation {
    /// Two floats: what the larger one rounds off is kept in the smaller.
    #[default]
    TwoFloat,
    /// One float, which stands still where a batch is less than half of its last bit, without [merging](crate::client::dense_cells); kept
    /// to show what the second costs. The variance has two in any case.
    Plain,
}

/// The kind of noise masking where the variance asks for blur (the paper's §4.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Masking {
    /// A wider reconstruction kernel.
    #[default]
    LowPass,
    /// Averages over neighbours whose difference the variance explains; below 4 samples per pixel as low-pass.
    Bilateral,
}

/// The streams of which every sample is shown through a kernel as wide as the density around it requires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum AdaptiveFilter {
    /// None: one level of detail for all of a stream.
    Off,
    /// The light stream.
    #[default]
    Light,
}

/// The filter that takes noise out of the displayed picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Denoise {
    /// None.
    #[default]
    Off,
    /// Wavelets, kept where two halves of the samples agree.
    Wavelet,
    /// Intel's Open Image Denoise, a neural network, if its library is installed (`pointillist devices` tells).
    Oidn,
}

/// The quantity that is shown: the picture, or the relative standard error of a stream as grey.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum DisplayView {
    /// The picture.
    #[default]
    Picture,
    /// Relative standard error of the camera stream.
    CameraVariance,
    /// Relative standard error of the light stream.
    LightVariance,
    /// Luminance in false colours, a colour for each stop around the middle grey.
    FalseColor,
    /// The picture, with stripes over what is displayed as white (red) or as black (blue).
    Clipping,
}

impl DisplayView {
    /// Whether a view shows the error of a stream rather than light.
    pub fn is_error(self) -> bool {
        matches!(self, Self::CameraVariance | Self::LightVariance)
    }
}

/// State of the observer's eye, which decides the components of its glare (Spencer et al. 1995, table 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Adaptation {
    /// Daylight, above 3 cd/m².
    #[default]
    Photopic,
    /// Dusk.
    Mesopic,
    /// Night, below 0.01 cd/m².
    Scotopic,
}

/// Glare of the observer's eye (Spencer, Shirley, Zimmerman, Greenberg, SIGGRAPH 1995).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glare {
    /// State of the eye.
    pub adaptation: Adaptation,
    /// Angle that the picture's width fills in the observer's eye, degrees.
    pub view_angle: f32,
}

impl Default for Glare {
    fn default() -> Self {
        Self { adaptation: Adaptation::default(), view_angle: 40.0 }
    }
}

/// The curve from scene luminance to display luminance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum ToneCurve {
    /// The paper's 1 − exp(−(B·Y)^C) on luminance.
    #[default]
    Paper,
    /// Khronos PBR Neutral: base colours stay as they are.
    PbrNeutral,
    /// AgX (Sobotka): film-like, highlights lose their colour.
    #[value(name = "agx")]
    AgX,
}

/// The dither that hides the steps of 8 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, ValueEnum)]
pub enum Dither {
    /// Plain rounding.
    #[default]
    None,
    /// Ordered 8×8 matrix.
    Ordered,
    /// Blue noise.
    BlueNoise,
}

/// The form of the running variance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum VarianceForm {
    /// `Σ f w² (Y − Ȳ_old)(Y − Ȳ_new)`: equals Chan's merge exactly for batches of any size of samples of the weight 1.
    #[default]
    Product,
    /// The paper's `Σ f w² (Y − Ȳ_new)²`, biased low; kept to show the difference.
    Paper,
}

/// The specification of a film; changing any of these starts it anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct FilmSpec {
    /// Width of the picture in pixels, without padding.
    pub width: u32,
    /// Height of the picture in pixels, without padding.
    pub height: u32,
    /// Splat filter.
    pub filter: SplatFilter,
    /// Form of the running variance; `None` omits its passes and images.
    pub variance: Option<VarianceForm>,
    /// Summation of the batches.
    pub sums: Summation,
}

/// Display controls.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Reconstruction.
    pub reconstruction: Reconstruction,
    /// The support of its Gaussian.
    pub kernel: ReconstructionKernel,
    /// Noise masking strength `Vm`: mip levels of extra blur per factor 4 of excess variance; 0 is off.
    pub vm: f32,
    /// The kind of noise masking where `vm` is above 0.
    pub masking: Masking,
    /// The streams that are filtered adaptively. They are not masked.
    pub adaptive_filter: AdaptiveFilter,
    /// Noise filter. It needs halves of the samples and feature buffers, which a film does not have, so that
    /// [`Film::display`](crate::client::Film::display) shows an unfiltered picture.
    pub denoise: Denoise,
    /// When only the camera moves, show a reprojection of the last denoised picture until there are enough samples of the new view.
    pub reproject: bool,
    /// Where a reprojection is shown, trace the first samples where it shows least.
    pub steer: bool,
    /// The quantity that is shown.
    pub view: DisplayView,
    /// Glare of the eye; `None` is off.
    pub glare: Option<Glare>,
    /// The post-processes, which are off by default.
    pub post: PostSettings,
    /// Tone curve.
    pub curve: ToneCurve,
    /// Brightness `B` of the tone curve.
    pub exposure: f32,
    /// Contrast `C` of the tone curve.
    pub contrast: f32,
    /// Display gamma `G`.
    pub gamma: f32,
    /// Primaries and white of the display: the matrix `P`.
    pub profile: Profile,
    /// The dither that hides the steps of 8 bits.
    pub dither: Dither,
    /// The encoding of the picture; files and 8-bit windows are [`ColorOutput::Sdr`].
    pub output: ColorOutput,
    /// Largest luminance of wide-range outputs, cd/m²: highlights roll off to it.
    pub peak: u32,
    /// How the pictures of two eyes become one, of a film that has both.
    pub stereo: StereoLayout,
}

impl Default for Settings {
    /// Windowed Gaussian, no noise masking, the plain curve `1 − exp(−Y)`, an sRGB display.
    fn default() -> Self {
        Self {
            reconstruction: Reconstruction::default(),
            kernel: ReconstructionKernel::default(),
            vm: 0.0,
            masking: Masking::default(),
            adaptive_filter: AdaptiveFilter::default(),
            denoise: Denoise::default(),
            reproject: false,
            steer: false,
            view: DisplayView::default(),
            glare: None,
            post: PostSettings::default(),
            curve: ToneCurve::default(),
            exposure: 1.0,
            contrast: 1.0,
            gamma: 2.2,
            profile: Profile::srgb(),
            dither: Dither::default(),
            output: ColorOutput::default(),
            peak: pq::PEAK,
            stereo: StereoLayout::default(),
        }
    }
}

impl Settings {
    /// The same for a picture that is still to be composed: glare and post-processes act on the whole one.
    pub fn before_glare(&self) -> Self {
        Self { glare: None, post: PostSettings::default(), ..self.clone() }
    }

    /// The view into a panorama that is shown in its place; `None` also where the error is shown, which is flat.
    pub fn look_around(&self) -> Option<PanoramaView> {
        self.post.look_around.view.filter(|_| !self.view.is_error())
    }

    /// The same for the whole panorama.
    pub fn flat(&self) -> Self {
        let mut flat = self.clone();
        flat.post.look_around = Default::default();
        flat
    }
}

/// The numbers of samples and paths that a film has received since it was cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FilmCounts {
    /// Samples of the camera stream.
    pub camera_samples: u64,
    /// Samples of the light stream.
    pub light_samples: u64,
    /// Paths started at the camera.
    pub camera_paths: u64,
    /// Paths started at lights: the divisor `Lw`.
    pub light_paths: u64,
}

impl FilmCounts {
    /// Number of traced indices of the sequence: each starts one path at the camera, at a light, or one at both.
    pub fn paths(&self) -> u64 {
        self.camera_paths.max(self.light_paths)
    }

    /// Samples of both streams.
    pub fn samples(&self) -> u64 {
        self.camera_samples.saturating_add(self.light_samples)
    }

    /// Factor from the light stream's sums to a picture of this size: texels per light path (values are densities over uv); 0 without light
    /// paths.
    pub fn light_scale(&self, width: u32, height: u32) -> f32 {
        if self.light_paths == 0 {
            return 0.0;
        }
        (f64::from(width) * f64::from(height) / self.light_paths as f64) as f32
    }
}

/// The raw accumulators of a film, cropped to the picture, `[height][width]`, row 0 at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilmData {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Sums `[X, Y, Z, W]` of the camera stream; empty when it had no samples.
    pub camera: Vec<[f32; 4]>,
    /// Sums `[X, Y, Z, W]` of the light stream; empty when it had no samples.
    pub light: Vec<[f32; 4]>,
    /// `Σ f w² (Y − Ȳ)²` of the camera stream in units of `luminance_scale²`; empty like `camera`, and where no variance is kept.
    pub camera_variance: Vec<f32>,
    /// As `camera_variance`, for the light stream.
    pub light_variance: Vec<f32>,
    /// Power of two by which luminance is divided in the variance images, so that no exposure overflows.
    pub luminance_scale: f32,
    /// The numbers of samples and paths in the sums.
    pub counts: FilmCounts,
}

/// The displayed picture: 8 bits per channel, encoded, `[height][width]`, row 0 at the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Encoded R, G, B.
    pub rgb: Vec<[u8; 3]>,
}
